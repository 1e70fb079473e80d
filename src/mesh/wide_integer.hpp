// Fixed-point numbers that hold every finite double: integers times 2^-1074. Slow: about ten
// times the time of expansions. For coordinates too large or too small for those.
#pragma once

#include <bit>
#include <cstdint>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

// A magnitude of 32 * Limbs bits, least significant limb first.
template <int Limbs>
struct WideInteger {
  std::uint32_t limb[Limbs] = {};
};

// total += x, modulo 2^(32 N).
template <int N, int M>
THRONG_HD inline void add(WideInteger<N>& total, const WideInteger<M>& x) noexcept {
  static_assert(M <= N);
  std::uint64_t carry = 0;
  for (int i = 0; i < N && (i < M || carry != 0); ++i) {
    carry += std::uint64_t{total.limb[i]} + (i < M ? x.limb[i] : 0);
    total.limb[i] = static_cast<std::uint32_t>(carry);
    carry >>= 32;
  }
}

// total -= x, modulo 2^(32 N).
template <int N>
THRONG_HD inline void subtract(WideInteger<N>& total, const WideInteger<N>& x) noexcept {
  std::uint64_t borrow = 0;
  for (int i = 0; i < N; ++i) {
    const std::uint64_t difference = std::uint64_t{total.limb[i]} - x.limb[i] - borrow;
    total.limb[i] = static_cast<std::uint32_t>(difference);
    borrow = difference >> 63;
  }
}

template <int N, int M>
THRONG_HD inline WideInteger<N + M> product(const WideInteger<N>& a,
                                            const WideInteger<M>& b) noexcept {
  WideInteger<N + M> result;
  for (int i = 0; i < N; ++i) {
    if (a.limb[i] == 0) continue;  // most limbs of most doubles
    std::uint64_t carry = 0;
    for (int k = 0; k < M; ++k) {
      carry += std::uint64_t{a.limb[i]} * b.limb[k] + result.limb[i + k];
      result.limb[i + k] = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    result.limb[i + M] = static_cast<std::uint32_t>(carry);
  }
  return result;
}

// -1, 0 or 1: a below, equal to or above b.
template <int N>
THRONG_HD inline int compare(const WideInteger<N>& a, const WideInteger<N>& b) noexcept {
  for (int i = N; i-- > 0;)
    if (a.limb[i] != b.limb[i]) return a.limb[i] < b.limb[i] ? -1 : 1;
  return 0;
}

// |x| 2^1074 < 2^2098 for finite x; the difference of two such numbers is below 2^2099.
constexpr int wide_limbs = 66;
static_assert(32 * wide_limbs > 2099);
using WideCoordinate = WideInteger<wide_limbs>;

// |x| 2^1074 of a finite double.
THRONG_HD inline WideCoordinate wide_magnitude(double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff);
  std::uint64_t mantissa = bits & ((std::uint64_t{1} << 52) - 1);
  if (exponent != 0) mantissa |= std::uint64_t{1} << 52;
  const int shift = exponent == 0 ? 0 : exponent - 1;  // in 0 .. 2045
  const int first = shift / 32, rest = shift % 32;
  WideCoordinate result;
  const std::uint64_t low = (mantissa & 0xffffffff) << rest;
  const std::uint64_t high = ((mantissa >> 32) << rest) + (low >> 32);  // below 2^53
  result.limb[first] = static_cast<std::uint32_t>(low);
  result.limb[first + 1] = static_cast<std::uint32_t>(high);
  result.limb[first + 2] = static_cast<std::uint32_t>(high >> 32);
  return result;
}

// The exact difference a - b of finite doubles: sign * magnitude * 2^-1074.
struct WideDifference {
  int sign;
  WideCoordinate magnitude;
};
THRONG_HD inline WideDifference wide_difference(double a, double b) noexcept {
  WideDifference result{a > b ? 1 : a < b ? -1 : 0, {}};
  const double greater = a > b ? a : b, less = a > b ? b : a;
  // greater - less >= 0. Intermediate values may wrap around.
  if (greater >= 0)
    add(result.magnitude, wide_magnitude(greater));
  else
    subtract(result.magnitude, wide_magnitude(greater));
  if (less >= 0)
    subtract(result.magnitude, wide_magnitude(less));
  else
    add(result.magnitude, wide_magnitude(less));
  return result;
}

}  // namespace throng::mesh
