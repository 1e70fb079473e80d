// Whether two closed triangles are within a distance.
//
// Two certificates decide, and neither depends on how it was found:
//   near: a point of each triangle, at most `distance` apart;
//   far:  a direction in which a gap wider than `distance` separates the triangles.
// The search tries the closest points of the nine pairs of edges, those of a vertex and a face, and
// the normals. For disjoint triangles one of them has the smallest distance, and the direction
// between its points separates the triangles.
//
// It runs in doubles first. If no certificate holds, it runs again in DoubleDouble, and then
// triangles_within_exact decides by integers. Triangles that intersect are recognised exactly.
//
// Scale. Points are relative to a.p[0] and multiplied by a power of two, so that the largest
// magnitude of a coordinate is in [1, 2); `distance` is multiplied by the same. It must be in
// 2^-500 .. 2^500 before; otherwise the exact decision is used. A scaled distance of 8 or more is
// above 2 * 2 sqrt(3), so above that of any two points of the triangles. A scaled distance below
// 2^-200 is only used for far certificates, as 2^-200. Nothing overflows, and what underflows is
// below 2^-1000.
//
// Errors. Let e be the relative error of an operation: 2^-53 for double, double_double_error for
// DoubleDouble. Coordinates w of vertices err by 2 e. For any s and t in [0, 1]:
//   a point p + s (p' - p) of an edge errs by (4 + 4 + 2 + 2) e per coordinate: difference,
//     product, sum, vertices;
//   a point o + s (p - o) + t (q - o) of a face with s + t <= 1 by 20 e: differences 4, products
//     4, sums 6, vertices 2, and 4 as s + t may be rounded;
//   the difference V of two such points by 4 e more. That is at most 28 e per coordinate, at most
//     64 e in length, terms in e^2 included.
// So |V| + 64 e is an upper bound of the distance. |V|^2 is compared with a factor of 1 - 2^-48,
// which covers the rounding of |V|^2, of the limit's square, and underflow.
//
// For any direction V let |V|_1 be the sum of the magnitudes of its coordinates. V . w takes part
// in four roundings, that of w included, and |w| <= 2, so it errs by 8 e |V|_1. The difference of
// two such errs by 4 e |V|_1 more. So a gap g between the projections proves a distance of at least
// (g - 32 e |V|_1) / |V|; the rest covers terms in e^2 and underflow, as |V|_1 >= 2^-300.
//
// The limit for near is distance (1 + 9 * 10^-13), which leaves 10^-13 for its rounding.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "mesh/double_double.hpp"
#include "mesh/orient.hpp"
#include "mesh/triangle_pair.hpp"

namespace throng::mesh {

namespace distance_internal {

template <class Real>
constexpr double error_of = 0x1p-53;
template <>
inline constexpr double error_of<DoubleDouble> = double_double_error;

template <class Real>
struct Vector {
  Real x, y, z;
};

template <class Real>
THRONG_HD inline Vector<Real> operator-(const Vector<Real>& a, const Vector<Real>& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
THRONG_HD inline Vector<Real> operator+(const Vector<Real>& a, const Vector<Real>& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
THRONG_HD inline Vector<Real> operator*(const Real& s, const Vector<Real>& a) noexcept {
  return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
THRONG_HD inline Real dot(const Vector<Real>& a, const Vector<Real>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
THRONG_HD inline Vector<Real> cross(const Vector<Real>& a, const Vector<Real>& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// NaN becomes 0.
template <class Real>
THRONG_HD inline Real clamped(Real x) noexcept {
  return x > Real(0.0) ? (x < Real(1.0) ? x : Real(1.0)) : Real(0.0);
}
template <class Real>
THRONG_HD inline Real smaller(Real a, Real b) noexcept {
  return b < a ? b : a;
}
template <class Real>
THRONG_HD inline Real larger(Real a, Real b) noexcept {
  return a < b ? b : a;
}

THRONG_HD inline double largest(const Vector<double>& a) noexcept {
  return larger(std::fabs(a.x), larger(std::fabs(a.y), std::fabs(a.z)));
}

// The scaled problem.
template <class Real>
struct Search {
  Vector<Real> a[3], b[3];
  double near_square;  // |V|^2 up to this: near; negative: never
  double far_square;   // (g - error)^2 above this times |V|^2: far

  // Needs a scaled `distance` below 8.
  THRONG_HD void set_distance(double distance) noexcept {
    const double limit = distance * (1 + 9e-13) - 64 * error_of<Real>;
    near_square =
        distance >= 0x1p-200 && limit >= 0.5 * distance ? limit * limit * (1 - 0x1p-48) : -1;
    const double far_distance = larger(distance, 0x1p-200);
    far_square = far_distance * far_distance * (1 + 0x1p-48);
  }

  THRONG_HD bool is_near(const Vector<Real>& v) const noexcept {
    return rounded(dot(v, v)) <= near_square;
  }

  // Whether the gap from the first projection to the second one is a far certificate.
  THRONG_HD bool is_far(Real gap, const Vector<Real>& v) const noexcept {
    const double length =
        std::fabs(rounded(v.x)) + std::fabs(rounded(v.y)) + std::fabs(rounded(v.z));
    const double bound = rounded(gap) - 32 * error_of<Real> * length;
    return length >= 0x1p-300 && bound > 0 && bound * bound > far_square * rounded(dot(v, v));
  }
  // For V from a to b.
  THRONG_HD bool separates(const Vector<Real>& v) const noexcept {
    const Real end = larger(dot(v, a[0]), larger(dot(v, a[1]), dot(v, a[2])));
    const Real begin = smaller(dot(v, b[0]), smaller(dot(v, b[1]), dot(v, b[2])));
    return is_far(begin - end, v);
  }

  // The plane of triangle p against triangle q: 1: near, 0: far, else `uncertain`. `straddles`: q
  // has vertices on both sides.
  THRONG_HD int compare_face(const Vector<Real> (&p)[3], const Vector<Real> (&q)[3],
                             bool& straddles) const noexcept {
    const Vector<Real> e1 = p[1] - p[0], e2 = p[2] - p[0], n = cross(e1, e2);
    Real height[3], above_of_p, below_of_p;
    above_of_p = below_of_p = dot(n, p[0]);
    for (int i = 1; i < 3; ++i) {
      const Real x = dot(n, p[i]);
      above_of_p = larger(above_of_p, x);
      below_of_p = smaller(below_of_p, x);
    }
    for (int i = 0; i < 3; ++i) height[i] = dot(n, q[i]);
    const Real lowest = smaller(height[0], smaller(height[1], height[2]));
    const Real highest = larger(height[0], larger(height[1], height[2]));
    if (is_far(lowest - above_of_p, n) || is_far(below_of_p - highest, n)) return 0;
    const bool is_above = lowest > below_of_p, is_below = highest < above_of_p;
    straddles = !is_above && !is_below;
    if (straddles) return uncertain;
    // The vertex next to the plane, and the point of the face below it.
    const Real nearest = is_above ? lowest : highest;
    const int k = !(nearest < height[0]) && !(height[0] < nearest)   ? 0
                  : !(nearest < height[1]) && !(height[1] < nearest) ? 1
                                                                     : 2;
    const Vector<Real> w = q[k] - p[0];
    const Real inverse = Real(1.0) / dot(n, n);
    const Real s = dot(cross(w, e2), n) * inverse, t = dot(cross(e1, w), n) * inverse;
    if (!(s > Real(0.0) && t > Real(0.0) && s + t < Real(1.0))) return uncertain;
    return is_near(q[k] - (p[0] + (s * e1 + t * e2))) ? 1 : uncertain;
  }

  THRONG_HD int compare_edges() const noexcept {
    Vector<Real> u[3], v[3];
    Real uu[3], vv[3], inverse_uu[3], inverse_vv[3];
    for (int i = 0; i < 3; ++i) {
      const int next = i == 2 ? 0 : i + 1;
      u[i] = a[next] - a[i];
      v[i] = b[next] - b[i];
      uu[i] = dot(u[i], u[i]);
      vv[i] = dot(v[i], v[i]);
      inverse_uu[i] = Real(1.0) / uu[i];
      inverse_vv[i] = Real(1.0) / vv[i];
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Vector<Real> r = b[j] - a[i];
        const Real uv = dot(u[i], v[j]), ur = dot(u[i], r), vr = dot(v[j], r);
        // The closest points of the lines, and then of the segments (Ericson, "Real-Time Collision
        // Detection", 5.1.9). A segment of length 0 gives NaN, so 0.
        Real s = clamped((ur * vv[j] - vr * uv) / (uu[i] * vv[j] - uv * uv));
        Real t = (s * uv - vr) * inverse_vv[j];
        if (!(t > Real(0.0) && t < Real(1.0))) {
          const bool at_end = t > Real(0.0);
          t = Real(at_end ? 1.0 : 0.0);
          s = clamped((at_end ? ur + uv : ur) * inverse_uu[i]);
        }
        const Vector<Real> between = (b[j] + t * v[j]) - (a[i] + s * u[i]);
        if (is_near(between)) return 1;
        // All six vertices only if the two others do not refute it.
        const int k = i == 0 ? 2 : i - 1, l = j == 0 ? 2 : j - 1;
        if (dot(between, b[l] - a[k]) > Real(0.0) && separates(between)) return 0;
      }
    }
    return uncertain;
  }

  // After compare_edges was uncertain: the common normals of two edges, which differ from the
  // direction between close points by less if these are very close.
  THRONG_HD bool is_far_by_normals() const noexcept {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Vector<Real> n = cross(a[i == 2 ? 0 : i + 1] - a[i], b[j == 2 ? 0 : j + 1] - b[j]);
        if (separates(n) || separates(Vector<Real>{-n.x, -n.y, -n.z})) return true;
      }
    }
    return false;
  }
};

THRONG_HD inline void scale_point(const DoubleVec3& p, const DoubleVec3& origin, double scale,
                                  Vector<DoubleDouble>& out) noexcept {
  const TwoTerms x = two_difference(p.x, origin.x), y = two_difference(p.y, origin.y),
                 z = two_difference(p.z, origin.z);
  out = {TwoTerms{x.high * scale, x.low * scale}, TwoTerms{y.high * scale, y.low * scale},
         TwoTerms{z.high * scale, z.low * scale}};
}

// The second attempt, of the pairs that doubles cannot decide.
THRONG_HD THRONG_OUTLINE inline int compare_in_double_double(const TrianglePoints& a,
                                                             const TrianglePoints& b, double scale,
                                                             double distance) noexcept {
  Search<DoubleDouble> search;
  for (int i = 0; i < 3; ++i) {
    scale_point(a.p[i], a.p[0], scale, search.a[i]);
    scale_point(b.p[i], a.p[0], scale, search.b[i]);
  }
  search.set_distance(distance);
  bool straddles = false;
  int result = search.compare_face(search.a, search.b, straddles);
  if (result == uncertain) result = search.compare_face(search.b, search.a, straddles);
  if (result == uncertain) result = search.compare_edges();
  if (result == uncertain && search.is_far_by_normals()) result = 0;
  return result;
}

THRONG_HD inline bool boxes_are_apart(double a0, double a1, double a2, double b0, double b1,
                                      double b2, double distance) noexcept {
  const double a_lower = smaller(a0, smaller(a1, a2)), a_upper = larger(a0, larger(a1, a2));
  const double b_lower = smaller(b0, smaller(b1, b2)), b_upper = larger(b0, larger(b1, b2));
  // Rounding is monotonic, so a rounded difference is above a double only if the exact one is.
  return (b_lower - a_upper > distance) | (a_lower - b_upper > distance);
}

}  // namespace distance_internal

// 1: the closed triangles are at most `distance` (1 + 10^-12) apart. 0: they are more than
// `distance` apart. Else `uncertain`: triangles_within_exact decides. Coordinates are finite,
// `distance` is finite and >= 0; 0 gives 1 for triangles that have a common point and 0 for others.
// `uncertain` needs a difference between `distance` and the distance of the triangles of some
// 2^-100 of their size, or coordinates relative to a.p[0] outside of 2^-500 .. 2^500.
THRONG_HD inline int triangles_within_filter(const TrianglePoints& a, const TrianglePoints& b,
                                             double distance) noexcept {
  using namespace distance_internal;
  if (boxes_are_apart(a.p[0].x, a.p[1].x, a.p[2].x, b.p[0].x, b.p[1].x, b.p[2].x, distance) ||
      boxes_are_apart(a.p[0].y, a.p[1].y, a.p[2].y, b.p[0].y, b.p[1].y, b.p[2].y, distance) ||
      boxes_are_apart(a.p[0].z, a.p[1].z, a.p[2].z, b.p[0].z, b.p[1].z, b.p[2].z, distance))
    return 0;
  if (distance == 0) return triangles_meet(a, b) ? 1 : 0;

  Search<double> search;
  double size = 0;
  for (int i = 0; i < 3; ++i) {
    const DoubleVec3 &o = a.p[0], &p = a.p[i], &q = b.p[i];
    search.a[i] = {p.x - o.x, p.y - o.y, p.z - o.z};
    search.b[i] = {q.x - o.x, q.y - o.y, q.z - o.z};
    size = larger(size, larger(largest(search.a[i]), largest(search.b[i])));
  }
  if (!(size >= 0x1p-500 && size <= 0x1p500)) {
    return size == 0 || triangles_meet(a, b) ? 1 : uncertain;
  }
  // 2^-k for size in 2^k .. 2^(k+1): the exponent's field is 1023 + k.
  const std::uint64_t exponent = std::bit_cast<std::uint64_t>(size) >> 52;
  const double scale = std::bit_cast<double>((2046 - exponent) << 52);
  const double scaled_distance = distance * scale;
  if (scaled_distance >= 8) return 1;
  for (int i = 0; i < 3; ++i) {
    search.a[i] = scale * search.a[i];
    search.b[i] = scale * search.b[i];
  }
  search.set_distance(scaled_distance);

  bool a_straddles = false, b_straddles = false;
  int result = search.compare_face(search.a, search.b, b_straddles);
  if (result == uncertain) result = search.compare_face(search.b, search.a, a_straddles);
  if (result != uncertain) return result;
  const bool likely_meet = a_straddles && b_straddles;
  if (likely_meet && triangles_meet(a, b)) return 1;
  result = search.compare_edges();
  if (result != uncertain) return result;
  if (!likely_meet && triangles_meet(a, b)) return 1;
  return compare_in_double_double(a, b, scale, scaled_distance);
}

// Whether the closed triangles are at most `distance` apart, by exact integers: some 100
// microseconds. Any finite coordinates, finite `distance` >= 0.
bool triangles_within_exact(const TrianglePoints& a, const TrianglePoints& b,
                            double distance) noexcept;

// No pair at most `distance` apart is lost, and a pair farther apart than `distance` (1 + 10^-12)
// is refused. Any finite coordinates, finite `distance` >= 0.
inline bool triangles_within(const TrianglePoints& a, const TrianglePoints& b,
                             double distance) noexcept {
  const int result = triangles_within_filter(a, b, distance);
  return result == uncertain ? triangles_within_exact(a, b, distance) : result == 1;
}

}  // namespace throng::mesh
