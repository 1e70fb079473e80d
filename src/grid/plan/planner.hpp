// The planner: statistics of the boxes in, an algorithm and its grid out. Pure functions.
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/options.hpp>

#include "base/quantize.hpp"
#include "grid/plan/stats.hpp"

namespace throng::grid {

// The cost of comparing a box with a window of `window` boxes, in the ns of the constants below:
// the cheaper of two methods, one with a cheap start, one with cheap comparisons. Windows below
// `least_window` cost as much as that.
struct SweepCost {
  double least_window;
  double start_ns, box_ns;
  double long_start_ns, long_box_ns;

  double operator()(double window) const noexcept {
    const double boxes = std::max(window, least_window);
    return std::min(start_ns + box_ns * boxes, long_start_ns + long_box_ns * boxes);
  }
};

struct GridPlan {
  bool all_pairs = false;
  std::uint32_t sweep_axis = 0;
  base::Quantizer map;
  std::uint32_t worlds = 1;  // each has its own `map` columns, in order of worlds
  double replicas = 1;       // expected columns per box
  bool clustered = false;    // boxes are denser than an even spread
  double expected_ns = 0;    // on one thread
  const char* reason = "";

  std::uint32_t column_count() const noexcept { return map.column_count() * worlds; }
};

// `sweep_cost`: cost of the kernels' comparisons. `forced`: automatic, all_pairs or grid.
// `cell_scale`: factor on the width of the cheapest columns, across the sweep axis.
GridPlan plan(const Stats& stats, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept;

// Up to this many boxes brute force is faster than a grid. Measured by throng bench.
constexpr std::uint64_t all_pairs_limit = 112;

// Costs in ns, fitted to runs over many grids on AVX-512 server cores; only the ratios matter. Per
// box binned; per additional column of a box; per record sorted in a column; per column with boxes,
// and per column without. Comparisons are the kernels' SweepCost.
constexpr double box_ns = 3.0;
constexpr double replica_ns = 5;
constexpr double record_ns = 6.0;
constexpr double column_ns = 150.0;
constexpr double empty_ns = 15.0;
// Per comparison of brute force.
constexpr double brute_force_ns = 0.25;
// A column of more records exceeds the L2 cache, and each record costs this much more.
constexpr double cached_records = 16384;
constexpr double uncached_ns = 40.0;
// A longer column is divided along its sweep axis into parts of about this many records.
constexpr double part_records = 4096;
// It is also divided until the mean extent is about this many quantization steps.
constexpr double extent_steps = 32;
// Columns scaled down by the caller stay wide enough to limit the columns per box: large boxes in
// small columns would exhaust any memory.
constexpr double most_scaled_replicas = 16;

}  // namespace throng::grid
