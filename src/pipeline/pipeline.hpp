// The device pipeline: from boxes to pairs in a fixed sequence of launches, on whatever Device runs
// them (pipeline/host_device.hpp, cuda/device.cuh). Nothing here waits for the device, so the whole
// of it can be recorded and replayed; the plan is made by the device and stays there.
//
// A Device has
//   launch(count, f)        f(i) for each i below count, in any order, at once
//   plan(PlanGrid, p, bytes)
//                           the phases of core::ClassPlanner, by one block; and zeros there
//   clear(p, bytes)         zeros
//   sum_up(wanted, table, cells, sums)
//                           exclusive sums, in place, unless *wanted is there and 0
//   sort_cells(keys, values, room, count, begin, end)
//                           by those bits of the keys, each with its value; tells where they are
//   place(count, PlaceBuckets)
//                           what threads that share memory do (pipeline/cell_order.hpp)
//   search(bound, s, sink)  walks s.begin(i), i < s.count() <= bound, and writes the hits
//   beside(f), join()       what f has done may go on beside all that follows, until join()
//   mark(stage)             the end of a stage, for whoever measures
//   sorted_above            more boxes than so many are sorted by cell
//   sums_bytes(cells), sort_cells_bytes(count)
//                           scratch that these take of so many; the first cleared, as the table
// and each of these sees what those before it wrote.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <throng/options.hpp>

#include "core/class_planner.hpp"
#include "pipeline/cell_order.hpp"
#include "pipeline/input.hpp"
#include "pipeline/search.hpp"
#include "pipeline/stages.hpp"
#include "pipeline/worlds.hpp"

namespace throng::pipeline {

// Up to so many boxes brute force is faster than a grid: two launches in place of six. On an H200
// 28 us for 37 of 4,000 boxes, 74 for 37 of 8,000 (throng-bench-gpu --part crossover).
constexpr std::uint64_t tile_search_limit = 4096;

// Indices run through both sets, and a table of 9/4 cells a box is counted in 32 bits.
constexpr std::uint64_t max_pipeline_boxes = 1'800'000'000;

enum class Stage : std::uint8_t { plan, bin, find, order };

// Where pairs go. `report->found` counts all of them, written or not.
struct PairSink {
  Pair* out = nullptr;
  std::uint64_t capacity = 0;
  Report* report = nullptr;
};

// Loads the sample and runs the planner: what the planning block does.
struct PlanGrid {
  Input in;
  core::GridLimits limits;
  core::ClassGrid* grid;
  std::uint32_t* occupied;  // cleared
  Report* report;           // emptied
  bool packed = in.sets[0].packed && (!in.two_sets || in.sets[1].packed);

  using Shared = core::ClassPlanner::Shared;
  static constexpr std::uint32_t threads = core::ClassPlanner::threads;

  THRONG_HD bool wanted() const noexcept { return in.wants_grid(); }
  template <class Each>
  THRONG_HD void operator()(Shared& s, const Each& each) const noexcept {
    if (!wanted()) {
      each([&](std::uint32_t t) {
        if (t == 0) *grid = core::ClassGrid{};
        clear_occupied(t);
      });
      return;
    }
    each([&](std::uint32_t t) { load(t, s); });
    core::ClassPlanner::run(s, limits, *grid, each);
  }

 private:
  THRONG_HD void clear_occupied(std::uint32_t t) const noexcept {
    THRONG_UNROLL(1)
    for (std::uint32_t k = t; k < occupied_words; k += threads) occupied[k] = 0;
  }

  static constexpr float infinity = std::numeric_limits<float>::infinity();

  // Each thread sees some boxes for the range; the first of every `parts` threads keeps one. Those
  // look at neighbours, which a memory hands out together.
  THRONG_HD void load(std::uint32_t t, Shared& s) const noexcept {
    constexpr std::uint32_t keepers = core::sample_size;
    const std::uint32_t keeper = t / core::ClassPlanner::parts;
    constexpr std::uint32_t looks = 8, at_once = 2;
    // Growing by the margin keeps the order, so the box around all is grown instead of each.
    Box all = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}}, kept = {};
    std::int32_t kept_world = -1;
    core::Reach seen = core::ClassPlanner::nothing();
    THRONG_UNROLL(1)
    for (std::uint32_t first = 0; first < looks; first += at_once) {
      // One loop for each thing that takes long to come: all of a loop are under way together.
      std::uint32_t at[at_once];
      Box boxes[at_once];
      std::int32_t worlds[at_once] = {}, next[at_once] = {};
      THRONG_UNROLL(at_once)
      for (std::uint32_t k = 0; k < at_once; ++k)
        at[k] = look(keeper * looks + first + k, keepers * looks, t % core::ClassPlanner::parts);
      if (packed && !in.two_sets) {
        THRONG_UNROLL(at_once)
        for (std::uint32_t k = 0; k < at_once; ++k) boxes[k] = in.sets[0].packed_box(at[k]);
      } else if (packed) {
        THRONG_UNROLL(at_once)
        for (std::uint32_t k = 0; k < at_once; ++k)
          boxes[k] = in.set_of(at[k]).packed_box(in.local(at[k]));
      } else {
        THRONG_UNROLL(at_once)
        for (std::uint32_t k = 0; k < at_once; ++k)
          boxes[k] = in.set_of(at[k]).box(in.local(at[k]));
      }
      if (in.has_worlds) {
        THRONG_UNROLL(at_once)
        for (std::uint32_t k = 0; k < at_once; ++k) {
          worlds[k] = in.world(at[k]);
          next[k] = at[k] + 1 < in.count ? in.world(at[k] + 1) : worlds[k];
        }
        THRONG_UNROLL(at_once)
        for (std::uint32_t k = 0; k < at_once; ++k) {
          const std::uint32_t world = static_cast<std::uint32_t>(worlds[k]) + 1;
          seen.worlds = seen.worlds > world ? seen.worlds : world;
          seen.changes += next[k] != worlds[k];
        }
        seen.looked_at += at_once;
        if (first == 0) kept_world = worlds[0];
      }
      THRONG_UNROLL(at_once)
      for (std::uint32_t k = 0; k < at_once; ++k)
        if (core::is_active(boxes[k])) include(boxes[k], all);
      if (first == 0) kept = boxes[0];
    }
    if (t == 0) *report = Report{};
    clear_occupied(t);
    THRONG_UNROLL(1)
    for (int k = 0; k < 2; ++k) {
      const bool keep = k == 1;
      Box box = keep ? kept : all;
      bool nan;
      const bool active = check_box(in, box, nan);
      const core::Reach reach = core::ClassPlanner::reach_of(box);
      if (!keep) {
        if (active) core::ClassPlanner::join(seen, reach);
        s.early.reaches[t] = seen;
        if (t % core::ClassPlanner::parts != 0) return;
      } else {
        for (int q = 0; q < 6; ++q) s.early.loaded.most[q][keeper] = reach.most[q];
        s.early.loaded.worlds[keeper] = active ? kept_world : -2;
      }
    }
  }

  // Of an active box.
  THRONG_HD static void include(const Box& b, Box& all) noexcept {
    all.lower.x = fminf(all.lower.x, b.lower.x), all.upper.x = fmaxf(all.upper.x, b.upper.x);
    all.lower.y = fminf(all.lower.y, b.lower.y), all.upper.y = fmaxf(all.upper.y, b.upper.y);
    all.lower.z = fminf(all.lower.z, b.lower.z), all.upper.z = fmaxf(all.upper.z, b.upper.z);
  }
  // So many behind somewhere in the k-th of `of` equal parts of all boxes: at even distances, boxes
  // that come in regular series would be taken for all alike. There is a box, and the parts have 32
  // bits.
  THRONG_HD std::uint32_t look(std::uint32_t k, std::uint32_t of,
                               std::uint32_t behind) const noexcept {
    const std::uint64_t n = in.count, begin = k * n / of, end = (k + std::uint64_t{1}) * n / of;
    const std::uint64_t part = static_cast<std::uint32_t>(end - begin);
    const auto at = static_cast<std::uint32_t>(begin + (part * core::mix(k ^ in.count) >> 32));
    return behind < in.count - at ? at + behind : at;
  }
};

// One block of memory for up to `boxes` boxes, carved up.
struct Workspace {
  static constexpr std::uint32_t row_cells = 8192;  // of a hashed grid

  std::uint32_t boxes = 0, table_cells = 0;
  Report* report = nullptr;
  core::ClassGrid* grid = nullptr;
  WorldsTold* worlds = nullptr;
  std::uint32_t* occupied = nullptr;
  std::uint64_t* sums = nullptr;  // scratch, before the table, with which it is cleared
  std::uint32_t* table = nullptr;
  Place* places = nullptr;                         // of boxes that are not sorted
  std::uint32_t *cells = nullptr, *ids = nullptr;  // of those that are, with room for as many again
  Record* records = nullptr;
  char* scratch = nullptr;  // of the device's sort
  std::size_t scratch_bytes = 0;

  static constexpr std::size_t occupied_count = occupied_words;

  // Sets the pointers, from `base` on; tells the bytes. base null: only measures.
  template <class Device>
  std::size_t carve(std::uint32_t count, char* base) {
    const bool sorted = count > Device::sorted_above;
    boxes = count;
    table_cells = cells_for(count);
    std::size_t at = 0;
    const auto take = [&](auto*& p, std::size_t n) {
      using T = std::remove_reference_t<decltype(*p)>;
      p = base ? reinterpret_cast<T*>(base + at) : nullptr;
      at += (n * sizeof(T) + 255) / 256 * 256;
    };
    take(report, 1);
    take(worlds, 1);
    take(occupied, occupied_count);
    take(grid, 1);
    take(sums, Device::sums_bytes(scanned(table_cells)) / sizeof *sums);
    take(table, scanned(table_cells));
    take(places, sorted ? 0 : count);
    take(cells, sorted ? std::size_t{2} * count : 0);
    take(ids, sorted ? std::size_t{2} * count : 0);
    take(records, count);
    // Fewer boxes than there is room for may need places.
    if (sorted) places = reinterpret_cast<Place*>(cells);
    scratch_bytes = sorted ? Device::sort_cells_bytes(count) : 0;
    take(scratch, scratch_bytes);
    return at;
  }
  // Cells, with a row beyond for a hashed grid, and one more, which counts all.
  static constexpr std::size_t scanned(std::uint32_t cells) noexcept {
    return std::size_t{cells} + row_cells + 1;
  }
  // 9/4 cells a box: enough for one box in two cells at the sizes that are best (measured by
  // comparisons a box), and a quarter for the coarser classes.
  static constexpr std::uint32_t cells_for(std::uint32_t count) noexcept {
    return static_cast<std::uint32_t>(std::uint64_t{count} * 9 / 4 + 1024);
  }
};

// The counts of all cells, of the row beyond them and of the one that counts all have numbers of 32
// bits, and so have the boxes of both sets together, which are counted there.
static_assert(Workspace::row_cells <= 1u << GridSearch::row_bits / 2);
static_assert(max_pipeline_boxes * 9 / 4 + 1024 + Workspace::row_cells + 1 <= 0xffffffffu);

template <class Device>
class Pipeline {
 public:
  explicit Pipeline(Device& device) noexcept : device_(device) {}

  static bool brute_force(const Input& in, Algorithm algorithm) noexcept {
    return algorithm == Algorithm::all_pairs ||
           (algorithm == Algorithm::automatic && in.count <= tile_search_limit);
  }

  // Whether small worlds, if that is what there is, are searched one by one.
  static bool by_worlds(const Input& in) noexcept {
    return in.has_worlds && !in.two_sets && !in.for_others;
  }

  // Both, where nothing is asked in between.
  void build_and_find(const Input& in, bool brute, const Workspace& w, const PairSink& sink) const {
    const bool worlds = !brute && by_worlds(in);
    build(in, brute, w, worlds ? &sink : nullptr);
    if (!worlds) return find(in, brute, w, sink);
    device_.search(in.count, grid_search(in, w), sink);
    device_.join();
    device_.mark(Stage::find);
  }

  // Reads, checks and stores the boxes. in.count is at most w.boxes. `early`: small worlds, if that
  // is what there is, are searched meanwhile.
  void build(Input in, bool brute, const Workspace& w, const PairSink* early = nullptr) const {
    if (brute) {
      device_.clear(w.report, sizeof(Report));
      device_.launch(in.count, LoadBoxes{in, w.records, w.report});
      device_.mark(Stage::bin);
      return;
    }
    core::GridLimits limits;
    limits.boxes = in.count;
    limits.table_cells = Workspace::cells_for(in.count);  // no more than a smaller set needs
    limits.row_cells = Workspace::row_cells;
    limits.present = in.present;
    limits.has_worlds = in.has_worlds;
    limits.cell_scale = in.cell_scale;
    const std::size_t scanned = Workspace::scanned(limits.table_cells);
    if (by_worlds(in)) {
      device_.launch(1, BeginWorlds{w.worlds, w.report});
      device_.launch(in.count, LookAtWorlds{in, w.worlds, w.report, early == nullptr});
      in.grid_wanted = &w.worlds->grid_wanted;
      if (early)
        device_.beside([&] {
          device_.search(in.count, WorldSearch{in, w.worlds, {}, w.report}, *early);
        });
    }
    const bool sorted = in.count > Device::sorted_above;
    const auto* const begin = reinterpret_cast<const char*>(w.sums);
    const auto* const end = reinterpret_cast<const char*>(w.table + scanned);
    device_.plan(PlanGrid{in, limits, w.grid, w.occupied, w.report}, w.sums,
                 sorted ? 0 : static_cast<std::size_t>(end - begin));
    device_.mark(Stage::plan);
    if (sorted) {
      sort_by_cell(in, w, Buckets::of(scanned));
    } else {
      device_.launch(in.count, CountBoxes{in, w.grid, w.table, w.occupied, w.places, w.report});
      device_.sum_up(in.grid_wanted, w.table, scanned, w.sums);
      const PlaceBoxes place{in,        w.table,  w.places,
                             w.records, w.report, static_cast<std::uint32_t>(scanned - 1)};
      device_.launch(std::uint64_t{2} * in.count, place);
    }
    device_.mark(Stage::bin);
  }

  // After build; calls f(bound, search) with those that it was built for, of which one is empty if
  // there are two.
  template <class F>
  void with_search(const Input& in, bool brute, const Workspace& w, const FirstRange& range,
                   F&& f) const {
    if (brute) {
      const TileSearch search{in, w.records, range};
      f(search.count(), search);
    } else {
      if (by_worlds(in)) f(std::uint64_t{in.count}, WorldSearch{in, w.worlds, range});
      f(std::uint64_t{in.count}, grid_search(in, w, range));
    }
  }

  // Finds the pairs of `range`, all unless told otherwise; adds to report->found.
  void find(const Input& in, bool brute, const Workspace& w, const PairSink& sink,
            const FirstRange& range = {}) const {
    if (!brute && !in.has_filters && !in.two_sets && range.holds_all()) {
      using Plain = GridSearchOf<Looking::plain>;
      device_.search(in.count, Plain{in, w.grid, w.table, w.occupied, w.records, w.report, range},
                     sink);
    } else {
      with_search(in, brute, w, range, [&](std::uint64_t bound, const auto& search) {
        device_.search(bound, search, sink);
      });
    }
    device_.mark(Stage::find);
  }

 private:
  static GridSearch grid_search(const Input& in, const Workspace& w, const FirstRange& range = {}) {
    return {in, w.grid, w.table, w.occupied, w.records, w.report, range};
  }
  void sort_by_cell(const Input& in, const Workspace& w, const Buckets& buckets) const {
    device_.launch(in.count,
                   NameCells{in, w.grid, w.cells, w.ids, w.occupied, w.report, buckets.outside()});
    device_.use_scratch(w.scratch, w.scratch_bytes);
    const ByBucket sorted =
        device_.sort_cells(w.cells, w.ids, w.boxes, in.count, buckets.bits, buckets.sorted_end());
    device_.place(in.count, PlaceBuckets{in, buckets, sorted.keys, sorted.values, w.table,
                                         w.records, w.report});
  }

  Device& device_;
};

}  // namespace throng::pipeline
