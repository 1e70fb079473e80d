#include "grid/plan/planner.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/cost_table.hpp"

namespace throng::grid {
namespace {

constexpr float largest = std::numeric_limits<float>::max();

// Numbers of columns along an axis that is not swept.
constexpr std::uint32_t column_counts[] = {1,   2,   3,   4,   5,   6,    7,    8,    10,   12,
                                           14,  16,  20,  24,  28,  32,   40,   48,   56,   64,
                                           80,  96,  112, 128, 160, 192,  224,  256,  320,  384,
                                           448, 512, 640, 768, 896, 1024, 1536, 2048, 3072, 4096};

// A Candidate from its price.
Candidate grid_candidate(const GridPrices::Price& price, std::uint32_t x, std::uint32_t columns_y,
                         std::uint32_t columns_z) noexcept {
  Candidate grid;
  grid.sweep_axis = x;
  grid.columns[x] = static_cast<std::uint32_t>(price.parts);
  grid.columns[(x + 1) % 3] = columns_y;
  grid.columns[(x + 2) % 3] = columns_z;
  grid.replicas = price.replicas;
  grid.window = price.window;
  grid.expected_ns = price.ns;
  return grid;
}

// Column indices are 32-bit: a plan has at most 2^17 columns, sections times parts, which
// GridPrices ensures. A position along an axis, columns * 32768 - 1 at most, fits 31 bits.
static_assert(std::uint64_t{base::max_columns_per_axis} * base::steps_per_column <= 0x7fffffffu);
base::Quantizer make_map(const Stats& s, const std::uint32_t (&columns)[3]) noexcept {
  base::Quantizer map;
  for (int k = 0; k < 3; ++k) {
    const double length = double{s.upper[k]} - double{s.lower[k]};
    const double wanted =
        columns[k] * double{base::steps_per_column} / std::max(length, least_length);
    map.by_bits[k] = s.by_bits[k];
    map.centre[k] = s.centre[k];
    // A length is at least one ulp of its ends, so these stay below 2^26 if it becomes 1.
    if (length > largest / 2 || (wanted > largest / 2 && length > 0))
      map.factor[k] = std::ldexp(1.0f, std::clamp(-std::ilogb(length), -126, 127));
    map.is_identity = map.is_identity && map.factor[k] == 1 && !s.by_bits[k];
    map.origin[k] = s.lower[k] * map.factor[k];
    map.scale[k] = static_cast<float>(std::min(wanted / double{map.factor[k]}, 3e38));
    map.max[k] = base::largest_index(columns[k]);
    map.columns[k] = columns[k];
  }
  map.stride[0] = columns[1] * columns[2];
  map.stride[1] = columns[2];
  map.stride[2] = 1;
  return map;
}

}  // namespace

Candidate brute_force(const Stats& s, const SweepCost& sweep_cost) noexcept {
  Candidate brute;
  brute.all_pairs = true;
  brute.expected_ns = base::cost.box_ns * static_cast<double>(s.target_count) +
                      s.comparisons * comparison_ns(sweep_cost);
  return brute;
}

Candidate cheapest_grid(const Stats& s, const SweepCost& sweep_cost, std::uint32_t axis) noexcept {
  const GridPrices prices(s, sweep_cost, axis);
  Candidate best;
  best.expected_ns = std::numeric_limits<double>::max();
  constexpr std::uint32_t numbers = std::size(column_counts);
  std::uint32_t best_y = 0, best_z = 0;
  const auto consider = [&](std::uint32_t y, std::uint32_t z) {
    const std::uint32_t columns_y = column_counts[y], columns_z = column_counts[z];
    if (!prices.allows(columns_y, columns_z)) return;
    const GridPrices::Price price = prices(columns_y, columns_z);
    if (price.ns >= best.expected_ns) return;
    best = grid_candidate(price, axis, columns_y, columns_z);
    best_y = y;
    best_z = z;
  };
  // Every second number along each axis first, then those around the cheapest.
  const auto too_dear = [&](std::uint32_t y, std::uint32_t z) {
    return !prices.allows(column_counts[y], column_counts[z]) ||
           prices.least_ns(column_counts[y], column_counts[z]) >= best.expected_ns;
  };
  for (std::uint32_t y = 0; y < numbers && !too_dear(y, 0); y += 2)
    for (std::uint32_t z = 0; z < numbers && !too_dear(y, z); z += 2) consider(y, z);
  const std::uint32_t around_y = best_y, around_z = best_z;
  for (std::uint32_t y = around_y - (around_y != 0); y <= std::min(around_y + 1, numbers - 1); ++y)
    for (std::uint32_t z = around_z - (around_z != 0); z <= std::min(around_z + 1, numbers - 1);
         ++z)
      consider(y, z);
  return best;
}

Candidate scaled(const Candidate& grid, const Stats& s, const SweepCost& sweep_cost,
                 double scale) noexcept {
  const std::uint32_t x = grid.sweep_axis, y = (x + 1) % 3, z = (x + 2) % 3;
  const GridPrices prices(s, sweep_cost, x);
  const auto count = [&](std::uint32_t axis, int k, double by) {
    if (!prices.may_divide(k)) return 1u;
    return static_cast<std::uint32_t>(
        std::clamp(std::round(grid.columns[axis] / by), 1.0, double{base::max_columns_per_axis}));
  };
  // Finer grids: the nearest scale within the limits, or none.
  for (double by = scale; scale >= 1 || by < 1; by *= 1.125) {
    const std::uint32_t columns_y = count(y, 0, by), columns_z = count(z, 1, by);
    const GridPrices::Price price = prices(columns_y, columns_z);
    if (scale >= 1 ||
        (prices.allows(columns_y, columns_z) && price.replicas <= max_scaled_replicas))
      return grid_candidate(price, x, columns_y, columns_z);
  }
  return grid;
}

GridPlan plan(const Stats& s, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept {
  GridPlan best;
  Candidate& choice = best;
  if (forced == Algorithm::all_pairs ||
      (forced == Algorithm::automatic &&
       static_cast<double>(s.target_count) <= base::cost.brute_force_boxes)) {
    choice = brute_force(s, sweep_cost);
    best.reason = forced == Algorithm::all_pairs ? "brute force was requested"
                                                 : "few boxes: brute force is fastest";
    return best;
  }
  choice.expected_ns = std::numeric_limits<double>::max();
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const Candidate grid = cheapest_grid(s, sweep_cost, axis);
    if (grid.expected_ns < choice.expected_ns) choice = grid;
  }
  if (cell_scale != 1) choice = scaled(choice, s, sweep_cost, double{cell_scale});
  best.clustered = s.clustered;
  best.map = make_map(s, best.columns);
  best.reason = forced == Algorithm::grid ? "the grid was requested"
                : best.map.column_count() == 1
                    ? "few or wide boxes: one column, swept along its longest axis"
                    : "columns wide enough that few boxes span two, narrow enough that sweep "
                      "windows are short";
  return best;
}

}  // namespace throng::grid
