// The rule for a pair of triangles, and the search, against rational numbers.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "mesh/exact_triangles.hpp"
#include "mesh/mesh_cases.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/triangle_pair.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {

mesh::TrianglePoints points_of(const std::array<DoubleVec3, 3>& t) { return {{t[0], t[1], t[2]}}; }

std::vector<Pair> exact_pairs(const SmallMesh& mesh) {
  std::vector<Pair> pairs;
  const auto n = static_cast<std::uint32_t>(mesh.triangles.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = i + 1; j < n; ++j) {
      if (exactly_pair(mesh.triangles[i], mesh.triangles[j], mesh.points(i), mesh.points(j)))
        pairs.push_back({i, j});
    }
  }
  return pairs;
}

class Kinds : public testing::TestWithParam<MeshKind> {};

TEST_P(Kinds, TheRuleIsThatOfRationalNumbers) {
  for (std::uint64_t seed = 0; seed < seeds(5); ++seed) {
    for (const bool floats : {true, false}) {
      const SmallMesh mesh = small_mesh(GetParam(), floats, seed);
      for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t j = i + 1; j < mesh.triangles.size(); ++j) {
          const auto a = mesh.points(i), b = mesh.points(j);
          const mesh::TrianglePoints pa = points_of(a), pb = points_of(b);
          ASSERT_EQ(mesh::triangles_meet(pa, pb), exactly_meet(a, b))
              << "seed " << seed << ", triangles " << i << " and " << j;
          ASSERT_EQ(mesh::triangles_pair(mesh.triangles[i], mesh.triangles[j], pa, pb),
                    exactly_pair(mesh.triangles[i], mesh.triangles[j], a, b))
              << "seed " << seed << ", triangles " << i << " and " << j;
        }
      }
    }
  }
}

// A segment is a triangle with two equal vertices.
TEST_P(Kinds, SegmentsAndPointsMeetTriangles) {
  for (std::uint64_t seed = 0; seed < seeds(10); ++seed) {
    const SmallMesh mesh = small_mesh(GetParam(), seed % 2 == 0, seed);
    for (std::size_t i = 0; i + 1 < mesh.triangles.size(); ++i) {
      const auto a = mesh.points(i), b = mesh.points(i + 1);
      const mesh::TrianglePoints t = points_of(a);
      const int u_side = mesh::side(t, b[0]), v_side = mesh::side(t, b[1]);
      const bool meets = exactly_meet(a, {b[0], b[1], b[1]});
      ASSERT_EQ(mesh::segment_meets_triangle(b[0], b[1], t, u_side, v_side), meets)
          << "seed " << seed << ", triangles " << i << " and " << i + 1;
      ASSERT_EQ(mesh::segment_meets_triangle(b[1], b[0], t, v_side, u_side), meets)
          << "seed " << seed << ", triangles " << i << " and " << i + 1;
      ASSERT_EQ(mesh::in_triangle(b[0], t, u_side), exactly_meet(a, {b[0], b[0], b[0]}));
    }
  }
}

TEST_P(Kinds, TheSearchFindsThePairsOfRationalNumbers) {
  for (std::uint64_t seed = 100; seed < 100 + seeds(5); ++seed) {
    for (const bool floats : {true, false}) {
      const SmallMesh mesh = small_mesh(GetParam(), floats, seed);
      const std::vector<Pair> want = exact_pairs(mesh);
      Options options;
      options.order = Order::canonical;
      EXPECT_EQ(find_self_intersections({mesh.vertices, mesh.triangles}, options), want) << seed;
      if (!floats) continue;
      EXPECT_EQ(find_self_intersections({to_floats(mesh.vertices), mesh.triangles}, options), want)
          << seed;
    }
  }
}

// What a triangle shares by index is a set of vertices: with one or two, also of triangles that
// repeat an index, only points beyond them count.
TEST(RepeatedIndices, CountAsOneVertex) {
  const std::vector<DoubleVec3> vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {2, 0, 0}};
  const auto pairs = [&](const Triangle& a, const Triangle& b) {
    const std::vector<Triangle> triangles = {a, b};
    const auto points = [&](const Triangle& t) {
      return std::array<DoubleVec3, 3>{vertices[t.a], vertices[t.b], vertices[t.c]};
    };
    const bool expected = exactly_pair(a, b, points(a), points(b));
    for (const Isa isa : {Isa::scalar, Isa::automatic}) {
      Options options;
      options.isa = isa;
      EXPECT_NE(find_self_intersections({vertices, triangles}, options).empty(), expected);
    }
    return expected;
  };
  // The segment from 0 to 1, in all ways.
  const Triangle segments[] = {{0, 1, 1}, {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 1}};
  for (const Triangle& a : segments)
    for (const Triangle& b : segments) EXPECT_FALSE(pairs(a, b));
  EXPECT_FALSE(pairs({0, 0, 0}, {0, 0, 0}));
  EXPECT_FALSE(pairs({0, 0, 0}, {0, 1, 2}));
  EXPECT_FALSE(pairs({0, 1, 1}, {0, 1, 2}));
  EXPECT_TRUE(pairs({0, 1, 1}, {0, 3, 3}));  // one vertex, and more
  EXPECT_TRUE(pairs({0, 1, 2}, {0, 3, 3}));
  EXPECT_TRUE(pairs({0, 1, 2}, {2, 1, 0}));  // three
}

std::string name_of(const testing::TestParamInfo<MeshKind>& info) {
  static constexpr const char* names[] = {"random",   "small_grid",  "grid",    "flat",
                                          "line",     "nudged_grid", "slivers", "far_from_origin",
                                          "denormal", "huge"};
  return names[static_cast<int>(info.param)];
}
INSTANTIATE_TEST_SUITE_P(All, Kinds,
                         testing::Values(MeshKind::random, MeshKind::small_grid, MeshKind::grid,
                                         MeshKind::flat, MeshKind::line, MeshKind::nudged_grid,
                                         MeshKind::slivers, MeshKind::far_from_origin,
                                         MeshKind::denormal, MeshKind::huge),
                         name_of);

// Whether triangles i and i + 1 have six different vertices.
bool all_distinct(const SmallMesh& mesh, std::size_t i) {
  const Triangle &a = mesh.triangles[i], &b = mesh.triangles[i + 1];
  return std::set<std::uint32_t>{a.a, a.b, a.c, b.a, b.b, b.c}.size() == 6;
}

// A decision of the filter is that of the exact rule, and on random triangles it nearly always
// decides.
TEST(PlaneFilter, ADecisionIsExact) {
  std::size_t unsure = 0, all = 0;
  for (int kind = 0; kind < static_cast<int>(MeshKind::count); ++kind) {
    for (std::uint64_t seed = 0; seed < seeds(20); ++seed) {
      const SmallMesh mesh = small_mesh(static_cast<MeshKind>(kind), seed % 2 == 0, seed);
      for (std::size_t i = 0; i + 1 < mesh.triangles.size(); ++i) {
        const auto a = mesh.points(i), b = mesh.points(i + 1);
        const auto largest = [](const std::array<DoubleVec3, 3>& t) {
          double most = 0;
          for (const DoubleVec3& p : t)
            most = std::max({most, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
          return most;
        };
        if (std::max(largest(a), largest(b)) > mesh::Bounds<double>::largest) continue;
        const mesh::TrianglePoints pa = points_of(a), pb = points_of(b);
        const mesh::Decision meet = mesh::decide_meeting(pa.p, pb.p);
        if (meet != mesh::Decision::unsure) {
          ASSERT_EQ(meet == mesh::Decision::yes, mesh::triangles_meet(pa, pb));
        }
        const mesh::Decision vertex = mesh::decide_beyond_vertex(a[0], a[1], a[2], b[1], b[2]);
        if (vertex != mesh::Decision::unsure) {
          ASSERT_EQ(vertex == mesh::Decision::yes,
                    mesh::meet_beyond_vertex(a[0], a[1], a[2], b[1], b[2]));
        }
        const mesh::Decision edge = mesh::decide_beyond_edge(a[0], a[1], a[2], b[2]);
        if (edge != mesh::Decision::unsure) {
          ASSERT_EQ(edge == mesh::Decision::yes, mesh::meet_beyond_edge(a[0], a[1], a[2], b[2]));
        }
        if (static_cast<MeshKind>(kind) != MeshKind::random || !all_distinct(mesh, i)) continue;
        unsure += meet == mesh::Decision::unsure;
        ++all;
      }
    }
  }
  EXPECT_GT(all, 10u);
  EXPECT_EQ(unsure, 0u);
}

// Triangles (p, a1, a2) and (p, b1, b2) with a1 and b1 at one position: a common point, unless it
// is that of p.
TEST(PlaneFilter, VerticesAtOnePosition) {
  const DoubleVec3 p{1, 2, 3}, a2{2, 2, 3}, b2{1, 3, 3}, q{2, 3, 3};
  EXPECT_EQ(mesh::decide_beyond_vertex(p, q, a2, q, b2), mesh::Decision::yes);
  EXPECT_EQ(mesh::decide_beyond_vertex(p, a2, q, b2, q), mesh::Decision::yes);
  EXPECT_NE(mesh::decide_beyond_vertex(p, p, a2, p, b2), mesh::Decision::yes);
  EXPECT_FALSE(mesh::meet_beyond_vertex(p, p, a2, p, b2));
}

}  // namespace
}  // namespace throng::tests
