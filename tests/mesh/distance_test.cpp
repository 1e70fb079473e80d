// Triangles within a distance: cases with known distances, one per pair of closest features.
#include "mesh/distance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::tests {
namespace {

using mesh::TrianglePoints;

constexpr TrianglePoints floor_triangle = {{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}}};

// The distance is a double, so it decides exactly, in each of the six orders of both triangles.
void expect_distance(const TrianglePoints& a, const TrianglePoints& b, double distance) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (int order = 0; order < 6; ++order) {
    const int i = order % 3, k = (i + 1 + order / 3) % 3, l = 3 - i - k;
    const TrianglePoints turned = {{a.p[i], a.p[k], a.p[l]}};
    for (const bool swapped : {false, true}) {
      const TrianglePoints &x = swapped ? b : turned, &y = swapped ? turned : b;
      EXPECT_TRUE(mesh::triangles_within(x, y, distance)) << distance;
      EXPECT_TRUE(mesh::triangles_within_exact(x, y, distance)) << distance;
      if (distance == 0) continue;
      const double below = std::min(distance * (1 - 1.1e-12), std::nextafter(distance, 0));
      EXPECT_FALSE(mesh::triangles_within(x, y, below)) << distance;
      EXPECT_FALSE(mesh::triangles_within_exact(x, y, std::nextafter(distance, 0))) << distance;
      EXPECT_TRUE(mesh::triangles_within(x, y, std::nextafter(distance, infinity))) << distance;
    }
  }
}

TEST(TrianglesWithin, VertexAndFace) {
  expect_distance(floor_triangle, {{{2, 2, 0.5}, {3, 9, 7}, {-1, 2, 5}}}, 0.5);
  expect_distance(floor_triangle, {{{2, 2, -0x1p-40}, {3, 9, -7}, {-1, 2, -5}}}, 0x1p-40);
}
TEST(TrianglesWithin, TwoEdges) {
  expect_distance({{{-1, 0, 0}, {1, 0, 0}, {0, 0, -5}}}, {{{0, -1, 3}, {0, 1, 3}, {0, 0, 9}}}, 3);
}
TEST(TrianglesWithin, ParallelEdges) {
  expect_distance({{{0, 0, 0}, {4, 0, 0}, {1, -5, 0}}}, {{{1, 3, 4}, {7, 3, 4}, {2, 9, 8}}}, 5);
}
TEST(TrianglesWithin, VertexAndEdge) {
  expect_distance(floor_triangle, {{{4, -3, 4}, {3, -9, 7}, {5, -9, 7}}}, 5);
}
TEST(TrianglesWithin, TwoVertices) {
  expect_distance(floor_triangle, {{{-2, -3, 6}, {-9, -9, 9}, {-5, -9, 19}}}, 7);
  // Farther apart than any of their coordinates.
  expect_distance({{{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}}}, {{{6, 6, 7}, {7, 6, 7}, {6, 7, 7}}}, 11);
}
TEST(TrianglesWithin, TwoFaces) {
  expect_distance(floor_triangle, {{{1, 1, 2}, {2, 1, 2}, {1, 2, 2}}}, 2);
  // In planes one float apart, far from the origin.
  expect_distance({{{1e7, 0, 0}, {1e7, 4, 0}, {1e7, 0, 4}}},
                  {{{10000001, 0, 0}, {10000001, 4, 0}, {10000001, 0, 4}}}, 1);
}
TEST(TrianglesWithin, WithoutArea) {
  expect_distance(floor_triangle, {{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}, 1);
  expect_distance(floor_triangle, {{{1, 1, 1}, {3, 1, 2}, {2, 1, 1.5}}}, 1);
  expect_distance({{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}, {{{1, 4, 5}, {1, 4, 5}, {1, 4, 5}}}, 5);
  expect_distance({{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}, {{{-5, 4, 5}, {5, 4, 5}, {0, 4, 5}}}, 5);
}
TEST(TrianglesWithin, CommonPoints) {
  expect_distance(floor_triangle, {{{1, 1, -9}, {2, 1, 9}, {1, 2, 9}}}, 0);  // far from all edges
  expect_distance(floor_triangle, {{{1, 1, 0}, {2, 1, 9}, {1, 2, 9}}}, 0);
  expect_distance(floor_triangle, floor_triangle, 0);
}
TEST(TrianglesWithin, ExtremeScales) {
  // sqrt(9 + 16) = 5 times the scale, exactly.
  for (const int exponent : {-1074, -1000, -600, -501, -500, 400, 498, 501, 600, 1018}) {
    const double one = std::ldexp(1.0, exponent);
    expect_distance(
        {{{0, 0, 0}, {4 * one, 0, 0}, {one, -5 * one, 0}}},
        {{{one, 3 * one, 4 * one}, {7 * one, 3 * one, 4 * one}, {2 * one, 9 * one, 8 * one}}},
        5 * one);
  }
  // Differences overflow.
  const double most = std::numeric_limits<double>::max();
  EXPECT_FALSE(mesh::triangles_within({{{most, 0, 0}, {most, 1, 0}, {most, 0, 1}}},
                                      {{{-most, 0, 0}, {-most, 1, 0}, {-most, 0, 1}}}, most));
  EXPECT_TRUE(mesh::triangles_within({{{most, 0, 0}, {most, 1, 0}, {most, 0, 1}}},
                                     {{{0, 0, 0}, {-most, 1, 0}, {-most, 0, 1}}}, most));
}
TEST(TrianglesWithin, TinyDistanceOfLargeTriangles) {
  for (const int exponent : {-10, -60, -150, -250, -1074}) {
    const double height = std::ldexp(1.0, exponent);
    expect_distance(floor_triangle, {{{1, 1, height}, {2, 1, height}, {1, 2, height}}}, height);
  }
}

}  // namespace
}  // namespace throng::tests
