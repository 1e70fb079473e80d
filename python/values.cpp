// One-dimensional arrays: filters, indices, rows of bodies.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <new>
#include <optional>
#include <type_traits>

#include <throng/update_boxes.hpp>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/lock.hpp"

namespace throng::python {
namespace {

using Code = nb::dlpack::dtype_code;

template <class T>
bool holds(const AnyArray& a) noexcept {
  constexpr Code code = std::is_signed_v<T> ? Code::Int : Code::UInt;
  return a.dtype() == nb::dlpack::dtype{static_cast<std::uint8_t>(code), sizeof(T) * 8, 1};
}

template <class T>
const char* type_name() {
  if (std::is_same_v<T, std::uint8_t>) return "uint8 or bool";
  return std::is_signed_v<T> ? "int32" : "uint32";
}

// The first value that does not fit, in words: "at 3 is -1".
using ConversionError = std::optional<std::string>;

template <class T, class Source>
ConversionError convert(const AnyArray& a, T* out) {
  const auto* data = static_cast<const Source*>(a.data());
  for (std::size_t i = 0; i < a.shape(0); ++i) {
    const Source v = data[static_cast<std::int64_t>(i) * a.stride(0)];
    out[i] = static_cast<T>(v);
    if (static_cast<Source>(out[i]) != v || (v < 0) != (out[i] < 0)) {
      return "at " + std::to_string(i) + " is " + std::to_string(v);
    }
  }
  return {};
}

template <class T>
ConversionError convert_any(const AnyArray& a, T* out, bool& known) {
  known = true;
  if (holds<std::int8_t>(a)) return convert<T, std::int8_t>(a, out);
  if (holds<std::int16_t>(a)) return convert<T, std::int16_t>(a, out);
  if (holds<std::int32_t>(a)) return convert<T, std::int32_t>(a, out);
  if (holds<std::int64_t>(a)) return convert<T, std::int64_t>(a, out);
  if (holds<std::uint8_t>(a)) return convert<T, std::uint8_t>(a, out);
  if (holds<std::uint16_t>(a)) return convert<T, std::uint16_t>(a, out);
  if (holds<std::uint32_t>(a)) return convert<T, std::uint32_t>(a, out);
  if (holds<std::uint64_t>(a)) return convert<T, std::uint64_t>(a, out);
  known = false;
  return {};
}

// An integer, or an array without dimensions that holds one.
nb::object one_value(nb::handle value) {
  if (PyLong_Check(value.ptr())) return nb::borrow(value);
  const nb::object dimensions = nb::getattr(value, "ndim", nb::none());
  if (dimensions.is_none() || !dimensions.equal(nb::int_(0)) || !nb::hasattr(value, "item"))
    return {};
  return value.attr("item")();
}

template <class T>
T fitting_value(nb::handle value, const std::string& name, const std::string& wanted) {
  if (!PyLong_Check(value.ptr()))
    type_error(name + ": found " + described(value) + ", wanted an integer, or " + wanted);
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &overflow);
  constexpr long long least = std::numeric_limits<T>::min(), most = std::numeric_limits<T>::max();
  if (overflow || number < least || number > most) {
    value_error(name + ": found " + described(value) + ", wanted " + std::to_string(least) +
                " to " + std::to_string(most));
  }
  return static_cast<T>(number);
}

struct Inexact {
  std::size_t row, column;
  double value;
};

// The rows of `a` as floats; reports the first value that is not a float32, except NaN.
std::optional<Inexact> to_floats(const AnyArray& a, float* out) {
  const auto* data = static_cast<const double*>(a.data());
  for (std::size_t i = 0; i < a.shape(0); ++i) {
    for (std::size_t k = 0; k < a.shape(1); ++k) {
      const double x = data[static_cast<std::int64_t>(i) * a.stride(0) +
                            static_cast<std::int64_t>(k) * a.stride(1)];
      // Beyond float's range the cast is undefined.
      if (std::isfinite(x) && std::fabs(x) > std::numeric_limits<float>::max())
        return Inexact{i, k, x};
      *out = static_cast<float>(x);
      if (static_cast<double>(*out++) != x && !std::isnan(x)) return Inexact{i, k, x};
    }
  }
  return {};
}

// Converts float64 rows to float32, or throws a ValueError.
std::shared_ptr<float[]> rows_of_floats(const AnyArray& a, const std::string& name) {
  require_aligned(a, name, sizeof(double));
  std::shared_ptr<float[]> rows(new (std::nothrow) float[a.size()]);
  if (!rows)
    memory_error(name + ": no memory for " + std::to_string(4 * a.size()) + " bytes of float32");
  std::optional<Inexact> bad;
  {
    const Unlocked unlocked;
    bad = to_floats(a, rows.get());
  }
  if (!bad) return rows;
  char number[40];
  std::snprintf(number, sizeof number, "%.17g", bad->value);
  value_error(
      name + ": the float64 at [" + std::to_string(bad->row) + ", " + std::to_string(bad->column) +
      "] is " + number +
      ", which no float32 equals; rounding it can lose containment: a box that does not contain "
      "its body, a missed hit; where that is acceptable, give " +
      name + ".astype(numpy.float32)");
}

}  // namespace

template <class T>
Strided<T> import_values(nb::handle value, const std::string& name, std::size_t count,
                         KeepAlive& kept, ArrayDevice* array_device, const char* element) {
  if (value.is_none()) return {};
  const std::string wanted = std::string(type_name<T>()) + " of shape (" + std::to_string(count) +
                             ",), one value per " + element;
  if (const nb::object one = one_value(value); one.is_valid()) {
    auto single = std::make_shared<T>(fitting_value<T>(one, name, wanted));
    if (array_device && array_device->on_gpu) {
      type_error(name + ": found one value for boxes on " + array_device->name() + ", wanted " +
                 wanted + ", there");
    }
    kept.push_back(single);
    if (count == 0) return {};
    return {single.get(), count, 0};
  }
  AnyArray a = import_array(value, name, wanted, array_device);
  if (a.ndim() != 1 || a.shape(0) != count) {
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  }
  if (count == 0) return {};
  const bool is_flag =
      sizeof(T) == 1 && static_cast<Code>(a.dtype().code) == Code::Bool && a.dtype().bits == 8;
  const bool aligned = reinterpret_cast<std::uintptr_t>(a.data()) % sizeof(T) == 0;
  if ((holds<T>(a) || is_flag) && aligned && (count == 1 || a.stride(0) >= 0)) {
    kept.push_back(std::make_shared<AnyArray>(a));
    const auto stride = count == 1 ? sizeof(T) : static_cast<std::size_t>(a.stride(0)) * sizeof(T);
    return {static_cast<const T*>(a.data()), count, stride};
  }
  if (array_device && array_device->on_gpu) {
    type_error(name + ": found " + described(a) + " on " + array_device->name() +
               ", where values are not converted; wanted " + wanted +
               ", aligned, with a positive stride");
  }
  if (!aligned)
    value_error(name + ": its values are not aligned; give a copy: " + name + ".copy()");
  auto values = std::shared_ptr<T[]>(new T[count]);
  bool known = false;
  // A flag with a negative stride is read as its byte.
  const ConversionError bad =
      is_flag ? convert<T, std::uint8_t>(a, values.get()) : convert_any(a, values.get(), known);
  if (!known && !is_flag) type_error(name + ": found " + described(a) + ", wanted " + wanted);
  if (bad) {
    value_error(name + ": the value " + *bad + ", wanted " +
                std::to_string(std::numeric_limits<T>::min()) + " to " +
                std::to_string(std::numeric_limits<T>::max()));
  }
  kept.push_back(values);
  return {values.get(), count, sizeof(T)};
}

namespace {

struct Vec2 {
  float x, y;
};

std::string rows_text(std::int64_t count, std::size_t columns) {
  std::string text = "(";
  text += count < 0 ? std::string("n") : std::to_string(count);
  text += ", ";
  text += std::to_string(columns);
  return text += ')';
}

template <class T>
Strided<T> rows_of(const AnyArray& a, const std::string& name, const std::string& wanted,
                   std::int64_t count, KeepAlive& kept) {
  constexpr std::size_t columns = sizeof(T) / sizeof(float);
  const bool is_double = a.dtype() == nb::dtype<double>();
  if (!is_float32(a) && !is_double) {
    type_error(name + ": found " + described(a) + ", wanted " + wanted +
               " (float64 where each value is a float32); if nothing is lost by it, " + name +
               ".astype(numpy.float32) makes that");
  }
  if (a.ndim() != 2 || a.shape(1) != columns ||
      (count >= 0 && a.shape(0) != static_cast<std::size_t>(count))) {
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  }
  if (a.shape(0) == 0) return {};
  if (is_double) {
    const std::shared_ptr<float[]> rows = rows_of_floats(a, name);
    kept.push_back(rows);
    return {reinterpret_cast<const T*>(rows.get()), a.shape(0), columns * sizeof(float)};
  }
  if (a.stride(1) != 1 || (a.shape(0) > 1 && a.stride(0) < 0) ||
      reinterpret_cast<std::uintptr_t>(a.data()) % alignof(float) != 0) {
    value_error(name +
                ": the values of a row must be contiguous, the row stride positive; "
                "numpy.ascontiguousarray(" +
                name + ") makes that");
  }
  kept.push_back(std::make_shared<AnyArray>(a));
  const std::size_t stride = a.shape(0) == 1 ? columns : static_cast<std::size_t>(a.stride(0));
  return {static_cast<const T*>(a.data()), a.shape(0), stride * sizeof(float)};
}

}  // namespace

template <class T>
Strided<T> import_rows(nb::handle value, const std::string& name, std::int64_t count,
                       KeepAlive& kept) {
  if (value.is_none()) return {};
  const std::string wanted = "float32 of shape " + rows_text(count, sizeof(T) / sizeof(float));
  return rows_of<T>(import_array(value, name, wanted), name, wanted, count, kept);
}

Strided<Vec3> import_directions(nb::handle value, const std::string& name, std::size_t count,
                                unsigned dimensions, KeepAlive& kept,
                                std::unique_ptr<DoubleVec3[]>& rest) {
  const auto n = static_cast<std::int64_t>(count);
  std::string wanted = "float32 or float64 of shape ";
  if (dimensions == 2) wanted += rows_text(n, 2) + " or ";
  wanted += rows_text(n, 3);
  if (value.is_none()) type_error(name + ": found None, wanted " + wanted + ", one per box");
  const AnyArray a = import_array(value, name, wanted);
  const bool is_double = a.dtype() == nb::dtype<double>();
  const bool is_flat = dimensions == 2 && a.ndim() == 2 && a.shape(1) == 2;
  if (!is_double && !is_flat) return rows_of<Vec3>(a, name, wanted, n, kept);
  std::shared_ptr<Vec3[]> vectors(new (std::nothrow) Vec3[count + 1]);
  if (!vectors) memory_error(name + ": no memory for " + std::to_string(count) + " directions");
  kept.push_back(vectors);
  if (!is_double) {
    const Strided<Vec2> given = rows_of<Vec2>(a, name, wanted, n, kept);
    for (std::size_t i = 0; i < given.count; ++i) vectors[i] = {given[i].x, given[i].y, 0};
    return {vectors.get(), given.count, sizeof(Vec3)};
  }
  if (a.ndim() != 2 || (a.shape(1) != 3 && !is_flat) || a.shape(0) != count)
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  require_aligned(a, name, sizeof(double));
  const auto* data = static_cast<const double*>(a.data());
  for (std::size_t i = 0; i < count; ++i) {
    double way[3] = {}, lost[3] = {};
    float nearest[3] = {};
    for (std::size_t k = 0; k < a.shape(1); ++k) {
      way[k] = data[static_cast<std::int64_t>(i) * a.stride(0) +
                    static_cast<std::int64_t>(k) * a.stride(1)];
      // Beyond float's range the cast is undefined.
      if (std::fabs(way[k]) > std::numeric_limits<float>::max()) {
        char number[40];
        std::snprintf(number, sizeof number, "%.17g", way[k]);
        value_error(name + ": the value at [" + std::to_string(i) + ", " + std::to_string(k) +
                    "] is " + number + ", wanted at most 3.4e38");
      }
      nearest[k] = static_cast<float>(way[k]);
      if (std::isfinite(way[k])) lost[k] = way[k] - static_cast<double>(nearest[k]);
    }
    vectors[i] = {nearest[0], nearest[1], nearest[2]};
    if (lost[0] == 0 && lost[1] == 0 && lost[2] == 0) continue;
    if (!rest) rest = std::make_unique<DoubleVec3[]>(count);
    rest[i] = {lost[0], lost[1], lost[2]};
  }
  return {vectors.get(), count, sizeof(Vec3)};
}

template Strided<std::uint32_t> import_values(nb::handle, const std::string&, std::size_t,
                                              KeepAlive&, ArrayDevice*, const char*);
template Strided<std::int32_t> import_values(nb::handle, const std::string&, std::size_t,
                                             KeepAlive&, ArrayDevice*, const char*);
template Strided<std::uint8_t> import_values(nb::handle, const std::string&, std::size_t,
                                             KeepAlive&, ArrayDevice*, const char*);
template Strided<Vec3> import_rows(nb::handle, const std::string&, std::int64_t, KeepAlive&);
template Strided<Quaternion> import_rows(nb::handle, const std::string&, std::int64_t, KeepAlive&);
template Strided<Shape> import_rows(nb::handle, const std::string&, std::int64_t, KeepAlive&);

}  // namespace throng::python
