// Square roots for the mapping formula: the hardware's in either precision, and the fast inverse
// square root with its two best known constants.
//
// The fast root reads the float's bits as an integer: a constant minus half of it has nearly the
// bits of 1/sqrt(x). Each Newton step y(1.5 - x/2 y y) then about doubles the correct digits. The
// constant 0x5f3759df became known by Quake III ("Carmack"), 0x5f375a86 is Lomont's (C. Lomont,
// Fast Inverse Square Root, 2003).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::paper {

inline constexpr std::uint32_t carmack_constant = 0x5f3759df;
inline constexpr std::uint32_t lomont_constant = 0x5f375a86;
inline constexpr int min_steps = 1, max_steps = 4;

// Approximates 1/sqrt(x), x >= 0. Each step is evaluated in Wide and stored as float. Wide = float
// is what a GPU does with the printed code; double (or wider) is what a compiler does for the x87
// unit, which the paper's processor has, or one that promotes.
template <class Wide>
THRONG_HD constexpr float fast_inverse_root(float x, std::uint32_t constant, int steps) noexcept {
  float y = std::bit_cast<float>(constant - (std::bit_cast<std::uint32_t>(x) >> 1));
  const Wide half = static_cast<Wide>(0.5f) * static_cast<Wide>(x);
  for (int step = 0; step < steps; ++step) {
    const Wide wide = static_cast<Wide>(y);
    y = static_cast<float>(wide * (static_cast<Wide>(1.5f) - half * wide * wide));
  }
  return y;
}

// Turns the inverse root into the root: x * y, as the paper prints it, or 1 / y.
enum class LastOperation { product, reciprocal };

template <class Wide>
struct FastRoot {
  using Real = float;

  std::uint32_t constant = carmack_constant;
  int steps = 2;
  LastOperation last = LastOperation::product;

  THRONG_HD constexpr float operator()(float x) const noexcept {
    const float y = fast_inverse_root<Wide>(x, constant, steps);
    return last == LastOperation::product ? x * y : 1.0f / y;
  }
};

// Correctly rounded by IEEE 754, on the host and (nvcc's default) on the device.
template <class T>
struct HardwareRoot {
  using Real = T;

  THRONG_HD T operator()(T x) const noexcept { return std::sqrt(x); }
};

}  // namespace throng::paper
