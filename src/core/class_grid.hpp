// Cells for boxes of several sizes, each box stored once, and why no pair is lost or told twice.
//
// One function q per axis maps a float to the index of a cell, 0 .. N-1:
//   q(x) = int(min(max((p(x * unit) - origin) * scale, 0), N - 1)),   unit > 0, scale > 0.
// p is the identity, or where boxes lie so unevenly that no one length of cells suits them, the
// place among knots (place_among). Each step is non-decreasing in x for every float but NaN
// (core/quantise.hpp), so q is. A size
// class c has larger cells: on axis k, 2^shift of these; its index is q >> shift, non-decreasing
// too. Call it c(x). A box belongs to the first class in whose grid it spans at most two cells on
// every axis,
//   c(upper) <= c(lower) + 1;
// the last class has one cell, so every box, infinite ones too, belongs to some. The box is stored
// in one cell of its class: that of its lower corner, its home.
//
// Let box a look for the boxes of class c, whatever the class of a, and let b of class c overlap a.
// On every axis a.lower <= b.upper and b.lower <= a.upper, therefore
//   c(a.lower) <= c(b.upper) <= c(b.lower) + 1   and   c(b.lower) <= c(a.upper):
// the home of b lies in c(a.lower) - 1 .. c(a.upper). That is where a looks, so nothing is lost.
// Nothing is widened and no rounding is estimated: all of it is monotony and integers. Which map,
// cells and classes are used is a matter of speed alone.
//
// Each pair is told once: of two boxes in different classes that of the earlier class looks for the
// other; in one class, that whose home comes first, in the order z, y, x, and of one home that
// which is stored first. A box looks into each cell once, and a cell holds a box once.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "core/hd.hpp"
#include "core/quantise.hpp"

namespace throng::core {

constexpr std::uint32_t max_size_classes = 12;
constexpr std::uint32_t max_class_cells = 1u << 22;  // along an axis: exact as a float

// Spans between the knots of an axis: a power of two.
constexpr std::uint32_t knot_spans = 32;

struct SizeClass {
  std::uint32_t shift[3] = {0, 0, 0};
  std::uint32_t cells[3] = {1, 1, 1};
  std::uint32_t offset = 0;  // of its first cell among those of all classes
};

// What a box's flags say of whom it may meet. Boxes of different groups are stored apart.
constexpr std::uint32_t static_bit = 1, everywhere_bit = 2, second_bit = 4;

// What makes equal steps of spans that hold about as many boxes each.
struct Knots {
  float at[knot_spans + 1];  // nowhere decreasing
  float scale[knot_spans];   // one over the span's length, or 0 where it has none; finite
};

// Where x stands: 0 .. knot_spans. Of two floats the greater one is in the same span, and no less
// far in it, as the steps below nowhere decrease; or in a later one, whose places are no less than
// those of the earlier one. What is not a number is 0: of x = at[i], or of all of a span of no
// length.
THRONG_HD inline float place_among(const Knots& knots, float x) noexcept {
  std::uint32_t span = 0;
  for (std::uint32_t half = knot_spans / 2; half > 0; half /= 2)
    span += x >= knots.at[span + half] ? half : 0;
  float part = (x - knots.at[span]) * knots.scale[span];
  part = part > 0.0f ? part : 0.0f;
  part = part < 1.0f ? part : 1.0f;
  return static_cast<float>(span) + part;
}

// The grids of all classes, laid out in one table of counts. `present`: which group bits occur. A
// world's cells stand together, one part a group; worlds that share a slot are told apart when a
// pair is found. Where all cells do not fit, rows are scattered over the table by a hash, and boxes
// whose home is elsewhere are told apart in the same way.
struct ClassGrid {
  float origin[3] = {0, 0, 0};
  float scale[3] = {1, 1, 1};
  float last[3] = {0, 0, 0};      // index of the last cell, as a float
  float unit = 1;                 // coordinates are multiplied by it first
  std::uint32_t among_knots = 0;  // as a word: no byte of the grid is left unwritten
  Knots knots[3] = {};
  std::uint32_t class_count = 1;  // the last one has one cell
  std::uint32_t present = 0;
  std::uint32_t world_cells = 1;  // of all classes of one group
  std::uint32_t world_slots = 1;
  std::uint32_t table_cells = 1;
  std::uint32_t hashed = 0;
  SizeClass classes[max_size_classes];

  THRONG_HD bool shares_cells(bool has_worlds) const noexcept { return hashed || has_worlds; }
};

// Finest cells of a box's two corners.
struct CellSpan {
  std::int32_t lower[3], upper[3];
};

// Along an axis, as it is before it is cut into cells.
THRONG_HD inline float place_of(const ClassGrid& grid, int axis, float x) noexcept {
  const float at = x * grid.unit;
  return grid.among_knots ? place_among(grid.knots[axis], at) : at;
}
THRONG_HD inline std::int32_t cell_of(const ClassGrid& grid, int axis, float x) noexcept {
  return index_of(place_of(grid, axis, x), grid.origin[axis], grid.scale[axis], grid.last[axis]);
}
// How many cells are before x, with a fraction; and about where there are so many.
THRONG_HD inline float cells_before(const ClassGrid& grid, int axis, float x) noexcept {
  const float t = (place_of(grid, axis, x) - grid.origin[axis]) * grid.scale[axis];
  return t > 0 ? (t < grid.last[axis] + 1 ? t : grid.last[axis] + 1) : 0;
}
THRONG_HD inline double where_before(const ClassGrid& grid, int axis, float cells) noexcept {
  const double at = double{grid.origin[axis]} + double{cells} / grid.scale[axis];
  if (!grid.among_knots) return at / grid.unit;
  const Knots& knots = grid.knots[axis];
  auto span = static_cast<std::uint32_t>(at > 0 ? at : 0);
  if (span >= knot_spans) span = knot_spans - 1;
  const double low = knots.at[span], high = knots.at[span + 1];
  return (low + (high - low) * (at - span)) / grid.unit;
}

THRONG_HD inline CellSpan cells_of(const ClassGrid& grid, const Box& b) noexcept {
  return {{cell_of(grid, 0, b.lower.x), cell_of(grid, 1, b.lower.y), cell_of(grid, 2, b.lower.z)},
          {cell_of(grid, 0, b.upper.x), cell_of(grid, 1, b.upper.y), cell_of(grid, 2, b.upper.z)}};
}

THRONG_HD inline bool fits(const SizeClass& c, const CellSpan& s) noexcept {
  return ((s.upper[0] >> c.shift[0]) - (s.lower[0] >> c.shift[0]) <= 1) &
         ((s.upper[1] >> c.shift[1]) - (s.lower[1] >> c.shift[1]) <= 1) &
         ((s.upper[2] >> c.shift[2]) - (s.lower[2] >> c.shift[2]) <= 1);
}

THRONG_HD inline std::uint32_t class_of(const ClassGrid& grid, const CellSpan& s) noexcept {
  std::uint32_t c = 0;
  while (c + 1 < grid.class_count && !fits(grid.classes[c], s)) ++c;
  return c;
}

// ---- groups -------------------------------------------------------------------------------------

// The number of a group among those that occur, and back.
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

enum class Look : std::uint8_t { no, forward, all };

// Whether a box of group `from` and class `own` looks for boxes of group `to` and class `other`. Of
// any two boxes that may meet, one looks for the other by `all`, or either by `forward`: an
// everywhere box is found by those of all worlds, whose cells it could not know; else the class
// decides, and of one class the group.
THRONG_HD constexpr Look look(std::uint32_t present, std::uint32_t from, std::uint32_t own,
                              std::uint32_t to, std::uint32_t other) noexcept {
  if (from & to & static_bit) return Look::no;
  if ((present & second_bit) && !((from ^ to) & second_bit)) return Look::no;
  if ((from ^ to) & everywhere_bit) return from & everywhere_bit ? Look::no : Look::all;
  if (own != other) return own < other ? Look::all : Look::no;
  if (from == to) return Look::forward;
  return from < to ? Look::all : Look::no;
}

// ---- the table ----------------------------------------------------------------------------------

THRONG_HD constexpr std::uint32_t mix(std::uint32_t h) noexcept {
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

// The cells of one class, group and world. `world` is 0 for everywhere boxes; `group` is packed.
struct Part {
  std::uint32_t base;  // dense: where they begin in the table; hashed: a seed
  std::uint32_t cells_x, cells_y;
};

THRONG_HD inline Part part_of(const ClassGrid& grid, std::uint32_t world, std::uint32_t group,
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

// Where a row of cells along x begins. Dense: below table_cells together with every x of the row.
// Hashed: below table_cells; the table has room for one more row beyond.
THRONG_HD inline std::uint32_t row_start(const ClassGrid& grid, const Part& part, std::int32_t y,
                                         std::int32_t z) noexcept {
  if (!grid.hashed) return dense_row_start(part, y, z);
  const auto row = static_cast<std::uint32_t>(y), slab = static_cast<std::uint32_t>(z);
  const std::uint32_t h = mix(mix(mix(slab * 0x9e3779b9u + 0x85ebca6bu) ^ row) ^ part.base);
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(h) * grid.table_cells) >> 32);
}

}  // namespace throng::core
