// The planner: what is known of the boxes in, an algorithm and its grid out. Pure functions.
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/options.hpp>
#include <throng/types.hpp>

#include "core/quantise.hpp"

namespace throng::core {

constexpr std::uint32_t max_sample = 512;
// A range that is shorter counts as so long: below the least float, as boxes may be that small.
constexpr double least_length = 1e-44;

// What a sample tells of all boxes.
struct Stats {
  std::uint64_t query_count = 0;  // boxes that look for partners: all, or those that are not static
  std::uint64_t target_count = 0;  // boxes among which they look
  // Along which axes all below is of positions by bits (core/quantise.hpp), around a centre, and
  // not of the coordinates.
  bool by_bits[3] = {false, false, false};
  float centre[3] = {0, 0, 0};
  float lower[3] = {0, 0, 0};  // where nearly all boxes lie; outliers are left out
  float upper[3] = {0, 0, 0};
  double extent[3] = {0, 0, 0};   // mean extent along each axis, cut to that range
  double product[3] = {0, 0, 0};  // mean product of the extents along the two other axes
  // How many times more neighbours a box has than if all were spread evenly over the range.
  double crowding = 1;

  // Where boxes are crowded, it matters along which axes. Of 2^r slabs along an axis, how many
  // there would be if all had as many boxes, for two boxes to share one by the same chance; and how
  // many times greater the chance is that two share cells across an axis, or of all three, than
  // these make it by themselves.
  bool crowded = false;
  static constexpr int halvings = 8;
  double filled[3][halvings] = {};
  double beyond_across[3] = {1, 1, 1}, beyond_all = 1;
  // Where they are not: the share of boxes that begins within one of them along an axis beyond what
  // their extents explain, if that is at least as much again, as in layers; else 0.
  double within[3] = {0, 0, 0};

  // The same of any number of slabs.
  double filled_slabs(std::uint32_t axis, std::uint32_t slabs) const noexcept;
};

// Measures `count` <= max_sample active boxes.
Stats measure(const Box* sample, std::uint32_t count, std::uint64_t query_count,
              std::uint64_t target_count) noexcept;

// What it costs to compare a box with a window of so many, in ns that fit those below: of two ways
// to do it, one that begins cheaply and one whose comparisons are cheap, the cheaper. Windows of
// less than `least_window` cost as much as that.
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
  Quantiser map;
  std::uint32_t worlds = 1;  // each has columns of its own, as many as the map, in order of worlds
  double replicas = 1;       // columns that a box is expected to be entered in
  bool crowded = false;      // boxes lie closer than spread evenly
  double expected_ns = 0;    // of one thread
  const char* reason = "";

  std::uint32_t column_count() const noexcept { return map.column_count() * worlds; }
};

// `sweep_cost`: what the kernels' comparisons cost. `forced`: automatic, all_pairs or grid.
// `cell_scale`: columns so many times as wide as the cheapest, across the axis of the sweep.
GridPlan plan(const Stats& stats, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept;

// Below so many boxes brute force is faster than a grid. Measured by throng bench.
constexpr std::uint64_t all_pairs_limit = 112;

// What a plan costs, in ns, fitted to runs over many grids on AVX-512 server cores; only the ratios
// matter. Binning a box; entering it in one more column; sorting a record of a column; each column
// that has boxes, and each that has none. Comparing is the kernels' SweepCost.
constexpr double box_ns = 3.0;
constexpr double replica_ns = 5;
constexpr double record_ns = 6.0;
constexpr double column_ns = 150.0;
constexpr double empty_ns = 15.0;
// A comparison of brute force.
constexpr double brute_ns = 0.25;
// A column of more records than this leaves the second level of cache, and each costs so much more.
constexpr double cached_records = 16384;
constexpr double uncached_ns = 40.0;
// A longer column is cut along its sweep axis into parts of about so many records.
constexpr double part_records = 4096;
// And into as many that the mean extent is about so many words.
constexpr double extent_words = 32;
// Columns scaled down by the caller stay so wide that a box is entered in so many at most: for
// large boxes in small columns no memory would do.
constexpr double most_scaled_replicas = 16;

}  // namespace throng::core
