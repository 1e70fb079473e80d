// Expansions: exact sums of doubles (Shewchuk, "Adaptive Precision Floating-Point Arithmetic and
// Fast Robust Geometric Predicates", 1997). An expansion is a list of nonzero doubles whose exact
// sum is its value. Its terms have increasing magnitude and do not overlap: the lowest set bit of a
// term is above the highest set bit of the term before it. So its sign is that of its last term.
//
// An expansion is nonadjacent if between two terms there is also at least one bit that belongs to
// neither. Theorems of the paper, for doubles rounded to nearest with ties to even:
//   two_sum, two_difference, two_product return two nonadjacent terms.
//   add_terms keeps nonadjacent expansions nonadjacent (theorem 10, term by term).
//   scaled keeps nonadjacent expansions nonadjacent (19).
//   merged sums strongly nonoverlapping expansions, and nonadjacent ones are that; so is the
//   result (13).
// Zero terms may be left out of each. No function scales what `merged` returned.
//
// Range. A number is on the grid of 2^k if it is a multiple of 2^k. Sums of numbers on a grid,
// rounded or not, are on it for any k >= -1074. A product of numbers on the grids of 2^j and 2^k is
// on that of 2^(j+k). If j + k >= -1074, each partial product and error term in two_product is a
// double, and the theorems hold as if exponents were unlimited below. Above, two_product needs
// |a|, |b| <= 2^995 and |a b| < 2^1022.
//
// Rounding to nearest, denormals kept, no contraction to fused multiply-add.
#pragma once

#include <cfloat>
#include <cmath>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

// Operations on doubles round to double: not so on the x87 unit.
static_assert(FLT_EVAL_METHOD == 0 || FLT_EVAL_METHOD == 1);

// high + low is exact; high is the rounded result.
struct TwoTerms {
  double high, low;
};

THRONG_HD inline TwoTerms two_sum(double a, double b) noexcept {
  const double sum = a + b;
  const double b_part = sum - a;
  const double a_part = sum - b_part;
  return {sum, (a - a_part) + (b - b_part)};
}

THRONG_HD inline TwoTerms two_difference(double a, double b) noexcept {
  const double difference = a - b;
  const double b_part = a - difference;
  const double a_part = difference + b_part;
  return {difference, (a - a_part) + (b_part - b)};
}

// Needs |a| >= |b| or a = 0.
THRONG_HD inline TwoTerms fast_two_sum(double a, double b) noexcept {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

// A factor in two halves of at most 26 bits (Veltkamp), so that products of halves are exact.
struct Factor {
  double value, high, low;

  THRONG_HD explicit Factor(double x) noexcept : value(x), high(0), low(0) {
#ifndef __CUDA_ARCH__
    const double scaled = 0x1.000002p27 * x;  // 2^27 + 1
    high = scaled - (scaled - x);
    low = x - high;
#endif
  }
};

// Dekker's product on the host: a fused multiply-add without hardware support is a slow call.
THRONG_HD inline TwoTerms two_product(const Factor& a, const Factor& b) noexcept {
  const double product = a.value * b.value;
#ifdef __CUDA_ARCH__
  return {product, fma(a.value, b.value, -product)};
#else
  const double error = product - a.high * b.high - a.low * b.high - a.high * b.low;
  return {product, a.low * b.low - error};
#endif
}

// At most `Capacity` terms.
template <int Capacity>
struct Expansion {
  int size = 0;
  double term[Capacity];

  // The terms stay uninitialized.
  // cppcheck-suppress uninitMemberVar
  THRONG_HD Expansion() noexcept {}  // NOLINT(cppcoreguidelines-pro-type-member-init)
  THRONG_HD explicit Expansion(TwoTerms x) noexcept {
    append(x.low);
    append(x.high);
  }
  THRONG_HD void append(double x) noexcept {
    if (x != 0) term[size++] = x;
  }
  THRONG_HD int sign() const noexcept { return size == 0 ? 0 : term[size - 1] > 0 ? 1 : -1; }
};

// e * factor. Scale-Expansion.
template <int N>
THRONG_HD inline Expansion<2 * N> scaled(const Expansion<N>& e, double factor) noexcept {
  Expansion<2 * N> result;
  if (e.size == 0 || factor == 0) return result;
  const Factor b(factor);
  TwoTerms total = two_product(Factor(e.term[0]), b);
  result.append(total.low);
  for (int i = 1; i < e.size; ++i) {
    const TwoTerms product = two_product(Factor(e.term[i]), b);
    const TwoTerms sum = two_sum(total.high, product.low);
    result.append(sum.low);
    total = fast_two_sum(product.high, sum.high);
    result.append(total.low);
  }
  result.append(total.high);
  return result;
}

// e + f, O(N M); for short expansions that are scaled later. Grow-Expansion for each term of f.
template <int N, int M>
THRONG_HD inline Expansion<N + M> add_terms(const Expansion<N>& e, const Expansion<M>& f) noexcept {
  Expansion<N + M> result;
  for (int i = 0; i < e.size; ++i) result.term[result.size++] = e.term[i];
  for (int k = 0; k < f.size; ++k) {
    double carry = f.term[k];
    const int count = result.size;
    result.size = 0;  // never written beyond the term that was read
    for (int i = 0; i < count; ++i) {
      const TwoTerms sum = two_sum(carry, result.term[i]);
      result.append(sum.low);
      carry = sum.high;
    }
    result.append(carry);
  }
  return result;
}

// e + f, O(N + M). Fast-Expansion-Sum: all terms by increasing magnitude, summed up.
template <int N, int M>
THRONG_HD inline Expansion<N + M> merged(const Expansion<N>& e, const Expansion<M>& f) noexcept {
  Expansion<N + M> result;
  int i = 0, k = 0;
  const auto next = [&]() -> double {
    if (k == f.size || (i < e.size && std::fabs(e.term[i]) < std::fabs(f.term[k])))
      return e.term[i++];
    return f.term[k++];
  };
  const int count = e.size + f.size;
  if (count == 0) return result;
  double carry = next();
  for (int n = 1; n < count; ++n) {
    const TwoTerms sum = two_sum(carry, next());
    result.append(sum.low);
    carry = sum.high;
  }
  result.append(carry);
  return result;
}

}  // namespace throng::mesh
