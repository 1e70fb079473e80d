// Whether two triangles form a pair, from the definition, in rational numbers: the points that can
// be extreme points of the intersection are computed, and each is tested.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gmpxx.h>

#include <throng/mesh.hpp>

namespace throng::tests {

struct ExactPoint {
  mpq_class x, y, z;
  bool operator==(const ExactPoint& b) const { return x == b.x && y == b.y && z == b.z; }
};

inline ExactPoint exact(const DoubleVec3& p) {
  return {mpq_class(p.x), mpq_class(p.y), mpq_class(p.z)};
}
inline ExactPoint operator-(const ExactPoint& a, const ExactPoint& b) {
  return {mpq_class(a.x - b.x), mpq_class(a.y - b.y), mpq_class(a.z - b.z)};
}
inline ExactPoint cross(const ExactPoint& a, const ExactPoint& b) {
  return {mpq_class(a.y * b.z - a.z * b.y), mpq_class(a.z * b.x - a.x * b.z),
          mpq_class(a.x * b.y - a.y * b.x)};
}
inline mpq_class dot(const ExactPoint& a, const ExactPoint& b) {
  return mpq_class(a.x * b.x + a.y * b.y + a.z * b.z);
}
inline bool is_zero(const ExactPoint& p) { return p.x == 0 && p.y == 0 && p.z == 0; }
// a + t (b - a)
inline ExactPoint along(const ExactPoint& a, const ExactPoint& b, const mpq_class& t) {
  const ExactPoint d = b - a;
  return {mpq_class(a.x + t * d.x), mpq_class(a.y + t * d.y), mpq_class(a.z + t * d.z)};
}

using ExactTriangle = std::array<ExactPoint, 3>;

// Whether p lies in the convex hull of two points.
inline bool in_hull(const ExactPoint& p, const ExactPoint& a, const ExactPoint& b) {
  const ExactPoint d = b - a, e = p - a;
  if (!is_zero(cross(d, e))) return false;
  const mpq_class t = dot(d, e);
  return is_zero(d) ? is_zero(e) : t >= 0 && t <= dot(d, d);
}

// Whether p lies in the convex hull of three points.
inline bool in_hull(const ExactPoint& p, const ExactTriangle& t) {
  const ExactPoint n = cross(t[1] - t[0], t[2] - t[0]);
  if (is_zero(n)) return in_hull(p, t[0], t[1]) || in_hull(p, t[1], t[2]) || in_hull(p, t[2], t[0]);
  if (dot(n, p - t[0]) != 0) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const ExactPoint& a = t[i];
    if (dot(n, cross(t[(i + 1) % 3] - a, p - a)) < 0) return false;
  }
  return true;
}

// The common points of the segment a b with a line or plane, as far as they can be extreme: where
// it crosses the plane of t, and where it crosses the lines of its edges.
inline void add_crossings(const ExactPoint& a, const ExactPoint& b, const ExactTriangle& t,
                          std::vector<ExactPoint>& points) {
  const ExactPoint n = cross(t[1] - t[0], t[2] - t[0]), d = b - a;
  if (const mpq_class speed = dot(n, d); speed != 0)
    points.push_back(along(a, b, mpq_class(dot(n, t[0] - a) / speed)));
  for (std::size_t i = 0; i < 3; ++i) {
    const ExactPoint& c = t[i];
    const ExactPoint e = t[(i + 1) % 3] - c;
    const ExactPoint m = cross(d, e);
    // Parallel segments meet in ends alone, which are tested anyway.
    if (is_zero(m) || dot(m, c - a) != 0) continue;
    points.push_back(along(a, b, mpq_class(dot(cross(c - a, e), m) / dot(m, m))));
  }
}

// The points that decide: those of both triangles among the candidates.
inline std::vector<ExactPoint> common_points(const ExactTriangle& a, const ExactTriangle& b) {
  std::vector<ExactPoint> candidates(a.begin(), a.end());
  candidates.insert(candidates.end(), b.begin(), b.end());
  for (std::size_t i = 0; i < 3; ++i) {
    add_crossings(a[i], a[(i + 1) % 3], b, candidates);
    add_crossings(b[i], b[(i + 1) % 3], a, candidates);
  }
  std::vector<ExactPoint> common;
  for (const ExactPoint& p : candidates) {
    if (in_hull(p, a) && in_hull(p, b)) common.push_back(p);
  }
  return common;
}

inline ExactTriangle exact(const std::array<DoubleVec3, 3>& t) {
  return {exact(t[0]), exact(t[1]), exact(t[2])};
}

inline bool exactly_meet(const std::array<DoubleVec3, 3>& a, const std::array<DoubleVec3, 3>& b) {
  return !common_points(exact(a), exact(b)).empty();
}

// Whether two triangles of one mesh form a pair.
inline bool exactly_pair(const Triangle& ids_a, const Triangle& ids_b,
                         const std::array<DoubleVec3, 3>& a, const std::array<DoubleVec3, 3>& b) {
  const std::array<std::uint32_t, 3> ia{ids_a.a, ids_a.b, ids_a.c}, ib{ids_b.a, ids_b.b, ids_b.c};
  std::vector<ExactPoint> shared;
  std::vector<std::uint32_t> shared_ids;
  for (std::size_t i = 0; i < 3; ++i) {
    const bool in_b = std::find(ib.begin(), ib.end(), ia[i]) != ib.end();
    if (!in_b || std::find(shared_ids.begin(), shared_ids.end(), ia[i]) != shared_ids.end())
      continue;
    shared_ids.push_back(ia[i]);
    shared.push_back(exact(a[i]));
  }
  if (shared.size() == 3) return true;
  const auto in_shared_hull = [&](const ExactPoint& p) {
    if (shared.empty()) return false;
    return in_hull(p,
                   {shared[0], shared[std::min<std::size_t>(1, shared.size() - 1)], shared.back()});
  };
  for (const ExactPoint& p : common_points(exact(a), exact(b))) {
    if (!in_shared_hull(p)) return true;
  }
  return false;
}

}  // namespace throng::tests
