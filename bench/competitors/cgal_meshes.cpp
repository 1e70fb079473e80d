// CGAL's self_intersections, sequential and parallel, with the kernel that its examples use. Its
// headers are GPL, so the benchmark is never packaged. Making its mesh is not timed.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#if defined(CGAL_LINKED_WITH_TBB)
#include <tbb/global_control.h>
#endif

#include <algorithm>
#include <array>
#include <utility>

#include "meshes.hpp"

namespace throng::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Face = Surface::Face_index;
namespace pmp = CGAL::Polygon_mesh_processing;

Kernel::Point_3 point(const Vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// Face i is triangle i.
Surface surface_of(const Mesh& mesh) {
  Surface surface;
  for (const Vec3& v : mesh.vertices) surface.add_vertex(point(v));
  const bool manifold =
      std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
        return surface.add_face(Surface::Vertex_index(t.a), Surface::Vertex_index(t.b),
                                Surface::Vertex_index(t.c)) != Surface::null_face();
      });
  if (manifold) return surface;
  surface.clear();
  std::vector<Kernel::Point_3> points;
  for (const Vec3& v : mesh.vertices) points.push_back(point(v));
  std::vector<std::array<std::size_t, 3>> polygons;
  for (const Triangle& t : mesh.triangles) polygons.push_back({t.a, t.b, t.c});
  pmp::orient_polygon_soup(points, polygons);
  pmp::polygon_soup_to_polygon_mesh(points, polygons, surface);
  return surface;
}

Mesh mesh_of(const Surface& surface) {
  Mesh mesh;
  for (const auto vertex : surface.vertices()) {
    const auto& p = surface.point(vertex);
    mesh.vertices.push_back(
        {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  for (const auto face : surface.faces()) {
    std::uint32_t corners[3];
    std::size_t k = 0;
    for (const auto vertex : vertices_around_face(surface.halfedge(face), surface))
      corners[k++] = static_cast<std::uint32_t>(vertex);
    mesh.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return mesh;
}

template <class Tag>
class Cgal : public SelfIntersectionMethod {
 public:
  Cgal(std::shared_ptr<const Surface> surface, const char* name, unsigned threads)
      : surface_(std::move(surface)), name_(name), threads_(threads) {}

  std::string name() const override { return name_; }
  unsigned threads() const override { return threads_; }
  std::size_t run() override {
#if defined(CGAL_LINKED_WITH_TBB)
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads_);
#endif
    found_.clear();
    pmp::self_intersections<Tag>(faces(*surface_), *surface_, std::back_inserter(found_));
    return found_.size();
  }
  std::vector<Pair> pairs() const override {
    std::vector<Pair> all;
    for (const auto& [a, b] : found_)
      all.push_back(ordered(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)));
    return all;
  }

 private:
  std::shared_ptr<const Surface> surface_;
  const char* name_;
  unsigned threads_;
  std::vector<std::pair<Face, Face>> found_;
};

}  // namespace

SelfIntersectionMethods cgal_self_intersections(const Mesh& mesh,
                                                [[maybe_unused]] unsigned threads) {
  const auto surface = std::make_shared<const Surface>(surface_of(mesh));
  SelfIntersectionMethods all;
  all.mesh = mesh_of(*surface);
  all.methods.push_back(
      std::make_unique<Cgal<CGAL::Sequential_tag>>(surface, "CGAL self_intersections", 1));
#if defined(CGAL_LINKED_WITH_TBB)
  all.methods.push_back(std::make_unique<Cgal<CGAL::Parallel_tag>>(
      surface, "CGAL self_intersections, parallel", threads));
#endif
  return all;
}

}  // namespace throng::bench
