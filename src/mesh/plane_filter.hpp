// The floating-point filters of the intersection tests: signs that are certain, or unknown.
//
// Real is float or double, with precision u = 2^-24 or 2^-53. The filters are used if all
// coordinates have type Real and are at most Bounds<Real>::largest in magnitude. Then nothing
// overflows. Differences and sums have a relative error of at most u and never underflow with an
// error. Products have one of at most u, or an absolute error of at most h, half the smallest
// denormal: 2^-150 or 2^-1075. Flushing of denormals is off.
//
// A side of a plane, of degree 3. For a plane through q, r and s and a point x let
//   n = (r - q) x (s - q),  m = the same with the sums of magnitudes |u v| + |u' v'|,
//   value = n . (x - q),    magnitude = m . |x - q|.
// Without underflow, following the operations, each of the six triple products passes a chain of 3
// differences, 1 + 1 products and 1 + 2 sums: value is off by at most (8u + O(u^2)) times the exact
// sum of magnitudes, and `magnitude` is at least (1 - 8u) of that sum. So if |value| > 9u
// magnitude, value has the sign of the exact determinant. Underflow: an error of h in a product of
// n is multiplied by a difference of at most 2 largest; there are six in n and three in value.
// Together they are below 16 largest h, which Bounds::triple exceeds.
//
// Products of two differences. E, A and so on are the largest magnitudes of the components of
// computed differences e and a.
// - e_y a_z - e_z a_y: each product passes two differences and a product, both one difference. The
//   error is at most 2 E A 3u + u 2 E A = 8u E A + O(u^2). 9u E A bounds it.
// - w . e for any numbers w: the products pass one difference, a product and two sums. The error is
//   at most 4u 3 W E = 12u W E + O(u^2). 13u W E bounds it, and 27u W E bounds the error of the
//   difference of two.
// Underflow adds at most 6h, which Bounds::product exceeds.
//
// Determinants of floats that are not 0 may be smaller than Bounds<float>::triple; filters of
// floats decide nothing there. A filter of doubles decides them: they are multiples of 2^-447.

#pragma once

#include <cmath>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "mesh/triangle_pair.hpp"

namespace throng::mesh {

template <class Real>
struct Bounds;
template <>
struct Bounds<float> {
  static constexpr float unit = 0x1p-24f, largest = 0x1p36f, triple = 0x1p-109f,
                         product = 0x1p-146f;
};
template <>
struct Bounds<double> {
  static constexpr double unit = 0x1p-53, largest = 0x1p300, triple = 0x1p-760, product = 0x1p-1070;
};
// Factors of the unit; see above.
constexpr int side_error = 9, cross_error = 9, dot_error = 13, two_dots_error = 27;

THRONG_HD inline DoubleVec3 minus(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
THRONG_HD inline DoubleVec3 plus(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
THRONG_HD inline double dot(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
THRONG_HD inline DoubleVec3 cross(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
THRONG_HD inline double larger(double a, double b) noexcept { return a > b ? a : b; }
THRONG_HD inline double smaller(double a, double b) noexcept { return a < b ? a : b; }
THRONG_HD inline double largest_magnitude(const DoubleVec3& a) noexcept {
  return larger(larger(std::fabs(a.x), std::fabs(a.y)), std::fabs(a.z));
}

// With a largest magnitude of one; not a number if all are 0.
THRONG_HD inline DoubleVec3 scaled_to_one(const DoubleVec3& a) noexcept {
  const double largest = largest_magnitude(a);
  return {a.x / largest, a.y / largest, a.z / largest};
}

// ---- what most candidates of a mesh take: neighbours, and triangles near one another ------------
//
// Each function returns true only if the triangles have no common point but the vertices that they
// share. Coplanar triangles are decided, too.

// Triangles (p, q, a) and (p, q, b); e, u, v: q - p, a - p, b - p. They are apart if along one axis
// their projections lie on opposite sides of the edge: a point of a triangle that is projected onto
// the line of the edge lies on the edge.
THRONG_HD inline bool apart_at_edge(const DoubleVec3& e, const DoubleVec3& u,
                                    const DoubleVec3& v) noexcept {
  using B = Bounds<double>;
  const double bound =
      cross_error * B::unit *
          (largest_magnitude(e) * larger(largest_magnitude(u), largest_magnitude(v))) +
      B::product;
  const auto opposite = [bound](double n, double m) {
    return ((n > bound) & (m > bound)) | ((n < -bound) & (m < -bound));
  };
  const DoubleVec3 n = cross(e, u), m = cross(v, e);
  return opposite(n.x, m.x) | opposite(n.y, m.y) | opposite(n.z, m.z);
}

// Triangles (p, a1, a2) and (p, b1, b2); u1, u2, v1, v2: the others relative to p. They are apart
// if a plane through p, with any normal w, has the first on its one side and the second on the
// other. One is tried first, across the line through both centers.
THRONG_HD inline bool apart_at_vertex(const DoubleVec3& u1, const DoubleVec3& u2,
                                      const DoubleVec3& v1, const DoubleVec3& v2,
                                      const DoubleVec3& w) noexcept {
  using B = Bounds<double>;
  const double most = larger(larger(largest_magnitude(u1), largest_magnitude(u2)),
                             larger(largest_magnitude(v1), largest_magnitude(v2)));
  const double bound = dot_error * B::unit * (largest_magnitude(w) * most) + B::product;
  const double a1 = dot(w, u1), a2 = dot(w, u2), b1 = dot(w, v1), b2 = dot(w, v2);
  return (a1 > bound) & (a2 > bound) & (b1 < -bound) & (b2 < -bound);
}
THRONG_HD inline bool apart_at_vertex(const DoubleVec3& u1, const DoubleVec3& u2,
                                      const DoubleVec3& v1, const DoubleVec3& v2) noexcept {
  return apart_at_vertex(u1, u2, v1, v2, minus(plus(u1, u2), plus(v1, v2)));
}

// Triangles (p, a1, a2) and (b0, b1, b2); u1, u2, v0, v1, v2: the others relative to p. The same
// with any plane of normal w, first across the line through both centers.
THRONG_HD inline bool apart_across(const DoubleVec3& u1, const DoubleVec3& u2, const DoubleVec3& v0,
                                   const DoubleVec3& v1, const DoubleVec3& v2,
                                   const DoubleVec3& w) noexcept {
  using B = Bounds<double>;
  const double most =
      larger(larger(largest_magnitude(u1), largest_magnitude(u2)),
             larger(larger(largest_magnitude(v0), largest_magnitude(v1)), largest_magnitude(v2)));
  const double bound = two_dots_error * B::unit * (largest_magnitude(w) * most) + B::product;
  const double least_a = smaller(smaller(dot(w, u1), dot(w, u2)), 0.0);
  const double most_b = larger(larger(dot(w, v0), dot(w, v1)), dot(w, v2));
  return least_a - most_b > bound;
}
THRONG_HD inline bool apart_across(const DoubleVec3& u1, const DoubleVec3& u2, const DoubleVec3& v0,
                                   const DoubleVec3& v1, const DoubleVec3& v2) noexcept {
  return apart_across(u1, u2, v0, v1, v2, minus(plus(u1, u2), plus(plus(v0, v1), v2)));
}

// ---- signs of determinants ----------------------------------------------------------------------

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
    const double bound = side_error * Bounds<double>::unit * magnitude + Bounds<double>::triple;
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

// As apart_at_vertex(), for triangles that are nearly or exactly in one plane, by six normals. The
// normals of all planes that part two such triangles are an open cone. It lies between two of these
// four directions: in the plane of a triangle, across an edge at p, towards the first triangle or
// away from the second. So the sum of these two is in the cone.
THRONG_HD inline bool apart_in_plane(const DoubleVec3& u1, const DoubleVec3& u2,
                                     const DoubleVec3& v1, const DoubleVec3& v2) noexcept {
  const DoubleVec3 n = cross(u1, u2), m = cross(v1, v2);
  const DoubleVec3 across[4] = {scaled_to_one(cross(n, u1)), scaled_to_one(cross(u2, n)),
                                scaled_to_one(cross(v1, m)), scaled_to_one(cross(m, v2))};
  for (int i = 0; i < 3; ++i)
    for (int k = i + 1; k < 4; ++k)
      if (apart_at_vertex(u1, u2, v1, v2, plus(across[i], across[k]))) return true;
  return false;
}

// The same for triangles without a common vertex. Those in one plane are apart if and only if the
// line of an edge parts them, so three normals are tried: in the plane of a, across an edge,
// towards the third vertex.
THRONG_HD inline bool apart_in_plane(const DoubleVec3 (&a)[3], const DoubleVec3 (&b)[3]) noexcept {
  const DoubleVec3 u1 = minus(a[1], a[0]), u2 = minus(a[2], a[0]), e = minus(a[2], a[1]);
  const DoubleVec3 v0 = minus(b[0], a[0]), v1 = minus(b[1], a[0]), v2 = minus(b[2], a[0]);
  const DoubleVec3 n = cross(u1, u2);
  return apart_across(u1, u2, v0, v1, v2, scaled_to_one(cross(n, u1))) ||
         apart_across(u1, u2, v0, v1, v2, scaled_to_one(cross(u2, n))) ||
         apart_across(u1, u2, v0, v1, v2, scaled_to_one(cross(n, e)));
}

// The three cases of fast decisions. Any sign that is 0 may be uncertain; the exact test then
// decides.

// Triangles (p, q, a) and (p, q, b): unless all points are coplanar, they meet in the edge alone.
THRONG_HD inline Decision decide_beyond_edge(const DoubleVec3& p, const DoubleVec3& q,
                                             const DoubleVec3& a, const DoubleVec3& b) noexcept {
  const DoubleVec3 e = minus(q, p), u = minus(a, p), v = minus(b, p);
  if (apart_at_edge(e, u, v)) return Decision::no;
  return PlaneFilter(e, u).side(v) != 0 ? Decision::no : Decision::unsure;
}

// From the sides of a1 and a2 at the plane of b and of b1 and b2 at that of a: see
// meet_beyond_vertex().
THRONG_HD inline Decision decide_by_sides(int a1, int a2, int b1, int b2) noexcept {
  if (a1 * a2 > 0 || b1 * b2 > 0) return Decision::no;
  if (a1 * a2 * b1 * b2 == 0) return Decision::unsure;
  return a1 != b1 ? Decision::yes : Decision::no;
}

// Whether vertices of different indices are one point other than p.
THRONG_HD inline bool meet_at_vertex(const DoubleVec3& a, const DoubleVec3& b,
                                     const DoubleVec3& p) noexcept {
  return same_point(a, b) && !same_point(a, p);
}

// Triangles (p, a1, a2) and (p, b1, b2).
THRONG_HD inline Decision decide_beyond_vertex(const DoubleVec3& p, const DoubleVec3& a1,
                                               const DoubleVec3& a2, const DoubleVec3& b1,
                                               const DoubleVec3& b2) noexcept {
  const DoubleVec3 u1 = minus(a1, p), u2 = minus(a2, p), v1 = minus(b1, p), v2 = minus(b2, p);
  if (apart_at_vertex(u1, u2, v1, v2)) return Decision::no;
  const PlaneFilter a(u1, u2), b(v1, v2);
  const Decision decision = decide_by_sides(b.side(u1), b.side(u2), a.side(v1), a.side(v2));
  if (decision != Decision::unsure) return decision;
  if (meet_at_vertex(a1, b1, p) || meet_at_vertex(a1, b2, p) || meet_at_vertex(a2, b1, p) ||
      meet_at_vertex(a2, b2, p))
    return Decision::yes;
  return apart_in_plane(u1, u2, v1, v2) ? Decision::no : Decision::unsure;
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
  // Exchanging two vertices of a triangle exchanges the sides of its plane. The lone vertex is on
  // the negative side if the sum is positive.
  if (of_a[0] + of_a[1] + of_a[2] > 0) {
    const int swapped = order.b[1];
    order.b[1] = order.b[2];
    order.b[2] = swapped;
  }
  if (of_b[0] + of_b[1] + of_b[2] > 0) {
    const int swapped = order.a[1];
    order.a[1] = order.a[2];
    order.a[2] = swapped;
  }
  return order;
}

// p[i] by selections: a device has no indexed registers.
THRONG_HD inline DoubleVec3 point_at(const DoubleVec3 (&p)[3], int i) noexcept {
  const auto select = [i](double x, double y, double z) { return i == 0 ? x : (i == 1 ? y : z); };
  return {select(p[0].x, p[1].x, p[2].x), select(p[0].y, p[1].y, p[2].y),
          select(p[0].z, p[1].z, p[2].z)};
}

// Triangles without a common vertex. If each has vertices strictly on both sides of the other's
// plane, each meets the line common to both planes in an interval, and two signs say whether the
// intervals overlap.
THRONG_HD inline Decision decide_meeting(const DoubleVec3 (&a)[3],
                                         const DoubleVec3 (&b)[3]) noexcept {
  if (apart_across(minus(a[1], a[0]), minus(a[2], a[0]), minus(b[0], a[0]), minus(b[1], a[0]),
                   minus(b[2], a[0])))
    return Decision::no;
  const PlaneFilter plane_b(minus(b[1], b[0]), minus(b[2], b[0]));
  int of_a[3], of_b[3];
  for (int i = 0; i < 3; ++i) of_a[i] = plane_b.side(minus(a[i], b[0]));
  if (of_a[0] != 0 && of_a[0] == of_a[1] && of_a[0] == of_a[2]) return Decision::no;
  const PlaneFilter plane_a(minus(a[1], a[0]), minus(a[2], a[0]));
  for (int i = 0; i < 3; ++i) of_b[i] = plane_a.side(minus(b[i], a[0]));
  if (of_b[0] != 0 && of_b[0] == of_b[1] && of_b[0] == of_b[2]) return Decision::no;
  if (of_a[0] * of_a[1] * of_a[2] * of_b[0] * of_b[1] * of_b[2] == 0) {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        if (same_point(a[i], b[k])) return Decision::yes;
    return apart_in_plane(a, b) || apart_in_plane(b, a) ? Decision::no : Decision::unsure;
  }
  const CrossingOrder order = crossing_order(of_a, of_b);
  const DoubleVec3 a0 = point_at(a, order.a[0]), b0 = point_at(b, order.b[0]);
  const DoubleVec3 to_b0 = minus(b0, a0);
  const int first = PlaneFilter(minus(point_at(a, order.a[1]), a0), to_b0)
                        .side(minus(point_at(b, order.b[1]), a0));
  if (first > 0) return Decision::no;
  const int second =
      PlaneFilter(minus(point_at(a, order.a[2]), a0), minus(point_at(b, order.b[2]), a0))
          .side(to_b0);
  if (second > 0) return Decision::no;
  return first * second == 0 ? Decision::unsure : Decision::yes;
}

}  // namespace throng::mesh
