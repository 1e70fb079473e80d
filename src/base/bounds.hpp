// Exact tests of one and of two boxes on the input numbers, and boxes expanded by a margin. These
// tests decide; everything else only selects candidates. A box here is a Box or a DoubleBox.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

// A compiler that assumes no NaN exists would remove the NaN checks.
#if defined(__FAST_MATH__) || defined(_M_FP_FAST) || \
    (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error \
    "Throng must be built without -ffast-math (-ffinite-math-only, /fp:fast): pairs would be lost"
#endif

namespace throng::base {

// Closed boxes: touching counts. False if any bound is NaN; -0 equals 0. Does not check is_active:
// an inverted box may "overlap" a large one here.
template <class AnyBox>
THRONG_HD constexpr bool overlaps(const AnyBox& a, const AnyBox& b) noexcept {
  return (a.lower.x <= b.upper.x) & (b.lower.x <= a.upper.x) & (a.lower.y <= b.upper.y) &
         (b.lower.y <= a.upper.y) & (a.lower.z <= b.upper.z) & (b.lower.z <= a.upper.z);
}

// lower <= upper on every axis. False for an empty slot and for a NaN.
template <class AnyBox>
THRONG_HD constexpr bool is_active(const AnyBox& b) noexcept {
  return (b.lower.x <= b.upper.x) & (b.lower.y <= b.upper.y) & (b.lower.z <= b.upper.z);
}

template <class AnyBox>
THRONG_HD constexpr bool has_nan(const AnyBox& b) noexcept {
  return (b.lower.x != b.lower.x) | (b.lower.y != b.lower.y) | (b.lower.z != b.lower.z) |
         (b.upper.x != b.upper.x) | (b.upper.y != b.upper.y) | (b.upper.z != b.upper.z);
}

// The nearest finite number; a NaN stays one.
constexpr float clamp_finite(float x) noexcept {
  constexpr float largest = std::numeric_limits<float>::max();
  return x < -largest ? -largest : (x > largest ? largest : x);
}

// The next number towards minus infinity. Precondition: x is neither NaN nor minus infinity.
THRONG_HD constexpr float next_down(float x) noexcept {
  if (x == 0) return -std::numeric_limits<float>::denorm_min();
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  return std::bit_cast<float>(x > 0 ? bits - 1 : bits + 1);
}
constexpr double next_down(double x) noexcept {
  if (x == 0) return -std::numeric_limits<double>::denorm_min();
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  return std::bit_cast<double>(x > 0 ? bits - 1 : bits + 1);
}

// The exact value of x - m, rounded down to float. m finite.
//
// s + e = x - m exactly (Knuth's two-sum; denormals are exact), and s is the double nearest to the
// exact value. f is the float nearest to s. Rounding is monotonic, so the exact value lies below a
// double if s does, and above one if s does.
//   f > s: s, and with it the exact value, lies strictly between f and the float below f: that
//          float is the result.
//   f < s: in the same way the exact value lies strictly between f and the float above: f is the
//          result.
//   f = s: the sign of e decides.
// A value below the smallest float rounds down to minus infinity (f is, or becomes, that). A value
// above the largest rounds to the largest (f is infinity, the float below it is the largest). If x
// is infinite, s is x and e is NaN, so neither comparison holds and the result is f = x; a NaN
// stays NaN. Requires denormals and rounding to nearest, as all of the library's arithmetic does.
THRONG_HD constexpr float subtract_rounded_down_to_float(double x, double m) noexcept {
  const double s = x - m;
  const double m_part = s - x;
  const double x_part = s - m_part;
  const double e = (x - x_part) + (-m - m_part);
  const float f = static_cast<float>(s);
  const double wide = static_cast<double>(f);
  return ((wide > s) | ((wide == s) & (e < 0))) ? next_down(f) : f;
}
THRONG_HD constexpr float subtract_rounded_down(float x, float m) noexcept {
  return subtract_rounded_down_to_float(static_cast<double>(x), static_cast<double>(m));
}

// The exact value of x + m, rounded up to float: the mirror image, since negation is exact.
THRONG_HD constexpr float add_rounded_up(float x, float m) noexcept {
  return -subtract_rounded_down(-x, m);
}

// The exact value of x - m, rounded down to double. m finite.
//
// s + e = x - m exactly (two-sum; denormals are exact), and s is the nearest double. So the exact
// value lies below s, within half a unit, if and only if e < 0. A sum below the least double is
// minus infinity, which is below it. If that or x is infinite, e is NaN and s stays.
constexpr double subtract_rounded_down(double x, double m) noexcept {
  const double s = x - m;
  const double m_part = s - x;
  const double x_part = s - m_part;
  const double e = (x - x_part) + (-m - m_part);
  return e < 0 ? next_down(s) : s;
}

// lower - margin rounded down, upper + margin rounded up: the smallest float box that contains the
// exact one. Check is_active and has_nan on the original box, not on this one: a margin can make an
// empty slot active. margin finite.
THRONG_HD constexpr Box expand(const Box& b, float margin) noexcept {
  return {{subtract_rounded_down(b.lower.x, margin), subtract_rounded_down(b.lower.y, margin),
           subtract_rounded_down(b.lower.z, margin)},
          {add_rounded_up(b.upper.x, margin), add_rounded_up(b.upper.y, margin),
           add_rounded_up(b.upper.z, margin)}};
}
// The smallest DoubleBox that contains the exact one.
constexpr DoubleBox expand(const DoubleBox& b, float margin) noexcept {
  const double m = static_cast<double>(margin);
  const auto down = [m](double x) { return subtract_rounded_down(x, m); };
  const auto up = [m](double x) { return -subtract_rounded_down(-x, m); };
  return {{down(b.lower.x), down(b.lower.y), down(b.lower.z)},
          {up(b.upper.x), up(b.upper.y), up(b.upper.z)}};
}

// Both corners plus `by`, each rounded to nearest, which preserves their order: an active box stays
// active. Rounding can make two different corners equal. If lower > upper, the upper one then moves
// one step down, so that an inactive box stays inactive. by finite.
THRONG_HD constexpr void shift_axis(float& lower, float& upper, float by) noexcept {
  const bool inverted = lower > upper;
  lower += by;
  upper += by;
  if (!inverted || lower > upper) return;
  if (upper == -std::numeric_limits<float>::infinity())
    lower = std::numeric_limits<float>::lowest();
  else
    upper = next_down(upper);
}
THRONG_HD constexpr Box shifted(Box b, const Vec3& by) noexcept {
  shift_axis(b.lower.x, b.upper.x, by.x);
  shift_axis(b.lower.y, b.upper.y, by.y);
  shift_axis(b.lower.z, b.upper.z, by.z);
  return b;
}

}  // namespace throng::base
