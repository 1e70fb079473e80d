// update_boxes: computes bounding boxes of transformed shapes, rounded outward.
#pragma once

#include <throng/cpp17.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

// A rotation; w is the real part. Expected to have unit length but used as given: a point v maps to
// R v,
//       1 - 2(yy + zz)   2(xy - wz)       2(xz + wy)
//   R = 2(xy + wz)       1 - 2(xx + zz)   2(yz - wx)
//       2(xz - wy)       2(yz + wx)       1 - 2(xx + yy)
// in real arithmetic, the usual matrix; the identity for 0, 0, 0, w. If xx + yy + zz + ww is 1 + e,
// R changes each length by at most a factor of 2|e|, and R v is at most 2|e| |v| from the image
// under the normalized quaternion. For unit quaternions rounded to float, 2|e| < 5e-7.
struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;
};

struct Transform {
  Vec3 position;
  Quaternion rotation;
};

enum class ShapeKind : std::uint32_t {
  box,     // half_extents around center; a point, segment or plate if some are 0
  convex,  // the hull of points[first_point .. first_point + point_count - 1]; empty if point_count
           // is 0
};

// A shape in body coordinates, inflated by a ball of `radius`. Half extents and radius may be
// infinite, center and points may not.
struct Shape {
  ShapeKind kind = ShapeKind::box;
  Vec3 center = {0, 0, 0};        // box
  Vec3 half_extents = {0, 0, 0};  // box; >= 0
  float radius = 0;               // >= 0; world units, not scaled by the rotation matrix
  std::uint32_t first_point = 0;  // convex
  std::uint32_t point_count = 0;  // convex

  static constexpr Shape sphere(float radius, Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, {0, 0, 0}, radius, 0, 0};
  }
  static constexpr Shape box(Vec3 half_extents, Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, half_extents, 0, 0, 0};
  }
  // Along y; half_length excludes the caps.
  static constexpr Shape capsule(float half_length, float radius,
                                 Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, {0, half_length, 0}, radius, 0, 0};
  }
  static constexpr Shape convex(std::uint32_t first_point, std::uint32_t point_count,
                                float radius = 0) noexcept {
    return {ShapeKind::convex, {0, 0, 0}, {0, 0, 0}, radius, first_point, point_count};
  }
};

// A non-owning view: the arrays must outlive the call. The number of bodies is position.count.
// Strides are in bytes, multiples of 4; 0 repeats one value.
struct Bodies {
  Strided<Vec3> position;
  Strided<Quaternion> rotation;  // absent: no rotation
  // Absent: none. Otherwise a body's box covers the shape translated along the segment from
  // `position` to position + displacement, without rotation, as needed for continuous collision
  // detection.
  Strided<Vec3> displacement;
  // Index into `shapes` per body. Absent: `shapes` has one shape per body, or one for all.
  Strided<std::uint32_t> shape;
  Strided<Shape> shapes;
  Strided<Vec3> points;  // of convex shapes

  Bodies() noexcept = default;
  // `count` bodies whose transforms are `stride_bytes` apart, and their shapes.
  Bodies(const Transform* transforms, std::size_t count, const Shape* shape_array,
         std::size_t shape_count, std::size_t stride_bytes = sizeof(Transform)) noexcept
      : position{transforms ? &transforms->position : nullptr, count, stride_bytes},
        rotation{transforms ? &transforms->rotation : nullptr, count, stride_bytes},
        shapes{shape_array, shape_count, sizeof(Shape)} {}

  std::size_t size() const noexcept { return position.count; }
};

struct UpdateOptions {
  // Added to every radius. World units, >= 0.
  float margin = 0.0f;
  // Maximum number of threads; 0: the executor's concurrency.
  unsigned threads = 0;
  Isa isa = Isa::automatic;
  // Executor to run on; null: the default (oneTBB). Must outlive the call.
  const Executor* executor = nullptr;
  // Cancellation flag, may be set from any thread; null: none. The call then ends soon with
  // Status::stopped and part of the boxes written; checked every 1024 bodies. Must outlive the
  // call.
  const std::atomic<bool>* stop = nullptr;
};

// Writes the box of body i to element i of `out`, which has bodies.size() boxes, `stride_bytes`
// apart (>= sizeof(Box), a multiple of 4). `out` must not overlap the inputs. Allocates nothing.
//
// A box contains the exact box in real arithmetic on the given floats. Each side is off by at most
// 2^-48 of the sum of the magnitudes of its terms (position, displacement, rotated center and half
// extents, radius, margin), plus one float outward: nearly always it is the tightest float or the
// next. Beyond the largest float it is infinite. The result is bit-identical for every thread
// count, instruction set and floating-point state of the caller.
//
// A non-finite transform, displacement, center or point gives a box with a NaN, which find_pairs
// reports by index. An infinite half extent gives a box that is infinite along the rotated axis. A
// plane stays a plane if it is turned about its normal or by half turns about the axes; otherwise
// it becomes infinite in all directions.
//
// A body with an invalid shape (Status::bad_shape) gets a box of NaN, all others are computed;
// first_invalid and invalid_count report them. On any other error nothing is written. Result has
// `written` (boxes), `plan.isa`, `plan.threads` and `times.total_ms`.
THRONG_API Result update_boxes(const Bodies& bodies, Box* out, const UpdateOptions& options = {},
                               std::size_t stride_bytes = sizeof(Box)) noexcept;

}  // namespace throng
