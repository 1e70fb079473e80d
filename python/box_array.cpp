// Boxes without a copy; conversion of float64 to float32 and back.
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

// One coordinate's values: strides `row` and `column`, in values.
template <class T>
struct Table {
  const T* data;
  std::int64_t row, column;
  T operator()(std::size_t i, std::size_t k) const noexcept {
    return data[static_cast<std::int64_t>(i) * row + static_cast<std::int64_t>(k) * column];
  }
};

Table<double> table_of(const CornerArray& corner) {
  const auto* data = static_cast<const double*>(corner.array.data());
  if (data) data += corner.begin;
  return {data, corner.array.stride(0), corner.axis};
}

// Only within float's range is the cast defined; and exact.
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

// `out` holds 2 d floats per box.
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
bool is_float64(const AnyArray& a, const std::string& name, const std::string& wanted) {
  if (is_float32(a)) return false;
  if (a.dtype() == nb::dtype<double>()) return true;
  type_error(name + ": found " + described(a) + ", wanted " + wanted +
             " or float64; if nothing is lost by it, " + name +
             ".astype(numpy.float32), of a PyTorch tensor " + name + ".float(), makes that");
}

// `count` rows of 2 d contiguous values.
template <class Real>
BasicBoxes<Real> rows_of(const Real* p, std::size_t count, unsigned d) {
  using View = BasicBoxes<Real>;
  if (d == 3) return View(reinterpret_cast<const typename View::Value*>(p), count);
  return View::arrays(p, p + 1, nullptr, p + 2, p + 3, nullptr, count, 4 * sizeof(Real));
}

// Lower and upper corners of Real, without a copy.
template <class Real>
BasicBoxes<Real> in_place_view(const CornerArray& lower, const CornerArray& upper, unsigned d) {
  using View = BasicBoxes<Real>;
  const std::size_t count = lower.array.shape(0);
  const std::size_t stride = row_stride(lower.array, lower.name, 2 * d) * sizeof(Real);
  const std::size_t upper_stride = row_stride(upper.array, upper.name, 2 * d) * sizeof(Real);
  if (upper_stride != stride) {
    value_error(lower.name + " has rows " + std::to_string(stride) + " bytes apart and " +
                upper.name + " " + std::to_string(upper_stride) +
                "; give both the same layout, as by numpy.ascontiguousarray");
  }
  const auto* l = static_cast<const Real*>(lower.array.data()) + lower.begin;
  const auto* u = static_cast<const Real*>(upper.array.data()) + upper.begin;
  if (d == 3 && u == l + 3 && lower.axis == 1 && upper.axis == 1)
    return View(reinterpret_cast<const typename View::Value*>(l), count, stride);
  const Real* p[6] = {};
  for (unsigned k = 0; k < d; ++k) {
    p[k] = l + static_cast<std::int64_t>(k) * lower.axis;
    p[3 + k] = u + static_cast<std::int64_t>(k) * upper.axis;
  }
  return View::arrays(p[0], p[1], p[2], p[3], p[4], p[5], count, stride);
}

bool is_readable_in_place(const CornerArray& lower, const CornerArray& upper) {
  const AnyArray &a = lower.array, &b = upper.array;
  return a.shape(0) <= 1 || (a.stride(0) >= 0 && a.stride(0) == b.stride(0));
}

}  // namespace

BoxArray::BoxArray(nb::handle given, const std::string& name, Rounding rounding, ArrayDevice* place)
    : array_device_(place) {
  const nb::object value = boxes_of_lists(given, name);
  if (PyTuple_Check(value.ptr()))
    import_lower_upper(value, name, rounding);
  else
    import_array_of_boxes(value, name, rounding);
}

BoxArray BoxArray::one_or_more(nb::handle given, const std::string& name, Rounding rounding) {
  nb::object value = boxes_of_lists(given, name);
  const nb::object dimensions = nb::getattr(value, "ndim", nb::none());
  if (!dimensions.is_none() && dimensions.equal(nb::int_(1)) && nb::hasattr(value, "reshape"))
    value = value.attr("reshape")(1, -1);
  return {value, name, rounding};
}

void BoxArray::import_array_of_boxes(nb::handle value, const std::string& name, Rounding rounding) {
  const std::string wanted =
      "float32 of shape (n, 6) or (n, 2, 3), for 2-D (n, 4) or (n, 2, 2), or a tuple (lower, "
      "upper)";
  AnyArray a = import_array(value, name, wanted, array_device_);
  const bool rows = a.ndim() == 2 && (a.shape(1) == 6 || a.shape(1) == 4);
  const bool corners = a.ndim() == 3 && a.shape(1) == 2 && (a.shape(2) == 3 || a.shape(2) == 2);
  if (!rows && !corners) {
    std::string text = name + ": found " + described(a) + ", wanted " + wanted;
    if (a.ndim() == 3 && (a.shape(2) == 6 || a.shape(2) == 4)) {
      const std::string worlds = std::to_string(a.shape(0)), n = std::to_string(a.shape(1));
      text += "; of " + worlds + " worlds of " + n + " boxes give " + name + ".reshape(-1, " +
              std::to_string(a.shape(2)) + "), " + (name == "other" ? "other_" : "") +
              "world=numpy.repeat(numpy.arange(" + worlds + "), " + n + ")";
    }
    value_error(text);
  }
  arrays_.push_back(a);
  if (corners) {
    dimensions_ = static_cast<unsigned>(a.shape(2));
    show({a, name, 0, a.stride(2), "0, "}, {a, name, a.stride(1), a.stride(2), "1, "}, wanted,
         rounding);
  } else {
    dimensions_ = a.shape(1) == 6 ? 3 : 2;
    show({a, name, 0, a.stride(1)},
         {a, name, dimensions_ * a.stride(1), a.stride(1), "", dimensions_}, wanted, rounding);
  }
}

void BoxArray::import_lower_upper(nb::handle pair, const std::string& name, Rounding rounding) {
  const std::string wanted = "float32 of shape (n, 3), or (n, 2) for 2-D";
  if (nb::len(pair) != 2) {
    value_error(name + ": found a tuple of " + std::to_string(nb::len(pair)) +
                ", wanted (lower, upper)");
  }
  const std::string names[2] = {name + "[0]", name + "[1]"};
  for (int k = 0; k < 2; ++k)
    arrays_.push_back(import_array(pair[k], names[k], wanted, array_device_));
  const AnyArray &lower = arrays_[0], &upper = arrays_[1];
  for (int k = 0; k < 2; ++k) {
    const AnyArray& a = arrays_[k];
    if (a.ndim() != 2 || (a.shape(1) != 3 && a.shape(1) != 2))
      value_error(names[k] + ": found " + described(a) + ", wanted " + wanted);
    (void)is_float64(a, names[k], wanted);  // of another type: a TypeError
  }
  if (lower.shape(0) != upper.shape(0) || lower.shape(1) != upper.shape(1) ||
      lower.dtype() != upper.dtype()) {
    value_error(name + ": found a lower of " + described(lower) + " and an upper of " +
                described(upper) + ", wanted two arrays of one type and shape");
  }
  dimensions_ = static_cast<unsigned>(lower.shape(1));
  show({lower, names[0], 0, lower.stride(1)}, {upper, names[1], 0, upper.stride(1)}, wanted,
       rounding);
}

// `value(i, k)`: coordinate k of 2 d of box i.
template <class Value>
void BoxArray::keep_doubles(const std::string& name, const Value& value, std::size_t n) {
  const unsigned d = dimensions_;
  widened_.reset(new (std::nothrow) double[2 * d * n]);
  if (!widened_) {
    memory_error(name + ": no memory for " + std::to_string(16 * d * n) + " bytes of float64");
  }
  {
    const Unlocked unlocked;
    double* out = widened_.get();
    for (std::size_t i = 0; i < n; ++i)
      for (unsigned k = 0; k < 2 * d; ++k) *out++ = value(i, k);
  }
  doubles_ = rows_of(widened_.get(), n, d);
}

void BoxArray::show(const CornerArray& lower, const CornerArray& upper, const std::string& wanted,
                    Rounding rounding) {
  const bool given_double = is_float64(lower.array, lower.name, wanted);
  if (given_double && array_device_ && array_device_->on_gpu) {
    type_error(lower.name + ": found " + described(lower.array) + " on " + array_device_->name() +
               ", where values are not converted; wanted float32, as by x.astype(float32)");
  }
  const std::size_t count = lower.array.shape(0);
  const unsigned d = dimensions_;
  if (count > max_box_count) {
    value_error(lower.name + ": found " + std::to_string(count) + " boxes, at most " +
                std::to_string(max_box_count) + " can be indexed; split them");
  }
  is_double_ = given_double && rounding == Rounding::exact;
  if (count == 0) return;
  require_aligned(lower.array, lower.name, given_double ? 8 : 4);
  require_aligned(upper.array, upper.name, given_double ? 8 : 4);
  if (is_double_ && is_readable_in_place(lower, upper)) {
    doubles_ = in_place_view<double>(lower, upper, d);
  } else if (is_double_) {
    keep_doubles(
        lower.name,
        [l = table_of(lower), u = table_of(upper), d](std::size_t i, unsigned k) {
          return k < d ? l(i, k) : u(i, k - d);
        },
        count);
  } else if (given_double) {
    converted_.reset(new (std::nothrow) float[2 * d * count]);
    if (!converted_) {
      memory_error(lower.name + ": no memory for " + std::to_string(8 * d * count) +
                   " bytes of float32");
    }
    std::optional<Inexact> bad;
    {
      const Unlocked unlocked;
      bad = to_floats(table_of(lower), table_of(upper), count, d, rounding, converted_.get());
    }
    if (bad) {
      const CornerArray& corner = bad->upper ? upper : lower;
      char number[40];
      std::snprintf(number, sizeof number, "%.17g", bad->value);
      value_error(corner.name + ": the float64 at [" + std::to_string(bad->row) + ", " +
                  corner.index + std::to_string(bad->column + corner.first_column) + "] is " +
                  number + ", which no float32 equals; give float32, rounded as you choose");
    }
    view_ = rows_of(converted_.get(), count, d);
  } else {
    view_ = in_place_view<float>(lower, upper, d);
  }
}

void BoxArray::widen(const std::string& name) {
  const unsigned d = dimensions_;
  keep_doubles(
      name, [this, d](std::size_t i, unsigned k) { return view_.corner(i, k < d ? k : 3 + k - d); },
      view_.size());
  doubles_.filters = view_.filters;
  is_double_ = true;
}

void BoxArray::set_filters(const std::string& prefix, nb::handle group, nb::handle mask,
                           nb::handle owner, nb::handle world, nb::handle is_static) {
  Filters& f = is_double_ ? doubles_.filters : view_.filters;
  const std::size_t n = size();
  f.group = import_values<std::uint32_t>(group, prefix + "group", n, filters_, array_device_);
  f.mask = import_values<std::uint32_t>(mask, prefix + "mask", n, filters_, array_device_);
  f.owner = import_values<std::int32_t>(owner, prefix + "owner", n, filters_, array_device_);
  f.world = import_values<std::int32_t>(world, prefix + "world", n, filters_, array_device_);
  f.is_static =
      import_values<std::uint8_t>(is_static, prefix + "static", n, filters_, array_device_);
}

}  // namespace throng::python
