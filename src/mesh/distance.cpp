#include "mesh/distance.hpp"

#include "mesh/exact_integer.hpp"

namespace throng::mesh {
namespace {

// Comparisons of distances with `limit`, the square of the requested distance. All are exact.
class Comparison {
 public:
  explicit Comparison(const ExactInteger& limit) noexcept : limit_(limit) {}

  bool points(const ExactVector& p, const ExactVector& q) const noexcept {
    const ExactVector w = q - p;
    return !(limit_ < dot(w, w));
  }

  // p and the line of o and o + u, where the closest point is inside of the segment.
  // |w|^2 - (w . u)^2 / |u|^2 <= limit
  bool point_and_segment(const ExactVector& p, const ExactVector& o,
                         const ExactVector& u) const noexcept {
    const ExactVector w = p - o;
    const ExactInteger uu = dot(u, u), wu = dot(w, u);
    if (wu.sign() <= 0 || !(wu < uu)) return false;
    return !(wu * wu < (dot(w, w) - limit_) * uu);
  }

  // Points o + s u and q + t v, where the closest points of both lines, or of a plane and q, are
  // inside. `is_face`: u and v are edges of one triangle, and its point o + s u + t v is compared
  // with q. The minimum of |w - s u - t v|^2, with w = q - o and v negated for two edges, is at
  // s = S / D, t = T / D and has the value (w . (u x v))^2 / D.
  bool interiors(const ExactVector& o, const ExactVector& u, const ExactVector& q,
                 const ExactVector& v, bool is_face) const noexcept {
    const ExactInteger uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
    const ExactInteger d = uu * vv - uv * uv;
    if (d.sign() == 0) return false;
    const ExactVector w = q - o;
    const ExactInteger wu = dot(w, u), wv = dot(w, v);
    const ExactInteger s = vv * wu - uv * wv;
    if (s.sign() <= 0 || !(s < d)) return false;
    const ExactInteger t = is_face ? uu * wv - uv * wu : uv * wu - uu * wv;
    if (t.sign() <= 0 || !(t < d)) return false;
    if (is_face && !(s + t < d)) return false;
    const ExactInteger height = dot(w, cross(u, v));
    return !(limit_ * d < height * height);
  }

 private:
  const ExactInteger& limit_;
};

}  // namespace

// The closest points of two disjoint triangles are on two vertices, on a vertex and inside of an
// edge, inside of two edges that are not parallel, or on a vertex and inside of a face: closest
// points inside of larger or parallel features can be moved along both until one is on the border.
// So the triangles are within the distance if and only if one of these is. Triangles that intersect
// also pass: the test before finds them.
bool triangles_within_exact(const TrianglePoints& a, const TrianglePoints& b,
                            double distance) noexcept {
  if (triangles_meet(a, b)) return true;
  CommonUnit unit;
  unit.include(distance);
  for (int i = 0; i < 3; ++i) {
    unit.include(a.p[i]);
    unit.include(b.p[i]);
  }
  const ExactInteger length(distance, unit.value());
  const ExactInteger limit = length * length;
  const Comparison is_within(limit);
  struct Edges {
    ExactVector p[3], u[3];
    Edges(const TrianglePoints& t, int common_unit) noexcept {
      for (int i = 0; i < 3; ++i) p[i] = ExactVector(t.p[i], common_unit);
      for (int i = 0; i < 3; ++i) u[i] = p[i == 2 ? 0 : i + 1] - p[i];
    }
  };
  const Edges ea(a, unit.value()), eb(b, unit.value());
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (is_within.points(ea.p[i], eb.p[k])) return true;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (is_within.point_and_segment(ea.p[i], eb.p[k], eb.u[k]) ||
          is_within.point_and_segment(eb.p[i], ea.p[k], ea.u[k]))
        return true;
  for (int i = 0; i < 3; ++i)
    if (is_within.interiors(eb.p[0], eb.u[0], ea.p[i], eb.p[2] - eb.p[0], true) ||
        is_within.interiors(ea.p[0], ea.u[0], eb.p[i], ea.p[2] - ea.p[0], true))
      return true;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (is_within.interiors(ea.p[i], ea.u[i], eb.p[k], eb.u[k], false)) return true;
  return false;
}

}  // namespace throng::mesh
