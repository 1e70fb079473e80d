// Arrays of any kind: what they are, where they lie, and whether they can be read there.
#include "python/arrays.hpp"

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

// What an object says of itself that nanobind could not take: numpy's object arrays and the like.
std::string described_array(nb::handle value) {
  std::string text = described(value);
  const nb::object type = nb::getattr(value, "dtype", nb::none());
  const nb::object shape = nb::getattr(value, "shape", nb::none());
  if (!type.is_none()) text += std::string(" of dtype ") + nb::str(type).c_str();
  if (!shape.is_none()) text += std::string(" and shape ") + nb::str(shape).c_str();
  return text;
}

// Not the CPU: told before the array is taken, as a device's memory cannot even be looked at here.
void require_cpu(nb::handle value, const std::string& name) {
  constexpr int cpu = 1, cuda = 2, cuda_pinned = 3, cuda_managed = 13;
  if (!nb::hasattr(value, "__dlpack_device__")) return;
  nb::object device;
  try {
    device = value.attr("__dlpack_device__")();
  } catch (const nb::python_error&) {
    return;  // a read-only array of older kinds; taking it tells
  }
  int type = cpu, index = 0;
  if (!nb::isinstance<nb::tuple>(device) || nb::len(device) != 2 ||
      !nb::try_cast(device[0], type) || !nb::try_cast(device[1], index)) {
    type_error(name + ": its __dlpack_device__ gives no (type, index)");
  }
  if (type == cpu || type == cuda_pinned) return;
  const bool is_cuda = type == cuda || type == cuda_managed;
  value_error(name + ": found an array on " + (is_cuda ? "cuda:" : "device type ") +
              (is_cuda ? std::to_string(index) : std::to_string(type)) +
              ", and this build searches on the CPU alone; copy it to the host first (CuPy: "
              "x.get(), PyTorch: x.cpu(), JAX: numpy.asarray(x))");
}

}  // namespace

void require_aligned(const AnyArray& a, const std::string& name, std::size_t bytes) {
  if (a.size() == 0 || reinterpret_cast<std::uintptr_t>(a.data()) % bytes == 0) return;
  value_error(name + ": its values lie at an address that is no multiple of " +
              std::to_string(bytes) + "; give a copy: " + name + ".copy()");
}

// The distance of rows, in values.
std::size_t row_stride(const AnyArray& a, const std::string& name, std::size_t if_one_row) {
  if (a.shape(0) <= 1) return if_one_row;
  if (a.stride(0) >= 0) return static_cast<std::size_t>(a.stride(0));
  value_error(name + ": its rows run backwards (a stride of " + std::to_string(a.stride(0)) +
              " values); give a copy: numpy.ascontiguousarray(" + name + ")");
}

AnyArray import_array(nb::handle value, const std::string& name, const std::string& wanted) {
  require_cpu(value, name);
  AnyArray array;
  if (!nb::try_cast(value, array) || !array.is_valid()) {
    type_error(name + ": found " + described_array(value) + ", wanted an array of " + wanted +
               " in this machine's byte order; numpy.asarray(x, dtype=...) makes one");
  }
  return array;
}

std::string described(const AnyArray& a) { return type_text(a) + " of shape " + shape_text(a); }

bool is_float32(const AnyArray& a) noexcept { return a.dtype() == nb::dtype<float>(); }

Rounding rounding_of(nb::handle round) {
  if (round.is_none()) return Rounding::exact;
  if (PyUnicode_Check(round.ptr()) && nb::borrow<nb::str>(round).c_str() == std::string("outward"))
    return Rounding::outward;
  value_error("round: found " + described(round) + ", wanted None or 'outward'");
}

}  // namespace throng::python
