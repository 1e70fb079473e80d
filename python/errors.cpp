#include "python/errors.hpp"

#include <stdexcept>

namespace throng::python {

void type_error(const std::string& text) { throw nb::type_error(text.c_str()); }
void value_error(const std::string& text) { throw nb::value_error(text.c_str()); }
void memory_error(const std::string& text) {
  PyErr_SetString(PyExc_MemoryError, text.c_str());
  throw nb::python_error();
}

std::string described(nb::handle value) {
  if (value.is_none()) return "None";
  if (PyUnicode_Check(value.ptr()) || PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr())) {
    const std::string text = nb::repr(value).c_str();
    return text.size() <= 60 ? text : text.substr(0, 57) + "...";
  }
  return std::string("a ") + nb::type_name(value.type()).c_str();
}

std::string in_python(std::string text) {
  static constexpr const char* words[][2] = {
      {"treat them as inactive by Options::nan", "pass nan='inactive'"},
      {"set Options::inverted to inactive", "pass inverted='inactive'"},
      {"box_from_center(center, size / 2)", "throng.boxes_from_center(center, size)"},
      {"boxes of doubles are searched on the CPU alone; set backend to cpu or automatic",
       "boxes of float64 are searched on the CPU alone; pass round='outward', or backend='cpu'"},
      {"MeshFinder::consume", "throng.mesh.Finder.consume"},
      {"Finder::consume", "Finder.consume"},
      {"Options::memory_cap_bytes", "memory_cap"},
      {"Options::isa", "isa"},
      {"--round outward", "round='outward'"},
      {"use Backend::cpu, or build with THRONG_CUDA=ON", "use backend='cpu'"},
      {"Backend::cpu", "backend='cpu'"},
  };
  for (const auto& [from, to] : words) {
    const std::size_t at = text.find(from);
    if (at != std::string::npos) text.replace(at, std::string(from).size(), to);
  }
  return text;
}

void require_ok(const Result& result) {
  if (result.ok()) return;
  const std::string text =
      result.message[0] ? in_python(result.message) : std::string(to_string(result.status));
  switch (result.status) {
    case Status::out_of_memory:
    case Status::memory_cap_too_small:
      memory_error(text);
    case Status::nan_box:
    case Status::inverted_box:
    case Status::bad_boxes:
    case Status::bad_filter:
    case Status::bad_option:
    case Status::bad_bodies:
    case Status::bad_shape:
    case Status::bad_mesh:
    case Status::too_many_boxes:
    case Status::unsupported_isa:
    case Status::bad_id:
      value_error(text);
    default:
      throw std::runtime_error(text);
  }
}

}  // namespace throng::python
