// Descriptions of intersections, against exact rational geometry.
#include "mesh/describe.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mesh/rational_geometry.hpp"
#include "mesh/triangle_cases.hpp"

namespace throng::tests {
namespace {

bool is_on_an_edge(const ExactPoint& x, const ExactTriangle& t) {
  return in_hull(x, t[0], t[1]) || in_hull(x, t[1], t[2]) || in_hull(x, t[2], t[0]);
}

bool are_coplanar(const ExactTriangle& a, const ExactTriangle& b) {
  const ExactPoint* const points[6] = {&a[0], &a[1], &a[2], &b[0], &b[1], &b[2]};
  for (int i = 1; i < 6; ++i)
    for (int k = i + 1; k < 6; ++k)
      for (int l = k + 1; l < 6; ++l)
        if (dot(cross(*points[i] - *points[0], *points[k] - *points[0]), *points[l] - *points[0]) !=
            0)
          return false;
  return true;
}

IntersectionKind exact_kind(const ExactTriangle& a, const ExactTriangle& b,
                            const std::vector<ExactPoint>& ends) {
  if (are_coplanar(a, b)) return IntersectionKind::coplanar;
  // Points of the segment: not all are on edges if one inside is not.
  for (const mpq_class& t : {mpq_class(0), mpq_class(1, 2), mpq_class(1, 3), mpq_class(1)}) {
    const ExactPoint x = along(ends.front(), ends.back(), t);
    if (!is_on_an_edge(x, a) && !is_on_an_edge(x, b)) return IntersectionKind::crossing;
  }
  return IntersectionKind::touching;
}

std::array<double, 3> rounded(const ExactPoint& p) {
  return {nearest_double(p.x), nearest_double(p.y), nearest_double(p.z)};
}
std::array<double, 3> as_array(const DoubleVec3& p) { return {p.x, p.y, p.z}; }

// Compares one description and returns it.
TriangleIntersection check(const TwoTriangles& t) {
  const TriangleIntersection found = mesh::describe_intersection(t.a, t.b);
  const ExactTriangle a = exact_triangle(t.a.p), b = exact_triangle(t.b.p);
  const std::vector<ExactPoint> points = intersection(a, b);
  EXPECT_EQ(found.point_count, points.size()) << to_text(t);
  EXPECT_EQ(found.kind == IntersectionKind::none, points.empty()) << to_text(t);
  if (points.empty() || found.point_count != points.size()) return found;
  EXPECT_EQ(found.kind, exact_kind(a, b, points)) << to_text(t);
  std::vector<std::array<double, 3>> wanted, got;
  for (const ExactPoint& p : points) wanted.push_back(rounded(p));
  for (std::size_t i = 0; i < points.size(); ++i) got.push_back(as_array(found.points[i]));
  if (points.size() == 2) {
    std::sort(wanted.begin(), wanted.end());
    std::sort(got.begin(), got.end());
  }
  // The same cycle, from any point on.
  bool is_same = false;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    is_same |= got == wanted;
    std::rotate(wanted.begin(), wanted.begin() + 1, wanted.end());
  }
  EXPECT_TRUE(is_same) << to_text(t);
  return found;
}

TEST(DescribeIntersection, AgreesWithRationals) {
  Random random(1);
  int kinds[3] = {}, counts[3][7] = {};
  for (int k = 0; k < triangle_kind_count; ++k) {
    const auto kind = static_cast<TriangleKind>(k);
    const bool is_extreme = kind >= TriangleKind::scaled_grid;  // the rationals are slow
    const bool is_small = kind == TriangleKind::small_grid || kind == TriangleKind::degenerate;
    for (int n = 0; n < (is_extreme ? 100 : is_small ? 1500 : 400); ++n) {
      const TwoTriangles t = draw_triangles(random, kind);
      const TriangleIntersection found = check(t);
      if (found.point_count == 0) continue;
      ++kinds[static_cast<std::size_t>(found.kind)];
      ++counts[static_cast<std::size_t>(found.kind)][found.point_count];
    }
  }
  for (const int n : kinds) EXPECT_GE(n, 100);
  using Kind = IntersectionKind;
  const auto count = [&](Kind kind, int points) {
    return counts[static_cast<std::size_t>(kind)][points];
  };
  EXPECT_EQ(count(Kind::crossing, 1), 0);
  EXPECT_GE(count(Kind::touching, 1), 10);
  EXPECT_GE(count(Kind::touching, 2), 10);
  for (int points = 1; points <= 6; ++points) EXPECT_GE(count(Kind::coplanar, points), 5) << points;
}

// So small that products of three or of two differences have few bits.
TEST(DescribeIntersection, AgreesWhereProductsUnderflow) {
  Random random(2);
  int described = 0;
  for (const int exponent : {-350, -345, -340, -525, -515}) {
    for (const TriangleKind kind : {TriangleKind::random, TriangleKind::crossing,
                                    TriangleKind::grid_plane, TriangleKind::star}) {
      for (int n = 0; n < 20; ++n) {
        TwoTriangles t = draw_triangles(random, kind);
        for (int i = 0; i < 6; ++i) {
          DoubleVec3& p = vertex(t, i);
          p = {std::ldexp(p.x, exponent), std::ldexp(p.y, exponent), std::ldexp(p.z, exponent)};
        }
        described += check(t).point_count != 0;
      }
    }
  }
  EXPECT_GE(described, 100);
}

// Where the exact result is next to a tie of rounding, or between two tiny doubles.
TEST(DescribeIntersection, RoundsToNearest) {
  const double after = std::nextafter(1.0, 2), tiny = 0x1p-1074;
  const auto crossing_on_x = [](double from, double to, double at_from, double at_to) {
    // The edge along x passes through z = 0.
    const TwoTriangles t{{{{from, 0, at_from}, {to, 0, at_to}, {from, 8, at_from}}},
                         {{{-4, -4, 0}, {4, -4, 0}, {0, 4, 0}}}};
    const TriangleIntersection found = check(t);
    EXPECT_EQ(found.point_count, 2);
    return std::min(found.points[0].x, found.points[1].x);
  };
  EXPECT_EQ(crossing_on_x(1, after, -1, 1), 1);  // a tie, to even
  EXPECT_EQ(crossing_on_x(after, std::nextafter(after, 2), -1, 1), after + (after - 1));
  EXPECT_EQ(crossing_on_x(1, after, -1, 0x1.fffffffffffffp-1), after);  // just above it
  EXPECT_EQ(crossing_on_x(0, tiny, -1, 1), 0);
  EXPECT_EQ(crossing_on_x(0, tiny, -1, 0.75), tiny);
  EXPECT_EQ(crossing_on_x(-1, 1, -1, 1), 0);
  EXPECT_EQ(crossing_on_x(-1, 1, -1, 0x1.fffffffffffffp-1), 0x1p-54 / (1 - 0x1p-54));
}

}  // namespace
}  // namespace throng::tests
