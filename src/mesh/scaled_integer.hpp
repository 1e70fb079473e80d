// Signs of determinants by integers with as many 32-bit limbs as the coordinates need. Three times
// the time of expansions, but for any finite coordinates, and fit for devices: little memory per
// thread (2.2 KB), loops instead of inlined code, and for usual coordinates only a few limbs.
//
// All coordinates are multiples of 2^base, the lowest bit set in any of them, and smaller than
// 2^top in magnitude. Divided by 2^base they are integers, and so are their differences, which are
// below 2^(top - base + 1). Numbers are stored modulo 2^(32 n), least significant limb first;
// negative ones in two's complement.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

// Doubles are multiples of 2^-1074 below 2^1024: differences are below 2^2099.
constexpr int most_difference_limbs = 66;
static_assert(32 * most_difference_limbs >= 2099);

// A finite double: (negative ? -1 : 1) * mantissa * 2^exponent.
struct DoubleParts {
  std::uint64_t mantissa;
  int exponent;
  bool negative;

  THRONG_HD explicit DoubleParts(double x) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const int biased = static_cast<int>(bits >> 52 & 0x7ff);
    mantissa = bits & ((std::uint64_t{1} << 52) - 1);
    if (biased != 0) mantissa |= std::uint64_t{1} << 52;
    exponent = (biased == 0 ? 1 : biased) - 1075;
    negative = bits >> 63 != 0;
  }
  // The position of the lowest bit that is set, and of the highest one plus 1. Not for 0.
  THRONG_HD int lowest() const noexcept {
#if defined(__CUDA_ARCH__)
    return exponent + __ffsll(static_cast<long long>(mantissa)) - 1;
#else
    return exponent + std::countr_zero(mantissa);
#endif
  }
  THRONG_HD int top() const noexcept {
#if defined(__CUDA_ARCH__)
    return exponent + 64 - __clzll(static_cast<long long>(mantissa));
#else
    return exponent + static_cast<int>(std::bit_width(mantissa));
#endif
  }
};

// The scale that coordinates have in common.
class IntegerScale {
 public:
  THRONG_HD void include(double x) noexcept {
    const DoubleParts parts(x);
    if (parts.mantissa == 0) return;
    base_ = parts.lowest() < base_ ? parts.lowest() : base_;
    top_ = parts.top() > top_ ? parts.top() : top_;
  }
  THRONG_HD int base() const noexcept { return base_; }
  // Of a difference, without a sign; 0 if all coordinates are 0.
  THRONG_HD int limbs() const noexcept { return top_ < base_ ? 0 : (top_ - base_ + 1 + 31) / 32; }

 private:
  int base_ = 2000, top_ = -2000;
};

// to[0 .. size-1] += (negative ? -1 : 1) * x[0 .. x_size-1] * factor * 2^(32 at), at + x_size <
// size.
THRONG_HD inline void add_multiple(std::uint32_t* to, int size, int at, const std::uint32_t* x,
                                   int x_size, std::uint32_t factor, bool negative) noexcept {
  // Adds ~p instead of p, and 1 once: -p = ~p + 1.
  const std::uint32_t flip = negative ? 0xffffffff : 0;
  std::uint64_t product = 0, carry = negative ? 1 : 0;
  THRONG_UNROLL(1)
  for (int i = at; i < size; ++i) {
    if (i - at < x_size) product += std::uint64_t{factor} * x[i - at];
    carry += std::uint64_t{to[i]} + (static_cast<std::uint32_t>(product) ^ flip);
    to[i] = static_cast<std::uint32_t>(carry);
    carry >>= 32;
    product >>= 32;
    // What is left to add is 0: without a carry, or minus a carry.
    if (i - at >= x_size && product == 0 && carry == (negative ? 1u : 0u)) break;
  }
}

// to += (negative ? -1 : 1) * x * y; both factors are not negative.
THRONG_HD inline void add_product(std::uint32_t* to, int size, const std::uint32_t* x, int x_size,
                                  const std::uint32_t* y, int y_size, bool negative) noexcept {
  THRONG_UNROLL(1)
  for (int i = 0; i < x_size; ++i) {
    if (x[i] != 0) add_multiple(to, size, i, y, y_size, x[i], negative);
  }
}

THRONG_HD inline void clear(std::uint32_t* to, int size) noexcept {
  THRONG_UNROLL(1)
  for (int i = 0; i < size; ++i) to[i] = 0;
}

// to += x / 2^base, or -= if `negative`.
THRONG_HD inline void add_coordinate(std::uint32_t* to, int size, int base, double x,
                                     bool negative) noexcept {
  const DoubleParts parts(x);
  if (parts.mantissa == 0) return;
  std::uint64_t mantissa = parts.mantissa;
  int shift = parts.exponent - base;
  if (shift < 0) {  // these bits are 0
    mantissa >>= -shift;
    shift = 0;
  }
  const int rest = shift % 32;
  const std::uint64_t low = (mantissa & 0xffffffff) << rest;
  const std::uint64_t high = ((mantissa >> 32) << rest) + (low >> 32);
  const std::uint32_t limbs[3] = {static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(high),
                                  static_cast<std::uint32_t>(high >> 32)};
  add_multiple(to, size, shift / 32, limbs, 3, 1, negative != parts.negative);
}

// to = |a - b| / 2^base; returns the sign of a - b.
THRONG_HD inline int magnitude_of_difference(std::uint32_t* to, int size, int base, double a,
                                             double b) noexcept {
  clear(to, size);
  if (a == b) return 0;
  add_coordinate(to, size, base, a > b ? a : b, false);
  add_coordinate(to, size, base, a > b ? b : a, true);
  return a > b ? 1 : -1;
}

THRONG_HD inline int sign_of(const std::uint32_t* x, int size) noexcept {
  if (x[size - 1] >> 31 != 0) return -1;
  THRONG_UNROLL(1)
  for (int i = 0; i < size; ++i) {
    if (x[i] != 0) return 1;
  }
  return 0;
}

// The sign of (bx - ax)(cy - ay) - (by - ay)(cx - ax) for any finite coordinates.
THRONG_HD THRONG_OUTLINE inline int orient2d_integer_sign(double ax, double ay, double bx,
                                                          double by, double cx,
                                                          double cy) noexcept {
  const double p[3][2] = {{ax, ay}, {bx, by}, {cx, cy}};
  IntegerScale scale;
  THRONG_UNROLL(1)
  for (int i = 0; i < 6; ++i) scale.include(p[i / 2][i % 2]);
  const int n = scale.limbs(), base = scale.base(), size = 2 * n + 1;
  std::uint32_t x[most_difference_limbs], y[most_difference_limbs];
  std::uint32_t sum[2 * most_difference_limbs + 1];
  clear(sum, size);
  THRONG_UNROLL(1)
  for (int i = 0; i < 2; ++i) {
    const int sign = magnitude_of_difference(x, n, base, p[1 + i][0], ax) *
                     magnitude_of_difference(y, n, base, p[2 - i][1], ay);
    if (sign != 0) add_product(sum, size, x, n, y, n, (sign < 0) != (i == 1));
  }
  return sign_of(sum, size);
}

// The sign of ((b - a) x (c - a)) . (d - a) for any finite coordinates.
THRONG_HD THRONG_OUTLINE inline int orient3d_integer_sign(const DoubleVec3& a, const DoubleVec3& b,
                                                          const DoubleVec3& c,
                                                          const DoubleVec3& d) noexcept {
  const double p[4][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}, {d.x, d.y, d.z}};
  IntegerScale scale;
  THRONG_UNROLL(1)
  for (int i = 0; i < 12; ++i) scale.include(p[i / 3][i % 3]);
  // The sum of six products of three differences is below 2^(3 bits + 3), and there is a sign.
  const int n = scale.limbs(), base = scale.base(), size = 3 * n + 1;
  std::uint32_t x[most_difference_limbs], y[most_difference_limbs], z[most_difference_limbs];
  std::uint32_t yz[2 * most_difference_limbs], sum[3 * most_difference_limbs + 1];
  clear(sum, size);
  THRONG_UNROLL(1)
  for (int i = 0; i < 6; ++i) {
    // The rows of x, y and z in a product of the determinant.
    const bool odd = i >= 3;
    const int of_x = i % 3, of_y = (of_x + 1 + odd) % 3, of_z = (of_x + 2 - odd) % 3;
    const int sign = magnitude_of_difference(x, n, base, p[1 + of_x][0], a.x) *
                     magnitude_of_difference(y, n, base, p[1 + of_y][1], a.y) *
                     magnitude_of_difference(z, n, base, p[1 + of_z][2], a.z);
    if (sign == 0) continue;
    clear(yz, 2 * n);
    add_product(yz, 2 * n, y, n, z, n, false);
    add_product(sum, size, x, n, yz, 2 * n, (sign < 0) != odd);
  }
  return sign_of(sum, size);
}

}  // namespace throng::mesh
