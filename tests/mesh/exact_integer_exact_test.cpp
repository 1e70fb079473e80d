// ExactInteger against GMP.
#include "mesh/exact_integer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <gmpxx.h>

#include "mesh/point_cases.hpp"
#include "mesh/rational_geometry.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

using mesh::ExactInteger;

constexpr int unit = -1074;

// An integer and the same for GMP.
struct Both {
  ExactInteger own;
  mpz_class gmp;
};

Both from_double(double x) {
  mpq_class scaled(x);
  mpq_mul_2exp(scaled.get_mpq_t(), scaled.get_mpq_t(), -unit);
  return {ExactInteger(x, unit), scaled.get_num()};
}

double draw(Random& random) {
  switch (random.below(4)) {
    case 0:
      return any_double(random);
    case 1:
      return random.between(-3, 3);
    case 2:
      return random.between(-3, 3) * 0x1p-1074;
    default:
      return std::ldexp(random.between(-1, 1), random.between(-1074, 1023));
  }
}

void expect_equal(const Both& x, const char* what) {
  EXPECT_EQ(x.own.sign(), sgn(x.gmp)) << what;
  if (sgn(x.gmp) == 0) return;
  EXPECT_EQ(static_cast<std::size_t>(x.own.bit_count()), mpz_sizeinbase(x.gmp.get_mpz_t(), 2))
      << what;
  // Bits from the top, 53 at a time.
  ExactInteger rest = x.own;
  mpz_class gmp_rest = x.gmp;
  while (sgn(gmp_rest) != 0) {
    long exponent;
    const double top = mpz_get_d_2exp(&exponent, gmp_rest.get_mpz_t());
    mpz_class part(std::ldexp(top, 53));
    if (exponent >= 53)
      part <<= static_cast<mp_bitcnt_t>(exponent - 53);
    else
      part >>= static_cast<mp_bitcnt_t>(53 - exponent);
    rest = rest - ExactInteger(std::ldexp(top, 60), 60 - static_cast<int>(exponent));
    gmp_rest -= part;
    ASSERT_EQ(rest.sign(), sgn(gmp_rest)) << what;
  }
  EXPECT_EQ(rest.sign(), 0) << what;
}

TEST(ExactInteger, AgreesWithGmp) {
  Random random(1);
  for (int n = 0; n < 400; ++n) {
    Both product{ExactInteger(1, 0), 1}, sum{};
    for (int k = random.between(1, 6); k > 0; --k) {
      const Both x = from_double(draw(random)), y = from_double(draw(random));
      const Both difference{x.own - y.own, x.gmp - y.gmp};
      expect_equal({x.own + y.own, x.gmp + y.gmp}, "sum");
      expect_equal(difference, "difference");
      EXPECT_EQ(x.own < y.own, x.gmp < y.gmp);
      EXPECT_EQ(-x.own < y.own, -x.gmp < y.gmp);
      product = {product.own * difference.own, product.gmp * difference.gmp};
    }
    expect_equal(product, "product");
  }
}

TEST(ExactInteger, QuotientsAreNearest) {
  Random random(2);
  int finite = 0;
  for (int n = 0; n < 4000; ++n) {
    const Both a = from_double(draw(random)), b = from_double(draw(random));
    const Both c = from_double(draw(random));
    const Both numerator = random.one_in(2) ? a : Both{a.own * c.own, a.gmp * c.gmp};
    if (sgn(b.gmp) == 0) continue;
    const int exponent = random.between(-1074, 0);
    mpq_class exact(numerator.gmp, b.gmp);
    exact.canonicalize();
    mpq_div_2exp(exact.get_mpq_t(), exact.get_mpq_t(), static_cast<mp_bitcnt_t>(-exponent));
    if (abs(exact) >= mpq_class(std::numeric_limits<double>::max())) continue;
    ++finite;
    EXPECT_EQ(nearest_quotient(numerator.own, b.own, exponent), nearest_double(exact))
        << exact.get_d();
  }
  EXPECT_GE(finite, 1000);
}

// Quotients on, next to and far from ties, also of denormal results.
TEST(ExactInteger, QuotientsNearTies) {
  Random random(3);
  for (int n = 0; n < 3000; ++n) {
    const double x = random.one_in(2) ? 1 + std::fabs(unit_double(random))
                                      : std::ldexp(random.between(1, 9), random.between(0, 4));
    // (2^60 x + offset) / (2^(60 + shift) divisor), with bits far below those of a double.
    const int shift = random.between(0, 1100), divisor = random.one_in(2) ? 1 : 3;
    const double offset = random.between(-2, 2) * std::ldexp(1.0, random.between(0, 12));
    const ExactInteger numerator = ExactInteger(x, -60) + ExactInteger(offset, 0);
    const ExactInteger denominator(divisor, 0);
    mpq_class exact(x);
    mpq_mul_2exp(exact.get_mpq_t(), exact.get_mpq_t(), 60);
    exact += mpq_class(offset);
    exact /= divisor;
    mpq_div_2exp(exact.get_mpq_t(), exact.get_mpq_t(), static_cast<mp_bitcnt_t>(60 + shift));
    EXPECT_EQ(nearest_quotient(numerator, denominator, -60 - shift), nearest_double(exact));
  }
}

TEST(CommonUnit, IsTheLowestBit) {
  EXPECT_EQ(mesh::lowest_bit(1), 0);
  EXPECT_EQ(mesh::lowest_bit(-12), 2);
  EXPECT_EQ(mesh::lowest_bit(0x1p-1074), -1074);
  EXPECT_EQ(mesh::lowest_bit(3 * 0x1p-1070), -1070);
  EXPECT_EQ(mesh::lowest_bit(std::numeric_limits<double>::max()), 971);
  mesh::CommonUnit common;
  EXPECT_EQ(common.value(), 0);
  common.include({0, 8, 4});
  EXPECT_EQ(common.value(), 2);
  common.include(0.5);
  EXPECT_EQ(common.value(), -1);
}

}  // namespace
}  // namespace throng::tests
