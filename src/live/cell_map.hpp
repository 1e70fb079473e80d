// Cells by size classes: which one a box belongs to, and which ones a search of it looks into.
//
// One function per axis maps a float to a whole number of units, q(x) = int(clamp(x * scale)).
// Each step is non-decreasing in round-to-nearest, so q is, for every float but NaN, infinities
// included. A box is of the first class c whose span 16 << c is at least q(upper) - q(lower) on
// every axis; cells of that class are 32 << c units long, 16 << c where boxes are dense, and the
// box's home on an axis is q(lower) >> (bits + c), bits 5 or 4.
//
// Where boxes are mostly long and thin, rods and plates, a class also tells along which axes an
// eighth of its span is enough: there c is less by 3. A search then takes for the span along an
// axis the longest that any box of the class has had there.
//
// Why no pair is lost: let box b of class c overlap box a. On every axis b.lower <= a.upper and
// a.lower <= b.upper, so q(b.lower) <= q(a.upper), and q(b.lower) >= q(b.upper) - span >=
// q(a.lower) - span. Shifting keeps the order: b's home is one of the cells
//   (q(a.lower) - span) >> (bits + c)  ..  q(a.upper) >> (bits + c),
// c being that of the axis, and a search of a looks into all of those, for every class in use. No
// float is widened.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "cpu/sse2.hpp"
#include "live/cell_plan.hpp"

namespace throng::live {

class CellMap {
 public:
  // The number of a class is its c and, above, a bit for each thin axis, which are two at most.
  // `classes`: that of boxes too wide for any.
  static constexpr int classes = 24, thin_shift = 5, thin_sets = 7,
                       class_numbers = thin_sets << thin_shift;

  struct alignas(16) Range {
    std::int32_t lower[4], upper[4];  // the last of each is of no meaning
  };

  void lay_out(const CellPlan& plan, std::size_t objects) noexcept;

  std::uint32_t homes() const noexcept { return homes_; }
  bool thin() const noexcept { return thin_; }
  // A length in the units that cells are made of.
  double units(double length) const noexcept { return length * static_cast<double>(scale_); }
  Range quantise(const Box& box) const noexcept;
  int class_of(const Range& r) const noexcept {
    std::int32_t span = 1;
    for (int k = 0; k < 3; ++k) span = std::max(span, r.upper[k] - r.lower[k]);
    const int bits = std::bit_width(static_cast<std::uint32_t>(span - 1));
    int c = std::clamp(bits - span_bits, 0, classes);
    c = c <= top_ ? c : classes;
    if (!thin_ || c < thinner || c == classes) return c;
    const std::int32_t thin_span = 1 << (span_bits + c - thinner);
    int axes = 0;
    for (int k = 0; k < 3; ++k) axes |= (r.upper[k] - r.lower[k] <= thin_span) << k;
    return c | axes << thin_shift;
  }
  // From now on boxes of classes above `c` are too wide for any.
  void set_top(int c) noexcept { top_ = c; }
  // Its c along an axis.
  int level(int size_class, int axis) const noexcept {
    if (!thin_) return size_class;
    const int c = size_class & ((1 << thin_shift) - 1);
    return c - thinner * (size_class >> thin_shift >> axis & 1);
  }
  // How long boxes of each class are at most, along each axis; kept where boxes are thin.
  struct Spans {
    std::int32_t of[class_numbers][3] = {};

    void hold(const Range& r, int size_class) noexcept {
      if (size_class == classes) return;
      for (int k = 0; k < 3; ++k)
        of[size_class][k] = std::max(of[size_class][k], r.upper[k] - r.lower[k]);
    }
    void hold(const Spans& other) noexcept {
      for (int c = 0; c < class_numbers; ++c) {
        for (int k = 0; k < 3; ++k) of[c][k] = std::max(of[c][k], other.of[c][k]);
      }
    }
  };
  // From now on searches reach as far back as such a box is long.
  void hold(const Box& box, int size_class) noexcept {
    if (thin_) spans_.hold(quantise(box), size_class);
  }
  void hold(const Spans& spans) noexcept { spans_.hold(spans); }
  // Where a box of this class has its home: one cell.
  Range home_cell(const Range& r, int size_class) const noexcept {
    Range cell{};
    for (int k = 0; k < 3; ++k) cell.lower[k] = cell.upper[k] = r.lower[k] >> shift(size_class, k);
    return cell;
  }
  // Of a box of class c, which is not `classes`: 0 .. homes() - 1.
  std::uint32_t home_of(const Range& r, int c, std::int32_t world) const noexcept {
    std::uint32_t home = first_part(c, world);
    for (int k = 0; k < 3; ++k) home = sum(home, cursor(r.lower[k] >> shift(c, k), c, k).part);
    return home;
  }

  // Where boxes of a class may lie that overlap one.
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
  // Of a class along an axis: how long cells are, 1 << that; and boxes in them, at most. In units.
  int shift(int size_class, int axis) const noexcept {
    return cell_bits_ + level(size_class, axis);
  }
  std::int32_t span(int size_class, int axis) const noexcept {
    return thin_ ? spans_.of[size_class][axis] : 1 << (span_bits + size_class);
  }
  // Whether it reaches to where coordinates are no longer told apart.
  static bool is_cut_off(const Range& r) noexcept {
    bool far = false;
    for (int k = 0; k < 3; ++k) far |= r.lower[k] <= -most_units || r.upper[k] >= most_units;
    return far;
  }
  // How many these are, or `most` where they are more. At most 2^26 an axis, so that the product
  // of two is known.
  static std::uint64_t count(const Range& cells, std::uint64_t most) noexcept {
    std::uint64_t n[3];
    for (int k = 0; k < 3; ++k)
      n[k] = static_cast<std::uint64_t>(std::int64_t{cells.upper[k]} - cells.lower[k] + 1);
    const std::uint64_t layer = n[0] * n[1];
    return layer >= most ? most : std::min(most, layer * n[2]);
  }
  // f(home) for each of these cells.
  template <class F>
  void each_home(const Range& cells, int c, std::int32_t world, F&& f) const;

 private:
  static constexpr int thinner = CellPlan::thinner;
  static constexpr int span_bits = 4;
  static constexpr float most_units = 0x1p28f;

  // A cell's home is the sum of four numbers, modulo the count of homes: one of its class and
  // world, and one an axis. Where the world is mostly full, those count cells, row by row and layer
  // by layer, and begin again after so many: neighbours lie side by side, and no two fall on one
  // another but far ones. Else those of y and z are hashed.
  struct Axis {
    std::int32_t origin;  // in units: about where boxes begin
    // period 0: hashed. lift: a multiple of it, of at least 2^26.
    std::uint32_t period, stride, lift;
  };
  struct Cursor {
    std::int32_t cell;
    std::uint32_t rest, part;  // cell modulo the period; its part of the sum
  };
  static std::uint32_t mixed(std::uint32_t h) noexcept {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
  }
  // 0 .. homes - 1.
  std::uint32_t hashed(std::uint32_t x) const noexcept {
    const std::uint64_t product = std::uint64_t{mixed(x)} * homes_;
    return static_cast<std::uint32_t>(product >> 32);
  }
  std::uint32_t first_part(int c, std::int32_t world) const noexcept {
    if (c == 0 && world == -1) return 0;
    return hashed((static_cast<std::uint32_t>(world) * 256 + static_cast<std::uint32_t>(c)) *
                  0x9e3779b1u);
  }
  std::uint32_t hashed_part(std::int32_t cell, const Axis& axis) const noexcept {
    return hashed((static_cast<std::uint32_t>(cell) ^ axis.lift) * 0x9e3779b1u);
  }
  // How many cells of class c it lies behind the origin: most by less than the period. What lies
  // before it, by less than 2^26, counts as far behind.
  std::uint32_t behind_origin(std::int32_t cell, int c, int axis) const noexcept {
    return static_cast<std::uint32_t>(cell - (axis_[axis].origin >> shift(c, axis)));
  }
  Cursor cursor(std::int32_t cell, int c, int k) const noexcept {
    const Axis& axis = axis_[k];
    if (axis.period == 0) return {cell, 0, hashed_part(cell, axis)};
    std::uint32_t rest = behind_origin(cell, c, k);
    if (rest >= axis.period) [[unlikely]]
      rest = (rest + axis.lift) % axis.period;
    return {cell, rest, rest * axis.stride};
  }
  void step(Cursor& at, const Axis& axis) const noexcept {
    ++at.cell;
    if (axis.period == 0) {
      at.part = hashed_part(at.cell, axis);
    } else {
      ++at.rest;
      at.part += axis.stride;
      if (at.rest == axis.period) at.rest = at.part = 0;
    }
  }
  std::uint32_t sum(std::uint32_t a, std::uint32_t b) const noexcept {
    return std::min(a + b, a + b - homes_);  // both below homes_, which is at most 2^31
  }

  Axis axis_[3] = {};
  std::uint32_t homes_ = 1;
  float scale_ = 1;
  int cell_bits_ = 5;
  int top_ = classes - 1;
  bool thin_ = false;  // whether there are classes of thin boxes
  Spans spans_;        // then
};

// Cut to whole numbers: towards zero, so nowhere decreasing.
inline CellMap::Range CellMap::quantise(const Box& box) const noexcept {
  Range r;
  const auto* corner = reinterpret_cast<const float*>(&box);
#if defined(THRONG_SSE2)
  const auto cut = [&](__m128 v) {
    v = _mm_max_ps(_mm_mul_ps(v, _mm_set1_ps(scale_)), _mm_set1_ps(-most_units));
    return _mm_cvttps_epi32(_mm_min_ps(v, _mm_set1_ps(most_units)));
  };
  const __m128i u = cut(_mm_loadu_ps(corner + 2));
  _mm_store_si128(reinterpret_cast<__m128i*>(r.lower), cut(_mm_loadu_ps(corner)));
  _mm_store_si128(reinterpret_cast<__m128i*>(r.upper), _mm_shuffle_epi32(u, 0x39));
#else
  for (int k = 0; k < 4; ++k) {
    const auto cut = [&](float x) {
      x = x * scale_;
      x = x > -most_units ? x : -most_units;
      return static_cast<std::int32_t>(x < most_units ? x : most_units);
    };
    r.lower[k] = cut(corner[k % 3]);
    r.upper[k] = cut(corner[3 + k % 3]);
  }
#endif
  return r;
}

template <class F>
void CellMap::each_home(const Range& cells, int c, std::int32_t world, F&& f) const {
  const std::uint32_t first = first_part(c, world);
  // Where no axis begins again, and the sum does not, homes are counted as cells are.
  std::uint32_t begin = first, n[3];
  std::uint64_t end = first + std::uint64_t{1};
  bool once = true;
  for (int k = 0; k < 3; ++k) {
    const Axis& axis = axis_[k];
    const std::uint32_t rest = behind_origin(cells.lower[k], c, k);
    n[k] = static_cast<std::uint32_t>(cells.upper[k] - cells.lower[k] + 1);
    once &= rest < axis.period && n[k] <= axis.period - rest;
    begin += rest * axis.stride;
    end += (rest + std::uint64_t{n[k]} - 1) * axis.stride;
  }
  if (once && end <= homes_) [[likely]] {
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
    const std::uint32_t layer = sum(first, z.part);
    for (Cursor y = y0; y.cell <= cells.upper[1]; step(y, axis_[1])) {
      const std::uint32_t row = sum(layer, y.part);
      for (Cursor x = x0; x.cell <= cells.upper[0]; step(x, axis_[0])) f(sum(row, x.part));
    }
  }
}

}  // namespace throng::live
