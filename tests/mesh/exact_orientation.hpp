// Orientation signs by GMP's integers, which share no code with the library.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <gmpxx.h>

#include "mesh/point_cases.hpp"

namespace throng::tests {

// Coordinates as integers, times one power of two for all: 2^1074.
inline mpz_class exact_integer(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);  // x = mantissa * 2^exponent
  // At least the 53 bits of the mantissa are above 2^-1074, or those that x has.
  mpz_class result(std::ldexp(mantissa, 53));
  const int shift = exponent - 53 + 1074;
  if (shift >= 0)
    mpz_mul_2exp(result.get_mpz_t(), result.get_mpz_t(), static_cast<mp_bitcnt_t>(shift));
  else
    mpz_tdiv_q_2exp(result.get_mpz_t(), result.get_mpz_t(), static_cast<mp_bitcnt_t>(-shift));
  return result;
}

inline int exact_orient2d(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c) {
  const mpz_class ax = exact_integer(a.x), ay = exact_integer(a.y);
  const mpz_class x1 = exact_integer(b.x) - ax, y1 = exact_integer(b.y) - ay;
  const mpz_class x2 = exact_integer(c.x) - ax, y2 = exact_integer(c.y) - ay;
  return sgn(mpz_class(x1 * y2 - y1 * x2));
}

inline int exact_orient3d(const FourPoints& p) {
  std::array<std::array<mpz_class, 3>, 3> row;
  for (int axis = 0; axis < 3; ++axis) {
    const mpz_class origin = exact_integer(coordinate(p[0], axis));
    for (std::size_t i = 0; i < 3; ++i)
      row[i][static_cast<std::size_t>(axis)] = exact_integer(coordinate(p[i + 1], axis)) - origin;
  }
  return sgn(mpz_class(row[0][0] * (row[1][1] * row[2][2] - row[1][2] * row[2][1]) -
                       row[0][1] * (row[1][0] * row[2][2] - row[1][2] * row[2][0]) +
                       row[0][2] * (row[1][0] * row[2][1] - row[1][1] * row[2][0])));
}

}  // namespace throng::tests
