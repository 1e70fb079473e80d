// Queries of persistent objects on a device. They use a grid of the objects' boxes, built for the
// first query after a change, and a bitmap of its occupied blocks once sweeps have been long. Each
// query synchronizes once with the device, and once more if its results do not fit.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "device/device_buffer.hpp"
#include "device/failure.hpp"
#include "device/persistent_objects.hpp"
#include "device/pipeline.hpp"
#include "device/queries.hpp"

namespace throng::device {

template <class Device>
class PersistentQueries {
 public:
  explicit PersistentQueries(Device& device) noexcept : device_(device) {}

  // Sorted.
  void find_overlaps(const PersistentObjects<Device>& objects, const Boxes& boxes, bool nan_allowed,
                     Result& r) {
    forget();
    overlap_count_ = find<QueryType::overlaps>(objects, {boxes, nullptr}, nan_allowed, r);
    r.found = r.written = overlap_count_;
  }
  void find_hits(const PersistentObjects<Device>& objects, const QueryBatch& queries,
                 SweepHits which, Result& r) {
    forget();
    const auto count = static_cast<std::size_t>(
        which == SweepHits::first ? find<QueryType::first_hit>(objects, queries, false, r)
                                  : find<QueryType::all_hits>(objects, queries, false, r));
    if (count != 0) {
      auto* hits = reinterpret_cast<SweepHit*>(hits_.ensure(count * sizeof(SweepHit)));
      device_.launch(count, TimeHits{queries.sweeps, make_set(objects.boxes()),
                                     pairs_.template as<Pair>(), hits});
    }
    r.found = r.written = hit_count_ = count;
  }
  // Writes the first hit of sweep i to out[i].
  void find_first_hits(const PersistentObjects<Device>& objects, const QueryBatch& queries,
                       SweepHit* out, Result& r) {
    forget();
    const Input in = begin(objects, queries, out);
    search<QueryType::first_hit>(in, queries, out, {nullptr, 0, report()});
    r.found = r.written = check_report(in, false, r) ? seen_.found : 0;
  }

  Pairs overlaps() const noexcept { return {pairs_.template as<Pair>(), overlap_count_}; }
  SweepHitList hits() const noexcept { return {hits_.template as<SweepHit>(), hit_count_}; }

  std::size_t held() const noexcept {
    return workspace_.bytes() + blocks_.bytes() + query_report_.bytes() + pairs_.bytes() +
           sorting_.bytes() + hits_.bytes();
  }

 private:
  struct QueryReport {
    Report report;
    std::uint64_t far_rows;  // see QuerySearch
  };
  // Building the block bitmap takes as long per object as searching this many rows.
  static constexpr double block_rows = 0.5;

  QueryReport* query_report() const noexcept { return query_report_.template as<QueryReport>(); }
  Report* report() const noexcept { return &query_report()->report; }
  void forget() noexcept { overlap_count_ = hit_count_ = 0; }

  // The query boxes and the objects as two sets. Writes invalid queries to the report.
  Input begin(const PersistentObjects<Device>& objects, const QueryBatch& queries, SweepHit* out) {
    if (queries.boxes.size() > max_pipeline_boxes)
      throw Failure{Status::too_many_boxes, queries.boxes.size()};
    make_grid(objects);
    const Boxes all = objects.boxes();
    const Input in = make_input(queries.boxes, &all, {});
    query_report_.ensure(sizeof(QueryReport));
    device_.clear(query_report(), sizeof(QueryReport));
    device_.launch(in.first_count, CheckQuery{in, queries.sweeps, out, report()});
    return in;
  }
  // Reads the report; returns whether the queries are valid.
  bool check_report(const Input& in, bool nan_allowed, Result& r) {
    const QueryReport query_report = device_.read(*this->query_report());
    seen_ = query_report.report;
    far_rows_ += query_report.far_rows;
    r.comparisons = seen_.comparisons;
    const auto refuse = [&](Status status, std::uint64_t count, std::uint32_t first) {
      r.status = status;
      r.invalid_count = count;
      r.first_invalid = in.local(first);
      return false;
    };
    if (seen_.bad_worlds)
      return refuse(Status::bad_filter, seen_.bad_worlds, seen_.first_bad_world());
    if (seen_.nan_count && !nan_allowed)
      return refuse(Status::nan_box, seen_.nan_count, seen_.first_nan());
    return true;
  }

  // Finds into pairs_, sorted; returns the number.
  template <QueryType query_type>
  std::uint64_t find(const PersistentObjects<Device>& objects, const QueryBatch& queries,
                     bool nan_allowed, Result& r) {
    const Input in = begin(objects, queries, nullptr);
    const std::size_t usual = query_type == QueryType::first_hit ? 1 : 4;
    pairs_.ensure((usual * in.first_count + 512) * sizeof(Pair));
    for (;;) {
      const std::uint64_t capacity = pairs_.bytes() / sizeof(Pair);
      search<query_type>(in, queries, nullptr, {pairs_.template as<Pair>(), capacity, report()});
      if (!check_report(in, nan_allowed, r)) return 0;
      if (seen_.found <= capacity) break;
      pairs_.ensure(static_cast<std::size_t>(seen_.found + seen_.found / 8 + 512) * sizeof(Pair));
      device_.clear(&report()->found, sizeof seen_.found);
      device_.clear(&report()->comparisons, sizeof seen_.comparisons);
    }
    const auto n = static_cast<std::size_t>(seen_.found);
    const std::size_t bytes = Device::sort_bytes(n);
    auto* pairs = pairs_.template as<Pair>();
    device_.sort(pairs, bytes ? sorting_.ensure(bytes) : nullptr, bytes, pairs, n, n, report(), in);
    return n;
  }
  template <QueryType query_type>
  void search(const Input& in, const QueryBatch& queries, SweepHit* firsts, const PairSink& sink) {
    if (!has_grid_) return;  // there are no objects
    const GridSearchOf<GridSearchMode::around> grid{grid_input_,
                                                    grid_workspace_.grid,
                                                    grid_workspace_.table,
                                                    grid_workspace_.occupied,
                                                    grid_workspace_.records,
                                                    grid_workspace_.report,
                                                    {}};
    device_.search(in.first_count,
                   QuerySearch<query_type>{in, queries.sweeps, grid, firsts, bits_, has_blocks_,
                                           &query_report()->far_rows},
                   sink);
  }

  // A grid of the present boxes, kept until something changes. A refused call may have given
  // filters to objects that had none; the grid records which it was built with.
  void make_grid(const PersistentObjects<Device>& objects) {
    grid_input_ = make_input(objects.boxes(), nullptr, {});
    grid_input_.has_external_queries = true;
    if (has_grid_ && grid_version_ == objects.version()) return make_blocks();
    has_grid_ = has_blocks_ = false;
    far_before_ = far_rows_;
    far_rows_ = 0;
    if (grid_input_.count == 0) return;
    const std::size_t bytes = grid_workspace_.template carve<Device>(grid_input_.count, nullptr);
    grid_workspace_.template carve<Device>(grid_input_.count, workspace_.ensure(bytes));
    Pipeline<Device>(device_).build(grid_input_, false, grid_workspace_);
    has_grid_ = true;
    grid_version_ = objects.version();
    make_blocks();
  }

  // Builds the bitmap of occupied blocks once it would have paid off in this grid or the previous
  // one. It is optional: out of memory is ignored.
  void make_blocks() {
    const auto far = static_cast<double>(far_rows_ > far_before_ ? far_rows_ : far_before_);
    if (has_blocks_ || far < block_rows * grid_input_.count) return;
    const std::size_t words = base::BlockBitmap::words_for(grid_input_.count), bytes = 4 * words;
    try {
      blocks_.ensure(bytes);
    } catch (const Failure& failure) {
      if (failure.status != Status::out_of_memory) throw;
      far_rows_ = far_before_ = 0;
      return;
    }
    bits_ = {blocks_.template as<std::uint32_t>(), words};
    device_.clear(blocks_.template as<char>(), bytes);
    device_.launch(grid_input_.count, MarkBlocks{grid_workspace_.grid, grid_workspace_.records,
                                                 grid_workspace_.report, bits_});
    has_blocks_ = true;
  }

  Device& device_;
  DeviceBuffer<Device> workspace_{device_}, blocks_{device_}, query_report_{device_},
      pairs_{device_}, sorting_{device_}, hits_{device_};
  Report seen_;
  std::size_t overlap_count_ = 0, hit_count_ = 0;
  Input grid_input_;  // the objects
  Workspace grid_workspace_;
  base::BlockBitmap bits_;
  std::uint64_t far_rows_ = 0, far_before_ = 0;  // in this grid and in the previous one
  bool has_grid_ = false, has_blocks_ = false;
  std::uint64_t grid_version_ = 0;
};

}  // namespace throng::device
