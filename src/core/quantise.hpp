// From float coordinates to columns and 15-bit words, and why no pair is lost on the way.
//
// One function q per axis maps a float to an integer in 0 .. columns * 32768 - 1:
//   q(x) = int(min(max((p(x) - origin) * scale, 0), max)),   scale > 0.
// p(x), the position, is one of two:
//   x * factor, where the factor is a power of two: 1, unless the range is so short that its scale
//   would be no float, or so long that differences overflow;
//   the bits of x - centre read as an integer, in the order of the floats: about a logarithm on
//   either side of the centre, for coordinates that lie around it over many powers of two; and for
//   denormals, of which it is a multiple. 0 is added first, as -0 equals 0 and must have the same
//   position; of negative numbers all bits but the sign are inverted, as greater ones there stand
//   for lesser numbers; and the integer is rounded to a float.
// In round-to-nearest, subtraction, adding 0, multiplication by a positive number, the conversion
// of an integer, min, max and truncation are each non-decreasing, so p and q are non-decreasing in
// x, for every float but NaN, infinities included: factor, centre, origin and scale are finite,
// factor and scale > 0, so nothing is infinity - infinity or 0 * infinity. q's high part is the
// column, its low 15 bits the word; a word of 0 is raised to 1, which keeps the order within a
// column. Therefore, for boxes a, b that share a column on an axis,
//   word(a.lower) < word(b.upper)  implies  a.lower <  b.upper   (contraposition of monotony)
//   word(a.lower) > word(b.upper)  implies  a.lower >  b.upper
// and equal words leave the decision to the floats. Nothing is widened and nothing is rounded
// outward: words never decide a tie.
//
// A box is entered into every column that it touches, q(lower) >> 15 .. q(upper) >> 15 on each
// axis. In a column where its lower end lies in an earlier one the lower word is 0; where its upper
// end lies in a later one the upper word is 32767. Both keep the two implications: 0 is below every
// word of an upper end in this column (those are >= 1) and the box's lower end is below them, as
// its column is earlier; 32767 against a lower word of 32767 is a tie and goes to the floats.
//
// Two boxes overlap only if on each axis their column ranges intersect (a.lower <= b.upper gives
// q(a.lower) <= q(b.upper), and likewise the other way), and then they share exactly one column
// that is on every axis max(column(a.lower), column(b.lower)): the pair's home. In a column both of
// them occupy, that is the home exactly if on each axis not both lower words are 0. So a pair is
// reported once, whatever number of columns the two share.
#pragma once

#include <bit>
#include <cstdint>

#include "core/hd.hpp"

namespace throng::core {

// 15 bits: the difference of two words is a signed 16-bit number, whose sign says which is greater
// and which is 0 exactly for a tie.
constexpr int word_bits = 15;
constexpr std::uint32_t words_per_column = 1u << word_bits;
constexpr std::uint16_t top_word = words_per_column - 1;
constexpr std::uint32_t max_columns_per_axis = 4096;

// The map of three axes; a fourth lane pads to a vector and maps everything to 0.
struct Quantiser {
  alignas(16) std::uint32_t by_bits[4] = {0, 0, 0, 0};  // 1: positions are bits
  alignas(16) float centre[4] = {0, 0, 0, 0};           // of these
  alignas(16) float factor[4] = {1, 1, 1, 1};           // of others
  alignas(16) float origin[4] = {0, 0, 0, 0};
  alignas(16) float scale[4] = {1, 1, 1, 1};
  alignas(16) float max[4] = {0, 0, 0, 0};
  alignas(16) std::uint32_t stride[4] = {0, 0, 0, 0};  // of a column's number, per axis
  std::uint32_t columns[3] = {1, 1, 1};
  bool plain = true;  // all positions are the floats themselves

  std::uint32_t column_count() const noexcept { return columns[0] * columns[1] * columns[2]; }
};

// The largest float not above columns * 32768 - 1. Beyond 2^24 that number is no float, and
// rounding to the nearest would give columns * 32768: a column that is not there.
THRONG_HD constexpr float largest_index(std::uint32_t columns) noexcept {
  const std::uint32_t top = columns * words_per_column - 1;  // columns <= 4096: fits
  std::uint32_t ulp = 1;
  while (top / ulp >= (1u << 24)) ulp *= 2;
  return static_cast<float>(top / ulp * ulp);
}

// The map of one axis; `last` below 2^31. What is not a number becomes 0.
THRONG_HD inline std::int32_t index_of(float x, float origin, float scale, float last) noexcept {
  float t = (x - origin) * scale;
  t = t > 0.0f ? t : 0.0f;
  t = t < last ? t : last;
  return static_cast<std::int32_t>(t);
}
// The bits of a float in the order of the floats.
inline std::int32_t ordered_bits(float x) noexcept {
  const auto bits = std::bit_cast<std::int32_t>(x + 0.0f);
  return bits ^ (bits >> 31 & 0x7fffffff);
}
inline float position_by_bits(float x, float centre) noexcept {
  return static_cast<float>(ordered_bits(x - centre));
}

inline std::int32_t quantise(const Quantiser& map, int axis, float x) noexcept {
  const float position =
      map.by_bits[axis] ? position_by_bits(x, map.centre[axis]) : x * map.factor[axis];
  return index_of(position, map.origin[axis], map.scale[axis], map.max[axis]);
}

// About the coordinate at a position, for those who look at a map.
inline double coordinate_at(const Quantiser& map, int axis, double position) noexcept {
  if (map.by_bits[axis] == 0) return position / double{map.factor[axis]};
  // Those of the infinities.
  constexpr double least = -2139095041.0, most = 2139095040.0;
  const double inside = position < least ? least : (position > most ? most : position);
  const auto bits = static_cast<std::int32_t>(inside);
  const float x = std::bit_cast<float>(bits ^ (bits >> 31 & 0x7fffffff));
  return double{x} + double{map.centre[axis]};
}

THRONG_HD constexpr std::int32_t column_of(std::int32_t index) noexcept {
  return index >> word_bits;
}
THRONG_HD constexpr std::uint16_t word_of(std::int32_t index) noexcept {
  const std::uint32_t low = static_cast<std::uint32_t>(index) & top_word;
  return static_cast<std::uint16_t>(low > 1 ? low : 1);
}
// The words of a box's two ends in column c of an axis; lower index <= upper index.
THRONG_HD constexpr std::uint16_t lower_word(std::int32_t lower, std::int32_t c) noexcept {
  return column_of(lower) < c ? std::uint16_t{0} : word_of(lower);
}
THRONG_HD constexpr std::uint16_t upper_word(std::int32_t upper, std::int32_t c) noexcept {
  return column_of(upper) > c ? top_word : word_of(upper);
}

}  // namespace throng::core
