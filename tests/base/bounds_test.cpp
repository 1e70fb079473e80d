// Bounds against independent computations: the processor's directed rounding modes, and 128-bit
// floats.
#include "base/bounds.hpp"

#include <gtest/gtest.h>

#include <cfenv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace throng::base {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float quiet = std::numeric_limits<float>::quiet_NaN();
constexpr float tiny = std::numeric_limits<float>::denorm_min();
constexpr float largest = std::numeric_limits<float>::max();

float from_bits(std::uint32_t bits) {
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

TEST(ClampFinite, ChangesInfinitiesAlone) {
  for (const float x : {0.0f, tiny, 1.0f, largest}) {
    EXPECT_EQ(clamp_finite(x), x);
    EXPECT_EQ(clamp_finite(-x), -x);
  }
  EXPECT_EQ(clamp_finite(inf), largest);
  EXPECT_EQ(clamp_finite(-inf), -largest);
  EXPECT_TRUE(std::isnan(clamp_finite(quiet)));
}

TEST(NextDown, IsTheFloatBelow) {
  for (const float x : {0.0f, -0.0f, tiny, -tiny, 1.0f, -1.0f, 0x1p-126f, -0x1p-126f, largest, inf})
    EXPECT_EQ(next_down(x), std::nextafter(x, -inf)) << x;
  EXPECT_EQ(next_down(-largest), -inf);
}

// Operands and result pass through memory, so the compiler moves no arithmetic across the mode
// change.
[[gnu::noinline]] float sum_in_mode(float a, float b, int mode) {
  volatile float x = a, y = b;
  std::fesetround(mode);
  volatile float sum = x + y;
  std::fesetround(FE_TONEAREST);
  return sum;
}

void expect_directed(float x, float m) {
  const float down = subtract_rounded_down(x, m), up = add_rounded_up(x, m);
  ASSERT_EQ(down, sum_in_mode(x, -m, FE_DOWNWARD)) << std::hexfloat << x << " - " << m;
  ASSERT_EQ(up, sum_in_mode(x, m, FE_UPWARD)) << std::hexfloat << x << " + " << m;
}

std::vector<float> special_floats() {
  std::vector<float> v = {0.0f,
                          -0.0f,
                          tiny,
                          2 * tiny,
                          3 * tiny,
                          largest,
                          std::nextafter(largest, 0.0f),
                          std::numeric_limits<float>::min(),
                          1.0f,
                          1.5f,
                          0.1f,
                          3.0f,
                          1e7f,
                          16777216.0f,
                          16777215.0f,
                          1e-20f,
                          1e20f,
                          1e30f,
                          1e38f,
                          2e38f};
  const std::size_t given = v.size();
  for (std::size_t i = 0; i < given; ++i) {
    if (v[i] != 0 && v[i] != largest) v.push_back(std::nextafter(v[i], inf));
    v.push_back(-v[i]);
  }
  return v;
}

TEST(Margin, RoundsAsTheProcessorDoes) {
  std::vector<float> xs = special_floats();
  for (const float m : special_floats()) {
    for (const float x : xs) expect_directed(x, m);
    if (HasFatalFailure()) return;
  }
  std::uint64_t state = 12345;
  for (int trial = 0; trial < 1000000; ++trial) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const float x = from_bits(static_cast<std::uint32_t>(state >> 32));
    state = state * 6364136223846793005u + 1442695040888963407u;
    std::uint32_t m_bits = static_cast<std::uint32_t>(state >> 33);
    if (trial % 2 == 0) {  // an exponent within 30 of the other one
      std::uint32_t x_bits;
      std::memcpy(&x_bits, &x, sizeof x);
      const int exponent =
          static_cast<int>(x_bits >> 23 & 255) + static_cast<int>(state >> 20 & 63) - 32;
      m_bits = (m_bits & 0x7fffff) | static_cast<std::uint32_t>(exponent < 0     ? 0
                                                                : exponent > 254 ? 254
                                                                                 : exponent)
                                         << 23;
    }
    const float m = from_bits(m_bits);
    if (!std::isfinite(x) || !std::isfinite(m)) continue;
    expect_directed(x, m);
    if (HasFatalFailure()) return;
  }
}

TEST(Margin, LeavesInfinityAlone) {
  for (const float m : {0.0f, tiny, 1.0f, largest}) {
    EXPECT_EQ(subtract_rounded_down(inf, m), inf);
    EXPECT_EQ(subtract_rounded_down(-inf, m), -inf);
    EXPECT_EQ(add_rounded_up(inf, m), inf);
    EXPECT_EQ(add_rounded_up(-inf, m), -inf);
    EXPECT_TRUE(std::isnan(add_rounded_up(quiet, m)));
  }
}

TEST(Margin, OverflowsOutward) {
  EXPECT_EQ(add_rounded_up(largest, tiny), inf);
  EXPECT_EQ(subtract_rounded_down(-largest, tiny), -inf);
  // Rounded down from above the largest float, and up from below the smallest.
  EXPECT_EQ(subtract_rounded_down(largest, -largest), largest);
  EXPECT_EQ(add_rounded_up(-largest, -largest), -largest);
}

TEST(Margin, ZeroChangesNothing) {
  for (const float x : special_floats()) {
    EXPECT_EQ(subtract_rounded_down(x, 0.0f), x);
    EXPECT_EQ(add_rounded_up(x, 0.0f), x);
  }
}

TEST(Margin, GrowsEveryFace) {
  constexpr Box grown = expand(Box{{1, 2, 3}, {4, 5, 6}}, 0.5f);
  static_assert(grown.lower.x == 0.5f && grown.lower.y == 1.5f && grown.lower.z == 2.5f);
  static_assert(grown.upper.x == 4.5f && grown.upper.y == 5.5f && grown.upper.z == 6.5f);
  const Box far = expand(Box{{1e7f, 0, 0}, {1e7f, 0, 0}}, 0.25f);
  EXPECT_EQ(far.lower.x, std::nextafter(1e7f, 0.0f));
  EXPECT_EQ(far.upper.x, std::nextafter(1e7f, inf));
}

constexpr Box unit{{0, 0, 0}, {1, 1, 1}};

// The unit box with one corner coordinate replaced.
Box with(int k, float value) {
  float c[6] = {0, 0, 0, 1, 1, 1};
  c[k] = value;
  return {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
}

TEST(Overlap, IsClosedOnEveryFace) {
  for (int axis = 0; axis < 3; ++axis) {
    float low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    for (const bool above : {true, false}) {
      for (const int gap : {0, 1}) {
        const float edge =
            above ? (gap ? std::nextafter(1.0f, 2.0f) : 1.0f) : (gap ? -tiny : -0.0f);
        low[axis] = above ? edge : -5.0f;
        high[axis] = above ? 5.0f : edge;
        const Box other{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
        EXPECT_EQ(overlaps(unit, other), gap == 0) << axis << above << gap;
        EXPECT_EQ(overlaps(other, unit), gap == 0) << axis << above << gap;
      }
    }
  }
}

TEST(Overlap, NanOverlapsNothing) {
  for (int k = 0; k < 6; ++k) {
    EXPECT_FALSE(overlaps(unit, with(k, quiet)));
    EXPECT_FALSE(overlaps(with(k, quiet), unit));
    EXPECT_TRUE(has_nan(with(k, quiet)));
    EXPECT_FALSE(is_active(with(k, quiet)));
  }
  EXPECT_FALSE(has_nan(unit));
  EXPECT_FALSE(has_nan(Box{{-inf, -inf, -inf}, {inf, inf, inf}}));
}

TEST(Active, InvertedOnAnyAxisIsNot) {
  EXPECT_TRUE(is_active(unit));
  EXPECT_TRUE(is_active(Box{{2, 2, 2}, {2, 2, 2}}));
  EXPECT_TRUE(is_active(Box{{0.0f, 0, 0}, {-0.0f, 0, 0}}));
  EXPECT_TRUE(is_active(Box{{-inf, -inf, -inf}, {inf, inf, inf}}));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_FALSE(is_active(with(axis, 1.5f)));
    EXPECT_FALSE(is_active(with(axis + 3, -tiny)));
  }
}

// For any rounding of the shift: an active axis stays active, an inverted one inverted, and both
// corners are the nearest floats if these already satisfy that.
TEST(Shift, KeepsActiveAndInactiveApart) {
  std::vector<float> values = {0.0f,    -0.0f,    1.0f, -1.0f, 0.1f, 16777216.0f,
                               largest, -largest, tiny, inf,   -inf};
  for (std::size_t k = values.size(); k-- > 0;) {
    values.push_back(std::nextafter(values[k], inf));
    values.push_back(std::nextafter(values[k], -inf));
  }
  int kept = 0;
  for (const float lower : values) {
    for (const float upper : values) {
      for (const float by : {0.0f, 1e12f, -1e12f, 1e-30f, 0.3f, largest, -largest}) {
        float l = lower, u = upper;
        shift_axis(l, u, by);
        ASSERT_EQ(l <= u, lower <= upper) << lower << ' ' << upper << " by " << by;
        if (l == lower + by && u == upper + by) continue;
        ASSERT_GT(lower, upper);
        ASSERT_EQ(lower + by, upper + by);
        ++kept;
      }
    }
  }
  EXPECT_GT(kept, 100) << "no shift rounds two corners to one";
  const Box slot{{0, 1, 0}, {1, 0.5f, 1}};
  const Box far = shifted(slot, {1e12f, 1e12f, 0});
  EXPECT_FALSE(is_active(far));
  EXPECT_TRUE(is_active(shifted(unit, {1e12f, -1e12f, 3})));
  // A NaN is neither.
  float l = quiet, u = 1;
  shift_axis(l, u, 5);
  EXPECT_NE(l, l);
  EXPECT_EQ(u, 6);
}

}  // namespace
}  // namespace throng::base
