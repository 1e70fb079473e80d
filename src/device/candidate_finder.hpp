// Candidates of persistent objects on a device: all of them, found in a grid that is kept, or in
// that grid those of the few objects that left their fat boxes.
#pragma once

#include <cstdint>

#include "device/device_buffer.hpp"
#include "device/outlier_stages.hpp"
#include "device/pair_keys.hpp"
#include "device/persistent_objects.hpp"
#include "device/pipeline.hpp"

namespace throng::device {

template <class Device>
class CandidateFinder {
 public:
  explicit CandidateFinder(Device& device) noexcept : device_(device) {}

  // Finds all into found(), sorted; returns their number. Keeps the grid that it searched.
  std::uint64_t find_all(const Boxes& fat, const Options& options, Result& r) {
    has_grid_ = false;
    if (fat.empty()) return 0;
    Options plain;
    plain.algorithm = options.algorithm;
    plain.cell_scale = options.cell_scale;
    grid_input_ = make_input(fat, nullptr, plain);
    bool brute = false;
    const std::uint64_t found =
        find(grid_input_, plain.algorithm, workspace_, grid_workspace_, found_, brute);
    r.plan.algorithm = brute ? Algorithm::all_pairs : Algorithm::grid;
    sort(found_, found, grid_input_, grid_workspace_.report);
    has_grid_ = !brute;
    return found;
  }

  // Finds the candidates of the few that left their fat boxes into fresh(), sorted: see
  // outlier_stages.hpp. Returns false if they are too many or there is no grid. Calls begin()
  // before fat boxes change.
  template <class Begin>
  bool find_escaped(const ObjectView& objects, UpdateReport* update_report, const Begin& begin,
                    std::uint64_t& count) {
    const std::uint64_t most = objects.limit / 8;
    if (!has_grid_ || objects.world || most == 0) return false;
    escaped_ids_.ensure(most * sizeof(Pair));
    outliers_.ensure(most * sizeof(Pair));
    device_.clear(&update_report->escaped, 2 * sizeof(Report));  // and outliers
    gather_hits(FindEscaped{objects}, escaped_ids_, &update_report->escaped);
    // If they were too many last time, their number is read first, before any further work is
    // launched.
    if (many_escaped_) many_escaped_ = device_.read(update_report->escaped).found > most;
    if (many_escaped_) return false;
    auto* queries = reinterpret_cast<Record*>(query_boxes_.ensure(most * sizeof(Record)));
    begin();
    device_.launch(most, FattenEscaped{objects, escaped_ids_.template as<Pair>(),
                                       &update_report->escaped, most, queries});
    gather_hits(FindOutliers{objects}, outliers_, &update_report->outliers);
    const UpdateReport seen = device_.read(*update_report);
    const std::uint64_t escaped = seen.escaped.found, outliers = seen.outliers.found;
    many_escaped_ = escaped > most;
    if (many_escaped_ || outliers > capacity_of(outliers_)) return false;
    // A refused call may have moved the filter arrays since.
    Set& filters = grid_input_.sets[0];
    const auto where_now = [](auto& column, const auto* now) {
      if (column) column.data = reinterpret_cast<const char*>(now);
    };
    where_now(filters.group, objects.group);
    where_now(filters.mask, objects.mask);
    where_now(filters.owner, objects.owner);
    where_now(filters.is_static, objects.is_static);
    GridSearchOf<GridSearchMode::around> around{grid_input_,
                                                grid_workspace_.grid,
                                                grid_workspace_.table,
                                                grid_workspace_.occupied,
                                                grid_workspace_.records,
                                                grid_workspace_.report,
                                                {}};
    around.queries = queries;
    around.query_count = escaped;
    around.states = objects.state;
    around.state_mask = alive_bit | outlier_bit;
    around.wanted_state = alive_bit;
    count = find_fresh_candidates(objects, around, outliers, update_report);
    sort(fresh_, count, ids_below(objects.limit), &update_report->fresh);
    return true;
  }

  const Pair* found() const noexcept { return found_.template as<Pair>(); }
  const Pair* fresh() const noexcept { return fresh_.template as<Pair>(); }
  // The memory of found(): free between calls.
  DeviceBuffer<Device>& scratch() noexcept { return found_; }
  void forget_grid() noexcept { has_grid_ = false; }

  std::size_t held() const noexcept {
    std::size_t sum = 0;
    for (const DeviceBuffer<Device>* b :
         {&workspace_, &found_, &sorting_, &escaped_ids_, &outliers_, &query_boxes_, &fresh_,
          &outlier_boxes_, &outlier_filters_, &outlier_workspace_})
      sum += b->bytes();
    return sum;
  }
  static std::uint64_t capacity_of(const DeviceBuffer<Device>& pairs) noexcept {
    return pairs.bytes() / sizeof(Pair);
  }

 private:
  // Runs `each` once per index into `out`, up to its capacity.
  template <class Test>
  void gather_hits(const Test& each, const DeviceBuffer<Device>& out, Report* report) const {
    const std::uint64_t n = each.bound();
    if (n)
      device_.search(n, ListSearch<Test>{each},
                     {out.template as<Pair>(), capacity_of(out), report});
  }
  static Input ids_below(std::uint32_t limit) noexcept {
    Input in;
    in.count = in.first_count = limit;
    return in;
  }

  // Reserves capacity for the usual number of pairs; returns whether it is by brute force.
  bool build(const Input& in, Algorithm algorithm, DeviceBuffer<Device>& memory, Workspace& w,
             DeviceBuffer<Device>& out) {
    const bool brute = Pipeline<Device>::brute_force(in, algorithm);
    w.template carve<Device>(in.count, memory.ensure(w.template carve<Device>(in.count, nullptr)));
    Pipeline<Device>(device_).build(in, brute, w);
    out.ensure((std::size_t{4} * in.count + 512) * sizeof(Pair));
    return brute;
  }
  // Finds into `out`, which grows; returns the number.
  std::uint64_t find(const Input& in, Algorithm algorithm, DeviceBuffer<Device>& memory,
                     Workspace& w, DeviceBuffer<Device>& out, bool& brute) {
    brute = build(in, algorithm, memory, w, out);
    const Pipeline<Device> pipeline(device_);
    for (;;) {
      device_.clear(&w.report->found, sizeof w.report->found);
      pipeline.find(in, brute, w, {out.template as<Pair>(), capacity_of(out), w.report});
      const std::uint64_t found = device_.read(*w.report).found;
      if (found <= capacity_of(out)) return found;
      out.ensure(static_cast<std::size_t>(found + found / 8 + 512) * sizeof(Pair));
    }
  }
  // A grid of the outliers (or brute force, if they are few), in outlier_workspace_.
  struct OutlierGrid {
    Input in;
    Workspace w;
    bool brute = false;
  };
  OutlierGrid build_outlier_grid(const ObjectView& objects, std::uint64_t outliers) {
    const auto* ids = outliers_.template as<Pair>();
    auto* boxes = reinterpret_cast<Box*>(outlier_boxes_.ensure(outliers * sizeof(Box)));
    auto* filters = reinterpret_cast<Filter*>(outlier_filters_.ensure(outliers * sizeof(Filter)));
    device_.launch(outliers, GatherOutliers{objects, ids, boxes, filters});
    const auto n = static_cast<std::size_t>(outliers);
    Boxes view(boxes, n);
    if (objects.group || objects.mask) {
      view.filters.group = {&filters->group, n, sizeof(Filter)};
      view.filters.mask = {&filters->mask, n, sizeof(Filter)};
    }
    if (objects.owner) view.filters.owner = {&filters->owner, n, sizeof(Filter)};
    if (objects.is_static) view.filters.is_static = {&filters->is_static, n, sizeof(Filter)};
    OutlierGrid grid;
    grid.in = make_input(view, nullptr, {});
    grid.brute = build(grid.in, Algorithm::automatic, outlier_workspace_, grid.w, found_);
    return grid;
  }
  // Finds the candidates of the objects that left into fresh_, which grows; returns the number.
  std::uint64_t find_fresh_candidates(const ObjectView& objects,
                                      const GridSearchOf<GridSearchMode::around>& around,
                                      std::uint64_t outliers, UpdateReport* update_report) {
    const std::uint64_t escaped = around.query_count;
    OutlierGrid grid;
    if (outliers) grid = build_outlier_grid(objects, outliers);
    for (;;) {
      device_.clear(&update_report->fresh, sizeof(Report) + sizeof update_report->outlier_pairs);
      device_.search(escaped, around,
                     {fresh_.template as<Pair>(), capacity_of(fresh_), &update_report->fresh});
      if (outliers) {
        Report* report = grid.w.report;
        auto* outlier_pairs = found_.template as<Pair>();
        device_.clear(&report->found, sizeof report->found);
        Pipeline<Device>(device_).find(grid.in, grid.brute, grid.w,
                                       {outlier_pairs, capacity_of(found_), report});
        gather_hits(FindOutlierPairs{objects, outliers_.template as<Pair>(), outlier_pairs, report,
                                     capacity_of(found_)},
                    fresh_, &update_report->fresh);
        device_.copy(&update_report->outlier_pairs, &report->found,
                     sizeof update_report->outlier_pairs);
      }
      const UpdateReport seen = device_.read(*update_report);
      const std::uint64_t fresh = seen.fresh.found;
      if (seen.outlier_pairs > capacity_of(found_)) {
        found_.ensure(static_cast<std::size_t>(seen.outlier_pairs + seen.outlier_pairs / 8 + 512) *
                      sizeof(Pair));
        continue;
      }
      if (fresh <= capacity_of(fresh_)) return fresh;
      fresh_.ensure(static_cast<std::size_t>(fresh + fresh / 8 + 1024) * sizeof(Pair));
    }
  }
  void sort(DeviceBuffer<Device>& pairs, std::uint64_t count, const Input& in,
            const Report* report) {
    const auto n = static_cast<std::size_t>(count);
    const std::size_t bytes = Device::sort_bytes(n);
    auto* p = pairs.template as<Pair>();
    device_.sort(p, bytes ? sorting_.ensure(bytes) : nullptr, bytes, p, n, n, report, in);
  }

  Device& device_;
  DeviceBuffer<Device> workspace_{device_}, found_{device_}, sorting_{device_};
  DeviceBuffer<Device> escaped_ids_{device_}, outliers_{device_}, query_boxes_{device_},
      fresh_{device_}, outlier_boxes_{device_}, outlier_filters_{device_},
      outlier_workspace_{device_};
  // The grid of the last find_all(), in workspace_.
  Input grid_input_;
  Workspace grid_workspace_;
  bool has_grid_ = false, many_escaped_ = false;
};

}  // namespace throng::device
