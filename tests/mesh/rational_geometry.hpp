// Geometry of triangles by GMP's rationals, which shares no code with the library.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <gmpxx.h>

#include <throng/types.hpp>

#include "mesh/exact_triangles.hpp"

namespace throng::tests {

inline ExactPoint operator+(const ExactPoint& a, const ExactPoint& b) {
  return {mpq_class(a.x + b.x), mpq_class(a.y + b.y), mpq_class(a.z + b.z)};
}
inline ExactPoint operator*(const mpq_class& s, const ExactPoint& a) {
  return {mpq_class(s * a.x), mpq_class(s * a.y), mpq_class(s * a.z)};
}

template <class Points>
ExactTriangle exact_triangle(const Points& p) {
  return {exact(p[0]), exact(p[1]), exact(p[2])};
}

// Rounded to nearest, ties to even. mpq_get_d rounds towards 0.
inline double nearest_double(const mpq_class& x) {
  const double toward_zero = mpq_get_d(x.get_mpq_t());
  const double away =
      std::nextafter(toward_zero, sgn(x) < 0 ? -std::numeric_limits<double>::infinity()
                                             : std::numeric_limits<double>::infinity());
  if (!std::isfinite(away)) return toward_zero;
  const mpq_class below = abs(x - mpq_class(toward_zero)), above = abs(mpq_class(away) - x);
  if (below != above) return below < above ? toward_zero : away;
  int exponent;
  const double mantissa = std::ldexp(std::frexp(toward_zero, &exponent), 53);
  const double in_units = std::fabs(toward_zero) < 0x1p-1022 ? toward_zero / 0x1p-1074 : mantissa;
  return std::fmod(in_units, 2) == 0 ? toward_zero : away;
}

// ---- intersection -------------------------------------------------------------------------------

// The points x with normal . x <= limit.
struct HalfSpace {
  ExactPoint normal;
  mpq_class limit;
};

// The half-spaces whose intersection is the triangle.
inline std::vector<HalfSpace> half_spaces_of(const ExactTriangle& t) {
  std::vector<HalfSpace> result;
  const auto add = [&](const ExactPoint& normal, const ExactPoint& through) {
    result.push_back({normal, dot(normal, through)});
  };
  const auto add_plane = [&](const ExactPoint& normal, const ExactPoint& through) {
    add(normal, through);
    add(mpq_class(-1) * normal, through);
  };
  const ExactPoint n = cross(t[1] - t[0], t[2] - t[0]);
  if (!is_zero(n)) {
    add_plane(n, t[0]);
    for (std::size_t i = 0; i < 3; ++i) add(cross(t[(i + 1) % 3] - t[i], n), t[i]);
    return result;
  }
  // A segment: on the line, between its ends. A point: a segment of length 0.
  std::pair<std::size_t, std::size_t> ends{0, 0};
  mpq_class longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const ExactPoint u = t[(i + 1) % 3] - t[i];
    if (dot(u, u) > longest) {
      longest = dot(u, u);
      ends = {i, (i + 1) % 3};
    }
  }
  const ExactPoint u = t[ends.second] - t[ends.first];
  const ExactPoint axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const ExactPoint& axis : axes) add_plane(is_zero(u) ? axis : cross(u, axis), t[ends.first]);
  add(u, t[ends.second]);
  add(mpq_class(-1) * u, t[ends.first]);
  return result;
}

// A convex polygon, also a segment or a point, cut by a half-space (Sutherland and Hodgman).
inline std::vector<ExactPoint> clipped(const std::vector<ExactPoint>& polygon,
                                       const HalfSpace& half_space) {
  std::vector<ExactPoint> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const ExactPoint& p = polygon[i];
    const ExactPoint& q = polygon[(i + 1) % polygon.size()];
    const mpq_class at_p = dot(half_space.normal, p) - half_space.limit;
    const mpq_class at_q = dot(half_space.normal, q) - half_space.limit;
    if (at_p <= 0) result.push_back(p);
    if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0))
      result.push_back(p + at_p / (at_p - at_q) * (q - p));
  }
  return result;
}

// The extreme points of the intersection of two triangles, in the order of the first one's winding.
inline std::vector<ExactPoint> intersection(const ExactTriangle& a, const ExactTriangle& b) {
  std::vector<ExactPoint> polygon(a.begin(), a.end());
  for (const HalfSpace& h : half_spaces_of(b)) polygon = clipped(polygon, h);
  std::vector<ExactPoint> distinct;
  for (const ExactPoint& p : polygon)
    if (std::find(distinct.begin(), distinct.end(), p) == distinct.end()) distinct.push_back(p);
  std::vector<ExactPoint> extreme;
  for (std::size_t i = 0; i < distinct.size(); ++i) {
    bool is_between = false;
    for (std::size_t k = 0; k < distinct.size(); ++k)
      for (std::size_t l = 0; l < k; ++l)
        is_between |= k != i && l != i && in_hull(distinct[i], distinct[k], distinct[l]);
    if (!is_between) extreme.push_back(distinct[i]);
  }
  return extreme;
}

// ---- distance -----------------------------------------------------------------------------------

enum class Closest { common_point, vertices, vertex_edge, edges, vertex_face, count };

struct SquaredDistance {
  mpq_class value;
  Closest between = Closest::common_point;

  void take(const mpq_class& x, Closest features) {
    if (between != Closest::common_point && x >= value) return;
    value = x;
    between = features;
  }
};

inline void take_point_and_segment(SquaredDistance& d, const ExactPoint& x, const ExactPoint& p,
                                   const ExactPoint& q) {
  const ExactPoint u = q - p, w = x - p;
  d.take(dot(w, w), Closest::vertices);
  d.take(dot(x - q, x - q), Closest::vertices);
  if (is_zero(u)) return;
  const mpq_class s = dot(u, w) / dot(u, u);
  if (s <= 0 || s >= 1) return;
  const ExactPoint v = w - s * u;
  d.take(dot(v, v), Closest::vertex_edge);
}

// The square of the distance of two triangles.
inline SquaredDistance squared_distance(const ExactTriangle& a, const ExactTriangle& b) {
  if (!intersection(a, b).empty()) return {0, Closest::common_point};
  SquaredDistance d;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const ExactPoint &p = a[i], &q = b[k], &p2 = a[(i + 1) % 3], &q2 = b[(k + 1) % 3];
      take_point_and_segment(d, p, q, q2);
      take_point_and_segment(d, q, p, p2);
      // Both derivatives of |p + s u - q - t v|^2 vanish.
      const ExactPoint u = p2 - p, v = q2 - q, w = p - q;
      const mpq_class determinant = dot(u, u) * dot(v, v) - dot(u, v) * dot(u, v);
      if (determinant == 0) continue;
      const mpq_class s = (dot(u, v) * dot(v, w) - dot(v, v) * dot(u, w)) / determinant;
      const mpq_class t = (dot(u, u) * dot(v, w) - dot(u, v) * dot(u, w)) / determinant;
      if (s <= 0 || s >= 1 || t <= 0 || t >= 1) continue;
      const ExactPoint between = w + s * u - t * v;
      d.take(dot(between, between), Closest::edges);
    }
  }
  for (const auto& [t, other] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    const ExactPoint n = cross((*t)[1] - (*t)[0], (*t)[2] - (*t)[0]);
    if (is_zero(n)) continue;
    for (const ExactPoint& x : *other) {
      const mpq_class height = dot(n, x - (*t)[0]) / dot(n, n);
      const ExactPoint foot = x - height * n;
      bool is_inside = true;
      for (std::size_t i = 0; i < 3; ++i)
        is_inside &= dot(n, cross((*t)[(i + 1) % 3] - (*t)[i], foot - (*t)[i])) > 0;
      if (is_inside) d.take(dot(x - foot, x - foot), Closest::vertex_face);
    }
  }
  return d;
}

}  // namespace throng::tests
