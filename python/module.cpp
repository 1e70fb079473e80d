// The module throng._throng, the base of the package throng (python/throng). Its functions take
// positional arguments; names, defaults and docs are in the package.
#include <memory>

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <throng/throng.hpp>

#include "python/errors.hpp"
#include "python/finder.hpp"
#include "python/options.hpp"
#include "python/pool.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

using Set = std::unique_ptr<BoxArray>;
struct Sets {
  Set a, b;  // b may be null
};

// Boxes and their filters: (group, mask, owner, world, static), each an array or None.
Set box_set(nb::handle boxes, const char* name, const nb::tuple& filters, const char* prefix,
            Rounding rounding, ArrayDevice* array_device) {
  auto set = std::make_unique<BoxArray>(boxes, name, rounding, array_device);
  set->set_filters(prefix, filters[0], filters[1], filters[2], filters[3], filters[4]);
  return set;
}

Set other_set(nb::handle boxes, const nb::tuple& filters, Rounding rounding,
              ArrayDevice* array_device) {
  if (!boxes.is_none()) return box_set(boxes, "other", filters, "other_", rounding, array_device);
  for (const nb::handle filter : filters) {
    if (filter.is_none()) continue;
    value_error("other: found None, wanted a second set of boxes for the filters other_...");
  }
  return nullptr;
}

// Both get one type: float32 becomes float64 if the other is.
Sets sets_of(nb::handle boxes, nb::handle other, const nb::tuple& filters,
             const nb::tuple& other_filters, Rounding rounding,
             ArrayDevice* array_device = nullptr) {
  Sets s;
  s.a = box_set(boxes, "boxes", filters, "", rounding, array_device);
  s.b = other_set(other, other_filters, rounding, array_device);
  if (s.b && s.b->is_double() && !s.a->is_double()) s.a->widen("boxes");
  if (s.b && s.a->is_double() && !s.b->is_double()) s.b->widen("other");
  return s;
}

void init_finder(FinderObject* self, nb::handle order, nb::handle algorithm, nb::handle backend,
                 nb::handle nan, nb::handle inverted, nb::handle isa, nb::handle margin,
                 nb::handle threads, nb::handle memory_cap, nb::handle round, bool once) {
  Options o;
  o.order = order_of(order);
  o.algorithm = algorithm_of(algorithm);
  o.backend = backend_of(backend);
  o.nan = nan_of(nan);
  o.inverted = inverted_of(inverted);
  o.isa = isa_of(isa);
  o.margin = margin_of(margin);
  o.threads = threads_of(threads);
  o.memory_cap_bytes = bytes_of(memory_cap, "memory_cap");
  new (self) FinderObject(o, rounding_of(round), once);
}

void bind_finder(nb::module_& m) {
  nb::class_<FinderObject>(m, "Finder")
      .def("__init__", init_finder, nb::arg("order").none(), nb::arg("algorithm").none(),
           nb::arg("backend").none(), nb::arg("nan").none(), nb::arg("inverted").none(),
           nb::arg("isa").none(), nb::arg("margin").none(), nb::arg("threads").none(),
           nb::arg("memory_cap").none(), nb::arg("round").none(), nb::arg("once"))
      .def(
          "find",
          [](FinderObject& self, nb::handle boxes, nb::handle other, const nb::tuple& filters,
             const nb::tuple& other_filters, std::uint64_t stream, bool to_host) {
            ArrayDevice array_device;
            array_device.stream = static_cast<std::uintptr_t>(stream);
            const Sets s =
                sets_of(boxes, other, filters, other_filters, self.rounding(), &array_device);
            return self.find(*s.a, s.b.get(), array_device, to_host);
          },
          nb::arg("boxes").none(), nb::arg("other").none(), nb::arg("filters"),
          nb::arg("other_filters"), nb::arg("stream"), nb::arg("to_host"))
      .def(
          "consume",
          [](FinderObject& self, nb::handle boxes, nb::handle callback, nb::handle other,
             const nb::tuple& filters, const nb::tuple& other_filters) {
            const Sets s = sets_of(boxes, other, filters, other_filters, self.rounding());
            self.consume(*s.a, s.b.get(), callback);
          },
          nb::arg("boxes").none(), nb::arg("callback").none(), nb::arg("other").none(),
          nb::arg("filters"), nb::arg("other_filters"))
      .def(
          "explain",
          [](FinderObject& self, nb::handle boxes, nb::handle other, const nb::tuple& filters,
             const nb::tuple& other_filters) {
            const Sets s = sets_of(boxes, other, filters, other_filters, Rounding::outward);
            return self.explain(*s.a, s.b.get());
          },
          nb::arg("boxes").none(), nb::arg("other").none(), nb::arg("filters"),
          nb::arg("other_filters"))
      .def_prop_ro("result", [](const FinderObject& self) { return self.result(); })
      .def_prop_ro("memory_bytes", &FinderObject::memory_bytes);
}

}  // namespace
}  // namespace throng::python

NB_MODULE(_throng, m) {
  using namespace throng::python;
  m.attr("__version__") = THRONG_VERSION;
  m.attr("has_cuda") = gpu_is_built();
  bind_results(m);
  bind_finder(m);
  bind_scenes(m);
  bind_bodies(m);
  bind_live(m);
  bind_mesh(m);
  bind_contact(m);
  m.def(
      "boxes_of_lists",
      [](nb::handle boxes, const std::string& name) { return boxes_of_lists(boxes, name); },
      nb::arg("boxes").none(), nb::arg("name"));
  m.def("forget_threads", forget_threads);
  m.def("expect_leaks", [] { nb::set_leak_warnings(false); });
}
