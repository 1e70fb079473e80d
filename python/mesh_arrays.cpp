#include "python/mesh_arrays.hpp"

#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <optional>

#include <nanobind/stl/array.h>

#include "python/errors.hpp"
#include "python/lock.hpp"

namespace throng::python {
namespace {

using Code = nb::dlpack::dtype_code;

// The values of a 2-D array by row and column. Values need not be aligned.
template <class T>
struct Table {
  const char* data;
  std::int64_t row_bytes, column_bytes;

  explicit Table(const AnyArray& a)
      : data(static_cast<const char*>(a.data())),
        row_bytes(a.stride(0) * static_cast<std::int64_t>(sizeof(T))),
        column_bytes(a.stride(1) * static_cast<std::int64_t>(sizeof(T))) {}

  T operator()(std::size_t i, std::size_t k) const noexcept {
    T value;
    std::memcpy(&value,
                data + static_cast<std::int64_t>(i) * row_bytes +
                    static_cast<std::int64_t>(k) * column_bytes,
                sizeof(T));
    return value;
  }
};

// Whether the library can read the rows of T where they are.
template <class T>
bool has_contiguous_rows(const AnyArray& a) noexcept {
  const bool is_aligned = reinterpret_cast<std::uintptr_t>(a.data()) % alignof(T) == 0;
  return is_aligned && a.stride(1) == 1 && (a.shape(0) == 1 || a.stride(0) >= 0);
}

template <class T>
std::size_t row_bytes(const AnyArray& a, std::size_t contiguous) noexcept {
  return a.shape(0) == 1 ? contiguous : static_cast<std::size_t>(a.stride(0)) * sizeof(T);
}

template <class T>
std::shared_ptr<T[]> allocate(std::size_t count, const std::string& name) {
  std::shared_ptr<T[]> values(new (std::nothrow) T[count]);
  if (!values) {
    memory_error(name + ": no memory for a copy of " + std::to_string(count * sizeof(T)) +
                 " bytes; give an array that is read in place: contiguous rows, indices of uint32");
  }
  return values;
}

// Point is Vec3 or DoubleVec3, of coordinates of type T.
template <class Point, class T>
PointArray points_of(const AnyArray& a, const std::string& name, KeepAlive& kept) {
  const std::size_t n = a.shape(0);
  const auto d = static_cast<unsigned>(a.shape(1));
  if (n == 0) return {Vertices(static_cast<const Point*>(nullptr), 0), d};
  if (d == 3 && has_contiguous_rows<T>(a)) {
    kept.push_back(std::make_shared<AnyArray>(a));
    return {Vertices(static_cast<const Point*>(a.data()), n, row_bytes<T>(a, sizeof(Point))), d};
  }
  const auto points = allocate<Point>(n, name);
  {
    const Unlocked unlocked;
    const Table<T> value(a);
    for (std::size_t i = 0; i < n; ++i)
      points[i] = {value(i, 0), value(i, 1), d == 3 ? value(i, 2) : T{0}};
  }
  kept.push_back(points);
  return {Vertices(points.get(), n), d};
}

struct BadIndex {
  std::size_t row, column;
  std::string value;
};

template <class T>
bool fits(T value) noexcept {
  if constexpr (std::is_signed_v<T>) {
    if (value < 0) return false;
  }
  return static_cast<std::uint64_t>(value) <= std::numeric_limits<std::uint32_t>::max();
}

template <class T>
std::optional<BadIndex> first_bad(const Table<T>& value, std::size_t rows, std::size_t columns) {
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t k = 0; k < columns; ++k)
      if (!fits(value(i, k))) return BadIndex{i, k, std::to_string(value(i, k))};
  return {};
}

// Rows whose values have type T. `out` null: only checked.
template <class T>
std::optional<BadIndex> convert(const AnyArray& a, std::uint32_t* out) {
  const Table<T> value(a);
  const std::size_t rows = a.shape(0), columns = a.shape(1);
  bool all_fit = true;  // without an exit from the loops: the compiler vectorizes the first
  if (has_contiguous_rows<T>(a) &&
      (rows == 1 || a.stride(0) == static_cast<std::int64_t>(columns))) {
    const auto* values = static_cast<const T*>(a.data());
    for (std::size_t i = 0; i < rows * columns; ++i) all_fit &= fits(values[i]);
    if (out)
      for (std::size_t i = 0; i < rows * columns; ++i)
        out[i] = static_cast<std::uint32_t>(values[i]);
    return all_fit ? std::nullopt : first_bad(value, rows, columns);
  }
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t k = 0; k < columns; ++k) {
      const T v = value(i, k);
      all_fit &= fits(v);
      if (out) *out++ = static_cast<std::uint32_t>(v);
    }
  }
  return all_fit ? std::nullopt : first_bad(value, rows, columns);
}

// False: not a type of integers.
bool convert_any(const AnyArray& a, std::uint32_t* out, std::optional<BadIndex>& bad) {
  const unsigned bits = a.dtype().lanes == 1 ? a.dtype().bits : 0;
  if (static_cast<Code>(a.dtype().code) == Code::Int) {
    if (bits == 8) return bad = convert<std::int8_t>(a, out), true;
    if (bits == 16) return bad = convert<std::int16_t>(a, out), true;
    if (bits == 32) return bad = convert<std::int32_t>(a, out), true;
    if (bits == 64) return bad = convert<std::int64_t>(a, out), true;
  } else if (static_cast<Code>(a.dtype().code) == Code::UInt) {
    if (bits == 8) return bad = convert<std::uint8_t>(a, out), true;
    if (bits == 16) return bad = convert<std::uint16_t>(a, out), true;
    if (bits == 32) return bad = convert<std::uint32_t>(a, out), true;
    if (bits == 64) return bad = convert<std::uint64_t>(a, out), true;
  }
  return false;
}

bool is_integer(const AnyArray& a) noexcept {
  const auto code = static_cast<Code>(a.dtype().code);
  return a.dtype().lanes == 1 && (code == Code::Int || code == Code::UInt) &&
         (a.dtype().bits == 8 || a.dtype().bits == 16 || a.dtype().bits == 32 ||
          a.dtype().bits == 64);
}

}  // namespace

PointArray import_points(nb::handle value, const std::string& name, bool allows_2d,
                         KeepAlive& kept) {
  const std::string wanted =
      std::string("float64 or float32 of shape (n, 3)") + (allows_2d ? ", or (n, 2) for 2-D" : "");
  const AnyArray a = import_array(value, name, wanted);
  const bool is_double = a.dtype() == nb::dtype<double>();
  if (!is_double && !is_float32(a)) {
    type_error(name + ": found " + described(a) + ", wanted " + wanted +
               "; if nothing is lost by it, " + name + ".astype(numpy.float64) makes that");
  }
  if (a.ndim() != 2 || (a.shape(1) != 3 && !(allows_2d && a.shape(1) == 2)))
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  return is_double ? points_of<DoubleVec3, double>(a, name, kept)
                   : points_of<Vec3, float>(a, name, kept);
}

template <class Row>
Strided<Row> import_index_rows(nb::handle value, const std::string& name, KeepAlive& kept) {
  constexpr std::size_t columns = sizeof(Row) / sizeof(std::uint32_t);
  const std::string wanted =
      "uint32 of shape (m, " + std::to_string(columns) + "), or another type of integers";
  const AnyArray a = import_array(value, name, wanted);
  if (!is_integer(a)) {
    type_error(name + ": found " + described(a) + ", wanted " + wanted + "; " + name +
               ".astype(numpy.uint32) makes that");
  }
  if (a.ndim() != 2 || a.shape(1) != columns)
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  const std::size_t n = a.shape(0);
  if (n == 0) return {};
  if (n > max_box_count) {
    value_error(name + ": found " + std::to_string(n) + " rows, at most " +
                std::to_string(max_box_count) + " can be indexed; split them");
  }
  const bool in_place = a.dtype().bits == 32 && has_contiguous_rows<std::uint32_t>(a);
  std::shared_ptr<std::uint32_t[]> copy;
  if (!in_place) copy = allocate<std::uint32_t>(columns * n, name);
  std::optional<BadIndex> bad;
  if (!in_place || static_cast<Code>(a.dtype().code) == Code::Int) {
    const Unlocked unlocked;
    (void)convert_any(a, copy.get(), bad);
  }
  if (bad) {
    value_error(name + ": the index at [" + std::to_string(bad->row) + ", " +
                std::to_string(bad->column) + "] is " + bad->value + ", wanted " +
                (bad->value[0] == '-' ? "0 or more" : "less than 2**32"));
  }
  if (in_place) {
    kept.push_back(std::make_shared<AnyArray>(a));
    return {static_cast<const Row*>(a.data()), n, row_bytes<std::uint32_t>(a, sizeof(Row))};
  }
  kept.push_back(copy);
  return {reinterpret_cast<const Row*>(copy.get()), n, sizeof(Row)};
}

template Strided<Triangle> import_index_rows(nb::handle, const std::string&, KeepAlive&);
template Strided<Edge> import_index_rows(nb::handle, const std::string&, KeepAlive&);
template Strided<Pair> import_index_rows(nb::handle, const std::string&, KeepAlive&);

MeshArrays::MeshArrays(const nb::tuple& mesh, const nb::tuple& filters, const std::string& prefix) {
  view_.vertices = import_points(mesh[0], prefix + "vertices", false, kept_).view;
  view_.triangles = import_index_rows<Triangle>(mesh[1], prefix + "faces", kept_);
  if (!mesh[2].is_none()) {
    const auto numbers = nb::cast<std::array<double, 12>>(mesh[2]);
    for (std::size_t i = 0; i < 12; ++i) view_.transform.row[i / 4][i % 4] = numbers[i];
  }
  const std::size_t n = view_.size();
  const auto fill = [&](auto& values, int k, const char* name) {
    using T = std::remove_cvref_t<decltype(values[0])>;
    values = import_values<T>(filters[k], prefix + name, n, kept_, nullptr, "triangle");
  };
  fill(view_.filters.group, 0, "group");
  fill(view_.filters.mask, 1, "mask");
  fill(view_.filters.owner, 2, "owner");
  fill(view_.filters.world, 3, "world");
  fill(view_.filters.is_static, 4, "static");
}

}  // namespace throng::python
