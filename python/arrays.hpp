// Arrays of the caller's, as the library's views: NumPy's and whatever speaks DLPack, without a
// copy wherever the values are what the library reads.
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
// What must outlive a view of it; let go of under the interpreter's lock.
using Kept = std::vector<std::shared_ptr<void>>;

// Where the arrays of one call lie: in host memory, or on one GPU. The first of them decides.
struct Place {
  // The caller's stream: an array of a GPU is good for what comes after on it.
  std::uintptr_t stream = 0;
  bool on_gpu = false;
  int device = 0;
  std::string decided_by;  // the argument that did; empty: none yet

  std::string name() const { return on_gpu ? "cuda:" + std::to_string(device) : "the CPU"; }
};

// TypeError where the value is no array, ValueError where it lies elsewhere than the others of the
// call; `place` null: anywhere but in host memory. `wanted` ends the message, its type first:
// "float32 of shape (n, 6)".
AnyArray import_array(nb::handle value, const std::string& name, const std::string& wanted,
                      Place* place = nullptr);
// "float32 of shape (5, 6)"
std::string described(const AnyArray& array);
bool is_float32(const AnyArray& array) noexcept;
// ValueError where values do not lie at multiples of `bytes`.
void require_aligned(const AnyArray& array, const std::string& name, std::size_t bytes);
// The distance of rows, in values; ValueError where they run backwards.
std::size_t row_stride(const AnyArray& array, const std::string& name, std::size_t if_one_row);

// What becomes of float64: float32 where each value is one, float32 that contain it, or itself.
enum class Rounding : std::uint8_t { none, outward, exact };
// ValueError for any other, and for 'exact' where only float32 will do.
Rounding rounding_of(nb::handle round, bool takes_exact);

// One corner of each box, in an array whose first index is the box.
struct CornerArray {
  const AnyArray& array;
  const std::string& name;       // of the argument, for messages
  std::int64_t begin, axis;      // in values: where the first box's is, and from axis to axis
  const char* index = "";        // of the corner, where the array has one: "0, "
  std::size_t first_column = 0;  // of the corner, where corners lie in one row
};

// Boxes as given, (n, 6), (n, 2, 3), of 2-D ones (n, 4), (n, 2, 2), or (lower, upper), and what
// must live for the view to be good.
class BoxArray {
 public:
  BoxArray(nb::handle value, const std::string& name, Rounding rounding, Place* place = nullptr);

  // One of the two views shows the boxes: doubles() of those that stay float64, by Rounding::exact.
  bool is_double() const noexcept { return is_double_; }
  const Boxes& view() const noexcept { return view_; }
  const DoubleBoxes& doubles() const noexcept { return doubles_; }
  std::size_t size() const noexcept { return is_double_ ? doubles_.size() : view_.size(); }
  // Makes boxes of float32 ones of float64, their filters kept.
  void widen(const std::string& name);
  unsigned dimensions() const noexcept { return dimensions_; }

  // One value a box; None: absent. `prefix` comes before the names in messages.
  void set_filters(const std::string& prefix, nb::handle group, nb::handle mask, nb::handle owner,
                   nb::handle world, nb::handle is_static);

 private:
  void take_one(nb::handle value, const std::string& name, Rounding rounding);
  void take_two(nb::handle pair, const std::string& name, Rounding rounding);
  // Makes the view, of values as they lie or of float64 converted.
  void show(const CornerArray& lower, const CornerArray& upper, const std::string& wanted,
            Rounding rounding);

  Boxes view_;
  DoubleBoxes doubles_;
  bool is_double_ = false;
  unsigned dimensions_ = 3;
  Place* place_;  // null: host memory
  std::vector<AnyArray> arrays_;
  std::unique_ptr<float[]> converted_;
  std::unique_ptr<double[]> widened_;
  Kept filters_;
};

// One value of T a box: the array itself where it has that type, else values converted, which must
// fit; on a GPU nothing is converted. What lives in `kept` must outlive the view.
template <class T>
Strided<T> import_values(nb::handle value, const std::string& name, std::size_t count, Kept& kept,
                         Place* place = nullptr);

// A NumPy array that owns its values.
template <class T>
nb::object numpy_array(std::unique_ptr<T[]> values, std::initializer_list<std::size_t> shape) {
  T* data = values.get();
  const nb::capsule owner(values.release(), [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(data, shape.size(), shape.begin(), owner));
}

// The same, of a copy of `count` things of T, each `columns` values.
template <class Value, class T>
nb::object numpy_rows(const T* from, std::size_t count, std::size_t columns) {
  static_assert(sizeof(T) % sizeof(Value) == 0);
  auto copy = std::make_unique<Value[]>(std::max<std::size_t>(count * columns, 1));
  if (count) std::memcpy(copy.get(), from, count * sizeof(T));
  return numpy_array(std::move(copy), {count, columns});
}

// n rows of the floats of a T, as they lie where those of a row lie together, or float64 converted,
// each of which must be a float32; None: absent (count 0). count: rows wanted, or -1.
template <class T>
Strided<T> import_rows(nb::handle value, const std::string& name, std::int64_t count, Kept& kept);
// The same of directions, each with `dimensions` values or with three; a z that is not there is 0.
Strided<Vec3> import_directions(nb::handle value, const std::string& name, std::size_t count,
                                unsigned dimensions, Kept& kept);

}  // namespace throng::python
