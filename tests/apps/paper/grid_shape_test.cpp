// The grid's shape: cells by density, and a non-decreasing map from float to cell.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

#include "apps/paper/grid.hpp"
#include "support/hard_boxes.hpp"

namespace throng::paper {
namespace {

using tests::BoxList;
constexpr float inf = std::numeric_limits<float>::infinity();
const Box unit_cube{{0, 0, 0}, {1, 1, 1}};

TEST(GridShape, FollowsTheDensity) {
  // 1000 objects, 8 per cell: a cell's volume is 1/125 of the cube's, so its side is a fifth.
  const GridShape five = make_grid(unit_cube, 1000, 8);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(five.cells[axis], 5u);
    EXPECT_EQ(five.scale[axis], 5.0f);
  }
  // Sides 2, 1 and 1/2, cells of volume 1/64: 8, 4 and 2 of side 1/4.
  const GridShape cubic = make_grid({{0, 0, 0}, {2, 1, 0.5f}}, 640, 10);
  EXPECT_EQ(cubic.cells[0], 8u);
  EXPECT_EQ(cubic.cells[1], 4u);
  EXPECT_EQ(cubic.cells[2], 2u);
  // 2.9 cells per side would fit: two larger ones.
  const GridShape refined = make_grid(unit_cube, 195, 8);
  EXPECT_EQ(refined.cells[0], 2u);
  EXPECT_EQ(refined.cell(0, 0.49f), 0u);
  EXPECT_EQ(refined.cell(0, 0.51f), 1u);
}

TEST(GridShape, CellCountIsBounded) {
  tests::Random random(7);
  for (int round = 0; round < 2000; ++round) {
    Box environment = unit_cube;
    environment.upper = {random.magnitude(-30, 30), random.magnitude(-30, 30),
                         random.one_in(4) ? 0 : random.magnitude(-30, 30)};
    const std::uint64_t n = 1 + random.below(1000000);
    const double per_cell = static_cast<double>(random.magnitude(-2, 10));
    const double cells = static_cast<double>(make_grid(environment, n, per_cell).cell_count());
    EXPECT_GE(cells, 1);
    EXPECT_LE(cells, std::max(1.0, static_cast<double>(n) / per_cell) * (1 + 1e-9))
        << n << " " << per_cell;
  }
}

TEST(GridShape, FlatAndEmptyEnvironments) {
  const GridShape flat = make_grid({{0, 0, 3}, {1, 1, 3}}, 400, 4);
  EXPECT_EQ(flat.cells[0], 10u);
  EXPECT_EQ(flat.cells[1], 10u);
  EXPECT_EQ(flat.cells[2], 1u);
  const GridShape line = make_grid({{2, 0, 0}, {3, 0, 0}}, 400, 4);
  EXPECT_EQ(line.cell_count(), 100u);
  EXPECT_EQ(make_grid({{2, 2, 2}, {2, 2, 2}}, 400, 4).cell_count(), 1u);
  EXPECT_EQ(make_grid(unit_cube, 0, 4).cell_count(), 1u);
  // So thin that one cell per length is not a float: the scale stays finite, as the proof requires.
  const GridShape thin = make_grid({{0, 0, 0}, {tests::denormal, 1, 1}}, 400, 4);
  EXPECT_EQ(thin.scale[0], tests::float_max);
  EXPECT_EQ(thin.cells[0], 1u);
}

// For any two ordered floats their cells are ordered, infinities and all scales included.
TEST(GridShape, CellsAreMonotonic) {
  tests::Random random(11);
  constexpr float huge = std::numeric_limits<float>::max();
  const float hard[] = {-inf, -huge, -1, -tests::denormal, -0.0f, 0, tests::denormal, 1, huge, inf};
  for (int round = 0; round < 300; ++round) {
    Box environment{};
    float* lower = &environment.lower.x;
    *lower = random.one_in(5) ? -huge : random.in(-1, 1) * random.magnitude(-40, 40);
    environment.upper.x = random.one_in(5) ? huge : *lower + random.magnitude(-140, 40);
    const GridShape shape = make_grid(environment, 1 + random.below(5000), 1);
    ASSERT_GT(shape.scale[0], 0);
    ASSERT_LT(shape.scale[0], inf);
    std::vector<float> values(std::begin(hard), std::end(hard));
    for (int i = 0; i < 200; ++i) {
      const float edge = environment.lower.x +
                         static_cast<float>(random.below(shape.cells[0] + 1)) / shape.scale[0];
      values.push_back(tests::nudge(edge, random.between(-2, 2)));
    }
    std::sort(values.begin(), values.end());
    std::uint32_t before = 0;
    for (const float x : values) {
      const std::uint32_t cell = shape.cell(0, x);
      ASSERT_GE(cell, before) << x;
      ASSERT_LT(cell, shape.cells[0]) << x;
      before = cell;
    }
    EXPECT_EQ(shape.cell(0, -inf), 0u);
    EXPECT_EQ(shape.cell(0, inf), shape.cells[0] - 1);
  }
}

TEST(GridShape, EnvironmentCoversFiniteActiveBoxes) {
  const BoxList boxes = {{{1, 2, 3}, {4, 5, inf}},
                         {{-inf, 0, 4}, {2, 9, 4}},
                         {{50, 50, 50}, {40, 60, 60}}};  // an empty slot
  const Box around = environment_of(boxes.data(), boxes.size());
  EXPECT_EQ(around.lower.x, 1);
  EXPECT_EQ(around.upper.x, 4);
  EXPECT_EQ(around.lower.y, 0);
  EXPECT_EQ(around.upper.y, 9);
  EXPECT_EQ(around.lower.z, 3);
  EXPECT_EQ(around.upper.z, 4);
  EXPECT_EQ(environment_of(nullptr, 0).upper.x, 0);
}

}  // namespace
}  // namespace throng::paper
