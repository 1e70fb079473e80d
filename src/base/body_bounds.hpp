// The box around a transformed shape: rounded outward, and tight.
//
// The exact interval along one axis i, in real arithmetic. R is the matrix of the quaternion as
// given (throng/update_boxes.hpp), p the position, d the displacement, r the radius with the
// margin:
//   box     p + [0, 1] d + sum_j R_ij c_j  +-  (sum_j |R_ij| h_j + r)
//   convex  p + [0, 1] d + [min, max] over the points v of sum_j R_ij v_j  +-  r
//
// All is computed in doubles, then the bound E is subtracted or added. Let u = 2^-53. Rounding to
// nearest errs by at most u times the magnitude of the result, as nothing overflows or underflows:
// inputs are finite floats, whose products are 0 or in 2^-298 .. 2^256; infinite sizes are replaced
// by 2^600; so every magnitude is 0 or in 2^-500 .. 2^900.
//
// (1) x * 2y and the like are exact: 48 bits. An entry off the diagonal is one sum of two of them
//     and errs by u |m|. One on the diagonal, 1 - t, errs by u |m| + u t.
// (2) P = fl(m_ij c_j) errs by u |P|, by (1 + u) u |P| more for the entry, and on the diagonal by
//     u t |c_i| more. So do fl(m_ij v_j) and H = fl(|m_ij| h_j).
// (3) r, the sum of radius and margin, errs by u r.
// (4) Let S = |p| + |d| + sum |P| + sum H + r. Each partial sum is at most S (1 + 10u) in magnitude
//     and errs by u times that. There are eight before E is applied: two for the P, three for H
//     and r, one to join the two, p + d, and one to add that. The last, that of E itself, errs by
//     at most u (S + E)(1 + 10u).
//
// Together (2 + 1 + 9) u S + u T + u E, where T is t (|c_i| + h_i), and terms in u^2, far below
// another u S. For a convex shape P is the products |m_ij| V_j, where V_j is the greatest |v_j| of
// all points, and V_i replaces |c_i|: they bound each point's error, and so that of the minimum and
// the maximum. M is S + T as computed, at least (1 - 20u)(S + T), and E = 16 u M exceeds the 13 u S
// + u T + u E needed: the interval contains the exact one, and lies within 32 u M = 2^-48 M of it.
// Then its ends are rounded outward to floats.
//
// Infinite sizes: a zero entry of R adds nothing to E, so a plane rotated about its normal stays a
// plane. Any other entry times 2^600 exceeds all floats. If 1 - t is 0 only by rounding, T is
// large.
//
// Why doubles. In float32 the error would be 2^-20 of S, a dozen ulps of the result under
// cancellation, and the bound would need cases for underflow and for 1e30. In doubles the result is
// the tightest float or the next, without special cases. The cost is some 140 double operations per
// body, against 52 bytes moved: both take about as long where doubles run at half the rate of
// floats (data-centre GPUs). At 1/64 (other GPUs) the doubles take four times as long, some 0.2 ns
// per body, in the shortest stage of all.
//
// The code uses only + - *, comparisons and conversions, in a fixed order: with contraction off,
// host and device compute the same bits (except the payload of a NaN).
#pragma once

#include <bit>
#include <cstdint>

#include <throng/update_boxes.hpp>

#include "base/host_device_macros.hpp"

namespace throng::base {

// A constexpr std::abs. A comparison instead would take a device three operations.
THRONG_HD constexpr double magnitude(double x) noexcept {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) & ~(std::uint64_t{1} << 63));
}

// Replaces infinity: any float times it exceeds all floats or is 0, and never NaN.
constexpr double unbounded = 0x1p600;
THRONG_HD constexpr double bounded(double x) noexcept { return x > unbounded ? unbounded : x; }

struct Vector {
  double x, y, z;
};
THRONG_HD constexpr Vector widen(const Vec3& v) noexcept {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// A row of R; t is the value subtracted from 1 on the diagonal.
struct Row {
  double x, y, z, t;
};
struct Rotation {
  Row x, y, z;
};

THRONG_HD constexpr Rotation rotation_of(const Quaternion& q) noexcept {
  const double x = static_cast<double>(q.x), y = static_cast<double>(q.y);
  const double z = static_cast<double>(q.z), w = static_cast<double>(q.w);
  const double x2 = x + x, y2 = y + y, z2 = z + z;
  const double xx = x * x2, yy = y * y2, zz = z * z2;
  const double xy = x * y2, xz = x * z2, yz = y * z2;
  const double wx = w * x2, wy = w * y2, wz = w * z2;
  const double tx = yy + zz, ty = xx + zz, tz = xx + yy;
  return {{1 - tx, xy - wz, xz + wy, tx},
          {xy + wz, 1 - ty, yz - wx, ty},
          {xz - wy, yz + wx, 1 - tz, tz}};
}

// The extent of a shape along one world axis, relative to the position; `weight` is its part of M.
struct Extent {
  double low, high, weight;
};
struct Extents {
  Extent x, y, z;
};

// own: |c_i| + h_i of this axis.
THRONG_HD constexpr Extent extent_of(const Row& m, const Vector& c, const Vector& h, double r,
                                     double own) noexcept {
  const double px = m.x * c.x, py = m.y * c.y, pz = m.z * c.z;
  const double middle = px + py + pz;
  const double reach = magnitude(m.x) * h.x + magnitude(m.y) * h.y + magnitude(m.z) * h.z + r;
  const double weight = reach + (magnitude(px) + magnitude(py) + magnitude(pz)) + m.t * own;
  return {middle - reach, middle + reach, weight};
}
// The same for R = 1: the other terms are 0.
THRONG_HD constexpr Extent extent_of(double c, double h, double r) noexcept {
  const double reach = h + r;
  return {c - reach, c + reach, reach + magnitude(c)};
}

// A box shape rounded by `radius`, which includes the margin.
THRONG_HD constexpr Extents extents_of(const Quaternion& rotation, const Vec3& center,
                                       const Vec3& half_extents, double radius) noexcept {
  const Rotation m = rotation_of(rotation);
  const Vector c = widen(center), wide = widen(half_extents);
  const Vector h = {bounded(wide.x), bounded(wide.y), bounded(wide.z)};
  const double r = bounded(radius);
  return {extent_of(m.x, c, h, r, magnitude(c.x) + h.x),
          extent_of(m.y, c, h, r, magnitude(c.y) + h.y),
          extent_of(m.z, c, h, r, magnitude(c.z) + h.z)};
}
THRONG_HD constexpr Extents extents_of(const Vec3& center, const Vec3& half_extents,
                                       double radius) noexcept {
  const Vector c = widen(center), h = widen(half_extents);
  const double r = bounded(radius);
  return {extent_of(c.x, bounded(h.x), r), extent_of(c.y, bounded(h.y), r),
          extent_of(c.z, bounded(h.z), r)};
}

struct Ends {
  float lower, upper;
};
// The greatest float <= x and the least >= x; NaN stays. f is the nearest float. If it is on the
// wrong side, one step of its bits as an integer reaches its neighbour: one less is a smaller
// magnitude. f has the sign of x, so a 0 on the wrong side steps away from 0, not across it;
// infinity on the wrong side, beyond the largest float, steps back to that.
THRONG_HD constexpr std::int32_t step_of(std::int32_t bits) noexcept { return bits < 0 ? -1 : 1; }
THRONG_HD constexpr float rounded_down(double x) noexcept {
  const float f = static_cast<float>(x);
  const std::int32_t bits = std::bit_cast<std::int32_t>(f);
  return std::bit_cast<float>(bits - (static_cast<double>(f) > x ? step_of(bits) : 0));
}
THRONG_HD constexpr float rounded_up(double x) noexcept {
  const float f = static_cast<float>(x);
  const std::int32_t bits = std::bit_cast<std::int32_t>(f);
  return std::bit_cast<float>(bits + (static_cast<double>(f) < x ? step_of(bits) : 0));
}

// M - M is 0, or NaN if any input was not finite: then both ends are NaN.
THRONG_HD constexpr Ends ends(double low, double high, double m) noexcept {
  const double e = m * 0x1p-49 + (m - m);
  return {rounded_down(low - e), rounded_up(high + e)};
}
THRONG_HD constexpr Ends place(float position, const Extent& e) noexcept {
  const double p = static_cast<double>(position);
  return ends(p + e.low, p + e.high, e.weight + magnitude(p));
}
THRONG_HD constexpr Ends place(float position, float displacement, const Extent& e) noexcept {
  const double p = static_cast<double>(position), d = static_cast<double>(displacement);
  return ends((p + (d < 0 ? d : 0.0)) + e.low, (p + (d > 0 ? d : 0.0)) + e.high,
              e.weight + magnitude(p) + magnitude(d));
}

THRONG_HD constexpr Box place(const Vec3& p, const Extents& e) noexcept {
  const Ends x = place(p.x, e.x), y = place(p.y, e.y), z = place(p.z, e.z);
  return {{x.lower, y.lower, z.lower}, {x.upper, y.upper, z.upper}};
}
THRONG_HD constexpr Box place(const Vec3& p, const Vec3& d, const Extents& e) noexcept {
  const Ends x = place(p.x, d.x, e.x), y = place(p.y, d.y, e.y), z = place(p.z, d.z, e.z);
  return {{x.lower, y.lower, z.lower}, {x.upper, y.upper, z.upper}};
}

}  // namespace throng::base
