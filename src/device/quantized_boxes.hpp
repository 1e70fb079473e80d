// Boxes quantized to 64 bits each, for a first test of many against many: boxes that are disjoint
// when quantized are disjoint.
//
// Per axis one function maps a float to a step of a range, 0 .. last, as in base/quantize.hpp:
//   q(x) = int(min(max((x - origin) * scale, 0), last)),   scale >= 0; NaN maps to 0.
// It is non-decreasing in x for every float but NaN: subtraction, multiplication, min, max and
// truncation are. The product 0 * infinity is NaN either for all x (scale 0) or only for x = origin
// (scale infinite), which is the least x with a value above 0. So q(a.lower) > q(b.upper) implies
// a.lower > b.upper for any range; equal steps imply nothing.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "base/quantize.hpp"

namespace throng::device {

// The steps of three axes packed in 10, 10 and 9 bits, each with a guard bit above: 0 in `lower`, 1
// in `upper`.
struct QuantizedBox {
  std::uint32_t lower, upper;
  static constexpr std::uint32_t guards = 1u << 10 | 1u << 21 | 1u << 31;
};

// Subtracts steps of lower ends from steps of upper ends: a guard bit is cleared where the result
// is negative.
THRONG_HD constexpr bool are_disjoint(const QuantizedBox& a, const QuantizedBox& b) noexcept {
  return (~((a.upper - b.lower) & (b.upper - a.lower)) & QuantizedBox::guards) != 0;
}

// The range of an axis that is quantized; values beyond it are clamped.
struct QuantizationRange {
  float origin[3], scale[3];

  THRONG_HD static constexpr float last(int axis) noexcept { return axis < 2 ? 1023.0f : 511.0f; }
  THRONG_HD void set_axis(int axis, float low, float high) noexcept {
    origin[axis] = low;
#if defined(__CUDA_ARCH__)
    scale[axis] = __fdividef(last(axis), high - low);  // any value is correct
#else
    scale[axis] = last(axis) / (high - low);
#endif
  }
  THRONG_HD std::uint32_t step(int axis, float x) const noexcept {
    return static_cast<std::uint32_t>(base::index_of(x, origin[axis], scale[axis], last(axis)));
  }
  THRONG_HD QuantizedBox quantize(const Box& b) const noexcept {
    return {step(0, b.lower.x) | step(1, b.lower.y) << 11 | step(2, b.lower.z) << 22,
            step(0, b.upper.x) | step(1, b.upper.y) << 11 | step(2, b.upper.z) << 22 |
                QuantizedBox::guards};
  }
};

}  // namespace throng::device
