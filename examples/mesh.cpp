// Triangle meshes: where a mesh intersects itself or another one, what is near, and what to do with
// the pairs.
#include <throng/throng.hpp>

#include <cstdio>
#include <utility>
#include <vector>

#include "check.hpp"

namespace {

struct Mesh {
  std::vector<throng::Vec3> vertices;
  std::vector<throng::Triangle> triangles;
};

// A tetrahedron with its corner at (x, y, z).
void add_tetrahedron(Mesh& mesh, float x, float y, float z, float size) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const throng::Vec3& p :
       std::vector<throng::Vec3>{{x, y, z}, {x + size, y, z}, {x, y + size, z}, {x, y, z + size}}) {
    mesh.vertices.push_back(p);
  }
  for (const throng::Triangle& t :
       std::vector<throng::Triangle>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    mesh.triangles.push_back({first + t.a, first + t.b, first + t.c});
  }
}

// snippet-begin: report
// Reports the intersecting triangles of a mesh; false on an error.
bool report(throng::MeshFinder& finder, const throng::TriangleMesh& mesh) {
  const throng::MeshResult result = finder.find(mesh);
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.message);
    return false;
  }
  std::printf("%llu of %llu candidates intersect, %llu needed exact arithmetic\n",
              static_cast<unsigned long long>(result.found),
              static_cast<unsigned long long>(result.candidates),
              static_cast<unsigned long long>(result.exact_tests));
  return true;
}
// snippet-end: report

// snippet-begin: parts
// The parts of a mesh that must be repaired: triangles that intersect, one number per connected
// part.
std::vector<std::vector<std::uint32_t>> parts(std::size_t triangle_count,
                                              const std::vector<throng::Pair>& pairs) {
  std::vector<std::uint32_t> parent(triangle_count);
  for (std::uint32_t i = 0; i < triangle_count; ++i) parent[i] = i;
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const throng::Pair& pair : pairs) parent[root(pair.second)] = root(pair.first);
  std::vector<std::vector<std::uint32_t>> members(triangle_count), found;
  for (std::uint32_t i = 0; i < triangle_count; ++i) members[root(i)].push_back(i);
  for (std::vector<std::uint32_t>& part : members) {
    if (part.size() > 1) found.push_back(std::move(part));
  }
  return found;
}
// snippet-end: parts

}  // namespace

int main() {
  Mesh mesh;
  add_tetrahedron(mesh, 0, 0, 0, 4);
  add_tetrahedron(mesh, 1, 1, -1, 1.5f);  // sticks through the bottom of the first
  add_tetrahedron(mesh, 6, 0, 0, 1);
  const std::vector<throng::Vec3>& vertices = mesh.vertices;
  const std::vector<throng::Triangle>& triangles = mesh.triangles;

  // snippet-begin: self
  // std::vector<throng::Vec3> vertices; std::vector<throng::Triangle> triangles;
  const std::vector<throng::Pair> pairs = throng::find_self_intersections({vertices, triangles});
  for (const throng::Pair& pair : pairs) std::printf("%u intersects %u\n", pair.first, pair.second);
  // snippet-end: self
  CHECK(pairs.size() == 3);
  CHECK(parts(triangles.size(), pairs).size() == 1);
  CHECK(parts(triangles.size(), pairs)[0].size() == 4);

  std::vector<throng::Vec3> positions = vertices;
  // snippet-begin: frames
  throng::MeshFinder finder;                                // keeps its memory
  const throng::TriangleMesh moving(positions, triangles);  // a view: reads the positions in find()
  for (int frame = 0; frame < 3; ++frame) {
    for (throng::Vec3& v : positions) v.z *= 0.99f;  // your simulation
    if (!finder.find(moving).ok()) break;
    std::printf("frame %d: %zu pairs, %zu bytes held\n", frame, finder.pairs().size(),
                finder.memory_bytes());
  }
  // snippet-end: frames
  const std::size_t held = finder.memory_bytes();
  CHECK(finder.find(moving).ok() && finder.pairs().size() == 3 && finder.memory_bytes() == held);
  CHECK(report(finder, {vertices, triangles}));

  // snippet-begin: gpu
  throng::Options options;
  options.backend = throng::Backend::cuda;  // arrays in host memory; they are copied
  throng::MeshFinder on_gpu(options);
  const throng::MeshResult result = on_gpu.find({vertices, triangles});
  if (result.status == throng::Status::no_device) std::fprintf(stderr, "%s\n", result.message);
  // snippet-end: gpu
  CHECK(result.status == throng::Status::no_device || on_gpu.pairs().size() == pairs.size());

  // snippet-begin: describe
  const std::vector<throng::TriangleIntersection> described =
      throng::describe_intersections({vertices, triangles}, {vertices, triangles}, pairs);
  for (const throng::TriangleIntersection& i : described) {
    if (i.point_count != 2) continue;  // a segment
    const throng::DoubleVec3 &p = i.points[0], &q = i.points[1];
    std::printf("(%g, %g, %g) to (%g, %g, %g)\n", p.x, p.y, p.z, q.x, q.y, q.z);
  }
  // snippet-end: describe
  CHECK(described.size() == 3 && described[0].kind == throng::IntersectionKind::crossing);

  const Mesh& robot = mesh;
  Mesh shelf;
  add_tetrahedron(shelf, 0.5f, 0.5f, 0, 2);
  // snippet-begin: two
  throng::TriangleMesh moved(robot.vertices, robot.triangles);
  moved.transform.row[2][3] = 1.5;  // 1.5 up; the matrix is (rotation | translation)
  const std::vector<throng::Pair> hits =
      throng::find_intersections(moved, {shelf.vertices, shelf.triangles});
  // first: a triangle of `moved`, second: one of the shelf
  // snippet-end: two
  CHECK(!hits.empty());

  // snippet-begin: within
  // Triangles at most 2.5 apart; neighbors that share a vertex are left out.
  const std::vector<throng::Pair> near = throng::find_within({vertices, triangles}, 2.5);
  // snippet-end: within
  CHECK(near.size() > pairs.size());
  return 0;
}
