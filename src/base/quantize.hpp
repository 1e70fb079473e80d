// Maps float coordinates to columns and 15-bit quantized coordinates. This comment proves that no
// pair is lost.
//
// One function q per axis maps a float to an integer in 0 .. columns * 32768 - 1:
//   q(x) = int(min(max((p(x) - origin) * scale, 0), max)),   scale > 0.
// p(x), the position, is one of two:
// - x * factor. The factor is a power of two: 1, unless the range is so short that its scale would
//   be no float, or so long that differences overflow.
// - the bits of x - centre, read as an integer in float order: about a logarithm on either side of
//   the centre. Used for coordinates that spread around the centre over many powers of two, and for
//   denormals, whose bits are a multiple of the value. 0 is added first, as -0 equals 0 and must
//   have the same position; negative numbers have all bits but the sign inverted, as larger bits
//   there mean a smaller number; the integer is rounded to a float.
// In round-to-nearest, subtraction, adding 0, multiplication by a positive number, integer
// conversion, min, max and truncation are each non-decreasing. So p and q are non-decreasing in x,
// for every float but NaN, infinities included: factor, centre, origin and scale are finite, factor
// and scale > 0, so infinity - infinity and 0 * infinity do not occur. q's high part is the column,
// its low 15 bits the quantized coordinate; 0 is raised to 1, which preserves the order within a
// column. Write w(x) for it. Therefore, for boxes a, b that share a column on an axis,
//   w(a.lower) < w(b.upper)  implies  a.lower <  b.upper   (contraposition of monotonicity)
//   w(a.lower) > w(b.upper)  implies  a.lower >  b.upper
// and a quantization tie (equal values) leaves the decision to the floats. Nothing is widened or
// rounded outward.
//
// A box is entered into every column that it touches, q(lower) >> 15 .. q(upper) >> 15 on each
// axis. If its lower end lies in an earlier column, the quantized lower end is 0; if its upper end
// lies in a later column, the quantized upper end is 32767. Both keep the two implications: 0 is
// below every quantized upper end in this column (>= 1), and the box's lower end is below them, as
// its column is earlier; 32767 against a lower end of 32767 is a tie and goes to the floats.
//
// Two boxes overlap only if on each axis their column ranges intersect (a.lower <= b.upper gives
// q(a.lower) <= q(b.upper), and likewise the other way). Then exactly one shared column is on every
// axis max(column(a.lower), column(b.lower)): the pair's owner cell, the only one that reports it.
// A column that holds both boxes is the owner cell exactly if on each axis not both quantized lower
// ends are 0. So a pair is reported once, however many columns the boxes share.
#pragma once

#include <bit>
#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::base {

// 15 bits: the difference of two quantized coordinates is a signed 16-bit number. Its sign gives
// the order, and 0 means a tie.
constexpr int quantized_bits = 15;
constexpr std::uint32_t steps_per_column = 1u << quantized_bits;
constexpr std::uint16_t max_quantized = steps_per_column - 1;
constexpr std::uint32_t max_columns_per_axis = 4096;

// The map of three axes. The fourth lane pads to a SIMD vector and maps everything to 0.
struct Quantizer {
  alignas(16) std::uint32_t by_bits[4] = {0, 0, 0, 0};  // 1: position from the bits
  alignas(16) float centre[4] = {0, 0, 0, 0};           // for by_bits
  alignas(16) float factor[4] = {1, 1, 1, 1};           // for the others
  alignas(16) float origin[4] = {0, 0, 0, 0};
  alignas(16) float scale[4] = {1, 1, 1, 1};
  alignas(16) float max[4] = {0, 0, 0, 0};
  alignas(16) std::uint32_t stride[4] = {0, 0, 0, 0};  // of the column index
  std::uint32_t columns[3] = {1, 1, 1};
  bool is_identity = true;  // every position is x itself

  std::uint32_t column_count() const noexcept { return columns[0] * columns[1] * columns[2]; }
};

// The largest float not above columns * 32768 - 1. Beyond 2^24 that number may not be a float, and
// rounding to nearest would give columns * 32768: a column out of range.
THRONG_HD constexpr float largest_index(std::uint32_t columns) noexcept {
  const std::uint32_t top = columns * steps_per_column - 1;  // columns <= 4096: fits
  std::uint32_t ulp = 1;
  while (top / ulp >= (1u << 24)) ulp *= 2;
  return static_cast<float>(top / ulp * ulp);
}

// Maps one axis; `last` < 2^31. NaN becomes 0.
THRONG_HD inline std::int32_t index_of(float x, float origin, float scale, float last) noexcept {
  float t = (x - origin) * scale;
  t = t > 0.0f ? t : 0.0f;
  t = t < last ? t : last;
  return static_cast<std::int32_t>(t);
}
// The bits of a float as an integer in float order.
inline std::int32_t ordered_bits(float x) noexcept {
  const auto bits = std::bit_cast<std::int32_t>(x + 0.0f);
  return bits < 0 ? bits ^ 0x7fffffff : bits;
}
inline float position_by_bits(float x, float centre) noexcept {
  return static_cast<float>(ordered_bits(x - centre));
}

inline std::int32_t quantize(const Quantizer& map, int axis, float x) noexcept {
  const float position =
      map.by_bits[axis] ? position_by_bits(x, map.centre[axis]) : x * map.factor[axis];
  return index_of(position, map.origin[axis], map.scale[axis], map.max[axis]);
}

// The approximate coordinate at a position, for diagnostics.
inline double coordinate_at(const Quantizer& map, int axis, double position) noexcept {
  if (map.by_bits[axis] == 0) return position / double{map.factor[axis]};
  // The positions of the infinities.
  constexpr double least = -2139095041.0, most = 2139095040.0;
  const double inside = position < least ? least : (position > most ? most : position);
  const auto bits = static_cast<std::int32_t>(inside);
  const float x = std::bit_cast<float>(bits ^ (bits >> 31 & 0x7fffffff));
  return double{x} + double{map.centre[axis]};
}

THRONG_HD constexpr std::int32_t column_of(std::int32_t index) noexcept {
  return index >> quantized_bits;
}
THRONG_HD constexpr std::uint16_t quantized_of(std::int32_t index) noexcept {
  const std::uint32_t low = static_cast<std::uint32_t>(index) & max_quantized;
  return static_cast<std::uint16_t>(low > 1 ? low : 1);
}
// The quantized ends of a box in column c of an axis; lower index <= upper index.
THRONG_HD constexpr std::uint16_t quantized_lower(std::int32_t lower, std::int32_t c) noexcept {
  return column_of(lower) < c ? std::uint16_t{0} : quantized_of(lower);
}
THRONG_HD constexpr std::uint16_t quantized_upper(std::int32_t upper, std::int32_t c) noexcept {
  return column_of(upper) > c ? max_quantized : quantized_of(upper);
}

}  // namespace throng::base
