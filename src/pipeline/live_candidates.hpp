// Candidates of persistent objects on a device: all of them, found in a grid that is kept, or in
// that grid those of the few objects that left their fat boxes.
#pragma once

#include <cstdint>

#include "pipeline/block.hpp"
#include "pipeline/live_objects.hpp"
#include "pipeline/live_stray_stages.hpp"
#include "pipeline/order.hpp"
#include "pipeline/pipeline.hpp"

namespace throng::pipeline {

template <class Device>
class CandidateFinder {
 public:
  explicit CandidateFinder(Device& device) noexcept : device_(device) {}

  // Finds all into found(), sorted; returns their number. Keeps the grid that it searched.
  std::uint64_t find_all(const Boxes& fat, const Options& options, Result& r) {
    in_grid_ = false;
    if (fat.empty()) return 0;
    Options plain;
    plain.algorithm = options.algorithm;
    plain.cell_scale = options.cell_scale;
    grid_of_ = make_input(fat, nullptr, plain);
    bool brute = false;
    const std::uint64_t found =
        find(grid_of_, plain.algorithm, workspace_, workspace_of_, found_, brute);
    r.plan.algorithm = brute ? Algorithm::all_pairs : Algorithm::grid;
    sort(found_, found, grid_of_, workspace_of_.report);
    in_grid_ = !brute;
    return found;
  }

  // Finds the candidates of the few that left their fat boxes into fresh(), sorted: see
  // live_stray_stages.hpp. Returns false if they are too many or there is no grid. Calls begin()
  // before fat boxes change.
  template <class Begin>
  bool find_few(const LiveView& live, LiveTold* told, const Begin& begin, std::uint64_t& count) {
    const std::uint64_t most = live.limit / 8;
    if (!in_grid_ || live.world || most == 0) return false;
    leavers_.room(most * sizeof(Pair));
    strays_.room(most * sizeof(Pair));
    device_.clear(&told->leavers, 2 * sizeof(Report));  // and outliers
    look(LookForLeavers{live}, leavers_, &told->leavers);
    // If they were too many last time, their number is read first, before any further work is
    // launched.
    if (many_left_) many_left_ = device_.read(told->leavers).found > most;
    if (many_left_) return false;
    auto* askers = reinterpret_cast<Record*>(askers_.room(most * sizeof(Record)));
    begin();
    device_.launch(most,
                   FattenLeavers{live, leavers_.template as<Pair>(), &told->leavers, most, askers});
    look(LookForStrays{live}, strays_, &told->strays);
    const LiveTold seen = device_.read(*told);
    const std::uint64_t leavers = seen.leavers.found, strays = seen.strays.found;
    many_left_ = leavers > most;
    if (many_left_ || strays > room_of(strays_)) return false;
    // A refused call may have moved the filter arrays since.
    Set& filters = grid_of_.sets[0];
    const auto where_now = [](auto& column, const auto* now) {
      if (column) column.data = reinterpret_cast<const char*>(now);
    };
    where_now(filters.group, live.group);
    where_now(filters.mask, live.mask);
    where_now(filters.owner, live.owner);
    where_now(filters.is_static, live.is_static);
    GridSearchOf<Looking::around> around{grid_of_,
                                         workspace_of_.grid,
                                         workspace_of_.table,
                                         workspace_of_.occupied,
                                         workspace_of_.records,
                                         workspace_of_.report,
                                         {}};
    around.askers = askers;
    around.asker_count = leavers;
    around.states = live.state;
    around.mask_bits = alive_bit | stray_bit;
    around.wanted_bits = alive_bit;
    count = find_fresh(live, around, strays, told);
    sort(fresh_, count, ids_below(live.limit), &told->fresh);
    return true;
  }

  const Pair* found() const noexcept { return found_.template as<Pair>(); }
  const Pair* fresh() const noexcept { return fresh_.template as<Pair>(); }
  // The memory of found(): free between calls.
  Block<Device>& scratch() noexcept { return found_; }
  void forget_grid() noexcept { in_grid_ = false; }

  std::size_t held() const noexcept {
    std::size_t sum = 0;
    for (const Block<Device>* b : {&workspace_, &found_, &sorting_, &leavers_, &strays_, &askers_,
                                   &fresh_, &stray_boxes_, &stray_filters_, &stray_workspace_})
      sum += b->bytes();
    return sum;
  }
  static std::uint64_t room_of(const Block<Device>& pairs) noexcept {
    return pairs.bytes() / sizeof(Pair);
  }

 private:
  // Runs `each` once per index into `out`, up to its capacity.
  template <class Look>
  void look(const Look& each, const Block<Device>& out, Report* report) const {
    const std::uint64_t n = each.bound();
    if (n) device_.search(n, EachOnce<Look>{each}, {out.template as<Pair>(), room_of(out), report});
  }
  static Input ids_below(std::uint32_t limit) noexcept {
    Input in;
    in.count = in.first_count = limit;
    return in;
  }

  // Reserves capacity for the usual number of pairs; returns whether it is by brute force.
  bool build(const Input& in, Algorithm algorithm, Block<Device>& memory, Workspace& w,
             Block<Device>& out) {
    const bool brute = Pipeline<Device>::brute_force(in, algorithm);
    w.template carve<Device>(in.count, memory.room(w.template carve<Device>(in.count, nullptr)));
    Pipeline<Device>(device_).build(in, brute, w);
    out.room((std::size_t{4} * in.count + 512) * sizeof(Pair));
    return brute;
  }
  // Finds into `out`, which grows; returns the number.
  std::uint64_t find(const Input& in, Algorithm algorithm, Block<Device>& memory, Workspace& w,
                     Block<Device>& out, bool& brute) {
    brute = build(in, algorithm, memory, w, out);
    const Pipeline<Device> pipeline(device_);
    for (;;) {
      device_.clear(&w.report->found, sizeof w.report->found);
      pipeline.find(in, brute, w, {out.template as<Pair>(), room_of(out), w.report});
      const std::uint64_t found = device_.read(*w.report).found;
      if (found <= room_of(out)) return found;
      out.room(static_cast<std::size_t>(found + found / 8 + 512) * sizeof(Pair));
    }
  }
  // A grid of the outliers (or brute force, if they are few), in stray_workspace_.
  struct StrayGrid {
    Input in;
    Workspace w;
    bool brute = false;
  };
  StrayGrid build_strays(const LiveView& live, std::uint64_t strays) {
    const auto* ids = strays_.template as<Pair>();
    auto* boxes = reinterpret_cast<Box*>(stray_boxes_.room(strays * sizeof(Box)));
    auto* filters = reinterpret_cast<Filter*>(stray_filters_.room(strays * sizeof(Filter)));
    device_.launch(strays, GatherStrays{live, ids, boxes, filters});
    const auto n = static_cast<std::size_t>(strays);
    Boxes view(boxes, n);
    if (live.group || live.mask) {
      view.filters.group = {&filters->group, n, sizeof(Filter)};
      view.filters.mask = {&filters->mask, n, sizeof(Filter)};
    }
    if (live.owner) view.filters.owner = {&filters->owner, n, sizeof(Filter)};
    if (live.is_static) view.filters.is_static = {&filters->is_static, n, sizeof(Filter)};
    StrayGrid grid;
    grid.in = make_input(view, nullptr, {});
    grid.brute = build(grid.in, Algorithm::automatic, stray_workspace_, grid.w, found_);
    return grid;
  }
  // Finds the candidates of the objects that left into fresh_, which grows; returns the number.
  std::uint64_t find_fresh(const LiveView& live, const GridSearchOf<Looking::around>& around,
                           std::uint64_t strays, LiveTold* told) {
    const std::uint64_t leavers = around.asker_count;
    StrayGrid grid;
    if (strays) grid = build_strays(live, strays);
    for (;;) {
      device_.clear(&told->fresh, sizeof(Report) + sizeof told->among);
      device_.search(leavers, around, {fresh_.template as<Pair>(), room_of(fresh_), &told->fresh});
      if (strays) {
        Report* report = grid.w.report;
        auto* among = found_.template as<Pair>();
        device_.clear(&report->found, sizeof report->found);
        Pipeline<Device>(device_).find(grid.in, grid.brute, grid.w,
                                       {among, room_of(found_), report});
        look(LookForStrayPairs{live, strays_.template as<Pair>(), among, report, room_of(found_)},
             fresh_, &told->fresh);
        device_.copy(&told->among, &report->found, sizeof told->among);
      }
      const LiveTold seen = device_.read(*told);
      const std::uint64_t fresh = seen.fresh.found;
      if (seen.among > room_of(found_)) {
        found_.room(static_cast<std::size_t>(seen.among + seen.among / 8 + 512) * sizeof(Pair));
        continue;
      }
      if (fresh <= room_of(fresh_)) return fresh;
      fresh_.room(static_cast<std::size_t>(fresh + fresh / 8 + 1024) * sizeof(Pair));
    }
  }
  void sort(Block<Device>& pairs, std::uint64_t count, const Input& in, const Report* report) {
    const auto n = static_cast<std::size_t>(count);
    const std::size_t bytes = Device::sort_bytes(n);
    auto* p = pairs.template as<Pair>();
    device_.sort(p, bytes ? sorting_.room(bytes) : nullptr, bytes, p, n, n, report, in);
  }

  Device& device_;
  Block<Device> workspace_{device_}, found_{device_}, sorting_{device_};
  Block<Device> leavers_{device_}, strays_{device_}, askers_{device_}, fresh_{device_},
      stray_boxes_{device_}, stray_filters_{device_}, stray_workspace_{device_};
  // The grid of the last find_all(), in workspace_.
  Input grid_of_;
  Workspace workspace_of_;
  bool in_grid_ = false, many_left_ = false;
};

}  // namespace throng::pipeline
