// The caller's arrays (NumPy or DLPack) as the library's views, without a copy where the values
// have the library's type.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <throng/boxes.hpp>

namespace throng::python {

namespace nb = nanobind;

using AnyArray = nb::ndarray<nb::ro>;
// Keeps the memory of a view alive; released with the interpreter's lock held.
using KeepAlive = std::vector<std::shared_ptr<void>>;

// The device of the arrays of one call: the host, or one GPU. The first array decides.
struct ArrayDevice {
  // The caller's stream: a GPU array is valid for work enqueued on it.
  std::uintptr_t stream = 0;
  bool on_gpu = false;
  int device = 0;
  std::string first_argument;  // the argument that decided; empty: none yet

  std::string name() const { return on_gpu ? "cuda:" + std::to_string(device) : "the CPU"; }
};

// TypeError if the value is not an array, ValueError if it is on another device than the call's
// other arrays; `array_device` null: host memory only. `wanted` ends the message, its type first:
// "float32 of shape (n, 6)".
AnyArray import_array(nb::handle value, const std::string& name, const std::string& wanted,
                      ArrayDevice* array_device = nullptr);
// A list or tuple as a NumPy array; any other value as it is. `wanted` as above: where it begins
// with "float", integers become float64.
nb::object array_of_list(nb::handle value, const std::string& name, const std::string& wanted);
// Boxes given as lists or tuples as arrays: of a tuple (lower, upper) a tuple of two.
nb::object boxes_of_lists(nb::handle value, const std::string& name);
// "float32 of shape (5, 6)"
std::string described(const AnyArray& array);
bool is_float32(const AnyArray& array) noexcept;
// ValueError unless values are at multiples of `bytes`.
void require_aligned(const AnyArray& array, const std::string& name, std::size_t bytes);
// The stride of rows, in values; ValueError if it is negative.
std::size_t row_stride(const AnyArray& array, const std::string& name,
                       std::size_t single_row_stride);

// The handling of float64: exact float32 only, rounded to float32 that contain it, or kept.
enum class Rounding : std::uint8_t { none, outward, exact };
// Of 'exact' or 'outward'; a ValueError for any other.
Rounding rounding_of(nb::handle round);

// One corner of each box, in an array whose first index is the box.
struct CornerArray {
  const AnyArray& array;
  const std::string& name;   // of the argument, for messages
  std::int64_t begin, axis;  // in values: the offset of the first box, and the stride of the axes
  const char* index = "";    // of the corner, if the array has one: "0, "
  std::size_t first_column = 0;  // of the corner, if corners share a row
};

// Boxes as given, (n, 6), (n, 2, 3), 2-D (n, 4), (n, 2, 2), (lower, upper), or lists of these, and
// the objects that keep the view valid.
class BoxArray {
 public:
  BoxArray(nb::handle value, const std::string& name, Rounding rounding,
           ArrayDevice* array_device = nullptr);
  // The same, or one box: (6,), or (4,) for 2-D.
  static BoxArray one_or_more(nb::handle value, const std::string& name, Rounding rounding);

  // Exactly one of the two views holds the boxes: doubles() if they stay float64, by
  // Rounding::exact.
  bool is_double() const noexcept { return is_double_; }
  const Boxes& view() const noexcept { return view_; }
  const DoubleBoxes& doubles() const noexcept { return doubles_; }
  std::size_t size() const noexcept { return is_double_ ? doubles_.size() : view_.size(); }
  // Converts float32 boxes to float64; keeps their filters.
  void widen(const std::string& name);
  unsigned dimensions() const noexcept { return dimensions_; }

  // One value per box; None: absent. `prefix` precedes the names in messages.
  void set_filters(const std::string& prefix, nb::handle group, nb::handle mask, nb::handle owner,
                   nb::handle world, nb::handle is_static);

 private:
  void import_array_of_boxes(nb::handle value, const std::string& name, Rounding rounding);
  void import_lower_upper(nb::handle pair, const std::string& name, Rounding rounding);
  // Makes the view, of values without a copy, or of converted float64.
  void show(const CornerArray& lower, const CornerArray& upper, const std::string& wanted,
            Rounding rounding);
  template <class Value>
  void keep_doubles(const std::string& name, const Value& value, std::size_t n);

  Boxes view_;
  DoubleBoxes doubles_;
  bool is_double_ = false;
  unsigned dimensions_ = 3;
  ArrayDevice* array_device_;  // null: host memory
  std::vector<AnyArray> arrays_;
  std::unique_ptr<float[]> converted_;
  std::unique_ptr<double[]> widened_;
  KeepAlive filters_;
};

// One value of T per box, or per `element`, or one for all: the array itself if it has that type,
// else converted values, which must fit; no conversion on a GPU. Objects in `kept` must outlive the
// view.
template <class T>
Strided<T> import_values(nb::handle value, const std::string& name, std::size_t count,
                         KeepAlive& kept, ArrayDevice* array_device = nullptr,
                         const char* element = "box");

// A NumPy array that owns its values.
template <class T>
nb::object numpy_array(std::unique_ptr<T[]> values, std::initializer_list<std::size_t> shape) {
  T* data = values.get();
  const nb::capsule owner(values.release(), [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.begin(), owner));
}

// The same for a copy of `count` objects of type T, each of `columns` values.
template <class Value, class T>
nb::object numpy_rows(const T* from, std::size_t count, std::size_t columns) {
  static_assert(sizeof(T) % sizeof(Value) == 0);
  auto copy = std::make_unique<Value[]>(std::max<std::size_t>(count * columns, 1));
  if (count) std::memcpy(copy.get(), from, count * sizeof(T));
  return numpy_array(std::move(copy), {count, columns});
}

// n rows of the floats of a T: without a copy if a row's values are contiguous, or converted
// float64, each of which must be a float32; None: absent (count 0). count: expected rows, or -1.
template <class T>
Strided<T> import_rows(nb::handle value, const std::string& name, std::int64_t count,
                       KeepAlive& kept);
// The same for directions, each of `dimensions` or three values; a missing z is 0. float64 is
// rounded to the nearest float32; the rest, float64 less float32, goes to `rest` if any is not 0.
Strided<Vec3> import_directions(nb::handle value, const std::string& name, std::size_t count,
                                unsigned dimensions, KeepAlive& kept,
                                std::unique_ptr<DoubleVec3[]>& rest);

}  // namespace throng::python
