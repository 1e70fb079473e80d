// Queries of persistent objects on a device. They use a grid of the objects' boxes, built for the
// first query after a change, and a bitmap of its occupied blocks once sweeps have been long. Each
// query synchronizes once with the device, and once more if its results do not fit.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "pipeline/block.hpp"
#include "pipeline/failure.hpp"
#include "pipeline/live_objects.hpp"
#include "pipeline/pipeline.hpp"
#include "pipeline/questions.hpp"

namespace throng::pipeline {

template <class Device>
class LiveQuestions {
 public:
  explicit LiveQuestions(Device& device) noexcept : device_(device) {}

  // Sorted.
  void find_overlaps(const LiveObjects<Device>& objects, const Boxes& boxes, bool nan_allowed,
                     Result& r) {
    forget();
    overlap_count_ = find<Question::overlaps>(objects, {boxes, nullptr}, nan_allowed, r);
    r.found = r.written = overlap_count_;
  }
  void find_hits(const LiveObjects<Device>& objects, const Asked& asked, SweepHits which,
                 Result& r) {
    forget();
    const auto count = static_cast<std::size_t>(
        which == SweepHits::first ? find<Question::first_hit>(objects, asked, false, r)
                                  : find<Question::all_hits>(objects, asked, false, r));
    if (count != 0) {
      auto* hits = reinterpret_cast<SweepHit*>(hits_.room(count * sizeof(SweepHit)));
      device_.launch(count, TimeHits{asked.sweeps, make_set(objects.boxes()),
                                     pairs_.template as<Pair>(), hits});
    }
    r.found = r.written = hit_count_ = count;
  }
  // Writes the first hit of sweep i to out[i].
  void find_first_hits(const LiveObjects<Device>& objects, const Asked& asked, SweepHit* out,
                       Result& r) {
    forget();
    const Input in = begin(objects, asked, out);
    search<Question::first_hit>(in, asked, out, {nullptr, 0, report()});
    r.found = r.written = tell(in, false, r) ? seen_.found : 0;
  }

  Pairs overlaps() const noexcept { return {pairs_.template as<Pair>(), overlap_count_}; }
  SweepHitList hits() const noexcept { return {hits_.template as<SweepHit>(), hit_count_}; }

  std::size_t held() const noexcept {
    return workspace_.bytes() + blocks_.bytes() + told_.bytes() + pairs_.bytes() +
           sorting_.bytes() + hits_.bytes();
  }

 private:
  struct Told {
    Report report;
    std::uint64_t far_rows;  // see QuestionSearch
  };
  // Building the block bitmap takes as long per object as searching this many rows.
  static constexpr double block_rows = 0.5;

  Told* told() const noexcept { return told_.template as<Told>(); }
  Report* report() const noexcept { return &told()->report; }
  void forget() noexcept { overlap_count_ = hit_count_ = 0; }

  // The query boxes and the objects as two sets. Writes invalid queries to the report.
  Input begin(const LiveObjects<Device>& objects, const Asked& asked, SweepHit* out) {
    if (asked.boxes.size() > max_pipeline_boxes)
      throw Failure{Status::too_many_boxes, asked.boxes.size()};
    make_grid(objects);
    const Boxes all = objects.boxes();
    const Input in = make_input(asked.boxes, &all, {});
    told_.room(sizeof(Told));
    device_.clear(told(), sizeof(Told));
    device_.launch(in.first_count, CheckQuestion{in, asked.sweeps, out, report()});
    return in;
  }
  // Reads the report; returns whether the queries are valid.
  bool tell(const Input& in, bool nan_allowed, Result& r) {
    const Told told = device_.read(*this->told());
    seen_ = told.report;
    far_rows_ += told.far_rows;
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
  template <Question question>
  std::uint64_t find(const LiveObjects<Device>& objects, const Asked& asked, bool nan_allowed,
                     Result& r) {
    const Input in = begin(objects, asked, nullptr);
    const std::size_t usual = question == Question::first_hit ? 1 : 4;
    pairs_.room((usual * in.first_count + 512) * sizeof(Pair));
    for (;;) {
      const std::uint64_t room = pairs_.bytes() / sizeof(Pair);
      search<question>(in, asked, nullptr, {pairs_.template as<Pair>(), room, report()});
      if (!tell(in, nan_allowed, r)) return 0;
      if (seen_.found <= room) break;
      pairs_.room(static_cast<std::size_t>(seen_.found + seen_.found / 8 + 512) * sizeof(Pair));
      device_.clear(&report()->found, sizeof seen_.found);
      device_.clear(&report()->comparisons, sizeof seen_.comparisons);
    }
    const auto n = static_cast<std::size_t>(seen_.found);
    const std::size_t bytes = Device::sort_bytes(n);
    auto* pairs = pairs_.template as<Pair>();
    device_.sort(pairs, bytes ? sorting_.room(bytes) : nullptr, bytes, pairs, n, n, report(), in);
    return n;
  }
  template <Question question>
  void search(const Input& in, const Asked& asked, SweepHit* firsts, const PairSink& sink) {
    if (!made_) return;  // there are no objects
    const GridSearchOf<Looking::around> grid{grid_of_,   w_.grid,   w_.table, w_.occupied,
                                             w_.records, w_.report, {}};
    device_.search(in.first_count,
                   QuestionSearch<question>{in, asked.sweeps, grid, firsts, bits_, has_blocks_,
                                            &told()->far_rows},
                   sink);
  }

  // A grid of the present boxes, kept until something changes. A refused call may have given
  // filters to objects that had none; the grid records which it was built with.
  void make_grid(const LiveObjects<Device>& objects) {
    grid_of_ = make_input(objects.boxes(), nullptr, {});
    grid_of_.for_others = true;
    if (made_ && made_of_ == objects.version()) return make_blocks();
    made_ = has_blocks_ = false;
    far_before_ = far_rows_;
    far_rows_ = 0;
    if (grid_of_.count == 0) return;
    const std::size_t bytes = w_.template carve<Device>(grid_of_.count, nullptr);
    w_.template carve<Device>(grid_of_.count, workspace_.room(bytes));
    Pipeline<Device>(device_).build(grid_of_, false, w_);
    made_ = true;
    made_of_ = objects.version();
    make_blocks();
  }

  // Builds the bitmap of occupied blocks once it would have paid off in this grid or the previous
  // one. It is optional: out of memory is ignored.
  void make_blocks() {
    const auto far = static_cast<double>(far_rows_ > far_before_ ? far_rows_ : far_before_);
    if (has_blocks_ || far < block_rows * grid_of_.count) return;
    const std::size_t words = core::BlockBits::words_for(grid_of_.count), bytes = 4 * words;
    try {
      blocks_.room(bytes);
    } catch (const Failure& failure) {
      if (failure.status != Status::out_of_memory) throw;
      far_rows_ = far_before_ = 0;
      return;
    }
    bits_ = {blocks_.template as<std::uint32_t>(), words};
    device_.clear(blocks_.template as<char>(), bytes);
    device_.launch(grid_of_.count, TellBlocks{w_.grid, w_.records, w_.report, bits_});
    has_blocks_ = true;
  }

  Device& device_;
  Block<Device> workspace_{device_}, blocks_{device_}, told_{device_}, pairs_{device_},
      sorting_{device_}, hits_{device_};
  Report seen_;
  std::size_t overlap_count_ = 0, hit_count_ = 0;
  Input grid_of_;  // the objects
  Workspace w_;
  core::BlockBits bits_;
  std::uint64_t far_rows_ = 0, far_before_ = 0;  // in this grid and in the previous one
  bool made_ = false, has_blocks_ = false;
  std::uint64_t made_of_ = 0;
};

}  // namespace throng::pipeline
