// Where a mesh intersects itself: pairs of triangles, and how each pair meets.
#include <throng/throng.hpp>

#include <cstdio>
#include <vector>

#include "check.hpp"

int main() {
  // snippet-begin: find
  // A strip of four triangles in the plane z = 0, and a fin: one triangle that stands in it.
  const std::vector<throng::Vec3> vertices = {{0, 0, 0},  {2, 0, 0},  {4, 0, 0},
                                              {0, 2, 0},  {2, 2, 0},  {4, 2, 0},
                                              {1, 1, -1}, {3, 1, -1}, {2, 1, 3}};
  const std::vector<throng::Triangle> triangles = {
      {0, 1, 3}, {1, 4, 3}, {1, 2, 4}, {2, 5, 4}, {6, 7, 8}};
  const throng::TriangleMesh mesh(vertices, triangles);
  throng::Options options;
  options.order = throng::Order::canonical;
  // Neighbors in the strip share vertices: they are no pairs.
  const std::vector<throng::Pair> pairs = throng::find_self_intersections(mesh, options);
  // snippet-end: find

  // snippet-begin: describe
  const char* const kinds[] = {"cross", "touch", "are coplanar"};
  const std::vector<throng::TriangleIntersection> found =
      throng::describe_intersections(mesh, mesh, pairs.data(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::printf("%u and %u %s:", pairs[i].first, pairs[i].second,
                kinds[static_cast<int>(found[i].kind)]);
    for (int k = 0; k < found[i].point_count; ++k) {
      const throng::DoubleVec3& p = found[i].points[k];
      std::printf(" (%g, %g, %g)", p.x, p.y, p.z);
    }
    std::puts("");
  }
  // snippet-end: describe
  const std::vector<throng::Pair> wanted = {{1, 4}, {2, 4}};
  CHECK(pairs == wanted);
}
