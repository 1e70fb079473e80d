// The planner: statistics of the boxes in, an algorithm and its grid out. Pure functions.
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/options.hpp>
#include <throng/types.hpp>

#include "base/quantize.hpp"

namespace throng::base {

constexpr std::uint32_t max_sample = 512;
// Shorter ranges count as this long. Below the least float, as boxes may be that small.
constexpr double least_length = 1e-44;

// Statistics of all boxes, estimated from a sample.
struct Stats {
  std::uint64_t query_count = 0;   // searching boxes: all, or those that are not static
  std::uint64_t target_count = 0;  // boxes that are searched
  // Axes for which the values below are positions by bits (base/quantize.hpp) around a centre,
  // instead of coordinates.
  bool by_bits[3] = {false, false, false};
  float centre[3] = {0, 0, 0};
  float lower[3] = {0, 0, 0};  // range of nearly all boxes; outliers are excluded
  float upper[3] = {0, 0, 0};
  double extent[3] = {0, 0, 0};   // mean extent along each axis, clipped to that range
  double product[3] = {0, 0, 0};  // mean product of the extents along the two other axes
  // Density: neighbours per box, relative to boxes spread evenly over the range.
  double density_ratio = 1;

  // If boxes are clustered, the density depends on the axes. `effective_slabs`: of 2^r slabs along
  // an axis, the number of equally full slabs that gives the same probability that two boxes share
  // one.
  // `*_correlation`: how many times greater the probability is that two boxes share a cell across
  // an axis, or of all three axes, than the product of the axes' own probabilities.
  bool clustered = false;
  static constexpr int levels = 8;
  double effective_slabs[3][levels] = {};
  double axis_correlation[3] = {1, 1, 1}, joint_correlation = 1;
  // If boxes are not clustered: the fraction of boxes that begin within another box along an axis,
  // minus the fraction that their extents explain, if that at least doubles it, as in layers; else
  // 0.
  double layer_overlap[3] = {0, 0, 0};

  // The same for any number of slabs.
  double effective_slabs_at(std::uint32_t axis, std::uint32_t slabs) const noexcept;
};

// Computes the statistics of `count` <= max_sample active boxes.
Stats measure(const Box* sample, std::uint32_t count, std::uint64_t query_count,
              std::uint64_t target_count) noexcept;

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
  Quantizer map;
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

}  // namespace throng::base
