// Triangle meshes: the finder of intersections, and their description.
#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include <throng/find_pairs.hpp>
#include <throng/mesh.hpp>

#include "python/errors.hpp"
#include "python/mesh_arrays.hpp"
#include "python/options.hpp"
#include "python/pair_search.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

// One mesh or two.
struct Meshes {
  std::unique_ptr<MeshArrays> a, b;  // b may be null

  std::size_t size() const noexcept { return a->view().size() + (b ? b->view().size() : 0); }
  template <class Call>
  Result operator()(const Call& call) const {
    return b ? call(a->view(), b->view()) : call(a->view());
  }
};

Meshes meshes_of(const nb::tuple& mesh, nb::handle other, const nb::tuple& filters,
                 const nb::tuple& other_filters) {
  Meshes meshes;
  meshes.a = std::make_unique<MeshArrays>(mesh, filters, "");
  if (!other.is_none()) {
    meshes.b = std::make_unique<MeshArrays>(nb::cast<nb::tuple>(other), other_filters, "other_");
  }
  return meshes;
}

class MeshFinderObject {
 public:
  MeshFinderObject(const Options& options, bool once) : search_(once) {
    finder_.set_options(search_.with_executor(options));
  }

  // `distance` None: intersections.
  nb::object find(const Meshes& meshes, nb::handle distance) {
    const PairSearch::Guard busy(search_);
    const bool is_within = !distance.is_none();
    const double d = is_within ? length_of(distance, "distance") : 0;
    return search_.find(meshes.size(), [&](Pair* out, std::size_t capacity) {
      return meshes([&](const auto&... mesh) {
        return keep(is_within ? finder_.find_within(mesh..., d, out, capacity)
                              : finder_.find(mesh..., out, capacity));
      });
    });
  }

  void consume(const Meshes& meshes, nb::handle distance, nb::handle callback) {
    const PairSearch::Guard busy(search_);
    const bool is_within = !distance.is_none();
    const double d = is_within ? length_of(distance, "distance") : 0;
    search_.consume(meshes.size(), callback, [&](Consumer consumer) {
      return meshes([&](const auto&... mesh) {
        return keep(is_within ? finder_.consume_within(mesh..., d, consumer)
                              : finder_.consume(mesh..., consumer));
      });
    });
  }

  const MeshResult& result() const noexcept { return result_; }
  std::size_t memory_bytes() const noexcept { return finder_.memory_bytes(); }

 private:
  Result keep(const MeshResult& result) { return result_ = result; }

  MeshFinder finder_;
  MeshResult result_;
  PairSearch search_;
};

void init_finder(MeshFinderObject* self, nb::handle order, nb::handle algorithm, nb::handle backend,
                 nb::handle isa, nb::handle threads, nb::handle memory_cap, bool once) {
  Options o;
  o.order = order_of(order);
  o.algorithm = algorithm_of(algorithm);
  o.backend = backend_of(backend);
  o.isa = isa_of(isa);
  o.threads = threads_of(threads);
  o.memory_cap_bytes = bytes_of(memory_cap, "memory_cap");
  new (self) MeshFinderObject(o, once);
}

// (kind, count, points): uint8 of shape (k,) twice, float64 of shape (k, 6, 3), NaN beyond count.
nb::tuple describe(nb::handle pairs, const nb::tuple& mesh, nb::handle other, nb::handle threads) {
  const nb::tuple no_filters =
      nb::make_tuple(nb::none(), nb::none(), nb::none(), nb::none(), nb::none());
  const Meshes meshes = meshes_of(mesh, other, no_filters, no_filters);
  const TriangleMesh& a = meshes.a->view();
  const TriangleMesh& b = meshes.b ? meshes.b->view() : a;
  KeepAlive kept;
  const Strided<Pair> rows = import_index_rows<Pair>(pairs, "pairs", kept);
  const std::size_t n = rows.count;
  std::vector<Pair> copy;
  if (n && rows.stride_bytes != sizeof(Pair)) {
    copy.resize(n);
    for (std::size_t i = 0; i < n; ++i) copy[i] = rows[i];
  }
  constexpr std::size_t most = std::size(TriangleIntersection{}.points);
  auto kind = std::make_unique<std::uint8_t[]>(n + 1);
  auto count = std::make_unique<std::uint8_t[]>(n + 1);
  auto points = std::make_unique<double[]>(3 * most * n + 1);
  PairSearch search(true);
  Options options;
  options.threads = threads_of(threads);
  options = search.with_executor(options);
  const auto all = std::make_unique<TriangleIntersection[]>(n);
  search.run(n, [&] {
    const Result r = describe_intersections_into(a, b, copy.empty() ? rows.data : copy.data(), n,
                                                 all.get(), options);
    double* out = points.get();
    for (std::size_t i = 0; r.ok() && i < n; ++i) {
      kind[i] = static_cast<std::uint8_t>(all[i].kind);
      count[i] = all[i].point_count;
      for (std::size_t k = 0; k < most; ++k, out += 3) {
        const double nan = std::numeric_limits<double>::quiet_NaN();
        const DoubleVec3 p = k < count[i] ? all[i].points[k] : DoubleVec3{nan, nan, nan};
        out[0] = p.x, out[1] = p.y, out[2] = p.z;
      }
    }
    return r;
  });
  require_ok(search.result());
  return nb::make_tuple(numpy_array(std::move(kind), {n}), numpy_array(std::move(count), {n}),
                        numpy_array(std::move(points), {n, most, 3}));
}

}  // namespace

void bind_mesh(nb::module_& m) {
  nb::class_<MeshFinderObject>(m, "MeshFinder")
      .def("__init__", init_finder, nb::arg("order").none(), nb::arg("algorithm").none(),
           nb::arg("backend").none(), nb::arg("isa").none(), nb::arg("threads").none(),
           nb::arg("memory_cap").none(), nb::arg("once"))
      .def(
          "find",
          [](MeshFinderObject& self, const nb::tuple& mesh, nb::handle other, nb::handle distance,
             const nb::tuple& filters, const nb::tuple& other_filters) {
            return self.find(meshes_of(mesh, other, filters, other_filters), distance);
          },
          nb::arg("mesh"), nb::arg("other").none(), nb::arg("distance").none(), nb::arg("filters"),
          nb::arg("other_filters"))
      .def(
          "consume",
          [](MeshFinderObject& self, const nb::tuple& mesh, nb::handle callback, nb::handle other,
             nb::handle distance, const nb::tuple& filters, const nb::tuple& other_filters) {
            self.consume(meshes_of(mesh, other, filters, other_filters), distance, callback);
          },
          nb::arg("mesh"), nb::arg("callback").none(), nb::arg("other").none(),
          nb::arg("distance").none(), nb::arg("filters"), nb::arg("other_filters"))
      .def_prop_ro("result", [](const MeshFinderObject& self) { return self.result(); })
      .def_prop_ro("memory_bytes", &MeshFinderObject::memory_bytes);
  m.def("describe_intersections", describe, nb::arg("pairs").none(), nb::arg("mesh"),
        nb::arg("other").none(), nb::arg("threads").none());
}

}  // namespace throng::python
