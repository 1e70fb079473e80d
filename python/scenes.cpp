// Generated scenes, and .npy files by the rules of the program.
#include "python/scenes.hpp"

#include <algorithm>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <nanobind/stl/string.h>

#include "apps/scenes/npy.hpp"
#include "apps/scenes/scene.hpp"
#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/lock.hpp"
#include "python/options.hpp"
#include "python/pair_search.hpp"

namespace throng::python {
namespace {

constexpr std::uint64_t max_boxes = std::uint64_t{1} << 40;

std::unique_ptr<Box[]> allocate_boxes(std::uint64_t count, const std::string& what) {
  std::unique_ptr<Box[]> boxes;
  if (count <= max_boxes) boxes.reset(new (std::nothrow) Box[std::max<std::uint64_t>(count, 1)]);
  if (boxes) return boxes;
  memory_error(what + ": no memory for " + std::to_string(count) + " boxes of 24 bytes");
}

// (frames, n, 6), or (n, 6) of the only frame, float32.
nb::object box_array(std::unique_ptr<Box[]> boxes, std::size_t frames, std::size_t count,
                     bool only) {
  auto* floats = reinterpret_cast<float*>(boxes.get());
  const nb::capsule owner(boxes.release(), [](void* p) noexcept { delete[] static_cast<Box*>(p); });
  const std::size_t shape[3] = {frames, count, 6};
  return nb::cast(
      nb::ndarray<nb::numpy, float>(floats, only ? 2 : 3, shape + (only ? 1 : 0), owner));
}

// The same of 2-D boxes: 4 for 6.
nb::object flat_array(const scenes::BoxFile& file) {
  const std::size_t n = file.frames * file.count;
  std::unique_ptr<float[]> floats(new (std::nothrow) float[4 * n + 1]);
  if (!floats) memory_error("no memory for " + std::to_string(n) + " boxes of 16 bytes");
  for (std::size_t i = 0; i < n; ++i) {
    const Box& b = file.boxes[i];
    const float row[4] = {b.lower.x, b.lower.y, b.upper.x, b.upper.y};
    std::copy(row, row + 4, floats.get() + 4 * i);
  }
  if (file.frames == 1) return numpy_array(std::move(floats), {file.count, 4});
  return numpy_array(std::move(floats), {file.frames, file.count, 4});
}

scenes::Scene make_scene(const std::string& name, nb::handle objects, std::size_t frames,
                         nb::handle density, nb::handle seed, nb::handle moving) {
  scenes::Spec spec;
  spec.name = name;
  spec.objects = static_cast<std::size_t>(parse_integer(objects, "objects", max_box_count));
  spec.frames = frames;
  spec.seed = parse_integer(seed, "seed", ~0ull);
  const auto number = [](nb::handle value, const char* argument) {
    double x = 0;
    if (!nb::try_cast(value, x))
      type_error(std::string(argument) + ": found " + described(value) + ", wanted a number");
    return x;
  };
  if (!density.is_none()) spec.density = number(density, "density");
  spec.moving = number(moving, "moving");
  return scenes::Scene(spec);  // std::invalid_argument is a ValueError
}

nb::object make_frames(const std::string& name, nb::handle objects, nb::handle frame_count,
                       nb::handle density, nb::handle seed, nb::handle moving) {
  const auto frames = static_cast<std::size_t>(parse_integer(frame_count, "frames", 1u << 30));
  if (frames == 0) value_error("frames: found 0, wanted 1 or more");
  const scenes::Scene made = make_scene(name, objects, frames, density, seed, moving);
  const std::size_t n = made.size();
  if (n > max_boxes / frames) memory_error("scene: more than 2^40 boxes in all frames");
  auto boxes = allocate_boxes(std::uint64_t{n} * frames, "scene");
  std::atomic<bool> stop{false};
  run_unlocked(n * frames >= 65536, stop, [&] {
    constexpr std::size_t part = 65536;
    for (std::size_t f = 0; f < frames; ++f) {
      for (std::size_t i = 0; i < n && !stop; i += part) {
        made.boxes(f, i, std::min(n, i + part), boxes.get() + f * n + i);
      }
    }
  });
  return box_array(std::move(boxes), frames, n, false);
}

nb::object scene_worlds(const std::string& name, nb::handle objects) {
  const scenes::Scene made = make_scene(name, objects, 1, nb::none(), nb::int_(1), nb::float_(1.0));
  if (!made.has_worlds()) return nb::none();
  auto worlds = std::make_unique<std::int32_t[]>(made.size());
  for (std::size_t i = 0; i < made.size(); ++i) worlds[i] = made.world(i);
  return numpy_array(std::move(worlds), {made.size()});
}

nb::object load_boxes(const std::string& path, nb::handle round) {
  const bool outward =
      PyUnicode_Check(round.ptr()) && PyUnicode_CompareWithASCIIString(round.ptr(), "outward") == 0;
  if (!outward && !round.is_none()) {
    value_error("round: found " + described(round) +
                ", wanted None or 'outward': the boxes of a file become float32");
  }
  scenes::BoxFile file;
  try {
    const Unlocked unlocked;
    file = scenes::read_boxes(path, outward);
  } catch (const scenes::FileError& error) {
    value_error(in_python(error.what()));
  }
  if (file.is_flat) return flat_array(file);
  return box_array(std::move(file.boxes), file.frames, file.count, file.frames == 1);
}

[[noreturn]] void os_error(const std::string& text) {
  PyErr_SetString(PyExc_OSError, text.c_str());
  throw nb::python_error();
}

void save_boxes(const std::string& path, const nb::list& frames) {
  // Each frame becomes a list item, with the array rules of every search.
  const std::size_t frame_count = nb::len(frames);
  if (frame_count == 0) value_error("boxes: found no frame, wanted at least one");
  try {
    std::unique_ptr<scenes::BoxWriter> writer;
    std::size_t count = 0;
    std::unique_ptr<Box[]> rows;
    for (const nb::handle frame : frames) {
      const BoxArray boxes(frame, "boxes", Rounding::none);
      if (boxes.dimensions() != 3) value_error("boxes: found 2-D boxes, wanted shape (n, 6)");
      if (!writer) {
        count = boxes.size();
        rows = allocate_boxes(count, "boxes");
        writer = std::make_unique<scenes::BoxWriter>(path, frame_count, count);
      }
      const Unlocked unlocked;
      for (std::size_t i = 0; i < count; ++i) rows[i] = boxes.view()[i];
      writer->write(rows.get(), count);
    }
    writer->finish();
  } catch (const scenes::FileError& error) {
    os_error(error.what());
  }
}

void save_pairs(const std::string& path, nb::handle value) {
  const std::string wanted = "uint32 of shape (m, 2)";
  const AnyArray a = import_array(value, "pairs", wanted);
  if (a.dtype() != nb::dtype<std::uint32_t>())
    type_error("pairs: found " + described(a) + ", wanted " + wanted);
  if (a.ndim() != 2 || a.shape(1) != 2)
    value_error("pairs: found " + described(a) + ", wanted " + wanted);
  const std::size_t count = a.shape(0);
  const auto* data = static_cast<const std::uint32_t*>(a.data());
  std::unique_ptr<Pair[]> pairs(new Pair[std::max<std::size_t>(count, 1)]);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t at = static_cast<std::int64_t>(i) * a.stride(0);
    pairs[i] = {data[at], data[at + a.stride(1)]};
  }
  try {
    const Unlocked unlocked;
    scenes::write_pairs(path, pairs.get(), count);
  } catch (const scenes::FileError& error) {
    os_error(error.what());
  }
}

}  // namespace

void bind_scenes(nb::module_& m) {
  nb::list names;
  for (const std::string& name : scenes::names()) names.append(name);
  m.attr("scene_names") = nb::tuple(names);
  m.def("scene", make_frames, nb::arg("name"), nb::arg("objects"), nb::arg("frames"),
        nb::arg("density").none(), nb::arg("seed"), nb::arg("moving"));
  m.def("scene_worlds", scene_worlds, nb::arg("name"), nb::arg("objects"));
  m.def("load_boxes", load_boxes, nb::arg("path"), nb::arg("round").none());
  m.def("save_boxes", save_boxes, nb::arg("path"), nb::arg("frames"));
  m.def("save_pairs", save_pairs, nb::arg("path"), nb::arg("pairs").none());
}

}  // namespace throng::python
