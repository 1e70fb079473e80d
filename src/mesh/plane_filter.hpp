// The floating-point filter of the intersection tests: the side of a plane, or uncertain.
//
// For a plane through q, r and s and a point x let
//   n = (r - q) x (s - q),  m = the same with the sums of magnitudes |u v| + |u' v'|,
//   value = n . (x - q),    magnitude = m . |x - q|.
// Let u = 2^-53. Differences, products and sums each have a relative error of at most u, except for
// underflow, as nothing overflows (below). Following the operations, each of the six triple
// products passes a chain of 3 differences, 1 + 1 products and 1 + 2 sums: value is off by at most
// (8u + O(u^2)) times the exact sum of magnitudes, and `magnitude` is at least (1 - 8u) of that
// sum. So if |value| > 9u magnitude, value has the sign of the exact determinant.
//
// The filter is used if all coordinates are at most 2^300 in magnitude. Then nothing overflows. A
// product that underflows has an absolute error of at most 2^-1074. Such an error of a component of
// n is multiplied by a difference of at most 2^301; there are six in n and three in value, so
// together they are below 2^-768. underflow_bound is added for them. Differences and sums never
// underflow with an error. Coordinates that are floats are multiples of 2^-149, so a determinant
// that is not 0 is at least 2^-447 in magnitude: the bound decides nothing there.
#pragma once

#include <cmath>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

constexpr double relative_bound = 9 * 0x1p-53;
constexpr double underflow_bound = 0x1p-760;
constexpr double largest_filtered = 0x1p300;

THRONG_HD inline DoubleVec3 minus(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

// A plane through a point of origin, spanned by two vectors from there.
class PlaneFilter {
 public:
  THRONG_HD PlaneFilter(const DoubleVec3& u, const DoubleVec3& v) noexcept
      : PlaneFilter(Products{u.y * v.z, u.z * v.x, u.x * v.y},
                    Products{u.z * v.y, u.x * v.z, u.y * v.x}) {}
  // 1 or -1: the side of x, a vector from the origin. 0: uncertain.
  THRONG_HD int side(const DoubleVec3& x) const noexcept {
    const double value = (normal_.x * x.x + normal_.y * x.y) + normal_.z * x.z;
    const double magnitude = (magnitude_.x * std::fabs(x.x) + magnitude_.y * std::fabs(x.y)) +
                             magnitude_.z * std::fabs(x.z);
    const double bound = relative_bound * magnitude + underflow_bound;
    return (value > bound) - (value < -bound);
  }

 private:
  struct Products {
    double x, y, z;
  };
  THRONG_HD PlaneFilter(const Products& a, const Products& b) noexcept
      : normal_{a.x - b.x, a.y - b.y, a.z - b.z},
        magnitude_{std::fabs(a.x) + std::fabs(b.x), std::fabs(a.y) + std::fabs(b.y),
                   std::fabs(a.z) + std::fabs(b.z)} {}

  DoubleVec3 normal_, magnitude_;
};

enum class Decision : signed char { no, yes, unsure };

// The three cases of fast decisions. Any sign that is 0 may be uncertain; the exact test then
// decides.

// Triangles (p, q, a) and (p, q, b): unless all points are coplanar, they meet in the edge alone.
THRONG_HD inline Decision decide_beyond_edge(const DoubleVec3& p, const DoubleVec3& q,
                                             const DoubleVec3& a, const DoubleVec3& b) noexcept {
  const PlaneFilter plane(minus(q, p), minus(a, p));
  return plane.side(minus(b, p)) != 0 ? Decision::no : Decision::unsure;
}

// From the sides of a1 and a2 at the plane of b and of b1 and b2 at that of a: see
// meet_beyond_vertex().
THRONG_HD inline Decision decide_by_sides(int a1, int a2, int b1, int b2) noexcept {
  if (a1 * a2 > 0 || b1 * b2 > 0) return Decision::no;
  if (a1 * a2 * b1 * b2 == 0) return Decision::unsure;
  return a1 != b1 ? Decision::yes : Decision::no;
}

// Triangles (p, a1, a2) and (p, b1, b2).
THRONG_HD inline Decision decide_beyond_vertex(const DoubleVec3& p, const DoubleVec3& a1,
                                               const DoubleVec3& a2, const DoubleVec3& b1,
                                               const DoubleVec3& b2) noexcept {
  const DoubleVec3 u1 = minus(a1, p), u2 = minus(a2, p), v1 = minus(b1, p), v2 = minus(b2, p);
  const PlaneFilter a(u1, u2), b(v1, v2);
  return decide_by_sides(b.side(u1), b.side(u2), a.side(v1), a.side(v2));
}

// The vertex that lies alone on its side of a plane, given three sides that are 1 or -1 and not all
// equal.
THRONG_HD inline int lone_vertex(int side0, int side1, int side2) noexcept {
  return side1 == side2 ? 0 : (side0 == side2 ? 1 : 2);
}

// The order of a pair's vertices for the last step: in both triangles the first one is alone on the
// positive side of the other's plane (Guigue and Devillers, 2003). `a`, `b`: positions of vertices.
struct CrossingOrder {
  int a[3], b[3];
};
THRONG_HD inline CrossingOrder crossing_order(const int (&of_a)[3], const int (&of_b)[3]) noexcept {
  const int i = lone_vertex(of_a[0], of_a[1], of_a[2]);
  const int k = lone_vertex(of_b[0], of_b[1], of_b[2]);
  CrossingOrder order = {{i, (i + 1) % 3, (i + 2) % 3}, {k, (k + 1) % 3, (k + 2) % 3}};
  // Exchanging two vertices of a triangle exchanges the sides of its plane.
  if (of_a[i] < 0) {
    const int swapped = order.b[1];
    order.b[1] = order.b[2];
    order.b[2] = swapped;
  }
  if (of_b[k] < 0) {
    const int swapped = order.a[1];
    order.a[1] = order.a[2];
    order.a[2] = swapped;
  }
  return order;
}

// Triangles without a common vertex. If each has vertices strictly on both sides of the other's
// plane, each meets the line common to both planes in an interval, and two signs say whether the
// intervals overlap.
THRONG_HD inline Decision decide_meeting(const DoubleVec3 (&a)[3],
                                         const DoubleVec3 (&b)[3]) noexcept {
  const PlaneFilter plane_b(minus(b[1], b[0]), minus(b[2], b[0]));
  int of_a[3], of_b[3];
  for (int i = 0; i < 3; ++i) of_a[i] = plane_b.side(minus(a[i], b[0]));
  if (of_a[0] != 0 && of_a[0] == of_a[1] && of_a[0] == of_a[2]) return Decision::no;
  const PlaneFilter plane_a(minus(a[1], a[0]), minus(a[2], a[0]));
  for (int i = 0; i < 3; ++i) of_b[i] = plane_a.side(minus(b[i], a[0]));
  if (of_b[0] != 0 && of_b[0] == of_b[1] && of_b[0] == of_b[2]) return Decision::no;
  if (of_a[0] * of_a[1] * of_a[2] * of_b[0] * of_b[1] * of_b[2] == 0) return Decision::unsure;
  const CrossingOrder order = crossing_order(of_a, of_b);
  const DoubleVec3 &a0 = a[order.a[0]], &b0 = b[order.b[0]];
  const DoubleVec3 to_b0 = minus(b0, a0);
  const int first = PlaneFilter(minus(a[order.a[1]], a0), to_b0).side(minus(b[order.b[1]], a0));
  if (first > 0) return Decision::no;
  const int second = PlaneFilter(minus(a[order.a[2]], a0), minus(b[order.b[2]], a0)).side(to_b0);
  if (second > 0) return Decision::no;
  return first * second == 0 ? Decision::unsure : Decision::yes;
}

}  // namespace throng::mesh
