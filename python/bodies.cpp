// update_boxes: from transforms and shapes to boxes.
#include <memory>
#include <new>
#include <string>

#include <throng/update_boxes.hpp>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/options.hpp"
#include "python/pair_search.hpp"
#include "python/pool.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

// `shapes`: an array of the package's shape_type, as rows of ten 32-bit words.
nb::object update(nb::handle position, nb::handle shapes, nb::handle rotation,
                  nb::handle displacement, nb::handle shape, nb::handle points, nb::handle margin,
                  nb::handle threads) {
  static_assert(sizeof(Shape) == 40);
  UpdateOptions options;
  options.margin = margin_of(margin);
  options.threads = threads_of(threads);
  options.executor = &executor();
  KeepAlive kept;
  Bodies bodies;
  bodies.position = import_rows<Vec3>(position, "position", -1, kept);
  const std::size_t n = bodies.size();
  const auto count = static_cast<std::int64_t>(n);
  bodies.rotation = import_rows<Quaternion>(rotation, "rotation", count, kept);
  bodies.displacement = import_rows<Vec3>(displacement, "displacement", count, kept);
  bodies.shape = import_values<std::uint32_t>(shape, "shape", n, kept);
  bodies.shapes = import_rows<Shape>(shapes, "shapes", -1, kept);
  bodies.points = import_rows<Vec3>(points, "points", -1, kept);
  std::unique_ptr<Box[]> boxes(new (std::nothrow) Box[n + 1]);
  if (!boxes) memory_error("no memory for " + std::to_string(n) + " boxes of 24 bytes");
  std::atomic<bool> stop{false};
  options.stop = &stop;
  Result result;
  run_unlocked(n >= long_from, stop,
               [&] { result = throng::update_boxes(bodies, boxes.get(), options); });
  require_ok(result);
  auto* floats = reinterpret_cast<float*>(boxes.get());
  const nb::capsule owner(boxes.release(), [](void* p) noexcept { delete[] static_cast<Box*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, float>(floats, {n, 6}, owner));
}

}  // namespace

void bind_bodies(nb::module_& m) {
  m.def("update_boxes", update, nb::arg("position").none(), nb::arg("shapes").none(),
        nb::arg("rotation").none(), nb::arg("displacement").none(), nb::arg("shape").none(),
        nb::arg("points").none(), nb::arg("margin").none(), nb::arg("threads").none());
}

}  // namespace throng::python
