// Exact signs of determinants of points (orientation predicates).
//
// A filter in doubles decides nearly all. Expansions decide the rest, if each coordinate is 0 or
// of a magnitude in 2^-300 .. 2^300 (all floats are); integers decide otherwise, and always on a
// device (mesh/scaled_integer.hpp). Each is exact on the numbers given, so the sign does not depend
// on which of them decides.
//
// The floating-point state must be that of base::FloatState: round to nearest, denormals kept.
// Coordinates must be finite.
//
// Bound of the filter. Let u = 2^-53 and h = 2^-1075. With d, e in [-u, u] and |k| <= h,
//   fl(a - b) = (a - b)(1 + d), also when it underflows, as it is exact then;
//   fl(a b) = a b (1 + e) + k.
// Let x_i, y_i, z_i be the exact differences of row i, and X_i, Y_i, Z_i the computed ones. The
// filter computes
//   D = fl(sum of Z_i M_i),      M_i = fl(X_j Y_k - X_k Y_j),
//   P = fl(sum of |Z_i| Q_i),    Q_i = fl((|fl(X_j Y_k)| + |fl(X_k Y_j)|) + t),
//   B = fl(C P + t),             C = 9 u, t = 2^-1000,
// and D has the sign of the determinant if |D| > B.
// (1) Let p be the sum of the six |x y z|. Each of these terms takes part in eight roundings: three
//     differences, a product, a difference, a product, two sums. An underflow in X Y adds k, which
//     is then multiplied by Z and takes part in four roundings; one in Z M adds k and takes part in
//     two. So D errs by at most
//       ((1+u)^8 - 1) p + 2h (1+u)^4 sum |Z_i| + 3h (1+u)^2.
// (2) In the same way
//       P >= (1-u)^9 p + (1-u)^5 (t - 2h) sum |Z_i| - 3h,
//       B >= (1-u) ((1-u) C P + t - h).
// (3) (1-u)^11 9u > (1+u)^8 - 1 covers the first term of (1); 9u (1-u)^7 (t - 2h) > 2^-1050 covers
//     the second, which is below 2^-1073 sum |Z_i|; and t covers the third. So B is at least the
//     error.
// (4) An overflow makes P infinite or NaN, as by t no Q_i is 0, and 0 * infinity is NaN. Then
//     |D| > B is false. |D| <= P holds for the rounded numbers, too, as rounding is monotonic.
// Widened floats: differences other than 0 are in 2^-149 .. 2^129, products of two in 2^-298 ..
// 2^258, of three in 2^-447 .. 2^387. Nothing overflows or underflows, and t changes no decision:
// it vanishes in every Q_i that would not be 0, and in B unless P is 0. So code for widened
// floats may drop t: B = C P; and P = 0 proves that the determinant is 0. The same holds for
// doubles if each difference is 0 or of a magnitude in 2^-300 .. 2^300.
//
// In two dimensions D = fl(X_1 Y_2 - Y_1 X_2), P is the sum of magnitudes, B = fl(5u P + t). The
// terms take part in four roundings, P >= (1-u)^4 p - 2h, and D errs by ((1+u)^4 - 1) p + 2h (1+u).
#pragma once

#include <cmath>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "mesh/expansion.hpp"
#include "mesh/scaled_integer.hpp"

namespace throng::mesh {

// What a filter returns instead of a sign when it cannot decide.
constexpr int uncertain = 2;

// C and t of the proof.
constexpr double orient3d_relative_error = 9 * 0x1p-53;
constexpr double orient2d_relative_error = 5 * 0x1p-53;
constexpr double orient_underflow_guard = 0x1p-1000;

// The magnitudes for which expansions are exact, apart from 0. Then all coordinates and differences
// are on the grid of 2^-352, products of two on that of 2^-704, of three on that of 2^-1056, which
// is above 2^-1074. The largest sum is below 6 * 2^903, and factors are below 2^604.
constexpr double expansion_min = 0x1p-300;
constexpr double expansion_max = 0x1p300;

THRONG_HD inline bool is_in_expansion_range(double x) noexcept {
  const double magnitude = std::fabs(x);
  return x == 0 || (magnitude >= expansion_min && magnitude <= expansion_max);
}
THRONG_HD inline bool is_in_expansion_range(const DoubleVec3& p) noexcept {
  return is_in_expansion_range(p.x) && is_in_expansion_range(p.y) && is_in_expansion_range(p.z);
}

// The sign of (bx - ax)(cy - ay) - (by - ay)(cx - ax), or `uncertain`.
THRONG_HD inline int orient2d_filter(double ax, double ay, double bx, double by, double cx,
                                     double cy) noexcept {
  const double x1 = bx - ax, y1 = by - ay, x2 = cx - ax, y2 = cy - ay;
  const double left = x1 * y2, right = y1 * x2;
  const double determinant = left - right;
  const double bound =
      orient2d_relative_error * (std::fabs(left) + std::fabs(right)) + orient_underflow_guard;
  if (determinant > bound) return 1;
  if (determinant < -bound) return -1;
  // A computed difference is 0 only if the exact one is.
  if ((x1 == 0 || y2 == 0) && (y1 == 0 || x2 == 0)) return 0;
  return uncertain;
}

// The sign of ((b - a) x (c - a)) . (d - a), or `uncertain`.
THRONG_HD inline int orient3d_filter(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c,
                                     const DoubleVec3& d) noexcept {
  const double x1 = b.x - a.x, y1 = b.y - a.y, z1 = b.z - a.z;
  const double x2 = c.x - a.x, y2 = c.y - a.y, z2 = c.z - a.z;
  const double x3 = d.x - a.x, y3 = d.y - a.y, z3 = d.z - a.z;
  const double x1y2 = x1 * y2, x2y1 = x2 * y1;
  const double x2y3 = x2 * y3, x3y2 = x3 * y2;
  const double x3y1 = x3 * y1, x1y3 = x1 * y3;
  const double determinant = z1 * (x2y3 - x3y2) + z2 * (x3y1 - x1y3) + z3 * (x1y2 - x2y1);
  constexpr double t = orient_underflow_guard;
  const double permanent = std::fabs(z1) * (std::fabs(x2y3) + std::fabs(x3y2) + t) +
                           std::fabs(z2) * (std::fabs(x3y1) + std::fabs(x1y3) + t) +
                           std::fabs(z3) * (std::fabs(x1y2) + std::fabs(x2y1) + t);
  const double bound = orient3d_relative_error * permanent + t;
  if (determinant > bound) return 1;
  if (determinant < -bound) return -1;
  // Each of the six products has a factor 0: equal points, or an axis on which all are equal. A
  // computed difference is 0 only if the exact one is.
  if ((z1 == 0 || ((x2 == 0 || y3 == 0) && (x3 == 0 || y2 == 0))) &&
      (z2 == 0 || ((x3 == 0 || y1 == 0) && (x1 == 0 || y3 == 0))) &&
      (z3 == 0 || ((x1 == 0 || y2 == 0) && (x2 == 0 || y1 == 0))))
    return 0;
  return uncertain;
}

// x * y. The sum of nonadjacent expansions, which may be scaled again.
THRONG_HD inline Expansion<8> product(TwoTerms x, TwoTerms y) noexcept {
  const Expansion<2> e(x);
  return add_terms(scaled(e, y.low), scaled(e, y.high));
}
// x1 * y2 - x2 * y1
THRONG_HD inline Expansion<16> minor_of(TwoTerms x1, TwoTerms y1, TwoTerms x2,
                                        TwoTerms y2) noexcept {
  return add_terms(product(x1, y2), product({-x2.high, -x2.low}, y1));
}
// minor * z, which must not be scaled again.
THRONG_HD inline Expansion<64> product(const Expansion<16>& minor, TwoTerms z) noexcept {
  return merged(scaled(minor, z.low), scaled(minor, z.high));
}

// By expansions. Needs coordinates in their range. Exact differences, as of most floats, leave 24
// terms at most.
THRONG_HD inline int orient2d_expansion_sign(double ax, double ay, double bx, double by, double cx,
                                             double cy) noexcept {
  return minor_of(two_difference(bx, ax), two_difference(by, ay), two_difference(cx, ax),
                  two_difference(cy, ay))
      .sign();
}
THRONG_HD inline int orient3d_expansion_sign(const DoubleVec3& a, const DoubleVec3& b,
                                             const DoubleVec3& c, const DoubleVec3& d) noexcept {
  const TwoTerms x1 = two_difference(b.x, a.x), y1 = two_difference(b.y, a.y);
  const TwoTerms x2 = two_difference(c.x, a.x), y2 = two_difference(c.y, a.y);
  const TwoTerms x3 = two_difference(d.x, a.x), y3 = two_difference(d.y, a.y);
  const Expansion<64> t1 = product(minor_of(x2, y2, x3, y3), two_difference(b.z, a.z));
  const Expansion<64> t2 = product(minor_of(x3, y3, x1, y1), two_difference(c.z, a.z));
  const Expansion<64> t3 = product(minor_of(x1, y1, x2, y2), two_difference(d.z, a.z));
  return merged(merged(t1, t2), t3).sign();
}

// The sign after the filter was uncertain; right for any finite coordinates.
THRONG_HD inline int orient2d_exact_sign(double ax, double ay, double bx, double by, double cx,
                                         double cy) noexcept {
#if defined(__CUDA_ARCH__)
  return orient2d_integer_sign(ax, ay, bx, by, cx, cy);
#else
  const bool in_range = is_in_expansion_range(ax) && is_in_expansion_range(ay) &&
                        is_in_expansion_range(bx) && is_in_expansion_range(by) &&
                        is_in_expansion_range(cx) && is_in_expansion_range(cy);
  return in_range ? orient2d_expansion_sign(ax, ay, bx, by, cx, cy)
                  : orient2d_integer_sign(ax, ay, bx, by, cx, cy);
#endif
}
THRONG_HD inline int orient3d_exact_sign(const DoubleVec3& a, const DoubleVec3& b,
                                         const DoubleVec3& c, const DoubleVec3& d) noexcept {
#if defined(__CUDA_ARCH__)
  return orient3d_integer_sign(a, b, c, d);
#else
  const bool in_range = is_in_expansion_range(a) && is_in_expansion_range(b) &&
                        is_in_expansion_range(c) && is_in_expansion_range(d);
  return in_range ? orient3d_expansion_sign(a, b, c, d) : orient3d_integer_sign(a, b, c, d);
#endif
}

// -1, 0 or 1: the sign of (bx - ax)(cy - ay) - (by - ay)(cx - ax). Positive if a, b, c turn left.
THRONG_HD THRONG_OUTLINE inline int orient2d_sign(double ax, double ay, double bx, double by,
                                                  double cx, double cy) noexcept {
  const int sign = orient2d_filter(ax, ay, bx, by, cx, cy);
  if (sign != uncertain) [[likely]]
    return sign;
  return orient2d_exact_sign(ax, ay, bx, by, cx, cy);
}

// -1, 0 or 1: the sign of ((b - a) x (c - a)) . (d - a). Positive if d is on the side of the
// triangle a, b, c to which its normal points.
THRONG_HD THRONG_OUTLINE inline int orient3d_sign(const DoubleVec3& a, const DoubleVec3& b,
                                                  const DoubleVec3& c,
                                                  const DoubleVec3& d) noexcept {
  const int sign = orient3d_filter(a, b, c, d);
  if (sign != uncertain) [[likely]]
    return sign;
  return orient3d_exact_sign(a, b, c, d);
}

}  // namespace throng::mesh
