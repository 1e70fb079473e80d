// The map from floats to columns and quantized coordinates is non-decreasing for all kinds of
// positions.
#include "base/quantize.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "grid/plan/planner.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::base {
namespace {

using tests::Random;

// Sorted floats of all magnitudes and both signs, with their neighbours; 0 twice.
std::vector<float> all_kinds() {
  std::vector<float> values = {-0.0f, 0.0f, tests::infinity, -tests::infinity};
  Random r(1);
  const auto add = [&](float x) {
    for (const float sign : {-1.0f, 1.0f})
      for (int step = -1; step <= 1; ++step) values.push_back(tests::nudge(sign * x, step));
  };
  for (int e = -149; e <= 127; ++e) {
    add(std::ldexp(1.0f, e));
    for (int k = 0; k < 8; ++k) add(std::ldexp(1 + r.unit(), e));
  }
  for (const float centre : {5.0f, 1e-40f, 3e38f}) {
    for (int k = -40; k <= 40; ++k) values.push_back(tests::nudge(centre, k));
  }
  std::stable_sort(values.begin(), values.end());
  return values;
}

Quantizer map_of(bool by_bits, float centre, float factor, float origin, float scale) {
  Quantizer map;
  for (int k = 0; k < 3; ++k) {
    map.by_bits[k] = by_bits;
    map.centre[k] = centre;
    map.factor[k] = factor;
    map.origin[k] = origin;
    map.scale[k] = scale;
    map.columns[k] = 64;
    map.max[k] = largest_index(64);
  }
  map.is_identity = !by_bits && factor == 1;
  return map;
}

// Returns the number of distinct indices; only a poor map has few.
std::size_t expect_monotone(const Quantizer& map) {
  std::int32_t before = 0;
  float last = std::numeric_limits<float>::quiet_NaN();
  std::size_t steps = 0;
  for (const float x : all_kinds()) {
    const std::int32_t index = quantize(map, 1, x);
    EXPECT_GE(index, before) << x << " after " << last;
    EXPECT_LT(column_of(index), 64);
    if (x == last) {
      EXPECT_EQ(index, before) << "equal floats, " << x;
    }
    steps += index != before;
    before = index;
    last = x;
  }
  return steps;
}

TEST(Quantize, NeverDecreases) {
  expect_monotone(map_of(false, 0, 1, -100, 1e4f));
  expect_monotone(map_of(false, 0, 1, 5, 3e38f));
  // So large that differences overflow, and so small that a scale would.
  EXPECT_GT(expect_monotone(map_of(false, 0, 0x1p-126f, -2, 5e5f)), 50u);
  EXPECT_GT(expect_monotone(map_of(false, 0, 0x1p127f, -0x1p-2f, 4e6f)), 50u);
  // All floats by their bits, and those of some powers of two.
  constexpr float all = 4294967296.0f, words = 64 * 32768.0f;
  for (const float centre : {0.0f, -0.0f, 5.0f, -1e-40f, 3e38f}) {
    SCOPED_TRACE(centre);
    EXPECT_GT(expect_monotone(map_of(true, centre, 1, -all / 2, words / all)), 50u);
    expect_monotone(map_of(true, centre, 1, 0x20000000p0f, 0.001f));
    expect_monotone(map_of(true, centre, 1, -0x72000000p0f, 0.001f));
    expect_monotone(map_of(true, centre, 1, -300, 4e3f));
  }
}

// Both zeros have one position, the least floats on either side other ones.
TEST(Quantize, BitsAreInTheOrderOfFloats) {
  EXPECT_EQ(ordered_bits(0.0f), 0);
  EXPECT_EQ(ordered_bits(-0.0f), 0);
  EXPECT_EQ(ordered_bits(tests::denormal), 1);
  EXPECT_EQ(ordered_bits(-tests::denormal), -2);
  EXPECT_EQ(ordered_bits(tests::infinity), 0x7f800000);
  EXPECT_LT(ordered_bits(-tests::infinity), ordered_bits(-tests::float_max));
}

// A coordinate at a position maps to about that position.
TEST(Quantize, CoordinatesAtPositions) {
  for (const bool by_bits : {false, true}) {
    for (const float x : {-3e5f, -1.5f, 0.25f, 7.0f, 12345.0f}) {
      const Quantizer map = map_of(by_bits, by_bits ? 2 : 0, by_bits ? 1 : 0x1p20f, 0, 1);
      const float position = by_bits ? position_by_bits(x, 2) : x * 0x1p20f;
      EXPECT_NEAR(coordinate_at(map, 0, position), x, std::fabs(x) * 1e-4);
    }
    const Quantizer map = map_of(by_bits, 0, 1, 0, 1);
    if (by_bits) {
      EXPECT_EQ(coordinate_at(map, 0, 1e10), tests::infinity);
      EXPECT_EQ(coordinate_at(map, 0, -1e10), -tests::infinity);
    }
  }
}

}  // namespace
}  // namespace throng::base
