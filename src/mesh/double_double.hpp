// Sums of two doubles, about 106 bits: high is the sum rounded to nearest.
//
// Errors, with u = 2^-53 and no overflow. Factors are at most 2^10, so partial products underflow
// only if the product is below 2^-950, and then errors are below 2^-1000.
//   two_difference(a, b), as a DoubleDouble: exact.
//   x + y, x - y: relative error 3 u^2 + 13 u^3 (AccurateDWPlusDW in Joldes, Muller and Popescu,
//     "Tight and rigorous error bounds for basic building blocks of double-word arithmetic", 2017).
//   x * y: 9 u^2 |x y| + 2^-1000. Left out is x.low y.low, u^2 |x y|. The cross products are at
//     most u |x y| each: rounding them adds u^2 |x y| each, their sum 2 u^2, the next sum 3 u^2.
//   x / y: not bounded here.
// Rounding to nearest, denormals kept, no contraction to fused multiply-add.
#pragma once

#include "base/host_device_macros.hpp"
#include "mesh/expansion.hpp"

namespace throng::mesh {

struct DoubleDouble {
  double high = 0, low = 0;

  DoubleDouble() noexcept = default;
  THRONG_HD DoubleDouble(double x) noexcept : high(x) {}  // NOLINT(google-explicit-constructor)
  THRONG_HD DoubleDouble(TwoTerms x) noexcept             // NOLINT(google-explicit-constructor)
      : high(x.high), low(x.low) {}
};

// Covers each operation above but the division: relative to its result, plus 2^-1000.
constexpr double double_double_error = 0x1p-102;

THRONG_HD inline DoubleDouble operator-(DoubleDouble x) noexcept {
  return TwoTerms{-x.high, -x.low};
}
THRONG_HD inline DoubleDouble operator+(DoubleDouble x, DoubleDouble y) noexcept {
  const TwoTerms sum = two_sum(x.high, y.high), rest = two_sum(x.low, y.low);
  const TwoTerms partial = fast_two_sum(sum.high, sum.low + rest.high);
  return fast_two_sum(partial.high, rest.low + partial.low);
}
THRONG_HD inline DoubleDouble operator-(DoubleDouble x, DoubleDouble y) noexcept { return x + -y; }
THRONG_HD inline DoubleDouble operator*(DoubleDouble x, DoubleDouble y) noexcept {
  const TwoTerms product = two_product(Factor(x.high), Factor(y.high));
  return fast_two_sum(product.high, product.low + (x.high * y.low + x.low * y.high));
}
// About 2^-100 of the quotient; NaN or infinite if y is 0.
THRONG_HD inline DoubleDouble operator/(DoubleDouble x, DoubleDouble y) noexcept {
  const double first = x.high / y.high;
  const DoubleDouble rest = x - y * first;
  const double second = rest.high / y.high;
  const DoubleDouble rest2 = rest - y * second;
  return DoubleDouble(fast_two_sum(first, second)) + DoubleDouble(rest2.high / y.high);
}
THRONG_HD inline bool operator<(DoubleDouble x, DoubleDouble y) noexcept {
  return x.high < y.high || (x.high == y.high && x.low < y.low);
}
THRONG_HD inline bool operator>(DoubleDouble x, DoubleDouble y) noexcept { return y < x; }

THRONG_HD inline double rounded(DoubleDouble x) noexcept { return x.high; }
THRONG_HD inline double rounded(double x) noexcept { return x; }

}  // namespace throng::mesh
