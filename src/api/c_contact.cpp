// C API of candidates for contact, implemented with the C++ API.
#include <throng/throng.h>

#include <cstddef>
#include <cstdint>
#include <new>

#include <throng/contact.hpp>

#include "c_api_common.hpp"
#include "c_mesh_views.hpp"

namespace c_api = throng::c_api;
using c_api::as_c_pairs;

static_assert(sizeof(throng::Edge) == 2 * sizeof(uint32_t));

struct throng_contact_finder : c_api::Handle {
  explicit throng_contact_finder(const throng_options& given) noexcept
      : Handle(given), finder(options()) {}

  throng::ContactFinder finder;
};

extern "C" {

throng_contact_finder* throng_contact_finder_create(const throng_options* options) {
  return new (std::nothrow) throng_contact_finder(c_api::complete_options(options));
}
void throng_contact_finder_destroy(throng_contact_finder* finder) { delete finder; }

throng_status throng_contact_finder_find(throng_contact_finder* finder,
                                         const throng_contact_mesh* mesh, double radius) {
  return c_api::run_call(finder, true, "", [&]() -> throng::Result {
    if (!mesh) return c_api::no_mesh();
    if (c_api::is_ambiguous(mesh->start) || c_api::is_ambiguous(mesh->end))
      return c_api::two_arrays();
    throng::ContactMesh m;
    m.start = c_api::view(mesh->start);
    m.end = c_api::view(mesh->end);
    m.edges = c_api::view_as<throng::Edge>(mesh->edges);
    m.faces = c_api::view_as<throng::Triangle>(mesh->faces);
    m.dimension = mesh->dimension == 0 ? 3 : mesh->dimension;
    m.rings = mesh->rings;
    m.group = c_api::strided<std::uint32_t>(mesh->group, mesh->start.count);
    m.mask = c_api::strided<std::uint32_t>(mesh->mask, mesh->start.count);
    return finder->finder.find(m, radius);
  });
}

const throng_pair* throng_contact_finder_vertex_face(const throng_contact_finder* finder,
                                                     size_t* count) {
  return as_c_pairs(finder ? finder->finder.candidates().vertex_face : throng::Pairs(), count);
}
const throng_pair* throng_contact_finder_edge_edge(const throng_contact_finder* finder,
                                                   size_t* count) {
  return as_c_pairs(finder ? finder->finder.candidates().edge_edge : throng::Pairs(), count);
}
const throng_pair* throng_contact_finder_edge_vertex(const throng_contact_finder* finder,
                                                     size_t* count) {
  return as_c_pairs(finder ? finder->finder.candidates().edge_vertex : throng::Pairs(), count);
}

const throng_result* throng_contact_finder_result(const throng_contact_finder* finder) {
  return c_api::result_of(finder);
}
void throng_contact_finder_stop(throng_contact_finder* finder) {
  if (finder) finder->stop();
}
size_t throng_contact_finder_memory_bytes(const throng_contact_finder* finder) {
  return finder ? finder->finder.memory_bytes() : 0;
}

}  // extern "C"
