// Array arguments: their type, their device, and whether this call can read them.
#include "python/arrays.hpp"

#include <cmath>

#include "python/device.hpp"
#include "python/errors.hpp"

namespace throng::python {
namespace {

using Code = nb::dlpack::dtype_code;

std::string shape_text(const AnyArray& a) {
  std::string text = "(";
  for (std::size_t k = 0; k < a.ndim(); ++k) {
    text += (k ? ", " : "") + std::to_string(a.shape(k));
  }
  return text + (a.ndim() == 1 ? ",)" : ")");
}

std::string type_text(const AnyArray& a) {
  const std::string bits = std::to_string(a.dtype().bits);
  switch (static_cast<Code>(a.dtype().code)) {
    case Code::Int:
      return "int" + bits;
    case Code::UInt:
      return "uint" + bits;
    case Code::Float:
      return "float" + bits;
    case Code::Bfloat:
      return "bfloat" + bits;
    case Code::Complex:
      return "complex" + bits;
    case Code::Bool:
      return "bool";
    default:
      return "values of another type";
  }
}

// Describes an object that nanobind did not accept: numpy's object arrays and the like.
std::string described_array(nb::handle value) {
  std::string text = described(value);
  const nb::object type = nb::getattr(value, "dtype", nb::none());
  const nb::object shape = nb::getattr(value, "shape", nb::none());
  if (!type.is_none()) text += std::string(" of dtype ") + nb::str(type).c_str();
  if (!shape.is_none()) text += std::string(" and shape ") + nb::str(shape).c_str();
  return text;
}

struct Where {
  int type = 1, index = 0;  // DLPack's device types

  // Pinned host memory counts as host memory.
  bool is_host() const noexcept { return type == 1 || type == 3; }
  bool is_gpu() const noexcept { return type == 2 || type == 13; }
  std::string name() const {
    if (is_host()) return "the CPU";
    return is_gpu() ? "cuda:" + std::to_string(index) : "device type " + std::to_string(type);
  }
};

// Describes an object before its array is taken: device memory cannot be inspected.
Where device_of(nb::handle value, const std::string& name) {
  Where where;
  if (!nb::hasattr(value, "__dlpack_device__")) return where;
  nb::object device;
  try {
    device = value.attr("__dlpack_device__")();
  } catch (const nb::python_error&) {
    return where;  // older read-only arrays raise here; taking the array reports the error
  }
  if (!nb::isinstance<nb::tuple>(device) || nb::len(device) != 2 ||
      !nb::try_cast(device[0], where.type) || !nb::try_cast(device[1], where.index)) {
    type_error(name + ": its __dlpack_device__ gives no (type, index)");
  }
  return where;
}

// Whether this call can use arrays of that device.
void require_device(const Where& where, const std::string& name, ArrayDevice* array_device) {
  const bool can = where.is_host() || (where.is_gpu() && array_device && gpu_is_built());
  if (!can) {
    value_error(name + ": found an array on " + where.name() +
                (where.is_gpu() && array_device
                     ? ", and this build searches on the CPU alone; build with "
                       "THRONG_CUDA=ON, or copy it"
                     : ", which this call cannot use; copy it") +
                " to the host first (CuPy: x.get(), PyTorch: x.cpu(), JAX: numpy.asarray(x))");
  }
  if (!array_device) return;
  if (array_device->first_argument.empty()) {
    array_device->on_gpu = where.is_gpu();
    array_device->device = where.is_gpu() ? where.index : 0;
    array_device->first_argument = name;
  } else if (array_device->on_gpu != where.is_gpu() ||
             (array_device->on_gpu && array_device->device != where.index)) {
    value_error(name + ": found an array on " + where.name() + ", and " +
                array_device->first_argument + " lies on " + array_device->name() +
                "; all must be on one device");
  }
}

// The producer's work on the array happens before later work on the stream.
nb::object capsule_for(nb::handle value, std::uintptr_t stream) {
  constexpr std::uintptr_t default_stream = 1;
  const nb::object give = value.attr("__dlpack__");
  const nb::int_ number(stream ? stream : default_stream);
  try {
    return give(nb::arg("stream") = number);
  } catch (const nb::python_error& error) {
    if (!error.matches(PyExc_BufferError)) throw;  // read-only arrays request the newer form
  }
  return give(nb::arg("stream") = number, nb::arg("max_version") = nb::make_tuple(1, 0));
}

// PyTorch tensors have two flags: gradients are recorded (DLPack refuses), and values are to be
// negated (DLPack ignores it). Both: take the plain tensor. A missing flag is no error.
nb::object resolve_tensor_flags(nb::handle value) {
  nb::object plain = nb::borrow(value);
  if (!nb::hasattr(plain, "resolve_neg") || !nb::hasattr(plain, "requires_grad")) return plain;
  if (nb::cast<bool>(plain.attr("requires_grad"))) plain = plain.attr("detach")();
  return plain.attr("resolve_neg")();
}

// Hidden values of a masked array would be read as if they were not.
void require_unmasked(nb::handle value, const std::string& name) {
  if (!nb::hasattr(value, "mask") || !nb::hasattr(value, "filled")) return;
  const nb::object hidden = value.attr("mask").attr("any")();
  const int some = PyObject_IsTrue(hidden.ptr());
  if (some < 0) throw nb::python_error();
  if (some) {
    value_error(name +
                ": found a masked array that hides values, wanted no hidden values; fill them: "
                "numpy.ma.filled(" +
                name + ", value)");
  }
}

// Whether a NumPy array has values that are not a whole number of items apart, as a field of a
// packed structure may have.
bool has_split_strides(nb::handle value) {
  if (!nb::hasattr(value, "strides") || !nb::hasattr(value, "itemsize")) return false;
  nb::tuple strides;
  std::int64_t item = 0;
  if (!nb::try_cast(value.attr("strides"), strides) || !nb::try_cast(value.attr("itemsize"), item))
    return false;
  for (nb::handle stride : strides) {
    std::int64_t bytes = 0;
    if (nb::try_cast(stride, bytes) && item > 0 && bytes % item != 0) return true;
  }
  return false;
}

}  // namespace

void require_aligned(const AnyArray& a, const std::string& name, std::size_t bytes) {
  if (a.size() == 0 || reinterpret_cast<std::uintptr_t>(a.data()) % bytes == 0) return;
  value_error(name + ": the address of its values is not a multiple of " + std::to_string(bytes) +
              "; give a copy: " + name + ".copy()");
}

// The stride of rows, in values.
std::size_t row_stride(const AnyArray& a, const std::string& name, std::size_t single_row_stride) {
  if (a.shape(0) <= 1) return single_row_stride;
  if (a.stride(0) >= 0) return static_cast<std::size_t>(a.stride(0));
  value_error(name + ": its rows run backwards (a stride of " + std::to_string(a.stride(0)) +
              " values); give a copy: numpy.ascontiguousarray(" + name + ")");
}

nb::object array_of_list(nb::handle value, const std::string& name, const std::string& wanted) {
  if (!PyList_Check(value.ptr()) && !PyTuple_Check(value.ptr())) return nb::borrow(value);
  constexpr double exact_in_double = 9007199254740992.0;  // 2^53
  nb::object array;
  try {
    array = nb::module_::import_("numpy").attr("asarray")(value);
  } catch (const nb::python_error& error) {
    if (!error.matches(PyExc_ValueError)) throw;
    value_error(name + ": found " + described(value) +
                " that makes no array: its parts differ in length; wanted " + wanted);
  }
  const bool is_empty = nb::cast<std::size_t>(array.attr("size")) == 0;
  const std::string kind = nb::str(array.attr("dtype").attr("kind")).c_str();
  if (wanted.rfind("float", 0) != 0) return is_empty ? array.attr("astype")("int64") : array;
  if (kind != "i" && kind != "u") return array;
  const auto extreme = [&](const char* which) {
    return std::fabs(PyFloat_AsDouble(nb::object(array.attr(which)()).ptr()));
  };
  if (!is_empty && (extreme("max") >= exact_in_double || extreme("min") >= exact_in_double)) {
    value_error(name + ": found an integer of 2**53 or more in " + described(value) +
                ", which no float64 may equal; give float64");
  }
  return array.attr("astype")("float64");
}

namespace {

// A row of a table of boxes or corners: one level of numbers.
bool is_row(nb::handle value) {
  if (PyList_Check(value.ptr()) || PyTuple_Check(value.ptr())) {
    if (nb::len(value) == 0) return true;
    const nb::object first = value[0];
    return PyNumber_Check(first.ptr()) && !nb::hasattr(first, "__len__");
  }
  const nb::object dimensions = nb::getattr(value, "ndim", nb::none());
  return !dimensions.is_none() && dimensions.equal(nb::int_(1));
}

}  // namespace

nb::object boxes_of_lists(nb::handle value, const std::string& name) {
  const bool is_tuple = PyTuple_Check(value.ptr());
  if (!is_tuple && !PyList_Check(value.ptr())) return nb::borrow(value);
  if (is_tuple && nb::len(value) == 2 && !is_row(value[0]) && !is_row(value[1])) {
    const std::string corners = "float64 of shape (n, 3), or (n, 2) for 2-D";
    return nb::make_tuple(array_of_list(value[0], name + "[0]", corners),
                          array_of_list(value[1], name + "[1]", corners));
  }
  const nb::object array = array_of_list(
      value, name, "float64 of shape (n, 6) or (n, 2, 3), for 2-D (n, 4) or (n, 2, 2)");
  if (nb::len(value) != 0) return array;
  return array.attr("reshape")(0, 6);
}

AnyArray import_array(nb::handle given, const std::string& name, const std::string& wanted,
                      ArrayDevice* array_device) {
  const nb::object value = array_of_list(given, name, wanted);
  const Where where = device_of(value, name);
  const bool is_capsule = PyCapsule_CheckExact(value.ptr());
  require_unmasked(value, name);
  if (!is_capsule) require_device(where, name, array_device);
  nb::object source = resolve_tensor_flags(value);
  if (where.is_gpu()) source = capsule_for(source, array_device->stream);
  AnyArray array;
  if (!nb::try_cast(source, array) || !array.is_valid()) {
    if (has_split_strides(value)) {
      value_error(name +
                  ": its strides are no multiples of its item size; give a copy: "
                  "numpy.ascontiguousarray(" +
                  name + ")");
    }
    type_error(name + ": found " + described_array(value) + ", wanted an array of " + wanted +
               " in this machine's byte order; numpy.asarray(x, dtype=numpy." +
               wanted.substr(0, wanted.find(' ')) + ") makes one");
  }
  const Where lies{array.device_type(), array.device_id()};
  if (is_capsule) {
    require_device(lies, name, array_device);
  } else if (lies.is_host() != where.is_host() ||
             (!lies.is_host() && (lies.type != where.type || lies.index != where.index))) {
    type_error(name + ": its __dlpack_device__ says " + where.name() + ", its __dlpack__ gives " +
               lies.name() + "; both must agree");
  }
  return array;
}

std::string described(const AnyArray& a) { return type_text(a) + " of shape " + shape_text(a); }

bool is_float32(const AnyArray& a) noexcept { return a.dtype() == nb::dtype<float>(); }

Rounding rounding_of(nb::handle round) {
  const auto is = [&](const char* text) {
    return PyUnicode_Check(round.ptr()) && PyUnicode_CompareWithASCIIString(round.ptr(), text) == 0;
  };
  if (is("exact")) return Rounding::exact;
  if (is("outward")) return Rounding::outward;
  value_error("round: found " + described(round) + ", wanted 'exact' or 'outward'");
}

}  // namespace throng::python
