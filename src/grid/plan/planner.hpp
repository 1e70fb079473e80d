// The planner: statistics of the boxes -> candidates -> prices -> choice. Pure functions.
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/options.hpp>

#include "base/cost_table.hpp"
#include "base/quantize.hpp"
#include "grid/plan/grid_prices.hpp"
#include "grid/plan/stats.hpp"

namespace throng::grid {

// A way to search, and its price.
struct Candidate {
  bool all_pairs = false;
  std::uint32_t sweep_axis = 0;
  std::uint32_t columns[3] = {1, 1, 1};
  double replicas = 1;     // expected columns per box
  double window = 0;       // expected boxes of a column that begin within one of them
  double expected_ns = 0;  // on one thread
};

// The cost of one comparison of brute force.
inline double comparison_ns(const SweepCost& sweep_cost) noexcept {
  return std::max(base::cost.brute_force_ns, 2 * sweep_cost.long_box_ns);
}
Candidate brute_force(const Stats& stats, const SweepCost& sweep_cost) noexcept;
// The cheapest grid that is swept along `axis`.
Candidate cheapest_grid(const Stats& stats, const SweepCost& sweep_cost,
                        std::uint32_t axis) noexcept;
// The same grid with columns `scale` times as wide across the sweep axis, within the limits of
// every grid and of the columns per box: large boxes in small columns would exhaust any memory.
Candidate scaled(const Candidate& grid, const Stats& stats, const SweepCost& sweep_cost,
                 double scale) noexcept;
constexpr double max_scaled_replicas = 16;

// What a search does.
struct GridPlan : Candidate {
  base::Quantizer map;
  std::uint32_t worlds = 1;  // each has its own `map` columns, in order of worlds
  bool clustered = false;    // boxes are denser than an even spread
  const char* reason = "";

  std::uint32_t column_count() const noexcept { return map.column_count() * worlds; }
};

// Brute force for up to base::cost.brute_force_boxes boxes, else the cheapest grid. `forced`:
// automatic, all_pairs or grid. `cell_scale`: factor on the width of its columns.
GridPlan plan(const Stats& stats, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept;

}  // namespace throng::grid
