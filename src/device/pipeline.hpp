// The device pipeline: from boxes to pairs in a fixed sequence of launches, on any Device
// (device/host_device.hpp, cuda/device.cuh). Never synchronizes with the device, so the sequence
// can be recorded and replayed. The plan is made on the device and stays there.
//
// A Device provides
//   launch(count, f)        f(i) for each i below count, in any order, in parallel
//   plan(PlanGrid, p, bytes)
//                           the phases of SizeClassPlanner, by one block; zeroes p
//   clear(p, bytes)         zeroes
//   scan_cells(wanted, table, cells, sums)
//                           exclusive sums in place, unless *wanted exists and is 0
//   sort_cells(keys, values, capacity, count, begin, end)
//                           sorts (key, value) by these bits of the key; returns where they are.
//                           Each array has two halves of `capacity` entries
//   place(count, PlaceBuckets)
//                           the block-wide steps of device/cell_sort.hpp
//   search(bound, s, sink, check)
//                           walks s.begin(i), i < s.count() <= bound, collects the hits, and writes
//                           those that pass the check; by default all
//   fork(f), join()         f's work may run concurrently with all that follows, until join()
//   mark(stage)             the end of a stage, for timing
//   sorted_above            inputs of more boxes are sorted by cell
//   scan_cells_bytes(cells), sort_cells_bytes(count)
//                           scratch sizes of these; the first is zeroed with the table
//   use_scratch(p, bytes)   the scratch memory of the sorts and scans that follow
// Each of these sees the writes of those before it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <throng/options.hpp>

#include "device/binning.hpp"
#include "device/cell_sort.hpp"
#include "device/input.hpp"
#include "device/plan/size_class_planner.hpp"
#include "device/search.hpp"
#include "device/worlds.hpp"

namespace throng::device {

// Up to this many boxes brute force is faster than a grid: two launches instead of six. On an H200:
// 28 us at 4,000 boxes and 74 us at 8,000, where the grid takes 37 us at both (throng-bench-gpu
// --part crossover).
constexpr std::uint64_t tile_search_limit = 4096;

// Indices run through both sets, and a table of 9/4 cells per box is counted in 32 bits.
constexpr std::uint64_t max_pipeline_boxes = 1'800'000'000;

enum class Stage : std::uint8_t { plan, bin, find, order };

// Where pairs go. `report->found` counts all of them, written or not.
struct PairSink {
  Pair* out = nullptr;
  std::uint64_t capacity = 0;
  Report* report = nullptr;
};

// Loads the sample and runs the planner, in one thread block.
struct PlanGrid {
  Input in;
  GridLimits limits;
  base::SizeClassGrid* grid;
  std::uint32_t* occupied;  // zeroed
  Report* report;           // reset
  bool packed = in.sets[0].packed && (!in.two_sets || in.sets[1].packed);

  using Shared = SizeClassPlanner::Shared;
  static constexpr std::uint32_t threads = SizeClassPlanner::threads;

  THRONG_HD bool wanted() const noexcept { return in.wants_grid(); }
  template <class Each>
  THRONG_HD void operator()(Shared& s, const Each& each) const noexcept {
    if (!wanted()) {
      each([&](std::uint32_t t) {
        if (t == 0) *grid = base::SizeClassGrid{};
        clear_occupied(t);
      });
      return;
    }
    each([&](std::uint32_t t) { load(t, s); });
    SizeClassPlanner::run(s, limits, *grid, each);
  }

 private:
  THRONG_HD void clear_occupied(std::uint32_t t) const noexcept {
    THRONG_UNROLL(1)
    for (std::uint32_t k = t; k < occupied_words; k += threads) occupied[k] = 0;
  }

  static constexpr float infinity = std::numeric_limits<float>::infinity();

  // Each thread reads some boxes for the bounds; the first of every `parts` threads keeps one as a
  // sample. The threads of a sample read neighbouring boxes, which memory delivers together.
  THRONG_HD void load(std::uint32_t t, Shared& s) const noexcept {
    constexpr std::uint32_t sample_count = sample_size;
    const std::uint32_t sample = t / SizeClassPlanner::parts;
    constexpr std::uint32_t boxes_per_thread = 8, batch = 2;
    // Expansion by the margin is monotonic, so the union is expanded instead of each box.
    Box all = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}}, kept = {};
    std::int32_t kept_world = -1;
    BoundsSummary seen = SizeClassPlanner::empty_summary();
    THRONG_UNROLL(1)
    for (std::uint32_t first = 0; first < boxes_per_thread; first += batch) {
      // One loop per kind of load, so that all loads of a loop are in flight together.
      std::uint32_t at[batch];
      Box boxes[batch];
      std::int32_t worlds[batch] = {}, next[batch] = {};
      THRONG_UNROLL(batch)
      for (std::uint32_t k = 0; k < batch; ++k)
        at[k] = sample_index(sample * boxes_per_thread + first + k, sample_count * boxes_per_thread,
                             t % SizeClassPlanner::parts);
      if (packed && !in.two_sets) {
        THRONG_UNROLL(batch)
        for (std::uint32_t k = 0; k < batch; ++k) boxes[k] = in.sets[0].packed_box(at[k]);
      } else if (packed) {
        THRONG_UNROLL(batch)
        for (std::uint32_t k = 0; k < batch; ++k)
          boxes[k] = in.set_of(at[k]).packed_box(in.local(at[k]));
      } else {
        THRONG_UNROLL(batch)
        for (std::uint32_t k = 0; k < batch; ++k) boxes[k] = in.set_of(at[k]).box(in.local(at[k]));
      }
      if (in.has_worlds) {
        THRONG_UNROLL(batch)
        for (std::uint32_t k = 0; k < batch; ++k) {
          worlds[k] = in.world(at[k]);
          next[k] = at[k] + 1 < in.count ? in.world(at[k] + 1) : worlds[k];
        }
        THRONG_UNROLL(batch)
        for (std::uint32_t k = 0; k < batch; ++k) {
          const std::uint32_t world = static_cast<std::uint32_t>(worlds[k]) + 1;
          seen.worlds = seen.worlds > world ? seen.worlds : world;
          seen.changes += next[k] != worlds[k];
        }
        seen.sampled_count += batch;
        if (first == 0) kept_world = worlds[0];
      }
      THRONG_UNROLL(batch)
      for (std::uint32_t k = 0; k < batch; ++k)
        if (base::is_active(boxes[k])) include(boxes[k], all);
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
      const BoundsSummary reach = SizeClassPlanner::summary_of(box);
      if (!keep) {
        if (active) SizeClassPlanner::join(seen, reach);
        s.early.reaches[t] = seen;
        if (t % SizeClassPlanner::parts != 0) return;
      } else {
        for (int q = 0; q < 6; ++q) s.early.loaded.most[q][sample] = reach.most[q];
        s.early.loaded.worlds[sample] = active ? kept_world : -2;
      }
    }
  }

  // `b` is active.
  THRONG_HD static void include(const Box& b, Box& all) noexcept {
    all.lower.x = fminf(all.lower.x, b.lower.x), all.upper.x = fmaxf(all.upper.x, b.upper.x);
    all.lower.y = fminf(all.lower.y, b.lower.y), all.upper.y = fmaxf(all.upper.y, b.upper.y);
    all.lower.z = fminf(all.lower.z, b.lower.z), all.upper.z = fmaxf(all.upper.z, b.upper.z);
  }
  // Index of the box `behind` places after a random one in the k-th of `of` equal parts of all
  // boxes. Regular strides would alias with boxes that come in regular series. There is at least
  // one box, and the parts have 32 bits.
  THRONG_HD std::uint32_t sample_index(std::uint32_t k, std::uint32_t of,
                                       std::uint32_t behind) const noexcept {
    const std::uint64_t n = in.count, begin = k * n / of, end = (k + std::uint64_t{1}) * n / of;
    const std::uint64_t part = static_cast<std::uint32_t>(end - begin);
    const auto at = static_cast<std::uint32_t>(begin + (part * base::mix(k ^ in.count) >> 32));
    return behind < in.count - at ? at + behind : at;
  }
};

// One block of memory for up to `boxes` boxes, carved into arrays.
struct Workspace {
  static constexpr std::uint32_t row_cells = 8192;  // of a hashed grid

  std::uint32_t boxes = 0, table_cells = 0;
  Report* report = nullptr;
  base::SizeClassGrid* grid = nullptr;
  WorldsReport* worlds = nullptr;
  std::uint32_t* occupied = nullptr;
  std::uint64_t* sums = nullptr;  // scratch, before the table, with which it is zeroed
  std::uint32_t* table = nullptr;
  Place* places = nullptr;                         // of unsorted boxes
  std::uint32_t *cells = nullptr, *ids = nullptr;  // of sorted boxes; twice the size, for the sort
  Record* records = nullptr;
  char* scratch = nullptr;  // of the device's sort
  std::size_t scratch_bytes = 0;

  static constexpr std::size_t occupied_count = occupied_words;

  // Sets the pointers into `base`; returns the bytes. base null: only measures.
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
    take(sums, Device::scan_cells_bytes(scanned(table_cells)) / sizeof *sums);
    take(table, scanned(table_cells));
    take(places, sorted ? 0 : count);
    take(cells, sorted ? std::size_t{2} * count : 0);
    take(ids, sorted ? std::size_t{2} * count : 0);
    take(records, count);
    // A later call with fewer boxes may need places.
    if (sorted) places = reinterpret_cast<Place*>(cells);
    scratch_bytes = sorted ? Device::sort_cells_bytes(count) : 0;
    take(scratch, scratch_bytes);
    return at;
  }
  // Cells, one extra row for a hashed grid, and one entry for the total.
  static constexpr std::size_t scanned(std::uint32_t cells) noexcept {
    return std::size_t{cells} + row_cells + 1;
  }
  // 9/4 cells per box: two cells per box are the optimum (measured by comparisons per box), plus a
  // quarter for the coarser classes.
  static constexpr std::uint32_t cells_for(std::uint32_t count) noexcept {
    return static_cast<std::uint32_t>(std::uint64_t{count} * 9 / 4 + 1024);
  }
};

// Counts of all cells, of the extra row and of the total are 32-bit, and so is the number of boxes
// of both sets together.
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

  // Whether small worlds, if the boxes turn out to be such, are searched one by one.
  static bool by_worlds(const Input& in) noexcept {
    return in.has_worlds && !in.two_sets && !in.has_external_queries && !in.grid_only;
  }

  // build and find, if the report is not read in between.
  void build_and_find(const Input& in, bool brute, const Workspace& w, const PairSink& sink) const {
    const bool worlds = !brute && by_worlds(in);
    build(in, brute, w, worlds ? &sink : nullptr);
    if (!worlds) return find(in, brute, w, sink);
    device_.search(in.count, grid_search(in, w), sink);
    device_.join();
    device_.mark(Stage::find);
  }

  // Reads, checks and stores the boxes. in.count is at most w.boxes. `early`: small worlds, if the
  // boxes turn out to be such, are searched concurrently.
  void build(Input in, bool brute, const Workspace& w, const PairSink* early = nullptr) const {
    if (brute) {
      device_.clear(w.report, sizeof(Report));
      device_.launch(in.count, LoadBoxes{in, w.records, w.report});
      device_.mark(Stage::bin);
      return;
    }
    GridLimits limits;
    limits.boxes = in.count;
    limits.table_cells = Workspace::cells_for(in.count);  // no more than a smaller set needs
    limits.row_cells = Workspace::row_cells;
    limits.present = in.present;
    limits.has_worlds = in.has_worlds;
    limits.cell_scale = in.cell_scale;
    const std::size_t scanned = Workspace::scanned(limits.table_cells);
    if (by_worlds(in)) {
      device_.launch(1, ResetWorldsReport{w.worlds, w.report});
      device_.launch(in.count, InspectWorlds{in, w.worlds, w.report, early == nullptr});
      in.grid_wanted = &w.worlds->grid_wanted;
      if (early)
        device_.fork([&] {
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
      device_.scan_cells(in.grid_wanted, w.table, scanned, w.sums);
      const PlaceBoxes place{in,        w.table,  w.places,
                             w.records, w.report, static_cast<std::uint32_t>(scanned - 1)};
      device_.launch(std::uint64_t{2} * in.count, place);
    }
    device_.mark(Stage::bin);
  }

  // After build: calls f(bound, search) with each search that the build allows. If there are two,
  // one of them is empty on the device.
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

  // Finds the pairs of `range`, by default all; adds to report->found. A check needs in.grid_only.
  template <class Check = AcceptAll>
  void find(const Input& in, bool brute, const Workspace& w, const PairSink& sink,
            const FirstRange& range = {}, const Check& check = {}) const {
    if (!brute && !in.has_filters && !in.two_sets && range.holds_all()) {
      using Plain = GridSearchOf<GridSearchMode::plain>;
      device_.search(in.count, Plain{in, w.grid, w.table, w.occupied, w.records, w.report, range},
                     sink, check);
    } else if constexpr (std::is_same_v<Check, AcceptAll>) {
      with_search(in, brute, w, range, [&](std::uint64_t bound, const auto& search) {
        device_.search(bound, search, sink);
      });
    } else if (brute) {
      const TileSearch search{in, w.records, range};
      device_.search(search.count(), search, sink, check);
    } else {
      device_.search(in.count, grid_search(in, w, range), sink, check);
    }
    device_.mark(Stage::find);
  }

 private:
  static GridSearch grid_search(const Input& in, const Workspace& w, const FirstRange& range = {}) {
    return {in, w.grid, w.table, w.occupied, w.records, w.report, range};
  }
  void sort_by_cell(const Input& in, const Workspace& w, const Buckets& buckets) const {
    device_.launch(in.count, ComputeCells{in, w.grid, w.cells, w.ids, w.occupied, w.report,
                                          buckets.inactive_cell()});
    device_.use_scratch(w.scratch, w.scratch_bytes);
    const SortedCells sorted =
        device_.sort_cells(w.cells, w.ids, w.boxes, in.count, buckets.bits, buckets.sort_end_bit());
    device_.place(in.count, PlaceBuckets{in, buckets, sorted.keys, sorted.values, w.table,
                                         w.records, w.report});
  }

  Device& device_;
};

}  // namespace throng::device
