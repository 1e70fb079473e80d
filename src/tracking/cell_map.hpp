// Maps boxes to cells of a hierarchical grid: the cell that stores a box, and the cells that a
// search around a box visits.
//
// One function per axis quantizes a float: q(x) = int(clamp(x * scale)). Each step is
// non-decreasing in round-to-nearest, so q is, for every float but NaN, infinities included. The
// class of a box is the first c whose span 16 << c is at least q(upper) - q(lower) on every axis.
// Cells of that class are 32 << c units long (bits = 5), or 16 << c where boxes are dense (bits =
// 4). The box is stored in cell q(lower) >> (bits + c) of each axis.
//
// Where most boxes are long and thin (rods, plates), a class also records the axes along which an
// eighth of its span suffices: c is less by 3 there. The span along an axis is then the longest of
// any box that the class has had.
//
// Why no pair is lost: let box b of class c overlap box a. On every axis b.lower <= a.upper and
// a.lower <= b.upper, so q(b.lower) <= q(a.upper), and q(b.lower) >= q(b.upper) - span >=
// q(a.lower) - span. Shifts are monotonic, so b is stored in one of the cells
//   (q(a.lower) - span) >> (bits + c)  ..  q(a.upper) >> (bits + c),
// with the c of that axis. A search around a visits all of those, for every class in use. No float
// is widened.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "base/sse2.hpp"
#include "tracking/cell_plan.hpp"

namespace throng::tracking {

class CellMap {
 public:
  // A class number: c in the low bits, then one bit per thin axis, at most two. `classes`: boxes
  // too wide for any class.
  static constexpr int classes = 24, thin_shift = 5, thin_sets = 7,
                       class_numbers = thin_sets << thin_shift;

  struct alignas(16) Range {
    std::int32_t lower[4], upper[4];  // the last of each has no meaning
  };

  void assign_storage(const CellPlan& plan, std::size_t objects) noexcept;

  std::uint32_t buckets() const noexcept { return buckets_; }
  bool thin() const noexcept { return thin_; }
  // Converts a length to units of quantized coordinates.
  double units(double length) const noexcept { return length * static_cast<double>(scale_); }
  Range quantize(const Box& box) const noexcept;
  int class_of(const Range& r) const noexcept {
    std::int32_t span = 1;
    for (int k = 0; k < 3; ++k) span = std::max(span, r.upper[k] - r.lower[k]);
    const int bits = std::bit_width(static_cast<std::uint32_t>(span - 1));
    int c = std::clamp(bits - span_bits, 0, classes);
    c = c <= top_ ? c : classes;
    if (!thin_ || c < thin_levels || c == classes) return c;
    const std::int32_t thin_span = 1 << (span_bits + c - thin_levels);
    int axes = 0;
    for (int k = 0; k < 3; ++k) axes |= (r.upper[k] - r.lower[k] <= thin_span) << k;
    return c | axes << thin_shift;
  }
  // Boxes of classes above `c` count as too wide from now on.
  void set_top(int c) noexcept { top_ = c; }
  // The c of the class along an axis.
  int level(int size_class, int axis) const noexcept {
    if (!thin_) return size_class;
    const int c = size_class & ((1 << thin_shift) - 1);
    return c - thin_levels * (size_class >> thin_shift >> axis & 1);
  }
  // The longest box per class and axis; kept where boxes are thin.
  struct Spans {
    std::int32_t of[class_numbers][3] = {};

    void extend(const Range& r, int size_class) noexcept {
      if (size_class == classes) return;
      for (int k = 0; k < 3; ++k)
        of[size_class][k] = std::max(of[size_class][k], r.upper[k] - r.lower[k]);
    }
    void extend(const Spans& other) noexcept {
      for (int c = 0; c < class_numbers; ++c) {
        for (int k = 0; k < 3; ++k) of[c][k] = std::max(of[c][k], other.of[c][k]);
      }
    }
  };
  // Extends the search range of the class to the length of this box.
  void extend(const Box& box, int size_class) noexcept {
    if (thin_) spans_.extend(quantize(box), size_class);
  }
  void extend(const Spans& spans) noexcept { spans_.extend(spans); }
  // The cell that stores a box of this class.
  Range storage_cell(const Range& r, int size_class) const noexcept {
    Range cell{};
    for (int k = 0; k < 3; ++k) cell.lower[k] = cell.upper[k] = r.lower[k] >> shift(size_class, k);
    return cell;
  }
  // For a box of class c < `classes`: 0 .. buckets() - 1.
  std::uint32_t bucket_of(const Range& r, int c, std::int32_t world) const noexcept {
    std::uint32_t bucket = class_term(c, world);
    for (int k = 0; k < 3; ++k) bucket = sum(bucket, cursor(r.lower[k] >> shift(c, k), c, k).term);
    return bucket;
  }

  // The cells that may hold boxes of a class which overlap this one.
  Range cells_of(const Range& r, int size_class) const noexcept {
    Range cells;
    if (thin_) {
      for (int k = 0; k < 3; ++k) {
        const int bits = shift(size_class, k);
        cells.lower[k] = (r.lower[k] - spans_.of[size_class][k]) >> bits;
        cells.upper[k] = r.upper[k] >> bits;
      }
      return cells;
    }
    for (int k = 0; k < 4; ++k) {
      cells.lower[k] = (r.lower[k] - (1 << (span_bits + size_class))) >> (cell_bits_ + size_class);
      cells.upper[k] = r.upper[k] >> (cell_bits_ + size_class);
    }
    return cells;
  }
  // Per class and axis, in units: log2 of the cell length; the maximal box length.
  int shift(int size_class, int axis) const noexcept {
    return cell_bits_ + level(size_class, axis);
  }
  std::int32_t span(int size_class, int axis) const noexcept {
    return thin_ ? spans_.of[size_class][axis] : 1 << (span_bits + size_class);
  }
  // Whether the range reaches the clamp of the quantized coordinates.
  static bool is_clamped(const Range& r) noexcept {
    constexpr auto most = static_cast<std::int32_t>(max_units);
    bool far = false;
    for (int k = 0; k < 3; ++k) far |= r.lower[k] <= -most || r.upper[k] >= most;
    return far;
  }
  // Number of cells, at most `most`. At most 2^26 per axis, so the product of two does not
  // overflow.
  static std::uint64_t count(const Range& cells, std::uint64_t most) noexcept {
    std::uint64_t n[3];
    for (int k = 0; k < 3; ++k)
      n[k] = static_cast<std::uint64_t>(std::int64_t{cells.upper[k]} - cells.lower[k] + 1);
    const std::uint64_t layer = n[0] * n[1];
    return layer >= most ? most : std::min(most, layer * n[2]);
  }
  // Calls f(bucket) for each of these cells.
  template <class F>
  void each_bucket(const Range& cells, int c, std::int32_t world, F&& f) const;

 private:
  static constexpr int thin_levels = CellPlan::thin_levels;
  static constexpr int span_bits = 4;
  static constexpr float max_units = 0x1p28f;

  // The bucket of a cell is the sum of four terms modulo the bucket count: one of its class and
  // world, and one per axis. If the occupied region is mostly full, the axis terms number the cells
  // row by row and layer by layer, with a period: neighbours are adjacent, and only distant cells
  // collide. Otherwise the terms of y and z are hashes.
  struct Axis {
    std::int32_t origin;  // in units: about where boxes begin
    // period 0: hashed. period_bias: a multiple of the period, at least 2^26.
    std::uint32_t period, stride, period_bias;
  };
  struct Cursor {
    std::int32_t cell;
    std::uint32_t remainder, term;  // cell modulo the period; its term of the sum
  };
  static std::uint32_t mix_bits(std::uint32_t h) noexcept {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
  }
  // In 0 .. buckets - 1.
  std::uint32_t hashed(std::uint32_t x) const noexcept {
    const std::uint64_t product = std::uint64_t{mix_bits(x)} * buckets_;
    return static_cast<std::uint32_t>(product >> 32);
  }
  std::uint32_t class_term(int c, std::int32_t world) const noexcept {
    if (c == 0 && world == -1) return 0;
    return hashed((static_cast<std::uint32_t>(world) * 256 + static_cast<std::uint32_t>(c)) *
                  0x9e3779b1u);
  }
  std::uint32_t hashed_term(std::int32_t cell, const Axis& axis) const noexcept {
    return hashed((static_cast<std::uint32_t>(cell) ^ axis.period_bias) * 0x9e3779b1u);
  }
  // Offset of the cell from the origin in cells of class c; usually less than the period. Cells
  // before the origin, by less than 2^26, wrap to large values.
  std::uint32_t offset_from_origin(std::int32_t cell, int c, int axis) const noexcept {
    return static_cast<std::uint32_t>(cell - (axis_[axis].origin >> shift(c, axis)));
  }
  Cursor cursor(std::int32_t cell, int c, int k) const noexcept {
    const Axis& axis = axis_[k];
    if (axis.period == 0) return {cell, 0, hashed_term(cell, axis)};
    std::uint32_t remainder = offset_from_origin(cell, c, k);
    if (remainder >= axis.period) [[unlikely]]
      remainder = (remainder + axis.period_bias) % axis.period;
    return {cell, remainder, remainder * axis.stride};
  }
  void step(Cursor& at, const Axis& axis) const noexcept {
    ++at.cell;
    if (axis.period == 0) {
      at.term = hashed_term(at.cell, axis);
    } else {
      ++at.remainder;
      at.term += axis.stride;
      if (at.remainder == axis.period) at.remainder = at.term = 0;
    }
  }
  std::uint32_t sum(std::uint32_t a, std::uint32_t b) const noexcept {
    return std::min(a + b, a + b - buckets_);  // both below buckets_, which is at most 2^31
  }

  Axis axis_[3] = {};
  std::uint32_t buckets_ = 1;
  float scale_ = 1;
  int cell_bits_ = 5;
  int top_ = classes - 1;
  bool thin_ = false;  // whether there are classes of thin boxes
  Spans spans_;        // only if thin_
};

// Truncates toward zero, which is non-decreasing.
inline CellMap::Range CellMap::quantize(const Box& box) const noexcept {
  Range r;
  const auto* corner = reinterpret_cast<const float*>(&box);
#if defined(THRONG_SSE2)
  const auto truncate = [&](__m128 v) {
    v = _mm_max_ps(_mm_mul_ps(v, _mm_set1_ps(scale_)), _mm_set1_ps(-max_units));
    return _mm_cvttps_epi32(_mm_min_ps(v, _mm_set1_ps(max_units)));
  };
  const __m128i u = truncate(_mm_loadu_ps(corner + 2));
  _mm_store_si128(reinterpret_cast<__m128i*>(r.lower), truncate(_mm_loadu_ps(corner)));
  _mm_store_si128(reinterpret_cast<__m128i*>(r.upper), _mm_shuffle_epi32(u, 0x39));
#else
  for (int k = 0; k < 4; ++k) {
    const auto truncate = [&](float x) {
      x = x * scale_;
      x = x > -max_units ? x : -max_units;
      return static_cast<std::int32_t>(x < max_units ? x : max_units);
    };
    r.lower[k] = truncate(corner[k % 3]);
    r.upper[k] = truncate(corner[3 + k % 3]);
  }
#endif
  return r;
}

template <class F>
void CellMap::each_bucket(const Range& cells, int c, std::int32_t world, F&& f) const {
  const std::uint32_t first = class_term(c, world);
  // If neither an axis nor the sum wraps, bucket numbers are linear in the cell coordinates.
  std::uint32_t begin = first, n[3];
  std::uint64_t end = first + std::uint64_t{1};
  bool linear = true;
  for (int k = 0; k < 3; ++k) {
    const Axis& axis = axis_[k];
    const std::uint32_t remainder = offset_from_origin(cells.lower[k], c, k);
    n[k] = static_cast<std::uint32_t>(cells.upper[k] - cells.lower[k] + 1);
    linear &= remainder < axis.period && n[k] <= axis.period - remainder;
    begin += remainder * axis.stride;
    end += (remainder + std::uint64_t{n[k]} - 1) * axis.stride;
  }
  if (linear && end <= buckets_) [[likely]] {
    for (std::uint32_t z = 0; z < n[2]; ++z) {
      for (std::uint32_t y = 0; y < n[1]; ++y) {
        const std::uint32_t row = begin + z * axis_[2].stride + y * axis_[1].stride;
        for (std::uint32_t x = 0; x < n[0]; ++x) f(row + x);
      }
    }
    return;
  }
  const Cursor x0 = cursor(cells.lower[0], c, 0), y0 = cursor(cells.lower[1], c, 1);
  Cursor z = cursor(cells.lower[2], c, 2);
  for (; z.cell <= cells.upper[2]; step(z, axis_[2])) {
    const std::uint32_t layer = sum(first, z.term);
    for (Cursor y = y0; y.cell <= cells.upper[1]; step(y, axis_[1])) {
      const std::uint32_t row = sum(layer, y.term);
      for (Cursor x = x0; x.cell <= cells.upper[0]; step(x, axis_[0])) f(sum(row, x.term));
    }
  }
}

}  // namespace throng::tracking
