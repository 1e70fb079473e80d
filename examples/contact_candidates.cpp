// Candidates for contact and continuous collision detection: a sheet of cloth falls onto a table.
#include <throng/throng.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

// The cloth has side x side vertices, the table the last four.
constexpr std::uint32_t side = 20, cloth = side * side;

std::vector<throng::DoubleVec3> vertices(double height) {
  std::vector<throng::DoubleVec3> points;
  for (std::uint32_t y = 0; y < side; ++y)
    for (std::uint32_t x = 0; x < side; ++x) points.push_back({0.1 * x, 0.1 * y, height});
  for (const double y : {-5.0, 5.0})
    for (const double x : {-5.0, 5.0}) points.push_back({x, y, 0.0});
  return points;
}

}  // namespace

int main() {
  std::vector<throng::Edge> edges;
  std::vector<throng::Triangle> faces;
  const auto add_square = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    faces.push_back({a, b, d});
    faces.push_back({a, d, c});
  };
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = y * side + x, b = a + 1, c = a + side, d = c + 1;
      if (x + 1 < side) edges.push_back({a, b});
      if (y + 1 < side) edges.push_back({a, c});
      if (x + 1 == side || y + 1 == side) continue;
      edges.push_back({a, d});
      add_square(a, b, c, d);
    }
  }
  add_square(cloth, cloth + 1, cloth + 2, cloth + 3);

  // snippet-begin: contact
  const std::vector<throng::DoubleVec3> start = vertices(0.05), end = vertices(-0.01);
  throng::ContactMesh mesh;
  mesh.start = start;
  mesh.end = end;
  mesh.edges = edges;
  mesh.faces = faces;
  mesh.rings = 2;  // no elements that two edges or fewer join

  throng::ContactFinder finder;  // keeps its memory from step to step
  const throng::Result result = finder.find(mesh, 0.001);
  if (!result.ok()) std::puts(result.message);
  for (const throng::Pair& pair : finder.candidates().vertex_face) {
    // pair.first: a vertex; pair.second: a face. Compute their time of impact.
    CHECK(pair.first < start.size() && pair.second < faces.size());
  }
  // snippet-end: contact
  CHECK(result.ok());
  // Each vertex of the cloth with both halves of the table, as the box of each half is that of the
  // table.
  CHECK(finder.candidates().vertex_face.size() == 2 * cloth);
  CHECK(finder.candidates().edge_edge.empty());

  // The cloth alone cannot meet itself: a filter per vertex.
  std::vector<std::uint32_t> group(start.size(), 1), mask(start.size(), 2);
  for (std::size_t v = cloth; v < start.size(); ++v) group[v] = 2, mask[v] = 1;
  mesh.rings = 0;
  CHECK(finder.find(mesh, 0.001).found > 2 * cloth);
  mesh.group = group;
  mesh.mask = mask;
  CHECK(finder.find(mesh, 0.001).found == 2 * cloth);
  std::printf("%llu candidates\n", static_cast<unsigned long long>(result.found));
}
