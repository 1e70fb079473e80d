// Signs by scaled integers, as a device computes them, against expansions and ExactInteger.
#include "mesh/scaled_integer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh/integer_orientation.hpp"
#include "mesh/orient.hpp"
#include "support/random.hpp"

namespace throng::mesh {
namespace {

using tests::Random;

// Coordinates with the given exponents, few or many digits, often equal, opposite or 0.
class Coordinates {
 public:
  Coordinates(std::uint64_t seed, int least_exponent, int most_exponent)
      : random_(seed), least_(least_exponent), most_(most_exponent) {}
  double next() {
    switch (random_.below(8)) {
      case 0:
        return 0;
      case 1:
        return last_;
      case 2:
        return -last_;
      case 3:
        return std::nextafter(last_, 0);
      default:
        break;
    }
    const std::uint64_t digits =
        (std::uint64_t{random_.below(1u << 31)} << 22 | random_.below(1u << 22)) >>
        random_.below(53);
    const int exponent =
        least_ + static_cast<int>(random_.below(static_cast<std::uint32_t>(most_ - least_ + 1)));
    last_ = std::ldexp(static_cast<double>(digits) + 1, exponent - 53);
    if (random_.below(2)) last_ = -last_;
    return last_;
  }
  DoubleVec3 point() {
    const double x = next(), y = next();
    return {x, y, next()};
  }

 private:
  Random random_;
  int least_, most_;
  double last_ = 1;
};

struct Range {
  int least, most;
};
constexpr Range ranges[] = {{0, 0},        {-3, 3},        {-40, 40},   {-140, 127},
                            {-1074, 1023}, {-1074, -1060}, {1000, 1023}};

TEST(ScaledInteger, SignsInSpace) {
  int signs[3] = {};
  for (const Range& range : ranges) {
    Coordinates from(7, range.least, range.most);
    for (int i = 0; i < 400; ++i) {
      const DoubleVec3 a = from.point(), b = from.point(), c = from.point();
      DoubleVec3 d = from.point();
      if (i % 4 == 0) d = {b.x / 2 + c.x / 2, b.y / 2 + c.y / 2, b.z / 2 + c.z / 2};
      const int sign = orient3d_integer_sign(a, b, c, d);
      EXPECT_EQ(sign, tests::integer_orient3d({a, b, c, d})) << i << " " << range.least;
      EXPECT_EQ(sign, -orient3d_integer_sign(b, a, c, d));
      ++signs[sign + 1];
    }
  }
  for (const int count : signs) EXPECT_GT(count, 100);
}

TEST(ScaledInteger, SignsInThePlane) {
  int signs[3] = {};
  for (const Range& range : ranges) {
    Coordinates from(8, range.least, range.most);
    for (int i = 0; i < 2000; ++i) {
      const double ax = from.next(), ay = from.next(), bx = from.next(), by = from.next();
      const double cx = i % 4 ? from.next() : ax / 2 + bx / 2,
                   cy = i % 4 ? from.next() : ay / 2 + by / 2;
      const int sign = orient2d_integer_sign(ax, ay, bx, by, cx, cy);
      EXPECT_EQ(sign, tests::integer_orient2d({ax, ay, 0}, {bx, by, 0}, {cx, cy, 0}))
          << i << " " << range.least;
      ++signs[sign + 1];
    }
  }
  for (const int count : signs) EXPECT_GT(count, 500);
}

// Floats, nearly coplanar: as expansions decide.
TEST(ScaledInteger, NearlyCoplanarFloats) {
  Random random(9);
  const auto real = [&] { return static_cast<double>(random.in(-1, 1)); };
  int zero = 0;
  for (int i = 0; i < 3000; ++i) {
    const DoubleVec3 a{real(), real(), real()}, b{real(), real(), real()},
        c{real(), real(), real()};
    const double u = real(), v = real();
    const auto on_plane = [&](double p, double q, double r) {
      return static_cast<double>(static_cast<float>(p + u * (q - p) + v * (r - p)));
    };
    const DoubleVec3 d = i % 5 == 0 ? DoubleVec3{2 * a.x - b.x, 2 * a.y - b.y, 2 * a.z - b.z}
                                    : DoubleVec3{on_plane(a.x, b.x, c.x), on_plane(a.y, b.y, c.y),
                                                 on_plane(a.z, b.z, c.z)};
    const int sign = orient3d_integer_sign(a, b, c, d);
    EXPECT_EQ(sign, orient3d_expansion_sign(a, b, c, d));
    zero += sign == 0;
  }
  EXPECT_GT(zero, 100);
}

TEST(ScaledInteger, Extremes) {
  constexpr double most = std::numeric_limits<double>::max(), least = 0x1p-1074;
  const DoubleVec3 a{-most, -most, -most}, b{most, -most, -most}, c{-most, most, -most},
      d{-most, -most, most}, zero{0, 0, 0}, tiny{least, 0, 0};
  EXPECT_EQ(orient3d_integer_sign(a, b, c, d), 1);
  EXPECT_EQ(orient3d_integer_sign(a, c, b, d), -1);
  EXPECT_EQ(orient3d_integer_sign(zero, zero, zero, zero), 0);
  EXPECT_EQ(orient3d_integer_sign(zero, tiny, {0, least, 0}, {0, 0, least}), 1);
  EXPECT_EQ(orient3d_integer_sign(a, b, c, {least, least, -most}), 0);
  EXPECT_EQ(orient3d_integer_sign(a, b, c, {least, least, std::nextafter(-most, 0)}), 1);
  EXPECT_EQ(orient2d_integer_sign(0, 0, most, most, most, std::nextafter(most, 0)), -1);
  EXPECT_EQ(orient2d_integer_sign(0, 0, least, 0, 0, least), 1);
  EXPECT_EQ(orient2d_integer_sign(-most, 0, most, least, 0, least), 1);
  EXPECT_EQ(orient2d_integer_sign(1, 1, 1, 1, 1, 1), 0);
}

// Differences fill their limbs: products of them need one more bit, and one for the sign.
TEST(ScaledInteger, FullLimbs) {
  for (const int bits : {31, 63, 95, 1023}) {
    const double one = std::ldexp(1.0, std::max(bits - 52, 0)), m = std::ldexp(1.0, bits) - one;
    // An odd coordinate makes 1 the common unit.
    const double odd = bits == 31 ? m : 1;
    const DoubleVec3 a{-m, -m, -m}, b{m, m, -m}, c{m, -m, m}, d{-odd, m, m};
    EXPECT_EQ(orient3d_integer_sign(a, b, c, d), -1) << bits;
    EXPECT_EQ(orient3d_integer_sign(b, a, c, d), 1) << bits;
    EXPECT_EQ(orient2d_integer_sign(-m, -m, m, -m, -odd, m), 1) << bits;
    EXPECT_EQ(orient2d_integer_sign(-m, -m, -odd, m, m, -m), -1) << bits;
  }
}

TEST(ScaledInteger, DenormalsBesideNormals) {
  constexpr double normal = std::numeric_limits<double>::min(), half = normal / 2;
  EXPECT_EQ(orient2d_integer_sign(0, 0, half, normal, normal, 2 * normal), 0);
  EXPECT_EQ(orient3d_integer_sign({0, 0, 0}, {half, normal, 0}, {0, 0, half},
                                  {normal, 2 * normal, normal}),
            0);
}

}  // namespace
}  // namespace throng::mesh
