// Boxes with positions other than the floats themselves, on each instruction set: exactly the pairs
// of a double loop.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <throng/throng.hpp>

#include "grid/searched_grid.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

using tests::BoxList;
using tests::Random;

void expect_exact(const BoxList& boxes, bool by_bits) {
  std::vector<Pair> expected;
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j)
      if (base::overlaps(boxes[i], boxes[j])) expected.push_back({i, j});
  EXPECT_GT(expected.size(), 100u);
  for (const Isa isa : tests::supported_isas()) {
    for (const float cell_scale : {1.0f, 0.25f}) {
      SCOPED_TRACE(to_string(isa) + std::string(", ") + std::to_string(cell_scale));
      const SearchedGrid grid(boxes, SearchedGrid::How{1, cell_scale, isa});
      EXPECT_FALSE(grid.plan().map.is_identity);
      EXPECT_EQ(grid.plan().map.by_bits[0], by_bits);
      EXPECT_TRUE(grid.sorted_pairs() == expected);
    }
  }
}

// A few of the least floats, with both zeros: quantization is finer than their bits, so all
// different floats have different quantized coordinates, and the two zeros have one.
TEST(Positions, OfTheLeastFloats) {
  Random r(1);
  BoxList boxes;
  const auto times_denormal = [&](int x) {
    return x == 0 && r.one_in(2) ? -0.0f : static_cast<float>(x) * tests::denormal;
  };
  for (int i = 0; i < 1500; ++i) {
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const int at = r.between(-12, 12);
      c[k] = times_denormal(at);
      c[k + 3] = times_denormal(at + r.between(0, 2));
    }
    boxes.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}});
  }
  expect_exact(boxes, true);
}

// The same at scales where a scale, or a difference, overflows.
TEST(Positions, OfScaledWholeNumbers) {
  for (const float factor : {0x1p-120f, 0x1p123f}) {
    SCOPED_TRACE(factor);
    Random r(2);
    BoxList boxes;
    for (int i = 0; i < 1500; ++i) {
      float c[6];
      for (int k = 0; k < 3; ++k) {
        const int at = r.between(-28, 26);
        c[k] = static_cast<float>(at) * factor;
        c[k + 3] = static_cast<float>(at + r.between(0, 5)) * factor;
      }
      boxes.push_back({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}});
    }
    expect_exact(boxes, false);
  }
}

TEST(Positions, OfManyDecades) { expect_exact(tests::many_decades(2000, 0, 3), true); }

}  // namespace
}  // namespace throng::grid
