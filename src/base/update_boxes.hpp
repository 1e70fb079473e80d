// The box of one body per call, for host and device threads. Plain pointers only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <throng/update_boxes.hpp>

#include "base/body_bounds.hpp"
#include "base/host_device_macros.hpp"
#include "base/strided_array.hpp"

namespace throng::base {

// Possible faults of a body's shape.
enum class ShapeFault : std::uint32_t { none, index, kind, radius, half_extents, points };

// The comparisons make a NaN a fault. The sum of two 32-bit numbers needs the wider type.
THRONG_HD constexpr ShapeFault fault_of(const Shape& s, std::uint64_t point_count) noexcept {
  if (!(s.radius >= 0)) return ShapeFault::radius;
  if (s.kind == ShapeKind::box) {
    const Vec3& h = s.half_extents;
    const bool good = (h.x >= 0) & (h.y >= 0) & (h.z >= 0);
    return good ? ShapeFault::none : ShapeFault::half_extents;
  }
  if (s.kind != ShapeKind::convex) return ShapeFault::kind;
  return std::uint64_t{s.first_point} + s.point_count <= point_count ? ShapeFault::none
                                                                     : ShapeFault::points;
}

// The range of a convex shape's points along one axis, relative to the position; `far` is at least
// every |v|. The comparisons drop a NaN, but `weight` keeps it, and then both ends are NaN.
struct PointRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  THRONG_HD constexpr void take(const Row& m, const Vector& v) noexcept {
    const double s = m.x * v.x + m.y * v.y + m.z * v.z;
    low = s < low ? s : low;
    high = s > high ? s : high;
  }
  THRONG_HD constexpr Extent extent(const Row& m, const Vector& far, double r,
                                    double own) const noexcept {
    const double weight =
        magnitude(m.x) * far.x + magnitude(m.y) * far.y + magnitude(m.z) * far.z + r + m.t * own;
    // A processor may choose either of +0 and -0 as the minimum; 0 + low is +0 in both cases.
    return {(0.0 + low) - r, high + r, weight};
  }
};

// The greater magnitude, or NaN if either argument is NaN.
THRONG_HD constexpr double larger_magnitude(double far, double x) noexcept {
  const double a = magnitude(x);
  return a > far || a != a ? a : far;
}

struct UpdateBoxes {
  StridedArray<Vec3> position;
  StridedArray<Quaternion> rotation;
  StridedArray<Vec3> displacement;
  StridedArray<std::uint32_t> shape;
  StridedArray<Shape> shapes;
  StridedArray<Vec3> points;
  std::uint64_t shape_count = 0, point_count = 0;
  bool one_shape = false;  // without `shape`: one shape for all bodies, else body i has shape i
  float margin = 0;
  char* out = nullptr;
  std::size_t out_stride = sizeof(Box);

  THRONG_HD std::uint64_t shape_index(std::size_t i) const noexcept {
    return shape.data ? shape[i] : one_shape ? 0 : i;
  }
  THRONG_HD Box& box(std::size_t i) const noexcept {
    return *reinterpret_cast<Box*>(out + i * out_stride);
  }
  THRONG_HD ShapeFault fault(std::size_t i) const noexcept {
    const std::uint64_t index = shape_index(i);
    return index < shape_count ? fault_of(shapes[index], point_count) : ShapeFault::index;
  }
  // Step 3 of the proof in body_bounds.hpp bounds its error.
  THRONG_HD double radius_of(const Shape& s) const noexcept {
    return static_cast<double>(s.radius) + static_cast<double>(margin);
  }

  // Writes box i and returns its fault; a faulty body gets a box of NaN. Reads no memory outside
  // the sizes above.
  THRONG_HD ShapeFault operator()(std::size_t i) const noexcept {
    const ShapeFault wrong = fault(i);
    if (wrong != ShapeFault::none) {
      constexpr float nan = std::numeric_limits<float>::quiet_NaN();
      box(i) = {{nan, nan, nan}, {nan, nan, nan}};
      return wrong;
    }
    const Shape& s = shapes[shape_index(i)];
    const Extents e = s.kind == ShapeKind::convex ? convex_extents(i, s)
                      : rotation.data
                          ? extents_of(rotation[i], s.center, s.half_extents, radius_of(s))
                          : extents_of(s.center, s.half_extents, radius_of(s));
    box(i) = displacement.data ? place(position[i], displacement[i], e) : place(position[i], e);
    return wrong;
  }

  THRONG_HD Extents convex_extents(std::size_t i, const Shape& s) const noexcept {
    const Rotation m = rotation_of(rotation.data ? rotation[i] : Quaternion{});
    const double r = bounded(radius_of(s));
    PointRange x, y, z;
    Vector far = {0, 0, 0};
    for (std::uint32_t k = 0; k < s.point_count; ++k) {
      const Vector v = widen(points[std::size_t{s.first_point} + k]);
      x.take(m.x, v);
      y.take(m.y, v);
      z.take(m.z, v);
      far = {larger_magnitude(far.x, v.x), larger_magnitude(far.y, v.y),
             larger_magnitude(far.z, v.z)};
    }
    return {x.extent(m.x, far, r, far.x), y.extent(m.y, far, r, far.y),
            z.extent(m.z, far, r, far.z)};
  }
};

}  // namespace throng::base
