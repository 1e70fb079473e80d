#include "apps/throng/falling_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <throng/checksum.hpp>

namespace throng::cli {
namespace {

// Units: an object's side and one frame. The numbers were chosen by the look of the heap.
constexpr float half = 0.5f;          // half a side
constexpr float gravity = 0.016f;     // so that the column has fallen after about 110 frames
constexpr float pitch = 1.12f;        // distance between objects at the start
constexpr float jitter = 0.05f;       // random offset from the rows
constexpr float drop_height = 12.0f;  // from the plane to the lowest objects
constexpr float relax = 0.9f;         // share of an overlap removed per frame
constexpr float upper_share = 0.75f;  // the upper of two moves more: stacks do not sink together
constexpr float topple = 0.25f;       // how fast an object slides off the one below
constexpr float overhang = 0.1f;      // minimum overhang for that
constexpr float keep_velocity = 0.995f;
constexpr float plane_friction = 0.15f;  // share of sliding speed lost on the plane per frame
constexpr float contact_friction = 0.05f;
constexpr float bounce = 0.1f;       // share of speed kept where a push reverses it
constexpr float push_speed = 0.1f;   // the speed that a push gives an object at rest
constexpr float lift_speed = 0.02f;  // the same upwards: prevents bouncing heaps
constexpr float max_speed = 0.9f;    // less than a side per frame: nothing passes through
constexpr float unit = 1048576.0f;   // 2^20

float random_half(std::uint64_t i, std::uint64_t axis) {  // in [-1/2, 1/2), exactly
  const auto bits = static_cast<std::int32_t>(mix64(3 * i + axis) >> 40);
  return static_cast<float>(bits - (1 << 23)) / 16777216.0f;
}

float& axis_of(Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

FallingBoxes::FallingBoxes(std::size_t objects)
    : objects_(objects),
      centre_(objects),
      velocity_(objects, Vec3{0, 0, 0}),
      pushes_(objects),
      boxes_(objects + 1) {
  // A column, three times as high as wide.
  const auto wide = static_cast<std::size_t>(
      std::max(1.0, std::ceil(std::cbrt(static_cast<double>(objects) / 3.0))));
  middle_row_ = wide % 2 == 0 ? 0.5f * pitch : 0.0f;
  for (std::size_t i = 0; i < objects; ++i) {
    const std::size_t grid_position[3] = {i % wide, i / wide % wide, i / wide / wide};
    for (int axis = 0; axis < 3; ++axis) {
      const float start =
          axis == 2 ? half + drop_height : -0.5f * pitch * static_cast<float>(wide - 1);
      axis_of(centre_[i], axis) = start + pitch * static_cast<float>(grid_position[axis]) +
                                  2 * jitter * random_half(i, static_cast<std::uint64_t>(axis));
    }
    place(i);
  }
  before_ = centre_;
  const float infinity = std::numeric_limits<float>::infinity();
  boxes_[objects] = {{-infinity, -infinity, -infinity}, {infinity, infinity, 0.0f}};
}

void FallingBoxes::place(std::size_t i) {
  const Vec3 c = centre_[i];
  boxes_[i] = {{c.x - half, c.y - half, c.z - half}, {c.x + half, c.y + half, c.z + half}};
}

void FallingBoxes::fall() {
  for (std::size_t i = 0; i < objects_; ++i) {
    before_[i] = centre_[i];
    velocity_[i].z -= gravity;
    for (int axis = 0; axis < 3; ++axis) {
      float& v = axis_of(velocity_[i], axis);
      v = std::clamp(v * keep_velocity, -max_speed, max_speed);
      axis_of(centre_[i], axis) += v;
    }
    place(i);
  }
}

void FallingBoxes::push(std::uint32_t a, std::uint32_t b) {
  float offset[3], overlap[3];
  int least = 0;
  for (int axis = 0; axis < 3; ++axis) {
    offset[axis] = axis_of(centre_[b], axis) - axis_of(centre_[a], axis);
    overlap[axis] = 2 * half - std::fabs(offset[axis]);
    if (overlap[axis] < overlap[least]) least = axis;
  }
  if (overlap[least] <= 0) return;  // they only touch
  const auto add = [&](std::uint32_t i, int axis, float by) {
    pushes_[i].by[axis] += static_cast<std::int32_t>(by * unit);
    ++pushes_[i].how_many[axis];
  };
  const float away = offset[least] < 0 ? -1.0f : 1.0f;
  const float share_b = least != 2 ? 0.5f : away > 0 ? upper_share : 1 - upper_share;
  add(a, least, -away * (1 - share_b) * relax * overlap[least]);
  add(b, least, away * share_b * relax * overlap[least]);
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == least) continue;
    // Friction: each takes over a part of the other's motion.
    const float moved_a = axis_of(centre_[a], axis) - axis_of(before_[a], axis);
    const float moved_b = axis_of(centre_[b], axis) - axis_of(before_[b], axis);
    float slide = 0.5f * contact_friction * (moved_b - moved_a);
    // Toppling, as boxes do not rotate here: the upper one slides off the lower.
    if (least == 2 && axis != 2 && std::fabs(offset[axis]) > overhang) {
      slide -= 0.5f * topple * offset[axis];
    }
    add(a, axis, slide);
    add(b, axis, -slide);
  }
}

void FallingBoxes::push_apart(const Pair* pairs, std::size_t count) {
  std::fill(pushes_.begin(), pushes_.end(), Push{});
  const auto plane = static_cast<std::uint32_t>(objects_);
  for (std::size_t k = 0; k < count; ++k) {
    if (pairs[k].second != plane) push(pairs[k].first, pairs[k].second);
  }
  for (std::size_t i = 0; i < objects_; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Push& p = pushes_[i];
      if (p.how_many[axis] == 0) continue;
      axis_of(centre_[i], axis) +=
          static_cast<float>(p.by[axis]) / unit / std::sqrt(static_cast<float>(p.how_many[axis]));
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    if (pairs[k].second != plane) continue;
    Vec3& c = centre_[pairs[k].first];
    const Vec3 before = before_[pairs[k].first];
    c.z = std::max(c.z, half);
    c.x -= plane_friction * (c.x - before.x);
    c.y -= plane_friction * (c.y - before.y);
  }
  for (std::size_t i = 0; i < objects_; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      // A push removes speed and adds little: nothing bounces.
      float& v = axis_of(velocity_[i], axis);
      const float most = std::max(std::fabs(v), axis == 2 ? lift_speed : push_speed);
      const float moved = axis_of(centre_[i], axis) - axis_of(before_[i], axis);
      v = std::clamp(moved * v < 0 ? bounce * moved : moved, -most, most);
    }
    place(i);
  }
}

std::vector<float> FallingBoxes::touches(const Pair* pairs, std::size_t count) const {
  std::vector<float> touching(objects_, 0.0f);
  for (std::size_t k = 0; k < count; ++k) {
    if (pairs[k].second == objects_) continue;
    ++touching[pairs[k].first];
    ++touching[pairs[k].second];
  }
  return touching;
}

}  // namespace throng::cli
