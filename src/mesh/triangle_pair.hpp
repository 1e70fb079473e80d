// The rule for one pair of triangles, decided exactly by signs of determinants.
//
// Points are never constructed. Three facts reduce everything to signs:
//
// 1. Two closed triangles meet if and only if an edge of one meets the other. Their intersection is
//    compact and convex, so it has an extreme point. A point inside of both triangles is not
//    extreme: near it, the intersection is a segment or an area around it. A triangle without area
//    is the union of its edges.
// 2. If all points lie in one plane, sets of them meet if and only if their projections
//    along each of the three axes meet: one of the three is injective on the plane.
// 3. If two triangles share vertex p and have another common point y, then some common point other
//    than p lies on the edge opposite of p in one of them: follow the ray from p through y to where
//    it first leaves a triangle.
#pragma once

#include <cstdint>

#include <throng/mesh.hpp>
#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "mesh/orient.hpp"

namespace throng::mesh {

struct TrianglePoints {
  DoubleVec3 p[3];
};

THRONG_HD inline bool same_point(const DoubleVec3& a, const DoubleVec3& b) noexcept {
  return (a.x == b.x) & (a.y == b.y) & (a.z == b.z);
}

// ---- in the plane: a projection along one axis --------------------------------------------------

struct Point2 {
  double x, y;
};

THRONG_HD inline Point2 project(const DoubleVec3& p, int axis) noexcept {
  return axis == 0 ? Point2{p.y, p.z} : (axis == 1 ? Point2{p.z, p.x} : Point2{p.x, p.y});
}

THRONG_HD inline int orient(const Point2& a, const Point2& b, const Point2& c) noexcept {
  return orient2d_sign(a.x, a.y, b.x, b.y, c.x, c.y);
}

THRONG_HD inline bool between(double x, double a, double b) noexcept {
  return a <= b ? (a <= x) & (x <= b) : (b <= x) & (x <= a);
}

// Whether p lies in the bounding box of a and b.
THRONG_HD inline bool between(const Point2& p, const Point2& a, const Point2& b) noexcept {
  return between(p.x, a.x, b.x) && between(p.y, a.y, b.y);
}
THRONG_HD inline bool between(const DoubleVec3& p, const DoubleVec3& a,
                              const DoubleVec3& b) noexcept {
  return between(p.x, a.x, b.x) && between(p.y, a.y, b.y) && between(p.z, a.z, b.z);
}

// Whether the open segments from a to b and from c to d cross in one point.
THRONG_HD THRONG_OUTLINE inline bool segments_cross(const Point2& a, const Point2& b,
                                                    const Point2& c, const Point2& d) noexcept {
  return orient(a, b, c) * orient(a, b, d) < 0 && orient(c, d, a) * orient(c, d, b) < 0;
}

THRONG_HD inline bool on_segment(const Point2& p, const Point2& a, const Point2& b) noexcept {
  return orient(a, b, p) == 0 && between(p, a, b);
}

// Whether p lies in the closed triangle. The vectors along its edges add up to 0, so for a triangle
// without area and a point off its line the signs differ.
THRONG_HD THRONG_OUTLINE inline bool in_triangle(const Point2& p, const Point2 (&t)[3]) noexcept {
  const int s0 = orient(t[0], t[1], p), s1 = orient(t[1], t[2], p), s2 = orient(t[2], t[0], p);
  const bool positive = (s0 > 0) | (s1 > 0) | (s2 > 0), negative = (s0 < 0) | (s1 < 0) | (s2 < 0);
  if (positive || negative) return positive != negative;
  // On the triangle's line, which two of its edges cover.
  return between(p, t[0], t[1]) || between(p, t[1], t[2]);
}

// ---- in space -----------------------------------------------------------------------------------

// The side of the triangle's plane on which x lies; 0: in it, or the triangle has no area.
THRONG_HD inline int side(const TrianglePoints& t, const DoubleVec3& x) noexcept {
  return orient3d_sign(t.p[0], t.p[1], t.p[2], x);
}

THRONG_HD THRONG_OUTLINE inline bool collinear(const DoubleVec3& a, const DoubleVec3& b,
                                               const DoubleVec3& c) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    if (orient(project(a, axis), project(b, axis), project(c, axis)) != 0) return false;
  }
  return true;
}

THRONG_HD inline bool on_segment(const DoubleVec3& x, const DoubleVec3& a,
                                 const DoubleVec3& b) noexcept {
  return between(x, a, b) && collinear(x, a, b);
}

// Whether x lies in the closed triangle. `x_side`: side(t, x).
THRONG_HD THRONG_OUTLINE inline bool in_triangle(const DoubleVec3& x, const TrianglePoints& t,
                                                 int x_side) noexcept {
  if (x_side != 0) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const Point2 flat[3] = {project(t.p[0], axis), project(t.p[1], axis), project(t.p[2], axis)};
    if (!in_triangle(project(x, axis), flat)) return false;
  }
  return true;
}

// Whether the closed segment from u to v meets the closed triangle. `u_side`, `v_side`: their
// sides.
THRONG_HD THRONG_OUTLINE inline bool segment_meets_triangle(const DoubleVec3& u,
                                                            const DoubleVec3& v,
                                                            const TrianglePoints& t, int u_side,
                                                            int v_side) noexcept {
  if (u_side * v_side > 0) return false;
  const int s0 = orient3d_sign(u, v, t.p[0], t.p[1]);
  const int s1 = orient3d_sign(u, v, t.p[1], t.p[2]);
  const int s2 = orient3d_sign(u, v, t.p[2], t.p[0]);
  if (u_side != 0 || v_side != 0) {
    // The triangle has an area, and the line through u and v meets its plane in one point.
    const bool positive = (s0 > 0) | (s1 > 0) | (s2 > 0), negative = (s0 < 0) | (s1 < 0) | (s2 < 0);
    return !(positive && negative);
  }
  // An edge on a line that is skew to the segment: the triangle has no area and lies on that line.
  if (s0 != 0 || s1 != 0 || s2 != 0) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const Point2 flat[3] = {project(t.p[0], axis), project(t.p[1], axis), project(t.p[2], axis)};
    const Point2 from = project(u, axis), to = project(v, axis);
    // A segment with both ends outside crosses an edge or passes through a vertex.
    bool meets = in_triangle(from, flat) || in_triangle(to, flat);
    for (int i = 0; i < 3; ++i) {
      meets = meets || segments_cross(from, to, flat[i], flat[i == 2 ? 0 : i + 1]) ||
              on_segment(flat[i], from, to);
    }
    if (!meets) return false;
  }
  return true;
}

// Whether two closed triangles have a common point.
THRONG_HD inline bool triangles_meet(const TrianglePoints& a, const TrianglePoints& b) noexcept {
  int of_a[3], of_b[3];  // the side of each vertex
  for (int i = 0; i < 3; ++i) of_a[i] = side(b, a.p[i]);
  if (of_a[0] != 0 && of_a[0] == of_a[1] && of_a[0] == of_a[2]) return false;
  for (int i = 0; i < 3; ++i) of_b[i] = side(a, b.p[i]);
  if (of_b[0] != 0 && of_b[0] == of_b[1] && of_b[0] == of_b[2]) return false;
  for (int i = 0; i < 3; ++i) {
    const int j = i == 2 ? 0 : i + 1;
    if (segment_meets_triangle(a.p[i], a.p[j], b, of_a[i], of_a[j]) ||
        segment_meets_triangle(b.p[i], b.p[j], a, of_b[i], of_b[j])) {
      return true;
    }
  }
  return false;
}

// Whether the triangles (p, a1, a2) and (p, b1, b2) have a common point other than p.
THRONG_HD inline bool meet_beyond_vertex(const DoubleVec3& p, const DoubleVec3& a1,
                                         const DoubleVec3& a2, const DoubleVec3& b1,
                                         const DoubleVec3& b2) noexcept {
  const TrianglePoints a = {{p, a1, a2}}, b = {{p, b1, b2}};
  const int a1_side = side(b, a1), a2_side = side(b, a2);
  if (a1_side * a2_side > 0) return false;
  const int b1_side = side(a, b1), b2_side = side(a, b2);
  if (b1_side * b2_side > 0) return false;
  // In general position each triangle meets the line common to both planes in a segment from p. The
  // two segments have the same direction if and only if these signs differ.
  if (a1_side != 0 && a2_side != 0 && b1_side != 0 && b2_side != 0) return a1_side != b1_side;
  if (!on_segment(p, a1, a2) && segment_meets_triangle(a1, a2, b, a1_side, a2_side)) return true;
  if (!on_segment(p, b1, b2) && segment_meets_triangle(b1, b2, a, b1_side, b2_side)) return true;
  // If p lies on the edge opposite of it, the triangle is a segment or a point, and the ray of fact
  // 3 leaves it at one of its ends.
  return (!same_point(a1, p) && in_triangle(a1, b, a1_side)) ||
         (!same_point(a2, p) && in_triangle(a2, b, a2_side)) ||
         (!same_point(b1, p) && in_triangle(b1, a, b1_side)) ||
         (!same_point(b2, p) && in_triangle(b2, a, b2_side));
}

// Whether the triangles (p, q, a) and (p, q, b) have a common point outside of the segment from p
// to q.
THRONG_HD inline bool meet_beyond_edge(const DoubleVec3& p, const DoubleVec3& q,
                                       const DoubleVec3& a, const DoubleVec3& b) noexcept {
  if (orient3d_sign(p, q, a, b) != 0) return false;
  if (same_point(p, q)) {
    return !same_point(a, p) && !same_point(b, p) && (on_segment(a, p, b) || on_segment(b, p, a));
  }
  bool a_on_line = true, b_on_line = true;
  for (int axis = 0; axis < 3; ++axis) {
    const Point2 from = project(p, axis), to = project(q, axis);
    const int a_side = orient(from, to, project(a, axis));
    const int b_side = orient(from, to, project(b, axis));
    // Both off the line: they meet beyond the edge if and only if they lie on the same side.
    if (a_side != 0 && b_side != 0) return a_side == b_side;
    a_on_line &= a_side == 0;
    b_on_line &= b_side == 0;
  }
  // If only one is on the line, they meet on the edge alone.
  if (!a_on_line || !b_on_line) return false;
  const bool before =
      between(p, q, a) && between(p, q, b) && !same_point(a, p) && !same_point(b, p);
  const bool after = between(q, p, a) && between(q, p, b) && !same_point(a, q) && !same_point(b, q);
  return before || after;
}

// ---- the rule -----------------------------------------------------------------------------------

// Whether two triangles of one mesh form a pair: they have a common point outside of the convex
// hull of the vertices that they share by index, or they share three vertices. An index that a
// triangle repeats is one vertex.
THRONG_HD inline bool triangles_pair(const Triangle& ids_a, const Triangle& ids_b,
                                     const TrianglePoints& a, const TrianglePoints& b) noexcept {
  const std::uint32_t ia[3] = {ids_a.a, ids_a.b, ids_a.c}, ib[3] = {ids_b.a, ids_b.b, ids_b.c};
  int shared[3], only_a[3], only_b[3];  // positions, the shared ones in a
  int shared_count = 0, a_count = 0, b_count = 0;
  for (int i = 0; i < 3; ++i) {
    const bool in_b = (ia[i] == ib[0]) | (ia[i] == ib[1]) | (ia[i] == ib[2]);
    bool seen = false;  // an index that the triangle repeats counts once
    for (int k = 0; k < i; ++k) seen |= ia[k] == ia[i];
    if (!in_b)
      only_a[a_count++] = i;
    else if (!seen)
      shared[shared_count++] = i;
    if (!((ib[i] == ia[0]) | (ib[i] == ia[1]) | (ib[i] == ia[2]))) only_b[b_count++] = i;
  }
  if (shared_count == 0) return triangles_meet(a, b);
  // One lies in the convex hull. Only three shared vertices form a pair anyway.
  if (a_count == 0 || b_count == 0) return shared_count == 3;
  if (shared_count == 1) {
    return meet_beyond_vertex(a.p[shared[0]], a.p[only_a[0]], a.p[only_a[a_count - 1]],
                              b.p[only_b[0]], b.p[only_b[b_count - 1]]);
  }
  return meet_beyond_edge(a.p[shared[0]], a.p[shared[1]], a.p[only_a[0]], b.p[only_b[0]]);
}

}  // namespace throng::mesh
