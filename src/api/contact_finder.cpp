// ContactFinder: checks arguments, and turns failures into messages.
#include <throng/contact.hpp>

#include <cmath>
#include <cstdio>
#include <new>
#include <utility>

#include <throng/find_pairs.hpp>

#include "base/float_state.hpp"
#include "base/large_pages.hpp"
#include "mesh/contact.hpp"
#include "validate.hpp"

namespace throng {

struct ContactFinder::State {
  explicit State(std::pmr::memory_resource* memory) noexcept
      : resource(memory), search(memory, sizeof(State)) {}
  std::pmr::memory_resource* resource;
  mesh::ContactSearch search;
};

namespace {

using ull = unsigned long long;
using mesh::InvalidElements;

bool valid_stride(std::size_t stride_bytes, std::size_t multiple, const char* name,
                  Result& r) noexcept {
  if (stride_bytes % multiple == 0) return true;
  set_message(r, "the stride of the %s is %llu bytes; it must be a multiple of %llu", name,
              ull{stride_bytes}, ull{multiple});
  return refuse(r, Status::bad_mesh);
}

bool valid_array(const void* data, std::size_t count, const char* name, Result& r) noexcept {
  if (count > max_box_count) {
    set_message(r, "there are %llu %s, at most %llu can be indexed; split the mesh", ull{count},
                name, ull{max_box_count});
    return refuse(r, Status::too_many_boxes);
  }
  if (data || count == 0) return true;
  set_message(r, "there are %llu %s but their address is null; give it, or count 0", ull{count},
              name);
  return refuse(r, Status::bad_mesh);
}

bool valid_vertices(const Vertices& v, const char* name, Result& r) noexcept {
  return valid_array(v.data(), v.size(), name, r) &&
         valid_stride(v.stride_bytes(), v.is_float() ? sizeof(float) : sizeof(double), name, r);
}

template <class Element>
bool valid_elements(const Strided<Element>& elements, const char* name, Result& r) noexcept {
  return valid_array(elements.data, elements.count, name, r) &&
         valid_stride(elements.stride_bytes, sizeof(std::uint32_t), name, r);
}

bool valid_mesh(const ContactMesh& m, Result& r) noexcept {
  if (m.dimension != 2 && m.dimension != 3) {
    set_message(r, "the dimension is %d; use 2 or 3", m.dimension);
    return refuse(r, Status::bad_mesh);
  }
  if (!valid_vertices(m.start, "start vertices", r) || !valid_vertices(m.end, "end vertices", r))
    return false;
  if (m.end.size() != 0 && m.end.size() != m.start.size()) {
    set_message(r,
                "there are %llu start vertices and %llu end vertices; give as many, or no end "
                "vertices if nothing moves",
                ull{m.start.size()}, ull{m.end.size()});
    return refuse(r, Status::bad_mesh);
  }
  if (!valid_elements(m.edges, "edges", r) ||
      (m.dimension == 3 && !valid_elements(m.faces, "faces", r)))
    return false;
  Filters filters;
  filters.group = m.group;
  filters.mask = m.mask;
  return valid_filters(filters, m.start.size(), "the mesh", {"vertex", "vertices"}, r);
}

bool valid_options(double radius, const Options& options, Result& r) noexcept {
  if (!(radius >= 0) || !std::isfinite(radius)) {
    set_message(r, "the radius is %g; it must be finite and not negative", radius);
    return refuse(r, Status::bad_option);
  }
  if (options.margin != 0) {
    set_message(r, "Options::margin is %g; set it to 0 and add it to the radius",
                double{options.margin});
    return refuse(r, Status::bad_option);
  }
  return valid_search(options, r) && valid_on_cpu(options, "contact candidates are found", r);
}

// Of an element that the search found invalid.
void explain(Result& r, const ContactMesh& m, const InvalidElements& invalid) noexcept {
  const bool edges = invalid.kind == InvalidElements::Kind::edge;
  const auto i = static_cast<std::size_t>(invalid.first);
  std::uint32_t corners[3];
  if (edges) {
    corners[0] = m.edges[i].a, corners[1] = corners[2] = m.edges[i].b;
  } else {
    corners[0] = m.faces[i].a, corners[1] = m.faces[i].b, corners[2] = m.faces[i].c;
  }
  const char* const plural = edges ? "edges" : "faces";
  const char* const one = edges ? "edge" : "face";
  const ull count{invalid.count}, index{invalid.first};
  for (const std::uint32_t v : corners) {
    if (v < m.start.size()) continue;
    set_message(r,
                "%llu %s are invalid, the first is %s %llu with vertex %lu of %llu; use 0 to one "
                "less than that",
                count, plural, one, index, static_cast<unsigned long>(v), ull{m.start.size()});
    return;
  }
  for (const std::uint32_t v : corners) {
    for (const Vertices* vertices : {&m.start, &m.end}) {
      if (vertices->size() == 0) continue;
      const DoubleVec3 p = (*vertices)[v];
      if (std::isfinite(p.x) && std::isfinite(p.y) && (m.dimension == 2 || std::isfinite(p.z)))
        continue;
      set_message(r,
                  "%llu %s are invalid, the first is %s %llu: its vertex %lu is (%g, %g, %g) at "
                  "the %s; make it finite, or leave the %s out",
                  count, plural, one, index, static_cast<unsigned long>(v), p.x, p.y, p.z,
                  vertices == &m.start ? "start" : "end", one);
      return;
    }
  }
}

}  // namespace

ContactFinder::~ContactFinder() {
  if (!state_) return;
  std::pmr::memory_resource* memory = state_->resource;
  state_->~State();
  memory->deallocate(state_, sizeof(State), alignof(State));
}
ContactFinder::ContactFinder(ContactFinder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      candidates_(std::exchange(other.candidates_, {})) {}
ContactFinder& ContactFinder::operator=(ContactFinder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(candidates_, other.candidates_);
  return *this;
}
std::size_t ContactFinder::memory_bytes() const noexcept {
  return state_ ? state_->search.held() : 0;
}

Result ContactFinder::find(const ContactMesh& mesh, double radius) noexcept {
  const base::FloatState float_state;
  Result r;
  candidates_ = {};
  if (!valid_options(radius, options_, r) || !valid_mesh(mesh, r)) return r;
  if (!state_) {
    std::pmr::memory_resource* memory = options_.memory;
    if (!memory) memory = base::large_blocks();
    void* block = allocate_state(*memory, sizeof(State), alignof(State), r);
    if (!block) return r;
    state_ = new (block) State(memory);
  }
  InvalidElements invalid;
  r = state_->search.find(mesh, radius, options_, invalid);
  candidates_ = state_->search.candidates();
  if (r.status == Status::bad_mesh) explain(r, mesh, invalid);
  throng::explain(r, false, false, "free some, or give a smaller mesh or radius");
  return r;
}

ContactCandidates find_contact_candidates(const ContactMesh& mesh, double radius,
                                          const Options& options) {
  ContactFinder finder(options);
  const Result r = finder.find(mesh, radius);
  if (!r.ok()) throw Error(r);
  const ContactCandidatesView& found = finder.candidates();
  const auto copy = [](const Pairs& pairs) {
    return std::vector<Pair>(pairs.begin(), pairs.end());
  };
  return {copy(found.vertex_face), copy(found.edge_edge), copy(found.edge_vertex)};
}

}  // namespace throng
