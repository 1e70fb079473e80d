#include "grid/plan/planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::grid {
namespace {

constexpr float largest = std::numeric_limits<float>::max();

constexpr std::uint32_t column_counts[] = {1,   2,   3,   4,   5,   6,    7,    8,    10,   12,
                                           14,  16,  20,  24,  28,  32,   40,   48,   56,   64,
                                           80,  96,  112, 128, 160, 192,  224,  256,  320,  384,
                                           448, 512, 640, 768, 896, 1024, 1536, 2048, 3072, 4096};

// Column indices are 32-bit: a plan has at most 2^17 columns, sections times parts, which price()
// and the loops over sections ensure. A position along an axis, columns * 32768 - 1 at most, fits
// 31 bits.
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

GridPlan plan(const Stats& s, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept {
  GridPlan best;
  const double n = static_cast<double>(s.target_count);
  const double work = static_cast<double>(s.query_count);
  if (forced == Algorithm::all_pairs ||
      (forced == Algorithm::automatic && s.target_count <= all_pairs_limit)) {
    best.all_pairs = true;
    best.expected_ns = 0.5 * n * work * brute_force_ns;
    best.reason = forced == Algorithm::all_pairs ? "brute force was requested"
                                                 : "few boxes: brute force is fastest";
    return best;
  }
  // Along an axis of zero range all boxes overlap: it is neither swept nor divided.
  double length[3], extents[3], layers[3];
  for (int k = 0; k < 3; ++k) {
    const double range = double{s.upper[k]} - double{s.lower[k]};
    length[k] = std::max(range, least_length);
    extents[k] = range > 0 ? s.extent[k] : length[k];
    layers[k] = 1 / std::max(s.layer_overlap[k], 1e-9);
  }
  const double max_columns = std::clamp(n / 48, 1.0, double{1u << 17});
  // The costs of sweeping along x that do not depend on the number of columns. `window`: the
  // fraction of a column's boxes that begin within one of them.
  struct AxisCosts {
    std::uint32_t x;
    double share_x, share_y, share_z, share_yz, window, step_parts, most_parts;
  };
  const auto sweep_along = [&](std::uint32_t x) {
    const std::uint32_t y = (x + 1) % 3, z = (x + 2) % 3;
    AxisCosts sweep;
    sweep.x = x;
    sweep.share_x = std::min(1.0, extents[x] / length[x]);
    sweep.share_y = extents[y] / length[y];
    sweep.share_z = extents[z] / length[z];
    sweep.share_yz = s.product[x] / (length[y] * length[z]);
    sweep.window = std::min(1.0, sweep.share_x + s.layer_overlap[x]);
    if (s.clustered) {
      const double slabs = std::clamp(1 / std::max(sweep.share_x, 1e-9), 1.0, 1e9);
      const double effective_slabs = s.effective_slabs_at(x, static_cast<std::uint32_t>(slabs));
      sweep.window = std::min(1.0, s.joint_correlation / (s.axis_correlation[x] * effective_slabs));
    }
    // Long columns are divided if their boxes are short enough: to stay in the cache, and to make
    // an extent some quantization steps long, as each tie reads the floats.
    sweep.step_parts =
        std::ceil(extent_steps / (base::steps_per_column * std::max(sweep.share_x, 1e-9)));
    sweep.most_parts = std::min(4096.0, std::floor(0.125 / std::max(sweep.share_x, 1e-9)) + 1);
    return sweep;
  };
  // A box crosses a fraction of the cy - 1 boundaries: its extent's fraction of the range.
  const auto replicas_of = [](const AxisCosts& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double y = cy - 1, z = cz - 1;
    return 1 + sweep.share_y * y + sweep.share_z * z + sweep.share_yz * y * z;
  };
  // A lower bound of the cost of every plan with at least this many columns.
  const double least_record_ns = record_ns + sweep_cost(0);
  const auto least = [&](const AxisCosts& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double replicas = replicas_of(sweep, cy, cz);
    return work * (box_ns - replica_ns + replicas * (replica_ns + least_record_ns)) +
           empty_ns * cy * cz;
  };
  // Of the columns across x, the number that hold boxes, derived from the probability that two
  // boxes share one. Without clustering, at most the number of layers per axis; boxes slightly
  // clustered, but in all columns, have correspondingly more neighbours.
  const auto occupied_columns = [&](const AxisCosts& sweep, std::uint32_t cy, std::uint32_t cz) {
    if (!s.clustered) {
      const double y = std::min(layers[(sweep.x + 1) % 3], static_cast<double>(cy));
      const double z = std::min(layers[(sweep.x + 2) % 3], static_cast<double>(cz));
      return y * z / s.density_ratio;
    }
    const double y = s.effective_slabs_at((sweep.x + 1) % 3, cy);
    const double z = s.effective_slabs_at((sweep.x + 2) % 3, cz);
    return std::max({y, z, y * z / s.axis_correlation[sweep.x]});
  };
  struct Price {
    double parts, replicas, cost;
  };
  const auto price = [&](const AxisCosts& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double sections = static_cast<double>(cy) * cz;
    const double replicas = replicas_of(sweep, cy, cz);
    const double full = occupied_columns(sweep, cy, cz);
    const double per_column = n * replicas / full;
    double parts = sweep.step_parts;
    if (per_column > cached_records) parts = std::max(parts, std::ceil(per_column / part_records));
    if (parts > 1) {
      parts = std::min({parts, sweep.most_parts, std::floor(max_columns / sections)});
      parts = std::max(1.0, parts);
    }
    const double cut = 1 + sweep.share_x * (parts - 1);
    const double record = record_ns + (per_column / parts > cached_records ? uncached_ns : 0) +
                          sweep_cost(per_column * sweep.window);
    const double cost =
        work * (box_ns + replica_ns * (replicas * cut - 1) + replicas * cut * record) +
        (empty_ns * sections + (column_ns - empty_ns) * full) * parts;
    return Price{parts, replicas * cut, cost};
  };
  std::uint32_t best_columns[3] = {1, 1, 1};
  best.expected_ns = std::numeric_limits<double>::max();
  const auto take = [&](std::uint32_t x, std::uint32_t cy, std::uint32_t cz, const Price& p) {
    best.expected_ns = p.cost;
    best.replicas = p.replicas;
    best.sweep_axis = x;
    best_columns[x] = static_cast<std::uint32_t>(p.parts);
    best_columns[(x + 1) % 3] = cy;
    best_columns[(x + 2) % 3] = cz;
  };
  // Whether an axis that is not swept may have `count` columns.
  const auto may_divide = [&](std::uint32_t axis, std::uint32_t count) {
    return count == 1 || extents[axis] < length[axis];
  };
  // Every second number along each axis first, then those around the cheapest.
  constexpr std::uint32_t numbers = sizeof column_counts / sizeof *column_counts;
  std::uint32_t best_y = 0, best_z = 0;
  for (std::uint32_t x = 0; x < 3; ++x) {
    const AxisCosts sweep = sweep_along(x);
    for (std::uint32_t y = 0; y < numbers; y += 2) {
      const std::uint32_t cy = column_counts[y];
      if (cy > max_columns || !may_divide((x + 1) % 3, cy)) break;
      if (least(sweep, cy, 1) >= best.expected_ns) break;
      for (std::uint32_t z = 0; z < numbers; z += 2) {
        const std::uint32_t cz = column_counts[z];
        if (static_cast<double>(cy) * cz > max_columns || !may_divide((x + 2) % 3, cz)) break;
        if (least(sweep, cy, cz) >= best.expected_ns) break;
        const Price p = price(sweep, cy, cz);
        if (p.cost >= best.expected_ns) continue;
        take(x, cy, cz, p);
        best_y = y;
        best_z = z;
      }
    }
  }
  const AxisCosts along_best = sweep_along(best.sweep_axis);
  for (std::uint32_t y = best_y - (best_y != 0); y <= std::min(best_y + 1, numbers - 1); ++y) {
    for (std::uint32_t z = best_z - (best_z != 0); z <= std::min(best_z + 1, numbers - 1); ++z) {
      const std::uint32_t cy = column_counts[y], cz = column_counts[z];
      if (static_cast<double>(cy) * cz > max_columns) continue;
      if (!may_divide((best.sweep_axis + 1) % 3, cy) || !may_divide((best.sweep_axis + 2) % 3, cz))
        continue;
      const Price p = price(along_best, cy, cz);
      if (p.cost < best.expected_ns) take(best.sweep_axis, cy, cz, p);
    }
  }
  if (cell_scale != 1) {
    // Finer cells respect the limits of every plan and the limit of columns per box: the result is
    // the nearest scale to the requested one within them.
    const std::uint32_t x = best.sweep_axis, y = (x + 1) % 3, z = (x + 2) % 3;
    const std::uint32_t planned[2] = {best_columns[y], best_columns[z]};
    const auto scaled = [&](std::uint32_t count, std::uint32_t axis, double scale) {
      if (extents[axis] >= length[axis]) return 1u;
      return static_cast<std::uint32_t>(
          std::clamp(std::round(count / scale), 1.0, double{base::max_columns_per_axis}));
    };
    for (double scale = double{cell_scale};; scale *= 1.125) {
      if (cell_scale < 1 && scale >= 1) break;  // keeps the plan
      const std::uint32_t cy = scaled(planned[0], y, scale), cz = scaled(planned[1], z, scale);
      const Price p = price(sweep_along(x), cy, cz);
      const bool few =
          static_cast<double>(cy) * cz <= max_columns && p.replicas <= most_scaled_replicas;
      if (cell_scale < 1 && !few) continue;
      take(x, cy, cz, p);
      break;
    }
  }
  best.clustered = s.clustered;
  best.map = make_map(s, best_columns);
  best.reason = forced == Algorithm::grid ? "the grid was requested"
                : best.map.column_count() == 1
                    ? "few or wide boxes: one column, swept along its longest axis"
                    : "columns wide enough that few boxes span two, narrow enough that sweep "
                      "windows are short";
  return best;
}

}  // namespace throng::grid
