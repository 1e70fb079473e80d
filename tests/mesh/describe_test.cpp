// Descriptions of intersections through the public function.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "support/heap_count.hpp"

namespace throng::tests {
namespace {

using Kind = IntersectionKind;
using Point = std::array<double, 3>;

std::vector<Point> points_of(const TriangleIntersection& d) {
  std::vector<Point> points;
  for (int i = 0; i < d.point_count; ++i)
    points.push_back({d.points[i].x, d.points[i].y, d.points[i].z});
  return points;
}

// Two triangles with six vertices.
struct TwoMesh {
  std::vector<DoubleVec3> vertices;
  std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}};
  operator TriangleMesh() const { return {vertices, triangles}; }
};

const std::vector<Pair> the_pair = {{0, 1}};

TriangleIntersection describe(const TriangleMesh& mesh) {
  return describe_intersections(mesh, mesh, the_pair.data(), 1).at(0);
}

// The points, from the least one on; a polygon in its order.
void expect(const TwoMesh& mesh, Kind kind, std::vector<Point> points) {
  const TriangleIntersection d = describe(mesh);
  EXPECT_EQ(d.kind, kind);
  std::vector<Point> found = points_of(d);
  if (!found.empty())
    std::rotate(found.begin(), std::min_element(found.begin(), found.end()), found.end());
  EXPECT_EQ(found, points);
}

TEST(DescribeIntersections, Crossing) {
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, -1}, {1, 1, 1}, {3, 1, 1}}}, Kind::crossing,
         {{1, 1, 0}, {2, 1, 0}});
  // Interlocked: each has one vertex on the other side.
  expect({{{-4, 0, 0}, {4, -4, 0}, {4, 4, 0}, {8, 0, 0}, {0, 0, -4}, {0, 0, 4}}}, Kind::crossing,
         {{0, 0, 0}, {4, 0, 0}});
}
TEST(DescribeIntersections, TouchingInAPoint) {
  expect({{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, 0}, {1, 1, 1}, {2, 1, 1}}}, Kind::touching,
         {{1, 1, 0}});
  // Two edges cross.
  expect({{{0, 0, 0}, {2, 0, 0}, {1, -2, 0}, {1, -1, 0}, {1, 1, 0}, {1, 0, 3}}}, Kind::touching,
         {{1, -1, 0}, {1, 0, 0}});
  expect({{{0, 0, 0}, {2, 0, 0}, {1, -2, 0}, {1, 0, -1}, {1, 0, 1}, {1, 3, 0}}}, Kind::touching,
         {{1, 0, 0}});
  // Two vertices at one place, in different planes.
  expect({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {-1, 0, 1}, {-1, 0, 2}}}, Kind::touching,
         {{0, 0, 0}});
}
TEST(DescribeIntersections, TouchingInASegment) {
  // An edge in the inside of the other one, and an edge on an edge.
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, 0}, {3, 1, 0}, {1, 1, 5}}}, Kind::touching,
         {{1, 1, 0}, {3, 1, 0}});
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {-5, 0, 0}, {3, 0, 0}, {1, 1, 5}}}, Kind::touching,
         {{0, 0, 0}, {3, 0, 0}});
}
TEST(DescribeIntersections, SharedVerticesArePointsAsAnyOther) {
  TwoMesh mesh{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
  expect(mesh, Kind::touching, {{0, 0, 0}, {2, 0, 0}});
  mesh.triangles = {{0, 1, 2}, {1, 2, 0}};
  expect(mesh, Kind::coplanar, {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}});
}
TEST(DescribeIntersections, Coplanar) {
  // A point, a segment, a triangle, and a hexagon.
  expect({{{0, 0, 1}, {4, 0, 1}, {0, 4, 1}, {4, 0, 1}, {5, 0, 1}, {5, 1, 1}}}, Kind::coplanar,
         {{4, 0, 1}});
  expect({{{0, 0, 1}, {4, 0, 1}, {0, 4, 1}, {1, 0, 1}, {9, 0, 1}, {5, -1, 1}}}, Kind::coplanar,
         {{1, 0, 1}, {4, 0, 1}});
  expect({{{0, 0, 1}, {4, 0, 1}, {0, 4, 1}, {-9, 1, 1}, {1, 1, 1}, {1, -9, 1}}}, Kind::coplanar,
         {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
  expect({{{0, -3, 0}, {0, 6, -6}, {0, 6, 6}, {0, 9, 0}, {0, 0, -6}, {0, 0, 6}}}, Kind::coplanar,
         {{0, 0, -2}, {0, 3, -4}, {0, 6, -2}, {0, 6, 2}, {0, 3, 4}, {0, 0, 2}});
}
TEST(DescribeIntersections, WithoutArea) {
  // A segment through a triangle is on its own edge.
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 2, -1}, {1, 2, 1}, {1, 2, 0.5}}}, Kind::touching,
         {{1, 2, 0}});
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 2, 0}, {1, 2, 0}, {1, 2, 0}}}, Kind::coplanar,
         {{1, 2, 0}});
  // Segments on one line, and crossing.
  expect({{{0, 0, 0}, {4, 4, 4}, {2, 2, 2}, {3, 3, 3}, {9, 9, 9}, {3, 3, 3}}}, Kind::coplanar,
         {{3, 3, 3}, {4, 4, 4}});
  expect({{{0, 0, 0}, {4, 4, 0}, {4, 4, 0}, {0, 4, 0}, {4, 0, 0}, {3, 1, 0}}}, Kind::coplanar,
         {{2, 2, 0}});
  // Skew lines.
  expect({{{0, 0, 0}, {4, 4, 0}, {4, 4, 0}, {0, 4, 1}, {4, 0, 1}, {3, 1, 1}}}, Kind::none, {});
}
TEST(DescribeIntersections, Apart) {
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {0, 0, 1}, {8, 0, 1}, {0, 8, 1}}}, Kind::none, {});
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {5, 5, -1}, {5, 5, 1}, {9, 9, 1}}}, Kind::none, {});
  // In one plane.
  expect({{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {5, 5, 0}, {9, 9, 0}, {9, 5, 0}}}, Kind::none, {});
}
TEST(DescribeIntersections, ZerosHaveNoSign) {
  const TriangleIntersection d = describe(TwoMesh{
      {{-0.0, -0.0, -0.0}, {4, -0.0, 0}, {0, 4, -0.0}, {-0.0, 0, 0}, {0, 0, 1}, {0, -1, 1}}});
  ASSERT_EQ(d.point_count, 1);
  for (const double x : {d.points[0].x, d.points[0].y, d.points[0].z}) {
    EXPECT_EQ(x, 0);
    EXPECT_FALSE(std::signbit(x));
  }
}

TEST(DescribeIntersections, TwoMeshesWithTransforms) {
  const std::vector<Vec3> floats = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const std::vector<Triangle> one = {{0, 1, 2}};
  const TriangleMesh flat(floats, one);
  TriangleMesh turned(floats, one);
  // (x, y, z) to (1 + z, y, x - 1): through the first one, in the plane x = 1.
  turned.transform = {{{0, 0, 1, 1}, {0, 1, 0, 0}, {1, 0, 0, -1}}};
  const Pair pair = {0, 0};
  const auto found = describe_intersections(flat, turned, &pair, 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, Kind::crossing);
  std::vector<Point> points = points_of(found[0]);
  std::sort(points.begin(), points.end());
  EXPECT_EQ(points, (std::vector<Point>{{1, 0, 0}, {1, 3, 0}}));
  // The same the other way round, and moved out of reach.
  EXPECT_EQ(points_of(describe_intersections(turned, flat, &pair, 1).at(0)).size(), 2u);
  turned.transform.row[2][3] = 1;
  const TriangleIntersection apart = describe_intersections(flat, turned, &pair, 1).at(0);
  EXPECT_EQ(apart.point_count, 0);
  EXPECT_EQ(apart.kind, Kind::none);
}

// Every pair that the finder reports in a scene has a description with points, and threads and the
// rest of the pairs change nothing.
TEST(DescribeIntersections, OfManyPairs) {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  std::uint32_t state = 1;
  const auto draw = [&state] {
    state = state * 1664525 + 1013904223;
    return static_cast<float>(state >> 22) * 0x1p-10f;
  };
  for (std::uint32_t i = 0; i < 900; i += 3) {
    const Vec3 corner = {draw(), draw(), draw()};
    for (int k = 0; k < 3; ++k)
      vertices.push_back(
          {corner.x + draw() * 0.5f, corner.y + draw() * 0.5f, corner.z + draw() * 0.5f});
    triangles.push_back({i, i + 1, i + 2});
  }
  const TriangleMesh mesh(vertices, triangles);
  Options options;
  options.order = Order::canonical;
  const std::vector<Pair> pairs = find_self_intersections(mesh, options);
  ASSERT_GE(pairs.size(), 300u);
  const auto together = describe_intersections(mesh, mesh, pairs);
  ASSERT_EQ(together.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_GE(together[i].point_count, 1);
    Options one_thread;
    one_thread.threads = 1;
    const auto alone = describe_intersections(mesh, mesh, &pairs[i], 1, one_thread);
    EXPECT_EQ(alone[0].kind, together[i].kind);
    EXPECT_EQ(points_of(alone[0]), points_of(together[i]));
  }
  EXPECT_TRUE(describe_intersections(mesh, mesh, nullptr, 0).empty());
}

TEST(DescribeIntersections, RunsOnTheExecutor) {
  struct Calls {
    unsigned runs = 0, tasks = 0;
  } calls;
  Executor executor;
  executor.concurrency = 3;
  executor.self = &calls;
  executor.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    auto& seen = *static_cast<Calls*>(self);
    ++seen.runs;
    seen.tasks += count;
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  Options options;
  options.executor = &executor;
  const TwoMesh mesh{{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, -1}, {1, 1, 1}, {3, 1, 1}}};
  const std::vector<Pair> pairs(1000, Pair{0, 1});
  const auto found = describe_intersections(mesh, mesh, Pairs{pairs.data(), pairs.size()}, options);
  EXPECT_EQ(calls.runs, 1u);
  EXPECT_EQ(calls.tasks, 3u);
  for (const TriangleIntersection& d : found) EXPECT_EQ(d.point_count, 2);
}

TEST(DescribeIntersections, IntoAnArray) {
  const TwoMesh two{{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, -1}, {1, 1, 1}, {3, 1, 1}}};
  const TriangleMesh mesh = two;
  const Pair pairs[2] = {{0, 1}, {0, 0}};
  TriangleIntersection out[3];
  out[2].point_count = 77;
  Options options;
  options.threads = 1;
  HeapCount::start();
  const Result r = describe_intersections_into(mesh, mesh, pairs, 2, out, options);
  EXPECT_EQ(HeapCount::stop(), 0u);
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(r.found, 2u);
  EXPECT_EQ(r.written, 2u);
  const auto want = describe_intersections(mesh, mesh, pairs, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(out[i].kind, want[i].kind);
    EXPECT_EQ(points_of(out[i]), points_of(want[i]));
  }
  EXPECT_EQ(out[2].point_count, 77);
  EXPECT_TRUE(describe_intersections_into(mesh, mesh, nullptr, 0, nullptr).ok());
  const Result no_array = describe_intersections_into(mesh, mesh, pairs, 2, nullptr);
  EXPECT_EQ(no_array.status, Status::bad_option);
  EXPECT_STREQ(no_array.message,
               "the array for the intersections is null; give the address of room for 2");
  EXPECT_EQ(describe_intersections_into(mesh, mesh, nullptr, 2, out).status, Status::bad_option);
  const Pair bad = {0, 2};
  EXPECT_EQ(describe_intersections_into(mesh, mesh, &bad, 1, out).status, Status::bad_mesh);
}

// The message of the error that the call throws.
std::string error_of(const TriangleMesh& a, const TriangleMesh& b, const std::vector<Pair>& pairs,
                     Status status, std::uint64_t first_invalid, const Options& options = {}) {
  try {
    (void)describe_intersections(a, b, pairs.data(), pairs.size(), options);
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), status);
    EXPECT_EQ(error.result().first_invalid, first_invalid);
    return error.what();
  }
  return "no error";
}

TEST(DescribeIntersections, Errors) {
  TwoMesh mesh{{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, -1}, {1, 1, 1}, {3, 1, 1}}};
  const TwoMesh other = mesh;
  std::vector<Pair> pairs(300, Pair{0, 1});
  pairs[200] = {0, 7};
  pairs[250] = {9, 0};
  pairs[251] = {0, ~0u};
  pairs[252] = {~0u, 0};
  EXPECT_EQ(error_of(mesh, other, pairs, Status::bad_mesh, 200),
            "throng: pair 200 has triangle 7 as its second, but the second mesh has 2 triangles, "
            "counted from 0; pass the meshes for which the pairs were found, in the same order");
  pairs[100] = {2, 0};
  const TriangleMesh view = mesh;
  EXPECT_EQ(error_of(view, view, pairs, Status::bad_mesh, 100),
            "throng: pair 100 has triangle 2 as its first, but the mesh has 2 triangles, counted "
            "from 0; pass the meshes for which the pairs were found, in the same order");
  EXPECT_EQ(error_of(view, view, {{0, 3}}, Status::bad_mesh, 0),
            "throng: pair 0 has triangle 3 as its second, but the mesh has 2 triangles, counted "
            "from 0; pass the meshes for which the pairs were found, in the same order");
  EXPECT_EQ(error_of({}, other, the_pair, Status::bad_mesh, 0),
            "throng: pair 0 has triangle 0 as its first, but the first mesh has 0 triangles, "
            "counted from 0; pass the meshes for which the pairs were found, in the same order");

  mesh.triangles[1].b = 6;
  EXPECT_EQ(error_of(other, mesh, the_pair, Status::bad_mesh, 1),
            "throng: triangle 1 of the second mesh has vertex 6, but there are 6 vertices, counted "
            "from 0; fix the index");
  mesh.triangles[1].b = 4;
  mesh.vertices[5].y = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_of(mesh, other, {{1, 0}}, Status::bad_mesh, 1),
            "throng: triangle 1 of the first mesh uses vertex 5 at (3, inf, 1); coordinates must "
            "be finite");
  // No pair has it.
  EXPECT_EQ(error_of(mesh, other, {{0, 1}}, Status::ok, 0), "no error");
  mesh.vertices[5].y = 1;
  TriangleMesh moved = mesh;
  moved.transform.row[0][0] = 1e308;
  EXPECT_EQ(error_of(moved, other, the_pair, Status::bad_mesh, 0),
            "throng: triangle 0 of the first mesh uses vertex 1 at (8, 0, 0), not finite after the "
            "transform; coordinates must be finite");
  moved.triangles.stride_bytes = 3;
  EXPECT_NE(error_of(moved, other, the_pair, Status::bad_mesh, 0).find("multiple of 4"),
            std::string::npos);
  EXPECT_THROW((void)describe_intersections(other, other, nullptr, 3), Error);

  const std::atomic<bool> stop{true};
  Options options;
  options.stop = &stop;
  EXPECT_EQ(error_of(other, other, the_pair, Status::stopped, 0, options),
            "throng: stopped by Options::stop");
}

}  // namespace
}  // namespace throng::tests
