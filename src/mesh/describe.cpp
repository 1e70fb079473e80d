// Signs of determinants find the extreme points of the intersection, without computing one: they
// are vertices of a triangle that lie in the other, and crossings of an edge with the other
// triangle. Then the coordinates of each crossing are computed once.
//
// Triangles in different planes. The intersection is a point, or a segment on the line common to
// both planes. Its ends are vertices that lie in the other triangle, or points where an edge passes
// through the other's plane from one side to the other. An edge that lies in the other's plane is
// on the common line, so its part in the other triangle ends in points of these two kinds.
// - A crossing of an edge of a and one of an edge of b are the same point if and only if both edges
//   lie in one plane. That plane does not contain the common line: else it would be that of a and
//   of b, as neither edge is on the line. So it has one point in common with the line, which lies
//   on both edges.
// - A vertex of one triangle and a crossing are the same if and only if the vertex is on the edge:
//   an edge that passes through a plane has one point in common with it.
//
// Triangles in one plane. The extreme points are vertices in the other triangle, and crossings of
// the insides of two edges. Two of them are the same only if they are vertices at one place. All
// are extreme: an end of the triangle that has it, or a corner between two lines. A triangle
// without area is replaced by the segment or the point that it is. The order follows from the
// edges: a side of the polygon is on an edge of a triangle, and an edge has at most two of the
// extreme points. Taken in the direction of the edge, they are a side in the direction of the
// winding. The first one of the two is where the edge enters the other triangle, if it is a
// crossing.
#include "mesh/describe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "mesh/double_double.hpp"
#include "mesh/exact_integer.hpp"

namespace throng::mesh {
namespace {

constexpr int next(int i) { return i == 2 ? 0 : i + 1; }
constexpr double DoubleVec3::*coordinates[3] = {&DoubleVec3::x, &DoubleVec3::y, &DoubleVec3::z};

// -0 becomes 0.
DoubleVec3 without_sign_of_zero(const DoubleVec3& p) noexcept {
  return {p.x + 0.0, p.y + 0.0, p.z + 0.0};
}

// ---- coordinates of a crossing ------------------------------------------------------------------

// The projections along `axis` of three points.
template <class Vector>
auto determinant2(const Vector& o, const Vector& p, const Vector& q, int axis) noexcept {
  const auto area = [](const auto& ox, const auto& oy, const auto& px, const auto& py,
                       const auto& qx,
                       const auto& qy) { return (px - ox) * (qy - oy) - (py - oy) * (qx - ox); };
  if (axis == 0) return area(o.y, o.z, p.y, p.z, q.y, q.z);
  if (axis == 1) return area(o.z, o.x, p.z, p.x, q.z, q.x);
  return area(o.x, o.y, p.x, p.y, q.x, q.y);
}

// An edge from u to v that passes through the plane of three points, or, in a plane, through the
// line of two of them. u and v are strictly on different sides.
struct Crossing {
  const DoubleVec3* u;
  const DoubleVec3* v;
  const DoubleVec3* through[3];
  int axis;  // of the projection in which the points are compared; -1: in space
};

struct Approximate {
  DoubleDouble value;
  double error;
};

// The determinant whose sign is the side of x, by exact differences and rounded products and
// sums. A term takes part in at most five operations, with a relative error of 2^-102 each, and
// the sum of the terms' magnitudes is rounded up by the factor 2^-98 / (5 * 2^-102) > 3.
Approximate approximate_side(const Crossing& c, const DoubleVec3& x) noexcept {
  const DoubleVec3 &o = *c.through[0], &p = *c.through[1];
  if (c.axis >= 0) {
    const double DoubleVec3::*const i = coordinates[next(c.axis)];
    const double DoubleVec3::*const k = coordinates[next(next(c.axis))];
    const DoubleDouble left = DoubleDouble(two_difference(p.*i, o.*i)) * two_difference(x.*k, o.*k);
    const DoubleDouble right =
        DoubleDouble(two_difference(p.*k, o.*k)) * two_difference(x.*i, o.*i);
    return {left - right, 0x1p-98 * (std::fabs(left.high) + std::fabs(right.high))};
  }
  const DoubleVec3& q = *c.through[2];
  DoubleDouble d[3][3];
  for (int i = 0; i < 3; ++i) {
    d[0][i] = two_difference(p.*coordinates[i], o.*coordinates[i]);
    d[1][i] = two_difference(q.*coordinates[i], o.*coordinates[i]);
    d[2][i] = two_difference(x.*coordinates[i], o.*coordinates[i]);
  }
  DoubleDouble sum;
  double magnitude = 0;
  for (int i = 0; i < 3; ++i) {
    const int k = next(i), l = next(k);
    const DoubleDouble left = d[0][k] * d[1][l], right = d[0][l] * d[1][k];
    sum = sum + d[2][i] * (left - right);
    magnitude += std::fabs(d[2][i].high) * (std::fabs(left.high) + std::fabs(right.high));
  }
  return {sum, 0x1p-98 * magnitude};
}

// Determinants of coordinates that are 0 or in 2^-100 .. 2^100 neither overflow nor underflow: they
// and all partial products and errors are multiples of 2^-456.
bool is_in_range(const DoubleVec3& p) noexcept {
  const auto fits = [](double x) {
    return x == 0 || (std::fabs(x) >= 0x1p-100 && std::fabs(x) <= 0x1p100);
  };
  return fits(p.x) && fits(p.y) && fits(p.z);
}

// Coordinates of a crossing by DoubleDouble; `is_known` where the bound of the error proves the
// rounding.
//
// With the exact determinants A of u and B of v, the point is u + A / (A - B) (v - u). Let a and b
// be the computed ones, of different signs, off by E at most, and d the computed a - b.
// (1) A / (A - B) - a / (a - b) = (a (B - b) - b (A - a)) / ((A - B) (a - b)). As a and b have
//     different signs, this is at most E / |A - B| <= 2 E / |a - b| if 2 E <= |a - b| / 2.
// (2) For any t near a / (a - b), a / (a - b) - t = (a - t (a - b)) / (a - b). The computed
// residual
//     a - t d is off by 2^-102 (2 |t d| + |residual|), and |t| <= 1.
// (3) t (v - u) and the sum with u add 2^-102 each of their results.
// The bounds below are these times two, for terms of a higher order.
void approximate_crossing(const Crossing& c, double (&x)[3], bool (&is_known)[3]) noexcept {
  bool in_range = is_in_range(*c.u) && is_in_range(*c.v);
  for (const DoubleVec3* p : c.through) in_range = in_range && is_in_range(*p);
  if (!in_range) return;
  const Approximate a = approximate_side(c, *c.u), b = approximate_side(c, *c.v);
  const double most = std::max(a.error, b.error);
  if (std::fabs(a.value.high) <= 2 * most || std::fabs(b.value.high) <= 2 * most) return;
  const DoubleDouble d = a.value - b.value, t = a.value / d;
  const DoubleDouble residual = a.value - t * d;
  const double t_error = (4 * most + 2 * std::fabs(residual.high)) / std::fabs(d.high) + 0x1p-99;
  for (int i = 0; i < 3; ++i) {
    if (is_known[i]) continue;
    const double u = (*c.u).*coordinates[i], v = (*c.v).*coordinates[i];
    const DoubleDouble edge = two_difference(v, u);
    const DoubleDouble sum = DoubleDouble(u) + t * edge;
    const double error =
        2 * std::fabs(edge.high) * (t_error + 0x1p-100) + 0x1p-99 * std::fabs(sum.high);
    // Rounding is monotonic. The sums low + error and low - error are rounded by less than
    // 2^-105 |high|.
    x[i] = sum.high + (sum.low + error);
    is_known[i] = x[i] == sum.high + (sum.low - error);
  }
}

// By integers: (A v - B u) / (A - B).
void exact_crossing(const Crossing& c, double (&x)[3], const bool (&is_known)[3]) noexcept {
  CommonUnit unit;
  for (const DoubleVec3* p : {c.u, c.v, c.through[0], c.through[1], c.through[2]}) unit.include(*p);
  const ExactVector u(*c.u, unit.value()), v(*c.v, unit.value());
  const ExactVector o(*c.through[0], unit.value()), p(*c.through[1], unit.value());
  ExactInteger at_u, at_v;
  if (c.axis >= 0) {
    at_u = determinant2(o, p, u, c.axis);
    at_v = determinant2(o, p, v, c.axis);
  } else {
    const ExactVector n = cross(p - o, ExactVector(*c.through[2], unit.value()) - o);
    at_u = dot(n, u - o);
    at_v = dot(n, v - o);
  }
  const ExactInteger difference = at_u - at_v;
  const ExactInteger* const from[3] = {&u.x, &u.y, &u.z};
  const ExactInteger* const to[3] = {&v.x, &v.y, &v.z};
  for (int i = 0; i < 3; ++i) {
    if (is_known[i]) continue;
    x[i] = nearest_quotient(at_u * *to[i] - at_v * *from[i], difference, unit.value());
  }
}

DoubleVec3 coordinates_of(const Crossing& c) noexcept {
  double x[3] = {};
  bool is_known[3];
  const DoubleVec3 &o = *c.through[0], &p = *c.through[1], &q = *c.through[2];
  for (int i = 0; i < 3; ++i) {
    // Equal for all points of the plane or line, so for the crossing.
    x[i] = o.*coordinates[i];
    is_known[i] = x[i] == p.*coordinates[i] && x[i] == q.*coordinates[i];
  }
  approximate_crossing(c, x, is_known);
  if (!is_known[0] || !is_known[1] || !is_known[2]) exact_crossing(c, x, is_known);
  return without_sign_of_zero({x[0], x[1], x[2]});
}

// ---- triangles in different planes --------------------------------------------------------------

struct Sides {
  int of[3];

  bool all_zero() const noexcept { return of[0] == 0 && of[1] == 0 && of[2] == 0; }
  bool all_on_one() const noexcept { return of[0] != 0 && of[0] == of[1] && of[0] == of[2]; }
  int zeros() const noexcept { return (of[0] == 0) + (of[1] == 0) + (of[2] == 0); }
};

Sides sides_of(const TrianglePoints& x, const TrianglePoints& plane) noexcept {
  return {{side(plane, x.p[0]), side(plane, x.p[1]), side(plane, x.p[2])}};
}

bool has_area(const TrianglePoints& t) noexcept { return !collinear(t.p[0], t.p[1], t.p[2]); }

// The distinct ends of the segment: at most two.
class Ends {
 public:
  void add_vertices(const TrianglePoints& x, const Sides& sides, const TrianglePoints& t) noexcept {
    for (int i = 0; i < 3; ++i) {
      const DoubleVec3& p = x.p[i];
      if (sides.of[i] != 0 || !in_triangle(p, t, 0)) continue;
      bool is_new = true;
      for (int k = 0; k < vertex_count_; ++k) is_new = is_new && !same_point(p, *vertex_[k]);
      if (is_new && vertex_count_ < 2) vertex_[vertex_count_++] = &p;
    }
  }
  // After all vertices.
  void add_crossings(const TrianglePoints& x, const Sides& sides,
                     const TrianglePoints& t) noexcept {
    const int before = crossing_count_;
    for (int i = 0; i < 3; ++i) {
      const DoubleVec3 &u = x.p[i], &v = x.p[next(i)];
      const int u_side = sides.of[i], v_side = sides.of[next(i)];
      if (u_side * v_side >= 0 || !segment_meets_triangle(u, v, t, u_side, v_side)) continue;
      bool is_new = true;
      for (int k = 0; k < vertex_count_; ++k) is_new = is_new && !on_segment(*vertex_[k], u, v);
      for (int k = 0; k < before; ++k)
        is_new = is_new && orient3d_sign(u, v, *crossing_[k].u, *crossing_[k].v) != 0;
      // Two edges of one triangle pass through a plane at one point if it has no area.
      if (crossing_count_ > before) is_new = is_new && has_area(x);
      if (is_new && count() < 2)
        crossing_[crossing_count_++] = {&u, &v, {&t.p[0], &t.p[1], &t.p[2]}, -1};
    }
  }
  int count() const noexcept { return vertex_count_ + crossing_count_; }
  void write(DoubleVec3* out) const noexcept {
    for (int k = 0; k < vertex_count_; ++k) *out++ = without_sign_of_zero(*vertex_[k]);
    for (int k = 0; k < crossing_count_; ++k) *out++ = coordinates_of(crossing_[k]);
  }

 private:
  const DoubleVec3* vertex_[2];
  Crossing crossing_[2];
  int vertex_count_ = 0, crossing_count_ = 0;
};

// ---- triangles in one plane ---------------------------------------------------------------------

// A triangle in the projection: its extreme points, 1 to 3 of them.
struct FlatPolygon {
  const DoubleVec3* corner[3];
  int count = 0;

  explicit FlatPolygon(const TrianglePoints& t) noexcept {
    const DoubleVec3 *const p = &t.p[0], *const q = &t.p[1], *const r = &t.p[2];
    if (has_area(t))
      set({p, q, r}, 3);
    else if (same_point(*p, *q) && same_point(*p, *r))
      set({p, p, p}, 1);
    else if (between(*r, *p, *q))
      set({p, q, q}, 2);
    else
      set(between(*q, *p, *r) ? std::array{p, r, r} : std::array{q, r, r}, 2);
  }
  void set(const std::array<const DoubleVec3*, 3>& points, int n) noexcept {
    std::copy(points.begin(), points.end(), corner);
    count = n;
  }
  int edges() const noexcept { return count == 3 ? 3 : count - 1; }
  const DoubleVec3& begin_of(int edge) const noexcept { return *corner[edge]; }
  const DoubleVec3& end_of(int edge) const noexcept { return *corner[next(edge)]; }
};

int orient(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c, int axis) noexcept {
  return orient(project(a, axis), project(b, axis), project(c, axis));
}

// An axis along which the projection of the common plane or line of the corners is injective.
int injective_axis(const FlatPolygon& a, const FlatPolygon& b) noexcept {
  const DoubleVec3* points[6] = {a.corner[0]};
  int count = 0;
  for (const FlatPolygon* polygon : {&a, &b})
    for (int i = 0; i < polygon->count; ++i) points[count++] = polygon->corner[i];
  // Points that are not all on one line of the projection span an area with the first one.
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 1; i < count; ++i)
      for (int k = i + 1; k < count; ++k)
        if (orient(*points[0], *points[i], *points[k], axis) != 0) return axis;
  // All are on one line.
  for (int axis = 0; axis < 3; ++axis) {
    const Point2 first = project(*points[0], axis);
    for (int i = 1; i < count; ++i) {
      const Point2 other = project(*points[i], axis);
      if (first.x != other.x || first.y != other.y) return axis;
    }
  }
  return 0;
}

class FlatIntersection {
 public:
  FlatIntersection(const TrianglePoints& a, const TrianglePoints& b) noexcept
      : a_(a), b_(b), axis_(injective_axis(a_, b_)) {
    a_turn_ = a_.count == 3 ? orient(*a_.corner[0], *a_.corner[1], *a_.corner[2], axis_) : 0;
    b_turn_ = b_.count == 3 ? orient(*b_.corner[0], *b_.corner[1], *b_.corner[2], axis_) : 0;
    // Both wind the same way.
    if (a_turn_ * b_turn_ < 0) {
      std::swap(b_.corner[1], b_.corner[2]);
      b_turn_ = a_turn_;
    }
    for (int i = 0; i < a_.count; ++i)
      for (int k = 0; k < b_.edges(); ++k)
        a_side_[i][k] = orient(b_.begin_of(k), b_.end_of(k), *a_.corner[i], axis_);
    for (int k = 0; k < b_.count; ++k)
      for (int i = 0; i < a_.edges(); ++i)
        b_side_[k][i] = orient(a_.begin_of(i), a_.end_of(i), *b_.corner[k], axis_);
    add_corners(a, b);
    add_crossings();
  }

  int count() const noexcept { return count_; }
  void write(DoubleVec3* out) const noexcept {
    int order[6] = {0, 1, 2, 3, 4, 5};
    if (count_ >= 3) sort(order);
    for (int i = 0; i < count_; ++i) {
      const Point& p = points_[order[i]];
      if (p.corner) {
        out[i] = without_sign_of_zero(*p.corner);
        continue;
      }
      const DoubleVec3 &q = b_.begin_of(p.b_edge), &r = b_.end_of(p.b_edge);
      out[i] = coordinates_of({&a_.begin_of(p.a_edge), &a_.end_of(p.a_edge), {&q, &r, &r}, axis_});
    }
  }

 private:
  // A corner of a or b, or the crossing of an edge of each.
  struct Point {
    const DoubleVec3* corner = nullptr;
    int a_edge = -1, b_edge = -1;
  };

  void add(const Point& p) noexcept {
    if (count_ < 6) points_[count_++] = p;
  }

  void add_corners(const TrianglePoints& a, const TrianglePoints& b) noexcept {
    const auto is_in = [this](const DoubleVec3& p, const TrianglePoints& t) {
      const Point2 flat[3] = {project(t.p[0], axis_), project(t.p[1], axis_),
                              project(t.p[2], axis_)};
      return in_triangle(project(p, axis_), flat);
    };
    for (int i = 0; i < a_.count; ++i)
      if (is_in(*a_.corner[i], b)) add({a_.corner[i]});
    const int of_a = count_;
    for (int k = 0; k < b_.count; ++k) {
      const DoubleVec3& p = *b_.corner[k];
      bool is_new = is_in(p, a);
      for (int i = 0; i < of_a && is_new; ++i) is_new = !same_point(p, *points_[i].corner);
      if (is_new) add({&p});
    }
  }
  void add_crossings() noexcept {
    for (int i = 0; i < a_.edges(); ++i)
      for (int k = 0; k < b_.edges(); ++k)
        if (a_side_[i][k] * a_side_[next(i)][k] < 0 && b_side_[k][i] * b_side_[next(k)][i] < 0)
          add({nullptr, i, k});
  }

  // Of a polygon: both triangles have an area.
  bool is_on(const Point& p, const FlatPolygon& polygon, int edge) const noexcept {
    if (!p.corner) return (&polygon == &a_ ? p.a_edge : p.b_edge) == edge;
    return orient(polygon.begin_of(edge), polygon.end_of(edge), *p.corner, axis_) == 0;
  }
  // Whether the crossing p is where an edge enters the other triangle, not where it leaves.
  bool enters(const Point& p, const FlatPolygon& polygon) const noexcept {
    return &polygon == &a_ ? a_side_[p.a_edge][p.b_edge] * a_turn_ < 0
                           : b_side_[p.b_edge][p.a_edge] * a_turn_ < 0;
  }
  // Whether p is before q on an edge.
  bool is_before(const Point& p, const Point& q, const FlatPolygon& polygon,
                 int edge) const noexcept {
    if (!p.corner) return enters(p, polygon);
    if (!q.corner) return !enters(q, polygon);
    const Point2 from = project(polygon.begin_of(edge), axis_);
    const Point2 to = project(polygon.end_of(edge), axis_);
    const Point2 first = project(*p.corner, axis_), second = project(*q.corner, axis_);
    if (from.x != to.x) return (from.x < to.x) == (first.x < second.x);
    return (from.y < to.y) == (first.y < second.y);
  }
  void sort(int (&order)[6]) const noexcept {
    int after[6] = {};
    for (const FlatPolygon* polygon : {&a_, &b_}) {
      for (int edge = 0; edge < 3; ++edge) {
        int found[2], n = 0;
        for (int i = 0; i < count_ && n < 2; ++i)
          if (is_on(points_[i], *polygon, edge)) found[n++] = i;
        if (n < 2) continue;
        const bool in_order = is_before(points_[found[0]], points_[found[1]], *polygon, edge);
        after[found[!in_order]] = found[in_order];
      }
    }
    for (int i = 1; i < count_; ++i) order[i] = after[order[i - 1]];
  }

  FlatPolygon a_, b_;
  int axis_;
  int a_turn_, b_turn_;
  int a_side_[3][3] = {}, b_side_[3][3] = {};  // of a corner, for an edge of the other
  Point points_[6];
  int count_ = 0;
};

// Whether all six points are in one plane, if all sides are 0: a triangle with an area has the
// other one in its plane.
bool are_coplanar(const TrianglePoints& a, const TrianglePoints& b) noexcept {
  if (has_area(a) || has_area(b)) return true;
  const FlatPolygon p(a), q(b);
  return orient3d_sign(*p.corner[0], *p.corner[1], *q.corner[0], *q.corner[1]) == 0;
}

}  // namespace

TriangleIntersection describe_intersection(const TrianglePoints& a,
                                           const TrianglePoints& b) noexcept {
  TriangleIntersection result;
  const Sides of_a = sides_of(a, b);
  if (of_a.all_on_one()) return result;
  const Sides of_b = sides_of(b, a);
  if (of_b.all_on_one()) return result;
  if (of_a.all_zero() && of_b.all_zero()) {
    if (!are_coplanar(a, b)) return result;  // two segments on skew lines
    const FlatIntersection flat(a, b);
    if (flat.count() == 0) return result;
    result.kind = IntersectionKind::coplanar;
    result.point_count = static_cast<std::uint8_t>(flat.count());
    flat.write(result.points);
    return result;
  }
  Ends ends;
  ends.add_vertices(a, of_a, b);
  ends.add_vertices(b, of_b, a);
  ends.add_crossings(a, of_a, b);
  ends.add_crossings(b, of_b, a);
  if (ends.count() == 0) return result;
  result.point_count = static_cast<std::uint8_t>(ends.count());
  ends.write(result.points);
  // The inside of a segment is on an edge if and only if that edge is on the common line.
  const bool crosses = ends.count() == 2 && of_a.zeros() < 2 && of_b.zeros() < 2;
  result.kind = crosses ? IntersectionKind::crossing : IntersectionKind::touching;
  return result;
}

}  // namespace throng::mesh
