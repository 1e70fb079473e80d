// A hierarchical grid for boxes of several sizes, as src/base/size_class_grid.hpp has it, in
// integers. Each box is stored once. This comment proves that no pair is lost or reported twice.
// Requires ordered_keys.wgsl, and in the step's file: grid.
//
// One function per axis maps a key to the index of a cell of the finest class; it is
// non-decreasing, as each of its steps is: fixed_point() or position_among_knots(), the clamp, the
// product with a scale that is not negative, the shift, min. Keys have the order of the floats, so
// the function is non-decreasing in them. It has no operation in floats: each step of the search,
// on any device, computes the same cell.
//
// A size class c has larger cells: on axis k, 2^shift of the finest; call its index c(x). A box
// belongs to the first class in whose grid it spans at most two cells on every axis, c(upper) <=
// c(lower) + 1. The last class has one cell, so every box, infinite ones included, belongs to a
// class. It is stored in the cell of its lower corner.
//
// Let box a search the boxes of class c, and let b of class c overlap a. On every axis a.lower <=
// b.upper and b.lower <= a.upper, therefore
//   c(a.lower) <= c(b.upper) <= c(b.lower) + 1   and   c(b.lower) <= c(a.upper):
// the cell of b lies in c(a.lower) - 1 .. c(a.upper). a searches exactly these cells, so no pair is
// lost.
//
// Of two boxes in different classes, the box of the earlier class searches for the other. Within
// one class, the box whose cell comes first in the order z, y, x searches; within one cell, the box
// stored first. A box visits each cell once, and a cell holds a box once: each pair is reported
// once. If rows are hashed, boxes of other rows may be stored among those of a row; a record has
// the mark of its row, and those with another mark are left out.

const max_size_classes = 12u;
const max_knots = 32u;
// Of a hashed grid: the longest row along x, and cells along y and z.
const max_row_cells = 8192u;

struct SizeClass {
  shift: vec4<u32>,
  cells: vec4<u32>,  // and the index of its first cell in the table of all classes
}

// Keys from `begin` on, up to the next knot, have positions of their own.
struct Knot {
  begin: u32,
  shift: u32,  // the distance of two knots, shifted, has bit 31 set
  scale: u32,  // 2^52 / the shifted distance
  unused: u32,
}

struct SizeClassGrid {
  exponent: vec4<i32>,  // of the unit of fixed_point()
  low: vec4<i32>,       // positions are clamped to low .. high
  high: vec4<i32>,
  scale: vec4<u32>,     // 2^32 * cells / positions
  last: vec4<u32>,      // index of the last cell
  class_count: u32,     // the last one has one cell
  table_cells: u32,
  hashed: u32,          // 1: rows are hashed into the table, and other rows may share their cells
  uses_knots: u32,
  classes: array<SizeClass, max_size_classes>,
  knots: array<Knot, 3u * max_knots>,
}

// The float in units of 2^exponent, truncated; beyond 2^31 units 2^31 - 1. exponent >= -149.
// Truncation and the bound are non-decreasing. A shift of at most 7 keeps 24 bits below 2^31, and a
// float that needs a greater one is at least 2^31 units, infinity too.
fn fixed_point(key: u32, exponent: i32) -> i32 {
  let bits = bits_of_key(key);
  let biased = (bits >> 23u) & 255u;
  let mantissa = (bits & 0x7fffffu) | select(0u, 0x800000u, biased > 0u);
  let shift = i32(max(biased, 1u)) - 150 - exponent;
  var magnitude = 0u;
  if shift > 7 {
    magnitude = 0x7fffffffu;
  } else if shift >= 0 {
    magnitude = mantissa << u32(shift);
  } else if shift > -24 {
    magnitude = mantissa >> u32(-shift);
  }
  return select(i32(magnitude), -i32(magnitude), bits >> 31u != 0u);
}

// The high word of the product of two words.
fn multiply_high(a: u32, b: u32) -> u32 {
  let low = (a & 0xffffu) * (b & 0xffffu);
  let middle = (a >> 16u) * (b & 0xffffu) + (low >> 16u);
  let other = (a & 0xffffu) * (b >> 16u) + (middle & 0xffffu);
  return (a >> 16u) * (b >> 16u) + (middle >> 16u) + (other >> 16u);
}

// The number of the span between two knots, and 20 bits for the part of it. Non-decreasing: of two
// keys the greater lies in the same span, where no step decreases, or in a later one, whose
// positions are greater. The first knot is 0. The product is below 2^20 up to rounding, and the
// bound keeps it there.
fn position_among_knots(axis: u32, key: u32) -> u32 {
  let first = axis * max_knots;
  var span = 0u;
  for (var half = max_knots / 2u; half > 0u; half /= 2u) {
    if key >= grid.knots[first + span + half].begin { span += half; }
  }
  let knot = grid.knots[first + span];
  let part = multiply_high((key - knot.begin) << knot.shift, knot.scale);
  return (span << 20u) | min(part, 0xfffffu);
}

fn cell_of(axis: u32, key: u32) -> u32 {
  var position = 0u;
  if grid.uses_knots == 0u {
    let low = grid.low[axis];
    let at = clamp(fixed_point(key, grid.exponent[axis]), low, grid.high[axis]);
    position = bitcast<u32>(at) - bitcast<u32>(low);
  } else {
    position = position_among_knots(axis, key);
  }
  return min(multiply_high(position, grid.scale[axis]), grid.last[axis]);
}

struct CellSpan {
  lower: vec3<u32>,
  upper: vec3<u32>,
}

// The finest-class cells of a box's two corners.
fn cells_of(box: Record) -> CellSpan {
  return CellSpan(
    vec3(cell_of(0u, box.lower.x), cell_of(1u, box.lower.y), cell_of(2u, box.lower.z)),
    vec3(cell_of(0u, box.upper.x), cell_of(1u, box.upper.y), cell_of(2u, box.upper.z)));
}

fn class_of(span: CellSpan) -> u32 {
  var c = 0u;
  while c + 1u < grid.class_count {
    let shift = grid.classes[c].shift.xyz;
    if all((span.upper >> shift) - (span.lower >> shift) <= vec3(1u)) { break; }
    c++;
  }
  return c;
}

fn mix_bits(value: u32) -> u32 {
  var h = value;
  h ^= h >> 16u;
  h *= 0x7feb352du;
  h ^= h >> 15u;
  h *= 0x846ca68bu;
  return h ^ (h >> 16u);
}

// First cell of a row along x. Hashed: it is below table_cells, and the table is one row longer.
fn row_start(size_class: u32, y: u32, z: u32) -> u32 {
  if grid.hashed == 0u {
    let cells = grid.classes[size_class].cells;
    return cells.w + (z * cells.y + y) * cells.x;
  }
  let h = mix_bits(mix_bits(mix_bits(z * 0x9e3779b9u + 0x85ebca6bu) ^ y) ^ size_class);
  return multiply_high(h, grid.table_cells);
}

// Distinguishes the rows of a hashed grid: 4 bits, and 13 bits each.
fn row_mark(size_class: u32, y: u32, z: u32) -> u32 {
  return (size_class << 26u) | ((z & 0x1fffu) << 13u) | (y & 0x1fffu);
}
