// Conservative test of which boxes a sweep may meet, in floats, for the two boxes of a line at
// once. It accepts every box that contact_interval() (base/swept_box.hpp) accepts, and some others;
// contact_interval() decides. It is monotonic: with a box it accepts every box that contains it.
//
// The sweep is tested up to a time `end`, and times here are fractions of `end`; otherwise a sweep
// much longer than the region of the boxes would reject none of them. `by` is the displacement
// until `end`.
//
// Why none is lost: let a sweep meet a box, by contact_interval(), from `enter` to `leave`, both in
// 0 .. 1 as fractions of `end`. First, an axis whose |by| is at least 2^-64 and within the range of
// floats, with a finite sweep box. A time is the product of a difference of two floats and an
// inverse in 2^-128 .. 2^64. Each of the three, `by` included, has a relative rounding error of at
// most 2^-22, or an absolute one of 2^-150, which the inverse scales to at most 2^-86; a difference
// that overflows is a time beyond 1. So a time at which touching begins, at most 1, is at most
// 2^-20 too large. A time at which it ends, at least 0, is at most 2^-20 too small, or at least 1.
// The test is enter <= leave
// + 2^-18. Second, any other axis: the box overlaps `cover`. A difference not above 0 stays so
// times 2^110. The distance from below the lower end becomes at least 1, as it is at least one
// float spacing (SweptBounds rounds outward) or 2^-90. Infinity minus infinity is NaN, and min and
// max never return a NaN in their first operand.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>

#include <throng/broad_phase.hpp>

#include "base/sse2.hpp"
#include "base/swept_box.hpp"
#include "tracking/cell_line.hpp"
#include "tracking/objects.hpp"

namespace throng::tracking {

// Along an axis, touching begins and ends at the times (lower - from_lower) * inverse and (upper -
// from_upper) * inverse, in either order.
class SweepPrefilter {
 public:
  // For the sweep up to time `end`, at most 1; `start`: its box; `cover`: of the sweep.
  SweepPrefilter(const Box& start, const base::SweptBounds& cover, double end) noexcept;

  // One bit per box of a line.
  std::uint32_t passes(const CellLine& line) const noexcept;

  // Calls f(id) for each object that passes. Reads only their boxes: another query may be building
  // cells.
  template <class F>
  void each(const Objects& objects, F&& f) const {
    CellLine line;
    for (std::size_t first = 0; first < objects.limit(); first += 2) {
      line.used = static_cast<std::uint32_t>(std::min<std::size_t>(2, objects.limit() - first));
      const auto id = static_cast<ObjectId>(first);
      line.set(objects.body(id).box, objects.body(id + line.used - 1).box);
      for (std::uint32_t bits = passes(line); bits != 0; bits &= bits - 1)
        f(static_cast<ObjectId>(first + static_cast<std::size_t>(std::countr_zero(bits))));
    }
  }

 private:
  // Bound of enter - leave that rounding may cause.
  static constexpr float slack = 0x1p-18f;
#if defined(THRONG_SSE2)
  __m128 from_[3], inverse_[3];  // in the order of CellLine
#else
  float from_lower_[3], from_upper_[3], inverse_[3];
#endif
};

inline SweepPrefilter::SweepPrefilter(const Box& start, const base::SweptBounds& cover,
                                      double end) noexcept {
  const Box whole = cover(0, end);
  const auto corners = [](const Box& b, int k) {
    const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
    const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
    return std::pair{lower[k], upper[k]};
  };
  float from_lower[3], from_upper[3], inverse[3];
  for (int k = 0; k < 3; ++k) {
    auto [lower, upper] = corners(start, k);
    const auto by = static_cast<float>(cover.by(k) * end);
    inverse[k] = 1 / by;
    if (!(std::fabs(by) >= 0x1p-64f && std::isfinite(by) && std::isfinite(lower) &&
          std::isfinite(upper))) {
      std::tie(lower, upper) = corners(whole, k);
      lower -= 0x1p-90f;
      inverse[k] = 0x1p110f;
    }
    from_lower[k] = upper;
    from_upper[k] = lower;
  }
#if defined(THRONG_SSE2)
  // Order of coordinates in a line, for both boxes each: lower x and y, lower z and upper x, upper
  // y and z.
  const auto four = [](float a, float b) { return _mm_setr_ps(a, a, b, b); };
  from_[0] = four(from_lower[0], from_lower[1]);
  from_[1] = four(from_lower[2], -from_upper[0]);
  from_[2] = four(-from_upper[1], -from_upper[2]);
  inverse_[0] = four(inverse[0], inverse[1]);
  inverse_[1] = four(inverse[2], -inverse[0]);
  inverse_[2] = four(-inverse[1], -inverse[2]);
#else
  std::copy(from_lower, from_lower + 3, from_lower_);
  std::copy(from_upper, from_upper + 3, from_upper_);
  std::copy(inverse, inverse + 3, inverse_);
#endif
}

inline std::uint32_t SweepPrefilter::passes(const CellLine& line) const noexcept {
#if defined(THRONG_SSE2)
  const auto times = [&](int i) {
    return _mm_mul_ps(_mm_sub_ps(_mm_load_ps(line.corner[2 * i]), from_[i]), inverse_[i]);
  };
  const __m128 lower_xy = times(0), mixed = times(1), upper_yz = times(2);
  const __m128 upper_xy = _mm_shuffle_ps(mixed, upper_yz, _MM_SHUFFLE(1, 0, 3, 2));
  const __m128 z = _mm_shuffle_ps(mixed, upper_yz, _MM_SHUFFLE(3, 2, 1, 0));
  const __m128 upper_z = _mm_movehl_ps(z, z);
  __m128 enter = _mm_max_ps(_mm_min_ps(upper_xy, lower_xy), _mm_setzero_ps());
  __m128 leave = _mm_min_ps(_mm_max_ps(lower_xy, upper_xy), _mm_set1_ps(1));
  enter = _mm_max_ps(enter, _mm_movehl_ps(enter, enter));
  leave = _mm_min_ps(leave, _mm_movehl_ps(leave, leave));
  enter = _mm_max_ps(_mm_min_ps(upper_z, z), enter);
  leave = _mm_min_ps(_mm_max_ps(z, upper_z), leave);
  const auto both = static_cast<std::uint32_t>(
      _mm_movemask_ps(_mm_cmple_ps(enter, _mm_add_ps(leave, _mm_set1_ps(slack)))));
  return both & ((1u << line.used) - 1);  // unused boxes are NaN, which passes
#else
  std::uint32_t bits = 0;
  for (unsigned i = 0; i < line.used; ++i) {
    const Box box = line.box(i);
    const float lower[3] = {box.lower.x, box.lower.y, box.lower.z};
    const float upper[3] = {box.upper.x, box.upper.y, box.upper.z};
    float enter = 0, leave = 1;
    for (int k = 0; k < 3; ++k) {
      const float a = (lower[k] - from_lower_[k]) * inverse_[k];
      const float b = (upper[k] - from_upper_[k]) * inverse_[k];
      const float first = b < a ? b : a, last = a > b ? a : b;  // a NaN is no bound
      enter = first > enter ? first : enter;
      leave = last < leave ? last : leave;
    }
    bits |= (enter <= leave + slack ? 1u : 0u) << i;
  }
  return bits;
#endif
}

}  // namespace throng::tracking
