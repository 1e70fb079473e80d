// Signs of determinants: the filter and its bounds, expansions and their range, integers.
#include "mesh/orient.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cfenv>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/float_state.hpp"
#include "mesh/integer_orientation.hpp"
#include "mesh/point_cases.hpp"
#include "support/sanitized.hpp"

namespace throng::mesh {
namespace {

using tests::coordinate;
using tests::FourPoints;
using tests::integer_orient2d;
using tests::integer_orient3d;
using tests::PointKind;
using tests::Random;
using tests::to_text;

constexpr double least = std::numeric_limits<double>::denorm_min();
constexpr double largest = std::numeric_limits<double>::max();
constexpr int rounds = tests::sanitized ? 400 : 4000;

int sign_of(std::int64_t x) { return (x > 0) - (x < 0); }

int orient3d_sign(const FourPoints& p) { return mesh::orient3d_sign(p[0], p[1], p[2], p[3]); }
int orient3d_filter(const FourPoints& p) { return mesh::orient3d_filter(p[0], p[1], p[2], p[3]); }
int orient3d_exact_sign(const FourPoints& p) {
  return mesh::orient3d_exact_sign(p[0], p[1], p[2], p[3]);
}
int orient3d_integer_sign(const FourPoints& p) {
  return mesh::orient3d_integer_sign(p[0], p[1], p[2], p[3]);
}

// What the filter computes, without the terms for underflow.
struct Estimate {
  double determinant, permanent;
};
Estimate estimate3d(const FourPoints& p) {
  const double x1 = p[1].x - p[0].x, y1 = p[1].y - p[0].y, z1 = p[1].z - p[0].z;
  const double x2 = p[2].x - p[0].x, y2 = p[2].y - p[0].y, z2 = p[2].z - p[0].z;
  const double x3 = p[3].x - p[0].x, y3 = p[3].y - p[0].y, z3 = p[3].z - p[0].z;
  return {z1 * (x2 * y3 - x3 * y2) + z2 * (x3 * y1 - x1 * y3) + z3 * (x1 * y2 - x2 * y1),
          std::fabs(z1) * (std::fabs(x2 * y3) + std::fabs(x3 * y2)) +
              std::fabs(z2) * (std::fabs(x3 * y1) + std::fabs(x1 * y3)) +
              std::fabs(z3) * (std::fabs(x1 * y2) + std::fabs(x2 * y1))};
}
Estimate estimate2d(const FourPoints& p) {
  const double left = (p[1].x - p[0].x) * (p[2].y - p[0].y);
  const double right = (p[1].y - p[0].y) * (p[2].x - p[0].x);
  return {left - right, std::fabs(left) + std::fabs(right)};
}

// The error of an estimate in units of 2^-53 of the permanent.
template <int N>
double relative_error(const Estimate& estimate, const Expansion<N>& exact) {
  const Expansion<N + 2> difference = merged(exact, Expansion<2>({-estimate.determinant, 0}));
  double error = 0;
  for (int i = 0; i < difference.size; ++i) error += difference.term[i];
  return estimate.permanent == 0 ? 0 : std::fabs(error) / estimate.permanent * 0x1p53;
}
double relative_error3d(const FourPoints& p) {
  const TwoTerms x1 = two_difference(p[1].x, p[0].x), y1 = two_difference(p[1].y, p[0].y);
  const TwoTerms x2 = two_difference(p[2].x, p[0].x), y2 = two_difference(p[2].y, p[0].y);
  const TwoTerms x3 = two_difference(p[3].x, p[0].x), y3 = two_difference(p[3].y, p[0].y);
  const auto t1 = product(minor_of(x2, y2, x3, y3), two_difference(p[1].z, p[0].z));
  const auto t2 = product(minor_of(x3, y3, x1, y1), two_difference(p[2].z, p[0].z));
  const auto t3 = product(minor_of(x1, y1, x2, y2), two_difference(p[3].z, p[0].z));
  return relative_error(estimate3d(p), merged(merged(t1, t2), t3));
}
double relative_error2d(const FourPoints& p) {
  return relative_error(estimate2d(p),
                        minor_of(two_difference(p[1].x, p[0].x), two_difference(p[1].y, p[0].y),
                                 two_difference(p[2].x, p[0].x), two_difference(p[2].y, p[0].y)));
}

TEST(Orient, SignConvention) {
  const DoubleVec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
  EXPECT_EQ(mesh::orient3d_sign(a, b, c, {0, 0, 1}), 1);
  EXPECT_EQ(mesh::orient3d_sign(a, b, c, {0, 0, -1}), -1);
  EXPECT_EQ(mesh::orient3d_sign(a, b, c, {5, 7, 0}), 0);
  EXPECT_EQ(orient2d_sign(0, 0, 1, 0, 0, 1), 1);
  EXPECT_EQ(orient2d_sign(0, 0, 0, 1, 1, 0), -1);
  EXPECT_EQ(orient2d_sign(0, 0, 1, 1, 2, 2), 0);
}

// All triples of a grid with all differences that a fourth point can have, against integers.
TEST(Orient, SmallGrid) {
  std::array<DoubleVec3, 27> grid;
  for (int i = 0; i < 27; ++i)
    grid[static_cast<std::size_t>(i)] = {static_cast<double>(i % 3), static_cast<double>(i / 3 % 3),
                                         static_cast<double>(i / 9)};
  const auto integer = [](double x) { return static_cast<std::int64_t>(x); };
  const DoubleVec3 a = grid[13];
  int zeros = 0;
  for (const DoubleVec3& b : grid)
    for (const DoubleVec3& c : grid)
      for (const DoubleVec3& d : grid) {
        const std::int64_t x1 = integer(b.x - a.x), y1 = integer(b.y - a.y),
                           z1 = integer(b.z - a.z);
        const std::int64_t x2 = integer(c.x - a.x), y2 = integer(c.y - a.y),
                           z2 = integer(c.z - a.z);
        const std::int64_t x3 = integer(d.x - a.x), y3 = integer(d.y - a.y),
                           z3 = integer(d.z - a.z);
        const int expected =
            sign_of(x1 * (y2 * z3 - y3 * z2) + x2 * (y3 * z1 - y1 * z3) + x3 * (y1 * z2 - y2 * z1));
        ASSERT_EQ(mesh::orient3d_sign(a, b, c, d), expected);
        ASSERT_EQ(mesh::orient3d_exact_sign(a, b, c, d), expected);
        const int flat = sign_of(x1 * y2 - y1 * x2);
        ASSERT_EQ(orient2d_sign(a.x, a.y, b.x, b.y, c.x, c.y), flat);
        ASSERT_EQ(orient2d_exact_sign(a.x, a.y, b.x, b.y, c.x, c.y), flat);
        zeros += expected == 0;
      }
  EXPECT_GT(zeros, 1000);
}

class OrientKinds : public testing::TestWithParam<int> {
 protected:
  PointKind kind() const { return static_cast<PointKind>(GetParam()); }
};

// Filter, expansions and integers agree.
TEST_P(OrientKinds, PathsAgree) {
  Random random(7 + static_cast<std::uint64_t>(GetParam()));
  for (int n = 0; n < rounds; ++n) {
    const FourPoints p = tests::draw_points(random, kind());
    const int expected = integer_orient3d(p);
    const int filter = orient3d_filter(p);
    ASSERT_TRUE(filter == expected || filter == uncertain) << to_text(p);
    ASSERT_EQ(orient3d_exact_sign(p), expected) << to_text(p);
    ASSERT_EQ(orient3d_integer_sign(p), expected) << to_text(p);
  }
}

// An exchange of two points changes the sign; in two dimensions, too.
TEST_P(OrientKinds, Permutations) {
  Random random(107 + static_cast<std::uint64_t>(GetParam()));
  for (int n = 0; n < rounds / 20; ++n) {
    const FourPoints p = tests::draw_points(random, kind());
    const int sign = orient3d_sign(p);
    const int flat = orient2d_sign(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
    std::array<std::size_t, 4> order{0, 1, 2, 3};
    do {
      int parity = 1;
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = i + 1; k < 4; ++k)
          if (order[i] > order[k]) parity = -parity;
      const FourPoints q{p[order[0]], p[order[1]], p[order[2]], p[order[3]]};
      ASSERT_EQ(orient3d_sign(q), parity * sign) << to_text(q);
      if (order[3] == 3) {
        ASSERT_EQ(orient2d_sign(q[0].x, q[0].y, q[1].x, q[1].y, q[2].x, q[2].y), parity * flat)
            << to_text(q);
      }
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, OrientKinds, testing::Range(0, tests::point_kind_count));

// Without the relative bound rounding errors would decide. The kinds must contain such points.
TEST(OrientFilter, RoundingErrors) {
  Random random(3);
  int wrong = 0, wrong_flat = 0;
  for (int n = 0; n < 4000; ++n) {
    const FourPoints p = tests::draw_points(random, PointKind::rounded_plane);
    const double determinant = estimate3d(p).determinant;
    const int sign = integer_orient3d(p);
    wrong += determinant != 0 && sign != (determinant > 0 ? 1 : -1);
    // The first point, and two in the same direction from it but for rounding.
    const double ax = p[0].x, ay = p[0].y, s = tests::unit_double(random);
    const double bx = ax + p[1].x, by = ay + p[1].y, cx = ax + s * p[1].x, cy = ay + s * p[1].y;
    const double flat = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    const int flat_sign = integer_orient2d({ax, ay, 0}, {bx, by, 0}, {cx, cy, 0});
    wrong_flat += flat != 0 && flat_sign != (flat > 0 ? 1 : -1);
    const int filter = orient2d_filter(ax, ay, bx, by, cx, cy);
    ASSERT_TRUE(filter == uncertain || filter == flat_sign);
    ASSERT_EQ(orient2d_exact_sign(ax, ay, bx, by, cx, cy), flat_sign);
  }
  EXPECT_GT(wrong, 200);
  EXPECT_GT(wrong_flat, 20);
}

// The greatest error that a climb from random points finds: close to the bound of the proof, 8 and
// 4 units, and never above the filter's constant.
TEST(OrientFilter, BoundIsTight) {
  const auto climb = [](auto&& error, double limit) {
    Random random(1);
    double worst = 0;
    for (int start = 0; start < 12; ++start) {
      FourPoints points = tests::draw_points(random, PointKind::random);
      double here = error(points);
      for (int step = 0; step < 6000; ++step) {
        FourPoints next = points;
        double& x = coordinate(next[random.below(4)], static_cast<int>(random.below(3)));
        switch (random.below(4)) {
          case 0:
            x = tests::unit_double(random);
            break;
          case 1:
            x += std::ldexp(tests::unit_double(random), -random.between(0, 52));
            break;
          case 2:
            x = tests::nudged(x, random);
            break;
          default:
            x = std::ldexp(x, random.between(-1, 1));
            break;
        }
        const double there = error(next);
        if (there > limit) {
          ADD_FAILURE() << there << " for " << to_text(next);
          return worst;
        }
        if (there < here) continue;
        here = there;
        points = next;
      }
      worst = std::max(worst, here);
    }
    return worst;
  };
  EXPECT_GT(climb(relative_error3d, orient3d_relative_error * 0x1p53), 5.5);
  EXPECT_GT(climb(relative_error2d, orient2d_relative_error * 0x1p53), 3.5);
}

// The filter decides nearly all random floats and doubles.
TEST(OrientFilter, DecidesRandomPoints) {
  Random random(4);
  int failed = 0;
  for (int n = 0; n < rounds; ++n) {
    const FourPoints p = tests::draw_points(random, PointKind::random);
    failed += orient3d_filter(p) == uncertain;
    failed += orient2d_filter(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y) == uncertain;
  }
  EXPECT_EQ(failed, 0);
}

// Equal points, and points in a plane across an axis, need no exact stage.
TEST(OrientFilter, ZeroFactors) {
  Random random(5);
  for (int n = 0; n < rounds; ++n) {
    for (const PointKind kind : {PointKind::random, PointKind::any, PointKind::extremes}) {
      FourPoints p = tests::draw_points(random, kind);
      const std::size_t i = random.below(4);
      FourPoints equal = p;
      equal[i] = equal[(i + 1) % 4];
      if (i == 0 || i == 3) {
        ASSERT_EQ(orient3d_filter(equal), 0) << to_text(equal);
      }
      const int axis = static_cast<int>(random.below(3));
      for (DoubleVec3& q : p) coordinate(q, axis) = coordinate(p[0], axis);
      ASSERT_EQ(orient3d_filter(p), 0) << to_text(p);
      ASSERT_EQ(orient2d_filter(p[0].x, p[0].y, p[0].x, p[1].y, p[0].x, p[2].y), 0);
      ASSERT_EQ(orient2d_filter(p[0].x, p[0].y, p[0].x, p[0].y, p[1].x, p[1].y), 0);
    }
  }
}

// A product of two that underflows is multiplied by a large third factor: 2^-80 - 2^-100 > 0.
TEST(OrientFilter, UnderflowOfTwoFactors) {
  const FourPoints p{{{0, 0, 0}, {0x1p440, 0, 0x1p1000}, {0x1p-540, 0, 1}, {0, 0x1p-540, 0}}};
  EXPECT_EQ(integer_orient3d(p), 1);
  EXPECT_EQ(orient3d_filter(p), uncertain);
  EXPECT_EQ(orient3d_sign(p), 1);
}

// Three products, 1.4, 1.4 and -2.6 times the least double, round to 1, 1 and -3 times it.
TEST(OrientFilter, UnderflowOfThreeFactors) {
  constexpr double s = 0x1p-537;
  // The minors of x and y are s, s and s.
  const FourPoints p{{{0, 0, 0}, {s, 0, -2.6 * s}, {-s, 1, 1.4 * s}, {0, -1, 1.4 * s}}};
  const Estimate estimate = estimate3d(p);
  EXPECT_LT(estimate.determinant, -orient3d_relative_error * estimate.permanent);
  EXPECT_EQ(integer_orient3d(p), 1);
  EXPECT_EQ(orient3d_filter(p), uncertain);
  EXPECT_EQ(orient3d_sign(p), 1);
}

// In the plane. x1 is a quarter of a unit below 1.5 and rounds up to it, so that x1 y2 rounds to 2
// times the least double; x2 rounds down, and y1 x2 to 1 times it, though it exceeds x1 y2 for
// some.
TEST(OrientFilter, UnderflowInThePlane) {
  Random random(12);
  constexpr double s = 0x1p-537, unit = 0x1p-52 * s;
  int wrong = 0;
  for (int n = 0; n < 4000; ++n) {
    const double by = 0.5 * s + random.between(0, 1 << 20) * unit;
    const FourPoints p{
        {{-0.75 * unit, 0, 0}, {1.5 * s - unit, by, 0}, {1.5 * s / by * s, s, 0}, {}}};
    const int expected = integer_orient2d(p[0], p[1], p[2]);
    const Estimate estimate = estimate2d(p);
    const double bound = orient2d_relative_error * estimate.permanent;
    wrong += (estimate.determinant > bound && expected != 1) ||
             (estimate.determinant < -bound && expected != -1);
    const int filter = orient2d_filter(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
    ASSERT_TRUE(filter == uncertain || filter == expected) << to_text(p);
    ASSERT_EQ(orient2d_sign(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y), expected);
  }
  EXPECT_GT(wrong, 20);
}

// Differences and products beyond the largest double.
TEST(OrientFilter, Overflow) {
  const FourPoints p{{{-largest, -largest, -largest},
                      {largest, -largest, -largest},
                      {-largest, largest, -largest},
                      {-largest, -largest, largest}}};
  EXPECT_EQ(orient3d_filter(p), uncertain);
  EXPECT_EQ(orient3d_sign(p), 1);
  EXPECT_EQ(orient2d_filter(-largest, -largest, largest, -largest, -largest, largest), uncertain);
  EXPECT_EQ(orient2d_sign(-largest, -largest, largest, -largest, -largest, largest), 1);
  // Only products overflow; a difference that overflows is multiplied by 0 elsewhere.
  const FourPoints q{{{0, 0, 0}, {0x1p600, 0, 0}, {0, 0x1p600, 0}, {1, 1, -least}}};
  EXPECT_EQ(orient3d_sign(q), -1);
  EXPECT_EQ(orient2d_sign(-largest, 0, largest, 0, 0, -least), -1);
}

// For floats B = C P decides the same as the whole bound; P = 0 means 0.
TEST(OrientFilter, FloatsNeedNoUnderflowTerm) {
  Random random(6);
  int decided = 0, zeros = 0;
  const auto is_float_kind = {PointKind::float_any, PointKind::float_rounded_plane,
                              PointKind::small_grid, PointKind::grid_plane};
  for (int n = 0; n < rounds; ++n)
    for (const PointKind kind : is_float_kind) {
      FourPoints p = tests::draw_points(random, kind);
      if (kind == PointKind::small_grid && random.one_in(2)) {
        for (DoubleVec3& q : p) {  // the least floats
          q.x *= 0x1p-149;
          q.y *= 0x1p-149;
          q.z *= 0x1p-149;
        }
      }
      const auto [determinant, permanent] = estimate3d(p);
      const double bound = orient3d_relative_error * permanent;
      const int filter = determinant > bound    ? 1
                         : determinant < -bound ? -1
                         : permanent == 0       ? 0
                                                : uncertain;
      ASSERT_EQ(orient3d_filter(p), filter) << to_text(p);
      decided += filter == 1 || filter == -1;
      zeros += filter == 0;
    }
  EXPECT_GT(decided, rounds);
  EXPECT_GT(zeros, rounds / 100);
}

// Expansions are exact at both ends of their range; beyond it the integers must take over.
TEST(OrientExpansion, Range) {
  Random random(8);
  for (const int exponent : {-1000, -700, -500, -400, -360, -330, -302, -301, -300, -299, 298,
                             299,   300,  301,  302,  340,  345,  350,  400,  500,  700,  1000})
    for (int n = 0; n < rounds / 10; ++n) {
      FourPoints p = tests::draw_points(random, PointKind::rounded_plane);
      for (DoubleVec3& q : p)
        for (int axis = 0; axis < 3; ++axis)
          coordinate(q, axis) = random.one_in(9) ? 0 : std::ldexp(coordinate(q, axis), exponent);
      ASSERT_EQ(orient3d_exact_sign(p), integer_orient3d(p)) << to_text(p);
      const double x = coordinate(p[1], 0), y = coordinate(p[1], 1), z = coordinate(p[1], 2);
      const double s = tests::unit_double(random);
      ASSERT_EQ(orient2d_exact_sign(x, z, y, z, s * x, s * z),
                integer_orient2d({x, z, 0}, {y, z, 0}, {s * x, s * z, 0}));
    }
  EXPECT_TRUE(is_in_expansion_range(0.0));
  EXPECT_TRUE(is_in_expansion_range(-0x1p-300));
  EXPECT_FALSE(is_in_expansion_range(0x1.fffffffffffffp-301));
  EXPECT_TRUE(is_in_expansion_range(-0x1p300));
  EXPECT_FALSE(is_in_expansion_range(0x1.0000000000001p300));
  EXPECT_TRUE(is_in_expansion_range(std::numeric_limits<float>::denorm_min()));
  EXPECT_TRUE(is_in_expansion_range(std::numeric_limits<float>::max()));
}

// a * b - high, for high = a * b rounded. Not by std::fma, which mingw-w64 computes inexactly.
double product_error(double a, double b, double high) {
  __extension__ using Integer = __int128;
  int a_exponent = 0, b_exponent = 0;
  const auto mantissa = [](double x, int& exponent) {
    return static_cast<Integer>(std::ldexp(std::frexp(x, &exponent), 53));
  };
  const Integer product = mantissa(a, a_exponent) * mantissa(b, b_exponent);
  const int scale = a_exponent + b_exponent - 106;
  const Integer error = product - static_cast<Integer>(std::ldexp(high, -scale));
  return std::ldexp(static_cast<double>(error), scale);
}

// The error terms are exact: a compiler that contracts or reorders breaks this.
TEST(OrientExpansion, ErrorTerms) {
  Random random(9);
  for (int n = 0; n < rounds * 10; ++n) {
    const double a = std::ldexp(tests::unit_double(random), random.between(-300, 300));
    const double b = std::ldexp(tests::unit_double(random), random.between(-300, 300));
    const TwoTerms product = two_product(Factor(a), Factor(b));
    ASSERT_EQ(product.high, a * b);
    ASSERT_EQ(product.low, product_error(a, b, product.high));
    const double near_a =
        std::ldexp(tests::unit_double(random), std::ilogb(a) + random.between(-60, 60));
    const TwoTerms sum = two_sum(a, near_a), difference = two_difference(a, -near_a);
    ASSERT_EQ(sum.high, a + near_a);
    ASSERT_EQ(difference.high, sum.high);
    ASSERT_EQ(difference.low, sum.low);
    // Dekker's condition makes the short form exact, too.
    const TwoTerms ordered =
        std::fabs(a) >= std::fabs(near_a) ? fast_two_sum(a, near_a) : fast_two_sum(near_a, a);
    ASSERT_EQ(ordered.low, sum.low);
  }
}

// A sum of products in integers of 128 bits, and the terms' order.
TEST(OrientExpansion, NonadjacentTerms) {
  Random random(10);
  const auto check = [](const auto& e, bool nonadjacent) {
    for (int i = 0; i < e.size; ++i) {
      ASSERT_NE(e.term[i], 0);
      if (i == 0) continue;
      // The lowest set bit of a term is above the highest of the one before.
      int exponent = 0;
      double mantissa = std::fabs(std::frexp(e.term[i], &exponent));
      int lowest = exponent;
      while (mantissa != 0) {
        mantissa = 2 * mantissa - std::floor(2 * mantissa);
        --lowest;
      }
      ASSERT_GE(lowest, std::ilogb(e.term[i - 1]) + (nonadjacent ? 2 : 1));
    }
  };
  for (int n = 0; n < rounds; ++n) {
    const auto draw = [&] {
      return std::ldexp(tests::unit_double(random), random.between(-30, 30));
    };
    const TwoTerms x1 = two_difference(draw(), draw()), y1 = two_difference(draw(), draw());
    const TwoTerms x2 = two_difference(draw(), draw()), y2 = two_difference(draw(), draw());
    const Expansion<16> minor = minor_of(x1, y1, x2, y2);
    check(product(x1, y1), true);
    check(minor, true);
    check(scaled(minor, draw()), true);
    check(product(minor, two_difference(draw(), draw())), false);
  }
}

TEST(OrientIntegers, Extremes) {
  // The same determinant but for the least double.
  const FourPoints flat{{{largest, largest, largest},
                         {-largest, largest, -largest},
                         {largest, -largest, -largest},
                         {0, 0, -largest}}};
  EXPECT_EQ(orient3d_sign(flat), 0);
  FourPoints above = flat, below = flat;
  above[3].x = least;
  below[3].x = -least;
  EXPECT_NE(orient3d_sign(above), 0);
  EXPECT_EQ(orient3d_sign(above), -orient3d_sign(below));
}

// The library sets its floating-point state in each thread; within it the caller's does not matter.
TEST(Orient, RoundingModeOfTheCaller) {
  Random random(11);
  for (int n = 0; n < rounds / 4; ++n) {
    const FourPoints p = tests::draw_points(random, PointKind::rounded_plane);
    const int expected = integer_orient3d(p);
    std::fesetround(FE_UPWARD);
    int sign = 0;
    {
      const base::FloatState state;
      sign = orient3d_sign(p);
    }
    std::fesetround(FE_TONEAREST);
    ASSERT_EQ(sign, expected) << to_text(p);
  }
}

}  // namespace
}  // namespace throng::mesh
