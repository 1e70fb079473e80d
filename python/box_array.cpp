// Boxes as given, shown where they lie; float64 made float32, and the reverse.
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <optional>

#include <throng/find_pairs.hpp>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/lock.hpp"

namespace throng::python {
namespace {

// One coordinate's values: `row` and `column` apart, in values.
template <class T>
struct Table {
  const T* data;
  std::int64_t row, column;
  T operator()(std::size_t i, std::size_t k) const noexcept {
    return data[static_cast<std::int64_t>(i) * row + static_cast<std::int64_t>(k) * column];
  }
};

Table<double> table_of(const AnyArray& a, std::size_t first_column) {
  const auto* data = static_cast<const double*>(a.data());
  if (data) data += static_cast<std::int64_t>(first_column) * a.stride(1);
  return {data, a.stride(0), a.stride(1)};
}

// Within float's range, where alone the cast is defined, and exact.
bool to_float(double x, float& f) noexcept {
  f = std::numeric_limits<float>::quiet_NaN();
  if (std::isnan(x)) return true;
  if (!std::isinf(x) && std::fabs(x) > std::numeric_limits<float>::max()) return false;
  f = static_cast<float>(x);
  return static_cast<double>(f) == x;
}

struct Inexact {
  std::size_t row, column;
  bool upper;
  double value;
};

// `out` takes 2 d floats a box.
std::optional<Inexact> to_floats(const Table<double>& lower, const Table<double>& upper,
                                 std::size_t count, unsigned d, Rounding rounding, float* out) {
  for (std::size_t i = 0; i < count; ++i, out += 2 * d) {
    bool exact = true;
    for (unsigned k = 0; k < 2 * d; ++k) {
      const double x = k < d ? lower(i, k) : upper(i, k - d);
      if (to_float(x, out[k])) continue;
      exact = false;
      if (rounding == Rounding::none) return Inexact{i, k % d, k >= d, x};
    }
    if (exact) continue;
    double l[3] = {}, u[3] = {};
    for (unsigned k = 0; k < d; ++k) l[k] = lower(i, k), u[k] = upper(i, k);
    const Box box = round_outward(l, u);
    const float bounds[6] = {box.lower.x, box.lower.y, box.lower.z,
                             box.upper.x, box.upper.y, box.upper.z};
    for (unsigned k = 0; k < 2 * d; ++k) out[k] = bounds[k < d ? k : 3 + k - d];
  }
  return {};
}

// float32, float64, or a TypeError.
bool holds_double(const AnyArray& a, const std::string& name, const std::string& wanted) {
  if (is_float32(a)) return false;
  if (a.dtype() == nb::dtype<double>()) return true;
  type_error(name + ": found " + described(a) + ", wanted " + wanted +
             " (float64 where each value is a float32, or with round='outward' or 'exact'); if "
             "nothing is lost by it, " +
             name + ".astype(numpy.float32), of a PyTorch tensor " + name + ".float(), makes that");
}

// `count` rows of 2 d values that lie together.
template <class Real>
BasicBoxes<Real> rows_of(const Real* p, std::size_t count, unsigned d) {
  using View = BasicBoxes<Real>;
  if (d == 3) return View(reinterpret_cast<const typename View::Value*>(p), count);
  return View::arrays(p, p + 1, nullptr, p + 2, p + 3, nullptr, count, 4 * sizeof(Real));
}

// Lower corners and, from `upper_column` on, upper ones of Real, which the view shows as they lie.
template <class Real>
BasicBoxes<Real> as_they_lie(const AnyArray& lower, const AnyArray& upper, unsigned upper_column,
                             const std::string& lower_name, const std::string& upper_name,
                             unsigned d) {
  using View = BasicBoxes<Real>;
  const std::size_t count = lower.shape(0);
  const std::size_t stride = row_stride(lower, lower_name, 2 * d) * sizeof(Real);
  const std::size_t upper_stride = row_stride(upper, upper_name, 2 * d) * sizeof(Real);
  if (upper_stride != stride) {
    value_error(lower_name + " has rows " + std::to_string(stride) + " bytes apart and " +
                upper_name + " " + std::to_string(upper_stride) +
                "; give both the same layout, as by numpy.ascontiguousarray");
  }
  const auto* l = static_cast<const Real*>(lower.data());
  const auto* u = static_cast<const Real*>(upper.data()) +
                  static_cast<std::int64_t>(upper_column) * upper.stride(1);
  if (d == 3 && upper_column == 3 && lower.stride(1) == 1)
    return View(reinterpret_cast<const typename View::Value*>(l), count, stride);
  const Real* p[6] = {};
  for (unsigned k = 0; k < d; ++k) {
    p[k] = l + static_cast<std::int64_t>(k) * lower.stride(1);
    p[3 + k] = u + static_cast<std::int64_t>(k) * upper.stride(1);
  }
  return View::arrays(p[0], p[1], p[2], p[3], p[4], p[5], count, stride);
}

}  // namespace

BoxArray::BoxArray(nb::handle value, const std::string& name, Rounding rounding, Place* place)
    : place_(place) {
  if (PyTuple_Check(value.ptr()))
    take_two(value, name, rounding);
  else
    take_one(value, name, rounding);
}

void BoxArray::take_one(nb::handle value, const std::string& name, Rounding rounding) {
  const std::string wanted = "float32 of shape (n, 6), (n, 4) for 2-D, or a tuple (lower, upper)";
  AnyArray a = import_array(value, name, wanted, place_);
  if (a.ndim() != 2 || (a.shape(1) != 6 && a.shape(1) != 4)) {
    value_error(name + ": found " + described(a) + ", wanted " + wanted);
  }
  dimensions_ = a.shape(1) == 6 ? 3 : 2;
  arrays_.push_back(a);
  show(a, a, dimensions_, name, name, wanted, rounding);
}

void BoxArray::take_two(nb::handle pair, const std::string& name, Rounding rounding) {
  const std::string wanted = "float32 of shape (n, 3), or (n, 2) for 2-D";
  if (nb::len(pair) != 2) {
    value_error(name + ": found a tuple of " + std::to_string(nb::len(pair)) +
                ", wanted (lower, upper)");
  }
  const std::string names[2] = {name + "[0]", name + "[1]"};
  for (int k = 0; k < 2; ++k) arrays_.push_back(import_array(pair[k], names[k], wanted, place_));
  const AnyArray &lower = arrays_[0], &upper = arrays_[1];
  for (int k = 0; k < 2; ++k) {
    const AnyArray& a = arrays_[k];
    if (a.ndim() != 2 || (a.shape(1) != 3 && a.shape(1) != 2))
      value_error(names[k] + ": found " + described(a) + ", wanted " + wanted);
    (void)holds_double(a, names[k], wanted);  // of another type: a TypeError
  }
  if (lower.shape(0) != upper.shape(0) || lower.shape(1) != upper.shape(1) ||
      lower.dtype() != upper.dtype()) {
    value_error(name + ": found a lower of " + described(lower) + " and an upper of " +
                described(upper) + ", wanted two arrays of one type and shape");
  }
  dimensions_ = static_cast<unsigned>(lower.shape(1));
  show(lower, upper, 0, names[0], names[1], wanted, rounding);
}

void BoxArray::show(const AnyArray& lower, const AnyArray& upper, unsigned upper_column,
                    const std::string& lower_name, const std::string& upper_name,
                    const std::string& wanted, Rounding rounding) {
  const bool given_double = holds_double(lower, lower_name, wanted);
  if (given_double && place_ && place_->on_gpu) {
    type_error(lower_name + ": found " + described(lower) + " on " + place_->name() +
               ", where nothing is converted; wanted float32, as by x.astype(float32)");
  }
  const std::size_t count = lower.shape(0);
  const unsigned d = dimensions_;
  if (count > max_box_count) {
    value_error(lower_name + ": found " + std::to_string(count) + " boxes, at most " +
                std::to_string(max_box_count) + " can be indexed; split them");
  }
  is_double_ = given_double && rounding == Rounding::exact;
  if (count == 0) return;
  require_aligned(lower, lower_name, given_double ? 8 : 4);
  require_aligned(upper, upper_name, given_double ? 8 : 4);
  if (is_double_) {
    doubles_ = as_they_lie<double>(lower, upper, upper_column, lower_name, upper_name, d);
  } else if (given_double) {
    converted_.reset(new (std::nothrow) float[2 * d * count]);
    if (!converted_) {
      memory_error(lower_name + ": no memory for " + std::to_string(8 * d * count) +
                   " bytes of float32");
    }
    std::optional<Inexact> bad;
    {
      const Unlocked unlocked;
      bad = to_floats(table_of(lower, 0), table_of(upper, upper_column), count, d, rounding,
                      converted_.get());
    }
    if (bad) {
      const unsigned column = static_cast<unsigned>(bad->column) + (bad->upper ? upper_column : 0);
      char number[40];
      std::snprintf(number, sizeof number, "%.17g", bad->value);
      const std::string& name = bad->upper ? upper_name : lower_name;
      value_error(name + ": the float64 at [" + std::to_string(bad->row) + ", " +
                  std::to_string(column) + "] is " + number +
                  ", which no float32 equals; pass round='exact' or 'outward' to a search, or give "
                  "float32");
    }
    view_ = rows_of(converted_.get(), count, d);
  } else {
    view_ = as_they_lie<float>(lower, upper, upper_column, lower_name, upper_name, d);
  }
}

void BoxArray::widen(const std::string& name) {
  const std::size_t n = view_.size();
  const unsigned d = dimensions_;
  widened_.reset(new (std::nothrow) double[2 * d * n]);
  if (!widened_) {
    memory_error(name + ": no memory for " + std::to_string(16 * d * n) + " bytes of float64");
  }
  {
    const Unlocked unlocked;
    double* out = widened_.get();
    for (std::size_t i = 0; i < n; ++i)
      for (unsigned k = 0; k < 2 * d; ++k) *out++ = view_.corner(i, k < d ? k : 3 + k - d);
  }
  doubles_ = rows_of(widened_.get(), n, d);
  doubles_.filters = view_.filters;
  is_double_ = true;
}

void BoxArray::set_filters(const std::string& prefix, nb::handle group, nb::handle mask,
                           nb::handle owner, nb::handle world, nb::handle is_static) {
  Filters& f = is_double_ ? doubles_.filters : view_.filters;
  const std::size_t n = size();
  f.group = import_values<std::uint32_t>(group, prefix + "group", n, filters_, place_);
  f.mask = import_values<std::uint32_t>(mask, prefix + "mask", n, filters_, place_);
  f.owner = import_values<std::int32_t>(owner, prefix + "owner", n, filters_, place_);
  f.world = import_values<std::int32_t>(world, prefix + "world", n, filters_, place_);
  f.is_static = import_values<std::uint8_t>(is_static, prefix + "static", n, filters_, place_);
}

}  // namespace throng::python
