// Boxes that are disjoint when quantized are disjoint, for any range; and most disjoint boxes are
// recognized.
#include "device/quantized_boxes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "base/bounds.hpp"
#include "support/hard_boxes.hpp"

namespace throng::device {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

QuantizationRange range_of(float low, float high) {
  QuantizationRange range;
  for (int k = 0; k < 3; ++k) range.set_axis(k, low, high);
  return range;
}

// Adjacent floats, both zeros, denormals and infinities.
std::vector<float> hard_values() {
  std::vector<float> values = {-inf,    inf,   0.0f,   -0.0f, 1e-45f,
                               -1e-45f, 1e38f, -1e38f, 3e38f, -3e38f};
  for (const float x : {-7.0f, -1.0f, 0.25f, 1.0f, 3.0f, 7.0f, 1000.0f}) {
    float at = std::nextafter(std::nextafter(x, -inf), -inf);
    for (int k = 0; k < 5; ++k, at = std::nextafter(at, inf)) values.push_back(at);
  }
  return values;
}

std::vector<QuantizationRange> hard_ranges() {
  std::vector<QuantizationRange> ranges;
  const float ends[][2] = {
      {-7, 7},     {0, 1},          {1, 1},          {-1, std::nextafter(-1.0f, 0.0f)},
      {0, 1e-45f}, {-inf, inf},     {-inf, 3},       {3, inf},
      {inf, inf},  {-3e38f, 3e38f}, {3e38f, -3e38f}, {0, 1e38f}};
  for (const auto& [low, high] : ends) ranges.push_back(range_of(low, high));
  return ranges;
}

TEST(QuantizedBoxes, OrderIsKept) {
  const std::vector<float> values = hard_values();
  for (const QuantizationRange& range : hard_ranges())
    for (int axis = 0; axis < 3; ++axis)
      for (const float a : values) {
        EXPECT_LE(range.step(axis, a), static_cast<std::uint32_t>(QuantizationRange::last(axis)));
        for (const float b : values) {
          if (!(a <= b)) continue;
          EXPECT_LE(range.step(axis, a), range.step(axis, b)) << a << ' ' << b;
        }
      }
  EXPECT_EQ(range_of(-7, 7).step(0, std::nanf("")), 0u);
}

// Each axis by itself, so that each field and guard decides once.
TEST(QuantizedBoxes, OverlapsAreNeverDisjoint) {
  const std::vector<float> values = hard_values();
  std::vector<Box> boxes;
  for (int axis = 0; axis < 3; ++axis)
    for (const float low : values)
      for (const float high : values) {
        if (!(low <= high)) continue;
        Box b = {{0, 0, 0}, {0, 0, 0}};
        (&b.lower.x)[axis] = low;
        (&b.upper.x)[axis] = high;
        boxes.push_back(b);
      }
  std::size_t overlap = 0;
  for (const QuantizationRange& range : hard_ranges()) {
    for (std::size_t i = 0; i < boxes.size(); i += 3)
      for (std::size_t j = 0; j < boxes.size(); j += 5) {
        if (!base::overlaps(boxes[i], boxes[j])) continue;
        ++overlap;
        ASSERT_FALSE(are_disjoint(range.quantize(boxes[i]), range.quantize(boxes[j])))
            << i << ' ' << j;
      }
  }
  EXPECT_GT(overlap, 100000u);
}

TEST(QuantizedBoxes, MostDisjointBoxesAreRecognized) {
  const tests::BoxList boxes = tests::uniform_boxes(400, 3);
  Box all = boxes[0];
  for (const Box& b : boxes) {
    all.lower = {std::fmin(all.lower.x, b.lower.x), std::fmin(all.lower.y, b.lower.y),
                 std::fmin(all.lower.z, b.lower.z)};
    all.upper = {std::fmax(all.upper.x, b.upper.x), std::fmax(all.upper.y, b.upper.y),
                 std::fmax(all.upper.z, b.upper.z)};
  }
  QuantizationRange range;
  range.set_axis(0, all.lower.x, all.upper.x);
  range.set_axis(1, all.lower.y, all.upper.y);
  range.set_axis(2, all.lower.z, all.upper.z);
  int overlap = 0, together = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const bool meet = base::overlaps(boxes[i], boxes[j]);
      const bool may = !are_disjoint(range.quantize(boxes[i]), range.quantize(boxes[j]));
      overlap += meet;
      together += may;
      ASSERT_TRUE(may || !meet);
    }
  EXPECT_GT(overlap, 100);
  EXPECT_LT(together, overlap + overlap / 10);
}

// Each corner against each, on each axis.
TEST(QuantizedBoxes, EveryFieldCounts) {
  const QuantizationRange range = range_of(0, 8);
  const Box middle = {{3, 3, 3}, {4, 4, 4}};
  for (int axis = 0; axis < 3; ++axis)
    for (const float by : {-2.0f, 2.0f}) {
      Box other = middle;
      (&other.lower.x)[axis] += by;
      (&other.upper.x)[axis] += by;
      EXPECT_TRUE(are_disjoint(range.quantize(middle), range.quantize(other))) << axis << by;
      EXPECT_TRUE(are_disjoint(range.quantize(other), range.quantize(middle))) << axis << by;
    }
  EXPECT_FALSE(are_disjoint(range.quantize(middle), range.quantize(middle)));
}

}  // namespace
}  // namespace throng::device
