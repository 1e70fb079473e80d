// A ray as a moving point, and what it hits.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <throng/broad_phase.hpp>

#include "base/swept_box.hpp"

namespace throng::base {

// The origin is finite, the direction finite and not zero, the maximum distance not negative; it
// may be infinite.
//
// The point moves by `direction` times a power of two. That product is exact in doubles, and so is
// the time of contact times the power of two, which is
//   t = (bound - origin) / direction   rounded to double.
// The distance is t * |direction|. So neither the power of two nor the maximum distance changes
// what is hit, or where.
//
// The power of two: the path is at least as long as the maximum distance, and at most twice.
// Without a maximum each component other than 0, which is at least 2^-149, moves the point by 2^130
// or more; the difference of two floats is less. No component exceeds 2^128, so no displacement
// exceeds 2^408; and none is below 2^-149 * 2^-280.
class Ray {
 public:
  Ray(const Vec3& origin, const Vec3& direction, double max_distance) noexcept
      : origin_{origin.x, origin.y, origin.z},
        direction_{direction.x, direction.y, direction.z},
        // Squares of floats are exact in doubles, and far from the ends of their range.
        length_(std::sqrt(direction_[0] * direction_[0] + direction_[1] * direction_[1] +
                          direction_[2] * direction_[2])),
        max_distance_(max_distance) {
    const double most = max_distance / length_;  // `t` at the maximum, rounded
    const int exponent = std::clamp(std::ilogb(most), -max_exponent, max_exponent - 1) + 1;
    scale_ = std::ldexp(1.0, exponent);
    path_ = {
        {origin, origin}, direction_[0] * scale_, direction_[1] * scale_, direction_[2] * scale_};
    // Both roundings, of `most` and of the distance, are less than 2^-52 of it.
    last_time_ = std::min(most / scale_ * (1 + 0x1p-50), 1.0);
  }

  const MovingBox& path() const noexcept { return path_; }
  // No hit within the maximum distance has a later time.
  double last_time() const noexcept { return last_time_; }
  double distance(double time) const noexcept { return time * scale_ * length_; }
  bool reaches(double time) const noexcept { return distance(time) <= max_distance_; }

  // The hit of an object whose box the path meets at `time`.
  RayHit hit(ObjectId object, const Box& box, double time) const noexcept {
    const float lower[3] = {box.lower.x, box.lower.y, box.lower.z};
    const float upper[3] = {box.upper.x, box.upper.y, box.upper.z};
    float point[3], normal[3] = {};
    bool entered = false;
    for (int k = 0; k < 3; ++k) {
      const double d = direction_[k], bound = d < 0 ? upper[k] : lower[k];
      if (time == 0) {
        point[k] = static_cast<float>(origin_[k]);
        normal[k] = static_cast<float>(0 - d / length_);
      } else if (!entered && d != 0 && (bound - origin_[k]) / path_.by[k] == time) {
        entered = true;
        point[k] = static_cast<float>(bound);
        normal[k] = d < 0 ? 1.0f : -1.0f;
      } else {
        const double at = origin_[k] + time * scale_ * d;
        const double inside = std::clamp(at, double{lower[k]}, double{upper[k]});
        constexpr double most = std::numeric_limits<float>::max();
        point[k] = static_cast<float>(std::clamp(inside, -most, most));
      }
    }
    return {
        object, distance(time), {point[0], point[1], point[2]}, {normal[0], normal[1], normal[2]}};
  }

 private:
  static constexpr int max_exponent = 280;

  double origin_[3], direction_[3];
  double length_, max_distance_, scale_, last_time_;
  MovingBox path_;
};

}  // namespace throng::base
