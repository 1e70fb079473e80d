// Candidates for contact and continuous collision detection.
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include <throng/contact.hpp>

#include "python/errors.hpp"
#include "python/mesh_arrays.hpp"
#include "python/options.hpp"
#include "python/pair_search.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

// A moving mesh as given, and the objects that keep its view valid.
class ContactArrays {
 public:
  // `end`: None if nothing moves. `dimension`: 2, 3, or None for that of `start`.
  ContactArrays(nb::handle start, nb::handle end, nb::handle edges, nb::handle faces,
                nb::handle dimension, nb::handle rings, nb::handle group, nb::handle mask) {
    const PointArray first = import_points(start, "vertices_t0", true, kept_);
    view_.start = first.view;
    const std::size_t n = view_.start.size();
    if (!end.is_none()) {
      const PointArray last = import_points(end, "vertices_t1", true, kept_);
      if (last.view.size() != n || last.dimensions != first.dimensions) {
        value_error("vertices_t1: found " + std::to_string(last.view.size()) + " vertices of " +
                    std::to_string(last.dimensions) + " coordinates, wanted " + std::to_string(n) +
                    " of " + std::to_string(first.dimensions) + " as in vertices_t0");
      }
      view_.end = last.view;
    }
    view_.dimension = static_cast<int>(first.dimensions);
    if (!dimension.is_none()) {
      view_.dimension = static_cast<int>(parse_integer(dimension, "dimension", 3));
      if (view_.dimension < 2 || (view_.dimension == 3 && first.dimensions == 2)) {
        value_error("dimension: found " + described(dimension) + ", wanted 2" +
                    (first.dimensions == 2 ? " for vertices of two coordinates" : " or 3"));
      }
    }
    if (!edges.is_none()) view_.edges = import_index_rows<Edge>(edges, "edges", kept_);
    if (!faces.is_none()) view_.faces = import_index_rows<Triangle>(faces, "faces", kept_);
    view_.rings = static_cast<unsigned>(parse_integer(rings, "rings", 65535));
    view_.group = import_values<std::uint32_t>(group, "group", n, kept_, nullptr, "vertex");
    view_.mask = import_values<std::uint32_t>(mask, "mask", n, kept_, nullptr, "vertex");
  }

  const ContactMesh& view() const noexcept { return view_; }
  std::size_t element_count() const noexcept {
    return view_.start.size() + view_.edges.count + view_.faces.count;
  }

 private:
  ContactMesh view_;
  KeepAlive kept_;
};

// A copy, filled without the interpreter's lock.
std::unique_ptr<std::uint32_t[]> copy_of(Pairs pairs) {
  std::unique_ptr<std::uint32_t[]> values(new std::uint32_t[2 * pairs.size() + 1]);
  if (pairs.size()) std::memcpy(values.get(), pairs.data(), pairs.size() * sizeof(Pair));
  return values;
}

class ContactFinderObject {
 public:
  explicit ContactFinderObject(const Options& options) : search_(true) {
    finder_.set_options(search_.with_executor(options));
  }

  // (vertex_face, edge_edge, edge_vertex), each (k, 2) uint32.
  nb::tuple find(const ContactArrays& mesh, double radius) {
    const PairSearch::Guard busy(search_);
    std::unique_ptr<std::uint32_t[]> pairs[3];
    ContactCandidatesView found;
    search_.run(mesh.element_count(), [&] {
      Result result = finder_.find(mesh.view(), radius);
      if (!result.ok()) return result;
      found = finder_.candidates();
      pairs[0] = copy_of(found.vertex_face);
      pairs[1] = copy_of(found.edge_edge);
      pairs[2] = copy_of(found.edge_vertex);
      return result;
    });
    require_ok(search_.result());
    return nb::make_tuple(numpy_array(std::move(pairs[0]), {found.vertex_face.size(), 2}),
                          numpy_array(std::move(pairs[1]), {found.edge_edge.size(), 2}),
                          numpy_array(std::move(pairs[2]), {found.edge_vertex.size(), 2}));
  }

  const Result& result() const noexcept { return search_.result(); }
  std::size_t memory_bytes() const noexcept { return finder_.memory_bytes(); }

 private:
  ContactFinder finder_;
  PairSearch search_;
};

}  // namespace

void bind_contact(nb::module_& m) {
  nb::class_<ContactFinderObject>(m, "ContactFinder")
      .def(
          "__init__",
          [](ContactFinderObject* self, nb::handle order, nb::handle isa, nb::handle threads) {
            Options o;
            o.order = order_of(order);
            o.isa = isa_of(isa);
            o.threads = threads_of(threads);
            new (self) ContactFinderObject(o);
          },
          nb::arg("order").none(), nb::arg("isa").none(), nb::arg("threads").none())
      .def(
          "find",
          [](ContactFinderObject& self, nb::handle start, nb::handle end, nb::handle edges,
             nb::handle faces, nb::handle radius, nb::handle dimension, nb::handle rings,
             nb::handle group, nb::handle mask) {
            const double r = length_of(radius, "radius");
            return self.find(ContactArrays(start, end, edges, faces, dimension, rings, group, mask),
                             r);
          },
          nb::arg("vertices_t0").none(), nb::arg("vertices_t1").none(), nb::arg("edges").none(),
          nb::arg("faces").none(), nb::arg("radius").none(), nb::arg("dimension").none(),
          nb::arg("rings").none(), nb::arg("group").none(), nb::arg("mask").none())
      .def_prop_ro("result", [](const ContactFinderObject& self) { return self.result(); })
      .def_prop_ro("memory_bytes", &ContactFinderObject::memory_bytes);
}

}  // namespace throng::python
