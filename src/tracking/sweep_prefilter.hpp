// Conservative test of which boxes a sweep may meet, in floats, for four objects or the two boxes
// of a line at once. It accepts every box that contact_interval() (base/swept_box.hpp) accepts, and
// some others; contact_interval() decides. It is monotonic: with a box it accepts every box that
// contains it.
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
struct SweepPrefilterTerms {
  // For the sweep up to time `end`, at most 1; `start`: its box; `cover`: of the sweep.
  SweepPrefilterTerms(const Box& start, const base::SweptBounds& cover, double end) noexcept;

  float from_lower[3], from_upper[3], inverse[3];
  // Bound of enter - leave that rounding may cause.
  static constexpr float slack = 0x1p-18f;

#if !defined(THRONG_SSE2)
  bool pass(const Box& box) const noexcept;
#endif
};

// Tests objects.
class ObjectSweepPrefilter {
 public:
  explicit ObjectSweepPrefilter(const SweepPrefilterTerms& terms) noexcept;

  // One bit per object, for four consecutive ones. Reads only their boxes: another query may be
  // building cells.
  std::uint32_t passes(const Body* four) const noexcept;

  // Calls f(id) for each object that passes.
  template <class F>
  void each(const Objects& objects, F&& f) const {
    const std::size_t limit = objects.limit(), whole = limit / 4 * 4;
    const auto report = [&](std::size_t first, std::uint32_t bits) {
      for (; bits != 0; bits &= bits - 1)
        f(static_cast<ObjectId>(first + static_cast<std::size_t>(std::countr_zero(bits))));
    };
    for (std::size_t id = 0; id < whole; id += 4)
      report(id, passes(&objects.body(static_cast<ObjectId>(id))));
    if (whole == limit) return;
    Body last[4];
    for (std::size_t k = 0; k < 4; ++k)
      last[k].box = objects.body(static_cast<ObjectId>(std::min(whole + k, limit - 1))).box;
    report(whole, passes(last) & ((1u << (limit - whole)) - 1));
  }

 private:
#if defined(THRONG_SSE2)
  __m128 from_lower_[3], from_upper_[3], inverse_[3];
#else
  SweepPrefilterTerms terms_;
#endif
};

// Tests boxes in lines.
class CellLineSweepPrefilter {
 public:
  explicit CellLineSweepPrefilter(const SweepPrefilterTerms& terms) noexcept;

  // One bit per box.
  std::uint32_t passes(const CellLine& line) const noexcept;

 private:
#if defined(THRONG_SSE2)
  __m128 from_[3], inverse_[3];  // in the order of CellLine
#else
  SweepPrefilterTerms terms_;
#endif
};

inline SweepPrefilterTerms::SweepPrefilterTerms(const Box& start, const base::SweptBounds& cover,
                                                double end) noexcept {
  const Box whole = cover(0, end);
  const auto corners = [](const Box& b, int k) {
    const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
    const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
    return std::pair{lower[k], upper[k]};
  };
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
}

#if defined(THRONG_SSE2)

inline ObjectSweepPrefilter::ObjectSweepPrefilter(const SweepPrefilterTerms& terms) noexcept {
  for (int k = 0; k < 3; ++k) {
    from_lower_[k] = _mm_set1_ps(terms.from_lower[k]);
    from_upper_[k] = _mm_set1_ps(terms.from_upper[k]);
    inverse_[k] = _mm_set1_ps(terms.inverse[k]);
  }
}

inline std::uint32_t ObjectSweepPrefilter::passes(const Body* four) const noexcept {
  const auto front = [&](int i) { return _mm_loadu_ps(&four[i].box.lower.x); };
  const auto back = [&](int i) {
    return _mm_castsi128_ps(
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(&four[i].box.upper.y)));
  };
  __m128 lower[3] = {front(0), front(1), front(2)}, upper[3] = {front(3)};
  _MM_TRANSPOSE4_PS(lower[0], lower[1], lower[2], upper[0]);
  const __m128 two = _mm_unpacklo_ps(back(0), back(1)), next = _mm_unpacklo_ps(back(2), back(3));
  upper[1] = _mm_movelh_ps(two, next);
  upper[2] = _mm_movehl_ps(next, two);
  __m128 enter = _mm_setzero_ps(), leave = _mm_set1_ps(1);
  for (int k = 0; k < 3; ++k) {
    const __m128 a = _mm_mul_ps(_mm_sub_ps(lower[k], from_lower_[k]), inverse_[k]);
    const __m128 b = _mm_mul_ps(_mm_sub_ps(upper[k], from_upper_[k]), inverse_[k]);
    enter = _mm_max_ps(_mm_min_ps(b, a), enter);
    leave = _mm_min_ps(_mm_max_ps(a, b), leave);
  }
  return static_cast<std::uint32_t>(_mm_movemask_ps(
      _mm_cmple_ps(enter, _mm_add_ps(leave, _mm_set1_ps(SweepPrefilterTerms::slack)))));
}

// Order of coordinates in a line, for both boxes each: lower x and y, lower z and upper x, upper y
// and z.
inline CellLineSweepPrefilter::CellLineSweepPrefilter(const SweepPrefilterTerms& t) noexcept {
  const auto four = [](float a, float b) { return _mm_setr_ps(a, a, b, b); };
  from_[0] = four(t.from_lower[0], t.from_lower[1]);
  from_[1] = four(t.from_lower[2], -t.from_upper[0]);
  from_[2] = four(-t.from_upper[1], -t.from_upper[2]);
  inverse_[0] = four(t.inverse[0], t.inverse[1]);
  inverse_[1] = four(t.inverse[2], -t.inverse[0]);
  inverse_[2] = four(-t.inverse[1], -t.inverse[2]);
}

inline std::uint32_t CellLineSweepPrefilter::passes(const CellLine& line) const noexcept {
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
  const auto both = static_cast<std::uint32_t>(_mm_movemask_ps(
      _mm_cmple_ps(enter, _mm_add_ps(leave, _mm_set1_ps(SweepPrefilterTerms::slack)))));
  return both & ((1u << line.used) - 1);  // unused boxes are NaN, which passes
}

#else

inline bool SweepPrefilterTerms::pass(const Box& box) const noexcept {
  const float lower[3] = {box.lower.x, box.lower.y, box.lower.z};
  const float upper[3] = {box.upper.x, box.upper.y, box.upper.z};
  float enter = 0, leave = 1;
  for (int k = 0; k < 3; ++k) {
    const float a = (lower[k] - from_lower[k]) * inverse[k];
    const float b = (upper[k] - from_upper[k]) * inverse[k];
    const float first = b < a ? b : a, last = a > b ? a : b;  // a NaN is no bound
    enter = first > enter ? first : enter;
    leave = last < leave ? last : leave;
  }
  return enter <= leave + slack;
}

inline ObjectSweepPrefilter::ObjectSweepPrefilter(const SweepPrefilterTerms& terms) noexcept
    : terms_(terms) {}

inline std::uint32_t ObjectSweepPrefilter::passes(const Body* four) const noexcept {
  std::uint32_t bits = 0;
  for (unsigned i = 0; i < 4; ++i) bits |= (terms_.pass(four[i].box) ? 1u : 0u) << i;
  return bits;
}

inline CellLineSweepPrefilter::CellLineSweepPrefilter(const SweepPrefilterTerms& terms) noexcept
    : terms_(terms) {}

inline std::uint32_t CellLineSweepPrefilter::passes(const CellLine& line) const noexcept {
  std::uint32_t bits = 0;
  for (unsigned k = 0; k < line.used; ++k) bits |= (terms_.pass(line.box(k)) ? 1u : 0u) << k;
  return bits;
}

#endif

}  // namespace throng::tracking
