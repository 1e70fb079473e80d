// A hierarchical grid for boxes of several sizes. Each box is stored once. This comment proves that
// no pair is lost or reported twice.
//
// One function q per axis maps a float to the index of a cell, 0 .. N-1:
//   q(x) = int(min(max((p(x * unit) - origin) * scale, 0), N - 1)),   unit > 0, scale > 0.
// p is the identity or, if the boxes are distributed too unevenly for cells of one length, a
// piecewise linear map through knots (knot_position). Each step is non-decreasing in x for every
// float but NaN (base/quantize.hpp), so q is non-decreasing. A size class c has larger cells: on
// axis k, 2^shift of the finest; its index is q >> shift, also non-decreasing. Call it c(x). A box
// belongs to the first class in whose grid it spans at most two cells on every axis,
//   c(upper) <= c(lower) + 1;
// the last class has one cell, so every box, infinite ones included, belongs to a class. The box is
// stored in one cell of its class, that of its lower corner: its storage cell.
//
// Let box a, of any class, search the boxes of class c, and let b of class c overlap a. On every
// axis a.lower <= b.upper and b.lower <= a.upper, therefore
//   c(a.lower) <= c(b.upper) <= c(b.lower) + 1   and   c(b.lower) <= c(a.upper):
// the storage cell of b lies in c(a.lower) - 1 .. c(a.upper). a searches exactly these cells, so no
// pair is lost. Nothing is widened and no rounding is estimated: the proof uses only monotonicity
// and integers. The choice of map, cells and classes affects speed alone.
//
// Each pair is reported once. Of two boxes in different classes, the box of the earlier class
// searches for the other. Within one class, the box whose storage cell comes first in the order z,
// y, x searches; within one cell, the box stored first. A box visits each cell once, and a cell
// holds a box once.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "base/quantize.hpp"

namespace throng::base {

constexpr std::uint32_t max_size_classes = 12;
constexpr std::uint32_t max_class_cells = 1u << 22;  // per axis; exact as a float

// Spans between the knots of an axis. A power of two.
constexpr std::uint32_t knot_spans = 32;

struct SizeClass {
  std::uint32_t shift[3] = {0, 0, 0};
  std::uint32_t cells[3] = {1, 1, 1};
  std::uint32_t offset = 0;  // index of its first cell in the table of all classes
};

// A box's group: the flags that decide which boxes it may pair with. Boxes of different groups are
// stored separately.
constexpr std::uint32_t static_bit = 1, everywhere_bit = 2, second_bit = 4;

// A piecewise linear map with spans that hold about as many boxes each.
struct Knots {
  float at[knot_spans + 1];  // non-decreasing
  float scale[knot_spans];   // 1 / the span's length, or 0 for an empty span; finite
};

// The mapped position of x, 0 .. knot_spans. Non-decreasing: of two floats the greater lies either
// in the same span, where no step below decreases, or in a later span, whose positions are no less
// than those of an earlier one. A NaN `part` becomes 0: it occurs only for x = at[i] or in an empty
// span.
THRONG_HD inline float knot_position(const Knots& knots, float x) noexcept {
  std::uint32_t span = 0;
  for (std::uint32_t half = knot_spans / 2; half > 0; half /= 2)
    span += x >= knots.at[span + half] ? half : 0;
  float part = (x - knots.at[span]) * knots.scale[span];
  part = part > 0.0f ? part : 0.0f;
  part = part < 1.0f ? part : 1.0f;
  return static_cast<float>(span) + part;
}

// The grids of all classes, laid out in one table of counts. `present`: the group bits that occur.
// A world's (environment's) cells are contiguous, one part per group. Worlds may share a slot of
// the table; their boxes are compared by world when a pair is found. If the cells do not fit, rows
// are hashed into the table, and boxes of other cells are rejected in the same way.
struct SizeClassGrid {
  float origin[3] = {0, 0, 0};
  float scale[3] = {1, 1, 1};
  float last[3] = {0, 0, 0};     // index of the last cell, as a float
  float unit = 1;                // applied to coordinates first
  std::uint32_t uses_knots = 0;  // 32 bits wide: the struct has no padding bytes
  Knots knots[3] = {};
  std::uint32_t class_count = 1;  // the last one has one cell
  std::uint32_t present = 0;
  std::uint32_t world_cells = 1;  // all classes of one group
  std::uint32_t world_slots = 1;
  std::uint32_t table_cells = 1;
  std::uint32_t hashed = 0;
  SizeClass classes[max_size_classes];

  THRONG_HD bool shares_cells(bool has_worlds) const noexcept { return hashed || has_worlds; }
};

// The finest-class cells of a box's two corners.
struct CellSpan {
  std::int32_t lower[3], upper[3];
};

// The position along an axis before it is divided into cells.
THRONG_HD inline float axis_position(const SizeClassGrid& grid, int axis, float x) noexcept {
  const float at = x * grid.unit;
  return grid.uses_knots ? knot_position(grid.knots[axis], at) : at;
}
THRONG_HD inline std::int32_t cell_of(const SizeClassGrid& grid, int axis, float x) noexcept {
  return index_of(axis_position(grid, axis, x), grid.origin[axis], grid.scale[axis],
                  grid.last[axis]);
}
// The number of cells before x, with a fraction; and its approximate inverse.
THRONG_HD inline float cells_before(const SizeClassGrid& grid, int axis, float x) noexcept {
  const float t = (axis_position(grid, axis, x) - grid.origin[axis]) * grid.scale[axis];
  return t > 0 ? (t < grid.last[axis] + 1 ? t : grid.last[axis] + 1) : 0;
}
THRONG_HD inline double coordinate_before(const SizeClassGrid& grid, int axis,
                                          float cells) noexcept {
  const double at = double{grid.origin[axis]} + double{cells} / grid.scale[axis];
  if (!grid.uses_knots) return at / grid.unit;
  const Knots& knots = grid.knots[axis];
  auto span = static_cast<std::uint32_t>(at > 0 ? at : 0);
  if (span >= knot_spans) span = knot_spans - 1;
  const double low = knots.at[span], high = knots.at[span + 1];
  return (low + (high - low) * (at - span)) / grid.unit;
}

THRONG_HD inline CellSpan cells_of(const SizeClassGrid& grid, const Box& b) noexcept {
  return {{cell_of(grid, 0, b.lower.x), cell_of(grid, 1, b.lower.y), cell_of(grid, 2, b.lower.z)},
          {cell_of(grid, 0, b.upper.x), cell_of(grid, 1, b.upper.y), cell_of(grid, 2, b.upper.z)}};
}

THRONG_HD inline bool fits(const SizeClass& c, const CellSpan& s) noexcept {
  return ((s.upper[0] >> c.shift[0]) - (s.lower[0] >> c.shift[0]) <= 1) &
         ((s.upper[1] >> c.shift[1]) - (s.lower[1] >> c.shift[1]) <= 1) &
         ((s.upper[2] >> c.shift[2]) - (s.lower[2] >> c.shift[2]) <= 1);
}

THRONG_HD inline std::uint32_t class_of(const SizeClassGrid& grid, const CellSpan& s) noexcept {
  std::uint32_t c = 0;
  while (c + 1 < grid.class_count && !fits(grid.classes[c], s)) ++c;
  return c;
}

// ---- groups -------------------------------------------------------------------------------------

// The index of a group among those that occur, and the inverse.
THRONG_HD constexpr std::uint32_t pack_group(std::uint32_t present, std::uint32_t bits) noexcept {
  std::uint32_t index = 0, place = 0;
  for (std::uint32_t bit = 1; bit <= second_bit; bit *= 2)
    if (present & bit) index |= ((bits & bit) != 0 ? 1u : 0u) << place++;
  return index;
}
THRONG_HD constexpr std::uint32_t unpack_group(std::uint32_t present,
                                               std::uint32_t index) noexcept {
  std::uint32_t bits = 0;
  for (std::uint32_t bit = 1; bit <= second_bit; bit *= 2) {
    if (!(present & bit)) continue;
    if (index & 1) bits |= bit;
    index >>= 1;
  }
  return bits;
}
THRONG_HD constexpr std::uint32_t group_count(std::uint32_t present) noexcept {
  return 1u << ((present & 1) + (present >> 1 & 1) + (present >> 2 & 1));
}

enum class SearchMode : std::uint8_t { no, forward, all };

// How a box of group `from` and class `own` searches boxes of group `to` and class `other`. Of two
// boxes that may pair, one searches for the other by `all`, or either by `forward`. A box in every
// world is found by the boxes of each world, because it cannot enumerate their cells. Otherwise the
// class decides, and within one class the group.
THRONG_HD constexpr SearchMode search_mode(std::uint32_t present, std::uint32_t from,
                                           std::uint32_t own, std::uint32_t to,
                                           std::uint32_t other) noexcept {
  if (from & to & static_bit) return SearchMode::no;
  if ((present & second_bit) && !((from ^ to) & second_bit)) return SearchMode::no;
  if ((from ^ to) & everywhere_bit) return from & everywhere_bit ? SearchMode::no : SearchMode::all;
  if (own != other) return own < other ? SearchMode::all : SearchMode::no;
  if (from == to) return SearchMode::forward;
  return from < to ? SearchMode::all : SearchMode::no;
}

// ---- the table ----------------------------------------------------------------------------------

THRONG_HD constexpr std::uint32_t mix(std::uint32_t h) noexcept {
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

// The cells of one class, group and world. `world` is 0 for boxes in every world; `group` is
// packed.
struct Part {
  std::uint32_t base;  // dense: first cell in the table; hashed: a seed
  std::uint32_t cells_x, cells_y;
};

THRONG_HD inline Part part_of(const SizeClassGrid& grid, std::uint32_t world, std::uint32_t group,
                              std::uint32_t size_class) noexcept {
  const SizeClass& c = grid.classes[size_class];
  if (grid.hashed) return {world * 0xc2b2ae35u + group * 256 + size_class, 0, 0};
  const std::uint32_t slot = world == 0 ? 0 : world % grid.world_slots;
  return {(slot * group_count(grid.present) + group) * grid.world_cells + c.offset, c.cells[0],
          c.cells[1]};
}

THRONG_HD inline std::uint32_t dense_row_start(const Part& part, std::int32_t y,
                                               std::int32_t z) noexcept {
  const auto row = static_cast<std::uint32_t>(y), slab = static_cast<std::uint32_t>(z);
  return part.base + (slab * part.cells_y + row) * part.cells_x;
}

// First cell of a row along x. Dense: the row ends below table_cells. Hashed: the first cell is
// below table_cells; the table is one row longer.
THRONG_HD inline std::uint32_t row_start(const SizeClassGrid& grid, const Part& part,
                                         std::int32_t y, std::int32_t z) noexcept {
  if (!grid.hashed) return dense_row_start(part, y, z);
  const auto row = static_cast<std::uint32_t>(y), slab = static_cast<std::uint32_t>(z);
  const std::uint32_t h = mix(mix(mix(slab * 0x9e3779b9u + 0x85ebca6bu) ^ row) ^ part.base);
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(h) * grid.table_cells) >> 32);
}

}  // namespace throng::base
