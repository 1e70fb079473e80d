// Boxes of moving vertices against GMP's rationals: for doubles of any magnitude the bounds are the
// nearest floats outside of the exact ones.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include <gmpxx.h>

#include "mesh/contact_boxes.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

// f <= value, for any f but NaN.
bool at_most(float f, const mpq_class& value) {
  if (std::isinf(f)) return f < 0;
  return mpq_class(static_cast<double>(f)) <= value;
}

// Any finite double: of all magnitudes, near floats, and near the ends of both types.
double any_double(Random& random) {
  const auto nudged = [&](double x) {
    for (int k = random.between(-3, 3); k != 0; k += k < 0 ? 1 : -1)
      x = std::nextafter(x, k < 0 ? -1e308 : 1e308);
    return x;
  };
  const double sign = random.one_in(2) ? 1 : -1;
  switch (random.below(8)) {
    case 0:
      return sign * 0.0;
    case 1:
      return sign * std::ldexp(static_cast<double>(random.next()), random.between(-1130, 950));
    case 2:
      return sign * std::ldexp(static_cast<double>(random.next()), random.between(-220, 68));
    case 3:
      return nudged(sign * static_cast<double>(random.magnitude(-126, 126)));
    case 4:
      return nudged(sign * static_cast<double>(std::numeric_limits<float>::max()));
    case 5:
      return nudged(sign * 0x1p-149 * random.below(5));
    case 6:
      return sign * nudged(std::numeric_limits<double>::max() * 0.5) * 1.5;
    default:
      return sign * static_cast<double>(random.below(2000)) / 64;
  }
}

TEST(ContactBoxes, AreTheNearestFloatsOutside) {
  Random random(1);
  std::size_t infinite = 0, exact = 0, uneven = 0;
  for (int turn = 0; turn < 400000; ++turn) {
    double p = any_double(random);
    const double q = random.one_in(4) ? p : any_double(random);
    double radius = random.one_in(4) ? 0.0 : std::abs(any_double(random));
    if (random.one_in(8)) {
      // The exact bound lies within a last unit of a double of a float, or half way of two.
      const double f = static_cast<double>(random.magnitude(-20, 20));
      radius = std::ldexp(f, -random.between(20, 90));
      p = f + radius;
    }
    float lower = 0, upper = 0;
    mesh::swept_bounds(p, q, radius, lower, upper);
    const mpq_class least = mpq_class(std::min(p, q)) - mpq_class(radius);
    const mpq_class most = mpq_class(std::max(p, q)) + mpq_class(radius);
    ASSERT_TRUE(at_most(lower, least)) << p << " " << q << " " << radius;
    ASSERT_TRUE(at_most(-upper, -most)) << p << " " << q << " " << radius;
    ASSERT_LE(lower, upper);
    if (lower != infinity) {
      ASSERT_FALSE(at_most(std::nextafter(lower, infinity), least))
          << p << " " << q << " " << radius;
    }
    if (upper != -infinity) {
      ASSERT_FALSE(at_most(std::nextafter(-upper, infinity), -most))
          << p << " " << q << " " << radius;
    }
    infinite += std::isinf(lower) || std::isinf(upper);
    exact += !std::isinf(lower) && mpq_class(static_cast<double>(lower)) == least;
    uneven += static_cast<double>(static_cast<float>(std::min(p, q) - radius)) !=
              static_cast<double>(lower);
  }
  EXPECT_GT(infinite, 1000u);
  EXPECT_GT(exact, 1000u);
  EXPECT_GT(uneven, 1000u);
}

TEST(ContactBoxes, OfVerticesThatAreNotFiniteAreInactive) {
  for (const double x : {std::numeric_limits<double>::quiet_NaN(),
                         std::numeric_limits<double>::infinity(), -HUGE_VAL}) {
    for (int k = 0; k < 6; ++k) {
      double c[6] = {1, 2, 3, 4, 5, 6};
      c[k] = x;
      const Box box = mesh::swept_vertex_box({c[0], c[1], c[2]}, {c[3], c[4], c[5]}, 1, false);
      EXPECT_FALSE(base::is_active(box));
      const Box flat = mesh::swept_vertex_box({c[0], c[1], c[2]}, {c[3], c[4], c[5]}, 1, true);
      EXPECT_EQ(base::is_active(flat), k % 3 == 2);
    }
  }
}

}  // namespace
}  // namespace throng::tests
