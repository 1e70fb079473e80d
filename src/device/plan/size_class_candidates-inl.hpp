// The candidates of the size class planner, and the chosen grid. Included only by
// device/plan/size_class_planner.hpp.
#pragma once

#include "device/plan/size_class_planner.hpp"

namespace throng::device {

// Whether this thread works: on all candidates or, at the requested scale, on the chosen one.
THRONG_HD inline bool SizeClassPlanner::handles_candidate(std::uint32_t t, bool chosen,
                                                          const Shared& s) noexcept {
  return t < rows * candidates && (!chosen || t % candidates == s.best);
}

// Candidate cell sizes: quantiles of the box extents, and sizes that give cells some boxes each.
THRONG_HD inline float SizeClassPlanner::side_of(std::uint32_t candidate, std::uint32_t axis,
                                                 float scale, const Shared& s) noexcept {
  const std::uint32_t n = s.count, scheme = candidate / sizes, size = candidate % sizes;
  const float low = s.extent[longest][n / 10], middle = s.extent[longest][n / 2],
              high = s.extent[longest][n - 1 - n / 10];
  const float thin = lesser(s.extent[0][n / 2], lesser(s.extent[1][n / 2], s.extent[2][n / 2]));
  // low, middle, high, thin, 2 low, 4 low, 2 thin, 2 middle, and multiples of the unit. For rods,
  // just over half of high replaces 2 thin: doubling such cells once fits long boxes.
  const bool half = size == 6 && scheme == 1;
  const float of = size >= 8                             ? s.unit
                   : size == 0 || size == 4 || size == 5 ? low
                   : size == 1 || size == 7              ? middle
                   : size == 2 || half                   ? high
                                                         : thin;
  const float times = size < 4 || size == 8     ? 1.0f
                      : half                    ? 0.52f
                      : size == 5 || size == 14 ? 4.0f
                      : size < 8 || size == 11  ? 2.0f
                      : size == 9               ? 1.26f
                      : size == 10              ? 1.59f
                      : size == 12              ? 2.52f
                      : size == 13              ? 3.17f
                                                : 8.0f;
  const float base = greater(times * of * 1.0001f * scale, shortest);
  if (scheme != 2) return base;
  // Proportions of the typical box.
  const float typical = greater(middle, shortest);
  return greater(base * quotient(greater(s.extent[axis][n / 2], typical * 0.01f), typical),
                 shortest);
}

// The finest cells, one thread row per axis; the last row counts the classes with doubled cells.
THRONG_HD inline void SizeClassPlanner::measure(std::uint32_t t, bool chosen, Shared& s,
                                                const GridLimits& limits) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (t == 0) s.some_cut = false;
  if (row > 3 || !handles_candidate(t, chosen, s)) return;
  const float side = side_of(candidate, row % 3, chosen ? limits.cell_scale : 1, s);
  if (row < 3) {
    float count = s.unbounded[row] ? 1 : quotient(s.length[row], greater(side, shortest));
    // Layers of rods that would all fit in one such cell are divided by a few thin cells: for two
    // layers 27 comparisons per box instead of 159.
    const float thick = s.extent[row][s.count - 1 - s.count / 10];
    if (candidate / sizes == 1 && count < 2 && 4 * thick < s.length[row])
      count = lesser(8, quotient(s.length[row], 2 * greater(thick, shortest)));
    const float bound = static_cast<float>(base::max_class_cells);
    count = count < 1 ? 1 : count > bound ? bound : count;
    s.cells[row][candidate] = static_cast<std::uint32_t>(count);
    return;
  }
  const bool rods = candidate / sizes == 1;
  std::uint32_t doublings = rods ? 1 : 0;
  const std::uint32_t n = s.count;
  const float reach = s.extent[longest][rods ? n - 1 - n / 10 : n - 1];
  THRONG_UNROLL(1)
  while (doublings < 20 && side * times(doublings) < reach) ++doublings;
  s.doublings[candidate] = doublings;
  s.used[candidate] = 0;
}

// The cells of a class along an axis.
THRONG_HD inline std::uint32_t SizeClassPlanner::cells_of(std::uint32_t finest,
                                                          std::uint32_t shift) noexcept {
  return ((finest - 1) >> shift) + 1;
}

// One or two of three axes: x, y, z, yz, zx, xy.
THRONG_HD constexpr std::uint32_t some_axes(std::uint32_t number) noexcept {
  return number < 3 ? 1u << number : 7u ^ (1u << (number - 3));
}

THRONG_HD inline void SizeClassPlanner::divide(std::uint32_t t, bool chosen, bool retry,
                                               Shared& s) noexcept {
  const std::uint32_t candidate = t % candidates;
  if (!handles_candidate(t, chosen, s) || (retry && !s.cut[candidate])) return;
  const std::uint32_t row = t / candidates;
  THRONG_UNROLL(1)
  for (std::uint32_t c = row; c < base::max_size_classes; c += rows) divide_class(candidate, c, s);
  // Thread rows with only one class.
  if (!retry && row >= rows - 3) measure_side(candidate, row - (rows - 3), s);
}

// Isotropic: each class doubles the cells, and beyond the sample's largest boxes, where few boxes
// are expected, multiplies them by eight. For rods: a class for each axis, or two, along which
// boxes are long. Returns whether c is beyond these.
THRONG_HD inline bool SizeClassPlanner::divide_bounded(std::uint32_t candidate, std::uint32_t c,
                                                       const Shared& s,
                                                       std::uint32_t (&shift)[3]) noexcept {
  const std::uint32_t doublings = s.doublings[candidate];
  const std::uint32_t level = c <= doublings ? c : doublings + 3 * (c - doublings);
  shift[0] = shift[1] = shift[2] = level;
  if (candidate / sizes == 1) {
    // No axis, one, two, all; then larger cells.
    const std::uint32_t axes = c == 0 ? 0 : c <= 6 ? some_axes(c - 1) : 7;
    const std::uint32_t more = c > 7 ? 2 * (c - 7) : 0;
    for (std::uint32_t k = 0; k < 3; ++k) shift[k] = axes >> k & 1 ? doublings + more : 0;
  }
  bool single = true, crosses = false;
  for (int k = 0; k < 3; ++k) {
    shift[k] = shift[k] < 22 ? shift[k] : 22;
    const std::uint32_t cells = cells_of(s.cells[k][candidate], shift[k]);
    single = single && cells == 1;
    crosses = crosses || (s.some_unbounded[k] && cells <= 2);
  }
  // Two cells on that axis fit unbounded boxes, which have a finer class.
  return single || (crosses && shift[0] > doublings);
}

// The classes for bounded boxes are followed by one for each axis, or two, along which the sample
// has unbounded boxes: one cell on these axes, cells as large as the sample's largest boxes on the
// others.
THRONG_HD inline void SizeClassPlanner::divide_class(std::uint32_t candidate, std::uint32_t c,
                                                     Shared& s) noexcept {
  std::uint32_t some_unbounded = 0, shift[3];
  for (std::uint32_t k = 0; k < 3; ++k) some_unbounded |= s.some_unbounded[k] ? 1u << k : 0;
  bool single = false;
  if (some_unbounded == 0) {
    single = divide_bounded(candidate, c, s, shift);
  } else {
    const std::uint32_t axes_count = bits_of(some_unbounded);
    const std::uint32_t more = axes_count * (axes_count + 1) / 2;  // 1, 3, 6
    std::uint32_t bounded = 0;
    THRONG_UNROLL(1)
    while (bounded <= c && bounded + more + 1 < base::max_size_classes &&
           !divide_bounded(candidate, bounded, s, shift))
      ++bounded;
    if (c >= bounded) {
      std::uint32_t left = c - bounded, axes = 0;
      THRONG_UNROLL(1)
      for (std::uint32_t number = 0; number < 6; ++number)
        if ((some_axes(number) & ~some_unbounded) == 0 && left-- == 0) axes = some_axes(number);
      single = axes == 0;
      for (std::uint32_t k = 0; k < 3; ++k) shift[k] = axes >> k & 1 ? 22 : s.doublings[candidate];
    }
  }
  std::uint32_t cells[3];
  for (int k = 0; k < 3; ++k) cells[k] = cells_of(s.cells[k][candidate], shift[k]);
  // The last class has one cell, no class before it does.
  single = single || c + 1 == base::max_size_classes || (cells[0] | cells[1] | cells[2]) == 1;
  s.shift[c][candidate] = single ? one_cell : shift[0] | shift[1] << 8 | shift[2] << 16;
  // A layer may have 2^44 cells, all layers 2^66: sizes beyond any table are clamped first.
  const std::uint64_t layer = std::uint64_t{cells[0]} * cells[1];
  const std::uint64_t all = layer < too_many ? layer * cells[2] : too_many;
  s.late.before[c][candidate] = single ? 1 : all;
}

// Offsets, and whether the table holds all cells.
THRONG_HD inline void SizeClassPlanner::finish(std::uint32_t t, bool chosen, bool retry, Shared& s,
                                               const GridLimits& limits) noexcept {
  const std::uint32_t candidate = t;
  if (t >= candidates || !handles_candidate(t, chosen, s) || (retry && !s.cut[candidate])) return;
  std::uint64_t sum = 0;
  std::uint32_t c = 0;
  THRONG_UNROLL(1)
  for (bool last = false; !last; ++c) {
    last = s.shift[c][candidate] == one_cell;
    const std::uint64_t cells = s.late.before[c][candidate];
    s.late.before[c][candidate] = sum;
    sum = sum + cells < too_many ? sum + cells : too_many;
  }
  s.class_count[candidate] = c;
  const bool hashed = too_large(sum * base::group_count(limits.present), s.worlds, limits);
  s.hashed[candidate] = hashed;
  if (retry) return;
  // y and z too: these indices must fit a row's hash and offsets.
  bool too_long = false;
  for (int k = 0; k < 3; ++k) too_long = too_long || s.cells[k][candidate] > limits.row_cells;
  s.cut[candidate] = hashed && too_long;
  if (!s.cut[candidate]) return;
  s.some_cut = true;
  THRONG_UNROLL(1)
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t cells = s.cells[k][candidate];
    s.cells[k][candidate] = cells < limits.row_cells ? cells : limits.row_cells;
    measure_side(candidate, k, s);
  }
}

THRONG_HD inline void SizeClassPlanner::measure_side(std::uint32_t candidate, std::uint32_t axis,
                                                     Shared& s) noexcept {
  s.side[axis][candidate] = quotient(s.length[axis], static_cast<float>(s.cells[axis][candidate]));
}

// Several worlds share the table; at least half of them must fit separately.
THRONG_HD inline bool SizeClassPlanner::too_large(std::uint64_t all, float worlds,
                                                  const GridLimits& limits) noexcept {
  const float slots = quotient(static_cast<float>(limits.table_cells), static_cast<float>(all));
  return all > limits.table_cells || 2 * slots < worlds;
}

// Without a sample: one cell.
THRONG_HD inline void SizeClassPlanner::write(std::uint32_t t, const Shared& s,
                                              const GridLimits& limits,
                                              base::SizeClassGrid& grid) noexcept {
  const std::uint32_t best = s.best;
  const bool none = s.count == 0;
  const std::uint32_t classes = none ? 1 : s.class_count[best];
  if (t < 3) {
    const std::uint32_t cells = none ? 1 : s.cells[t][best];
    grid.origin[t] = none ? 0 : s.low[t];
    grid.scale[t] = none ? 1 : lesser(quotient(static_cast<float>(cells), s.length[t]), 0x1p126f);
    grid.last[t] = static_cast<float>(cells - 1);
  }
  constexpr std::uint32_t ends = base::knot_spans + 1;
  if (t >= 128 && t < 128 + 3 * ends) {
    const std::uint32_t axis = (t - 128) / ends, k = (t - 128) % ends;
    const bool among = !none && s.uses_knots;
    grid.knots[axis].at[k] = among ? s.knots[axis].at[k] : 0;
    if (k < base::knot_spans) grid.knots[axis].scale[k] = among ? s.knots[axis].scale[k] : 0;
  }
  // Unused classes too: the grid is copied as a whole.
  if (t >= 32 && t < 32 + base::max_size_classes) {
    const std::uint32_t c = t - 32;
    const bool empty = none || c >= classes;
    const std::uint32_t shifts = empty ? 0 : s.shift[c][best];
    base::SizeClass& to = grid.classes[c];
    for (int k = 0; k < 3; ++k) {
      to.shift[k] = shifts >> 8 * k & 0xff;
      to.cells[k] = shifts == one_cell || empty ? 1 : cells_of(s.cells[k][best], to.shift[k]);
    }
    to.offset = empty ? 0 : static_cast<std::uint32_t>(s.late.before[c][best]);
  }
  if (t != 64) return;
  grid.unit = given_unit;
  grid.uses_knots = !none && s.uses_knots;
  grid.class_count = classes;
  grid.present = limits.present;
  grid.table_cells = limits.table_cells;
  const std::uint32_t groups = base::group_count(limits.present);
  grid.hashed = none ? too_large(groups, 1, limits) : s.hashed[best];
  // A table that is not hashed holds all cells, so 32 bits are enough; the last class has one.
  const std::uint32_t cells =
      none ? 1 : static_cast<std::uint32_t>(s.late.before[classes - 1][best]) + 1;
  grid.world_cells = grid.hashed ? 1 : cells;
  grid.world_slots = grid.hashed ? 1 : limits.table_cells / (cells * groups);
}

}  // namespace throng::device
