// C API of triangle meshes, implemented with the C++ API.
#include <throng/throng.h>

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <new>

#include <throng/find_pairs.hpp>
#include <throng/mesh.hpp>

#include "c_api_common.hpp"
#include "c_mesh_views.hpp"

using throng::c_api::is_ambiguous;
using throng::c_api::run_call;

static_assert(sizeof(throng_intersection) == sizeof(throng::TriangleIntersection) &&
              offsetof(throng_intersection, kind) == offsetof(throng::TriangleIntersection, kind) &&
              offsetof(throng_intersection, point_count) ==
                  offsetof(throng::TriangleIntersection, point_count) &&
              offsetof(throng_intersection, points) ==
                  offsetof(throng::TriangleIntersection, points));
static_assert(
    THRONG_INTERSECTION_CROSSING == static_cast<int>(throng::IntersectionKind::crossing) &&
    THRONG_INTERSECTION_TOUCHING == static_cast<int>(throng::IntersectionKind::touching) &&
    THRONG_INTERSECTION_COPLANAR == static_cast<int>(throng::IntersectionKind::coplanar) &&
    THRONG_INTERSECTION_NONE == static_cast<int>(throng::IntersectionKind::none));
static_assert(sizeof(throng::AffineTransform) == 12 * sizeof(double) &&
              sizeof(throng::Triangle) == 3 * sizeof(uint32_t));

struct throng_mesh_finder : throng::c_api::Handle {
  explicit throng_mesh_finder(const throng_options& given) noexcept
      : Handle(given), finder(options()) {}

  throng::MeshFinder finder;
};

namespace {

using throng::MeshResult;
using throng::Result;
using throng::Status;
using throng::c_api::as_c_pairs;
using throng::c_api::no_mesh;
using throng::c_api::refused;
using throng::c_api::two_arrays;
using throng::c_api::view_as;
using ConsumerFunction = int (*)(void* context, const throng_pair* pairs, size_t count);

throng::TriangleMesh view(const throng_mesh& c) noexcept {
  throng::TriangleMesh mesh;
  mesh.vertices = throng::c_api::view(c.vertices);
  mesh.triangles = view_as<throng::Triangle>(c.triangles);
  if (c.transform) std::memcpy(mesh.transform.row, c.transform, sizeof mesh.transform.row);
  mesh.filters = throng::c_api::filters_of(c, c.triangles.count);
  return mesh;
}

MeshResult as_mesh_result(const Result& r) noexcept {
  MeshResult mesh_result;
  static_cast<Result&>(mesh_result) = r;
  return mesh_result;
}

// Runs call(view of a), or with a second mesh call(both views).
template <class Call>
throng_status search(throng_mesh_finder* finder, const throng_mesh* a, const throng_mesh* b,
                     const Call& call) noexcept {
  return run_call(finder, true, "", [&]() -> MeshResult {
    if (!a) return as_mesh_result(no_mesh());
    if (is_ambiguous(a->vertices) || (b && is_ambiguous(b->vertices)))
      return as_mesh_result(two_arrays());
    return b ? call(view(*a), view(*b)) : call(view(*a));
  });
}

// Calls call(consumer of the C++ API).
template <class Call>
throng_status consume(throng_mesh_finder* finder, const throng_mesh* a, const throng_mesh* b,
                      ConsumerFunction consumer, void* context, const Call& call) noexcept {
  const auto take = [&](const throng::Pair* pairs, std::size_t count) {
    return consumer(context, reinterpret_cast<const throng_pair*>(pairs), count) != 0;
  };
  return search(finder, a, b, [&](const auto&... meshes) {
    if (!consumer) return as_mesh_result(throng::c_api::bad_option("found no consumer (NULL)"));
    return call(take, meshes...);
  });
}

throng_mesh packed(const throng_vertices& vertices, const uint32_t* triangles,
                   size_t triangle_count) noexcept {
  throng_mesh mesh{};
  mesh.vertices = vertices;
  mesh.triangles = {triangle_count, triangles, 0};
  return mesh;
}

}  // namespace

extern "C" {

throng_mesh throng_mesh_packed(const float* vertices, size_t vertex_count,
                               const uint32_t* triangles, size_t triangle_count) {
  return packed({vertex_count, vertices, nullptr, 0}, triangles, triangle_count);
}
throng_mesh throng_mesh_packed_doubles(const double* vertices, size_t vertex_count,
                                       const uint32_t* triangles, size_t triangle_count) {
  return packed({vertex_count, nullptr, vertices, 0}, triangles, triangle_count);
}

throng_mesh_finder* throng_mesh_finder_create(const throng_options* options) {
  return new (std::nothrow) throng_mesh_finder(throng::c_api::complete_options(options));
}
void throng_mesh_finder_destroy(throng_mesh_finder* finder) { delete finder; }

throng_status throng_mesh_finder_find(throng_mesh_finder* finder, const throng_mesh* a,
                                      const throng_mesh* b) {
  return search(finder, a, b,
                [&](const auto&... meshes) { return finder->finder.find(meshes...); });
}
throng_status throng_mesh_finder_find_into(throng_mesh_finder* finder, const throng_mesh* a,
                                           const throng_mesh* b, throng_pair* out,
                                           size_t capacity) {
  auto* const pairs = reinterpret_cast<throng::Pair*>(out);
  return search(finder, a, b, [&](const auto&... meshes) {
    return finder->finder.find(meshes..., pairs, capacity);
  });
}
throng_status throng_mesh_finder_consume(throng_mesh_finder* finder, const throng_mesh* a,
                                         const throng_mesh* b, ConsumerFunction consumer,
                                         void* context) {
  return consume(finder, a, b, consumer, context, [&](const auto& take, const auto&... meshes) {
    return finder->finder.consume(meshes..., take);
  });
}

throng_status throng_mesh_finder_find_within(throng_mesh_finder* finder, const throng_mesh* a,
                                             const throng_mesh* b, double distance) {
  return search(finder, a, b, [&](const auto&... meshes) {
    return finder->finder.find_within(meshes..., distance);
  });
}
throng_status throng_mesh_finder_find_within_into(throng_mesh_finder* finder, const throng_mesh* a,
                                                  const throng_mesh* b, double distance,
                                                  throng_pair* out, size_t capacity) {
  auto* const pairs = reinterpret_cast<throng::Pair*>(out);
  return search(finder, a, b, [&](const auto&... meshes) {
    return finder->finder.find_within(meshes..., distance, pairs, capacity);
  });
}
throng_status throng_mesh_finder_consume_within(throng_mesh_finder* finder, const throng_mesh* a,
                                                const throng_mesh* b, double distance,
                                                ConsumerFunction consumer, void* context) {
  return consume(finder, a, b, consumer, context, [&](const auto& take, const auto&... meshes) {
    return finder->finder.consume_within(meshes..., distance, take);
  });
}

const throng_pair* throng_mesh_finder_pairs(const throng_mesh_finder* finder, size_t* count) {
  return as_c_pairs(finder ? finder->finder.pairs() : throng::Pairs(), count);
}

throng_status throng_mesh_finder_describe(throng_mesh_finder* finder, const throng_mesh* a,
                                          const throng_mesh* b, const throng_pair* pairs,
                                          size_t count, throng_intersection* out) {
  return run_call(finder, true, "", [&]() -> Result {
    if (!a) return no_mesh();
    if (is_ambiguous(a->vertices) || (b && is_ambiguous(b->vertices))) return two_arrays();
    if (count != 0 && (!pairs || !out)) {
      return refused(Status::bad_option,
                     "found no pairs, or no array for their intersections (NULL); give both");
    }
    // One mesh is passed twice, so that messages name it as such.
    const throng::TriangleMesh mesh_a = view(*a), mesh_b = b ? view(*b) : throng::TriangleMesh();
    return throng::describe_intersections_into(
        mesh_a, b ? mesh_b : mesh_a, reinterpret_cast<const throng::Pair*>(pairs), count,
        reinterpret_cast<throng::TriangleIntersection*>(out), finder->options());
  });
}

const throng_result* throng_mesh_finder_result(const throng_mesh_finder* finder) {
  return throng::c_api::result_of(finder);
}
void throng_mesh_finder_stop(throng_mesh_finder* finder) {
  if (finder) finder->stop();
}
size_t throng_mesh_finder_memory_bytes(const throng_mesh_finder* finder) {
  return finder ? finder->finder.memory_bytes() : 0;
}

}  // extern "C"
