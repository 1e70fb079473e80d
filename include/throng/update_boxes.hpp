// update_boxes: from transforms and shapes to the boxes around them, rounded outward.
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

// A rotation, w the real part. Meant to have length one, and taken as it is: a point v goes to R v,
//       1 - 2(yy + zz)   2(xy - wz)       2(xz + wy)
//   R = 2(xy + wz)       1 - 2(xx + zz)   2(yz - wx)
//       2(xz - wy)       2(yz + wx)       1 - 2(xx + yy)
// in real arithmetic: the matrix that most engines compute, the identity for 0, 0, 0, w. Where
// xx + yy + zz + ww is 1 + e, R changes each length by at most 2|e| of it, and R v is at most
// 2|e| |v| from where the normalised quaternion takes v. Unit ones rounded to float: 2|e| < 5e-7.
struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;
};

struct Transform {
  Vec3 position;
  Quaternion rotation;
};

enum class ShapeKind : std::uint32_t {
  box,     // of half_extents around center; a point, a segment, a plate where some are 0
  convex,  // the hull of points[first_point .. first_point + point_count - 1]; of none: nothing
};

// A shape in its body's frame, grown by a ball of `radius`. Half extents and radius may be
// infinite, center and points may not.
struct Shape {
  ShapeKind kind = ShapeKind::box;
  Vec3 center = {0, 0, 0};        // box
  Vec3 half_extents = {0, 0, 0};  // box; not negative
  float radius = 0;               // not negative; a ball in the world, whatever R does to lengths
  std::uint32_t first_point = 0;  // convex
  std::uint32_t point_count = 0;  // convex

  static constexpr Shape sphere(float radius, Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, {0, 0, 0}, radius, 0, 0};
  }
  static constexpr Shape box(Vec3 half_extents, Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, half_extents, 0, 0, 0};
  }
  // Along y; half_length without the caps.
  static constexpr Shape capsule(float half_length, float radius,
                                 Vec3 center = {0, 0, 0}) noexcept {
    return {ShapeKind::box, center, {0, half_length, 0}, radius, 0, 0};
  }
  static constexpr Shape convex(std::uint32_t first_point, std::uint32_t point_count,
                                float radius = 0) noexcept {
    return {ShapeKind::convex, {0, 0, 0}, {0, 0, 0}, radius, first_point, point_count};
  }
};

// A view: it owns nothing, and what it shows must outlive the call. There are as many bodies as
// positions. Strides are in bytes, multiples of four; 0 repeats one value.
struct Bodies {
  Strided<Vec3> position;
  Strided<Quaternion> rotation;  // absent: none is rotated
  // Absent: none. Else a body's box covers its shape on the whole straight way from `position` to
  // position + displacement, without turning: what continuous collision detection asks for.
  Strided<Vec3> displacement;
  // Which of `shapes`. Absent: `shapes` has one a body, or one for all.
  Strided<std::uint32_t> shape;
  Strided<Shape> shapes;
  Strided<Vec3> points;  // of the convex shapes

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
  // At most so many threads; 0: as many as the executor offers.
  unsigned threads = 0;
  Isa isa = Isa::automatic;
  // Where to run; null: the default (oneTBB). It must outlive the call.
  const Executor* executor = nullptr;
  // Set it to true from any thread, and the call ends soon, with Status::stopped and some of the
  // boxes written; looked at every 1024 bodies. Null: nobody stops it. It must outlive the call.
  const std::atomic<bool>* stop = nullptr;
};

// Writes the box of body i to the i-th of bodies.size() boxes, `stride_bytes` apart (at least
// sizeof(Box), a multiple of four). `out` may not overlap what is read.
//
// A box contains the exact one, in real arithmetic on the floats as given. Each side lies within
// 2^-48 of the sum of the magnitudes that make it up (position, displacement, center and half
// extents as rotated, radius, margin) of the exact one, and then at most one float further out: it
// is nearly always the tightest float or the next. Beyond the largest float it is infinite. The
// same bits for every thread count, instruction set and floating-point state of the caller's.
//
// A transform, displacement, center or point that is not finite gives a box with a NaN, which
// find_pairs refuses by its index. An infinite half extent gives a box that is infinite along that
// axis as rotated; a plane stays one while it is turned about its normal, or by half turns about
// the axes, and is infinite in all directions otherwise.
//
// A body whose shape is wrong (status bad_shape) gets a box of NaN, all others theirs;
// first_invalid and invalid_count tell of them. On every other error nothing is written. `written`
// counts boxes; of Result, `plan.isa`, `plan.threads` and `times.total_ms` are filled in, too.
// Allocates nothing.
THRONG_API Result update_boxes(const Bodies& bodies, Box* out, const UpdateOptions& options = {},
                               std::size_t stride_bytes = sizeof(Box)) noexcept;

}  // namespace throng
