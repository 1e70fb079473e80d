// Cells of any size find the same pairs: the plan decides the speed, never the result.
#include <cmath>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

constexpr float scales[] = {1 / 64.0f, 1 / 8.0f, 0.5f, 3, 64};

class CellScale : public Conformance {
 protected:
  Options scaled(float scale) const {
    Options with = options();
    with.cell_scale = scale;
    return with;
  }
};

TEST_P(CellScale, HardBoxes) {
  static std::vector<HardScene> scenes;
  static std::vector<Answer> answers;
  if (answers.empty()) {
    scenes = hard_scenes(sanitized ? 200 : 400);
    for (const HardScene& scene : scenes) answers.push_back(reference_pairs(scene.boxes));
  }
  for (const float scale : scales) {
    Finder finder(scaled(scale));
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      SCOPED_TRACE(scenes[k].name + ", cells " + std::to_string(scale));
      const Result result = finder.find(scenes[k].boxes);
      expect_pairs(result, config(), answers[k], to_vector(finder.pairs()), scenes[k].boxes.size());
    }
  }
}

TEST_P(CellScale, TwoSetsAndFilters) {
  const BoxList a = sizes_to_10000(500, 5), b = snapped_boxes(700, 16, 0.1f, 6);
  std::vector<std::int32_t> worlds;
  for (int i = 0; i < 700; ++i) worlds.push_back(i % 5 - 1);
  Boxes first = a, second = b;
  static const Answer whole = reference_pairs(first, second);
  first.filters.world = {worlds.data(), a.size()};
  second.filters.world = {worlds.data(), b.size()};
  static const Answer parted = reference_pairs(first, second);
  for (const float scale : scales) {
    SCOPED_TRACE(scale);
    Finder finder(scaled(scale));
    const Result result = finder.find(a, b);
    expect_pairs(result, config(), whole, to_vector(finder.pairs()), 500);
    const Result in_worlds = finder.find(first, second);
    expect_pairs(in_worlds, config(), parted, to_vector(finder.pairs()), 0);
  }
}

THRONG_INSTANTIATE(CellScale, suite_configs);

// The slower tests: once per algorithm and instruction set.
class CellScaleOfMany : public CellScale {};

// Nested clusters, for which columns get grids of their own; of one layer, of several, and of
// several worlds.
TEST_P(CellScaleOfMany, NestedGrids) {
  static BoxList boxes;
  static std::vector<std::uint32_t> group, mask;
  static std::vector<std::int32_t> world;
  static Answer answer, of_layers, of_worlds;
  if (boxes.empty()) {
    Random random(4);
    const std::uint32_t meets[] = {0x3e, 0x3d, 0x3b, 0x37, 0x2f, 0x1f};  // all others
    for (int k = 0; k < (sanitized ? 3000 : 9000); ++k) {
      const Vec3 p = random.point(0, k % 3 == 0 ? 10000.0f : k % 3 == 1 ? 40.0f : 8.0f);
      boxes.push_back(cube(p, random.unit()));
      const auto layer = static_cast<std::size_t>(random.below(6));
      group.push_back(1u << layer);
      mask.push_back(meets[layer]);
      world.push_back(random.one_in(1000) ? -1 : random.between(0, 1));
    }
  }
  Boxes layers = boxes, worlds = boxes;
  layers.filters.group = {group.data(), group.size()};
  layers.filters.mask = {mask.data(), mask.size()};
  worlds.filters.world = {world.data(), world.size()};
  if (answer.pairs.empty()) {
    answer = reference_pairs(boxes);
    of_layers = reference_pairs(layers);
    of_worlds = reference_pairs(worlds);
  }
  for (const float scale : scales) {
    SCOPED_TRACE(scale);
    Finder finder(scaled(scale));
    Result result = finder.find(boxes);
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), boxes.size());
    result = finder.find(layers);
    expect_pairs(result, config(), of_layers, to_vector(finder.pairs()), boxes.size());
    result = finder.find(worlds);
    expect_pairs(result, config(), of_worlds, to_vector(finder.pairs()), boxes.size());
  }
}

// Needles that get shorter towards some points, for which grids nest three deep; of one layer and
// of several, whose reject bits fit two.
TEST_P(CellScaleOfMany, GridsNestedThreeDeep) {
  if (config().algorithm != Algorithm::grid) GTEST_SKIP() << "no columns";
  static BoxList boxes;
  static std::vector<std::uint32_t> group, mask;
  static Answer answer, of_layers;
  if (boxes.empty()) {
    Random random(13);
    std::vector<Vec3> places;
    for (int k = 0; k < 20; ++k) places.push_back(random.point(0, 1000));
    for (std::size_t k = 0; k < 30000; ++k) {
      const float near = random.unit() * random.unit(), length = 500 * near * near;
      const Vec3 p = random.point(-0.5f, 0.5f), &at = places[k % places.size()];
      const float size = length * random.in(0.005f, 0.015f);
      boxes.push_back(cube(
          {at.x + length * p.x, at.y + 0.01f * length * p.y, at.z + 0.01f * length * p.z}, size));
      const auto layer = static_cast<std::uint32_t>(random.below(6));
      group.push_back(1u << layer);
      mask.push_back(0x3f ^ 1u << layer);
    }
    answer = swept_pairs(boxes);
    for (const Pair& pair : answer.pairs) {
      if ((group[pair.first] & mask[pair.second]) != 0) of_layers.pairs.push_back(pair);
    }
  }
  Boxes layers = boxes;
  layers.filters.group = {group.data(), group.size()};
  layers.filters.mask = {mask.data(), mask.size()};
  expect_exact(boxes, config(), answer);
  expect_exact(layers, config(), of_layers);
}

// The same with boxes across the columns that get such a grid, and over much of one.
TEST_P(CellScaleOfMany, AcrossNestedGrids) {
  if (config().algorithm != Algorithm::grid) GTEST_SKIP() << "no columns";
  static BoxList boxes;
  static Answer answer;
  if (boxes.empty()) {
    Random random(11);
    for (int k = 0; k < 60000; ++k) {
      if (k % 5 < 3)
        boxes.push_back(cube(random.point(0, 10000), random.unit()));
      else if (k % 3000 == 4)
        boxes.push_back(cube(random.point(4800, 4850), random.in(350, 700)));
      else
        boxes.push_back(cube(random.point(4800, 5200), random.in(0, 3)));
    }
    answer = swept_pairs(boxes);
  }
  expect_exact(boxes, config(), answer);
}

// The same with boxes too wide for such a grid: in the scalar implementation, which has many
// columns, they would be binned into more than 64.
TEST_P(CellScaleOfMany, TooWideForNestedGrids) {
  if (config().algorithm != Algorithm::grid) GTEST_SKIP() << "no columns";
  static BoxList boxes;
  static Answer answer;
  if (boxes.empty()) {
    Random random(12);
    for (int k = 0; k < 60000; ++k) {
      if (k % 10 < 9)
        boxes.push_back(cube(random.point(0, 10000), random.unit()));
      else if (k % 3000 == 9)
        boxes.push_back(cube(random.point(4780, 4800), random.in(60, 150)));
      else
        boxes.push_back(cube(random.point(4800, 4840), random.in(0, 0.6f)));
    }
    answer = swept_pairs(boxes);
  }
  expect_exact(boxes, config(), answer);
}

double cells(const Result& r) {
  return double{1} * r.plan.columns[0] * r.plan.columns[1] * r.plan.columns[2];
}

TEST_P(CellScaleOfMany, ScalesCellLength) {
  if (config().algorithm != Algorithm::grid) GTEST_SKIP() << "no cells, or none that are reported";
  const BoxList boxes = uniform_boxes(40000, 3);
  Finder finder(options());
  // The first call also estimates the number of pairs.
  ASSERT_TRUE(finder.find(boxes).ok());
  const Result planned = finder.find(boxes);
  ASSERT_TRUE(planned.ok()) << planned.message;
  // A GPU's cells are scaled along all three axes, the CPU's columns along two.
  const double axes = config().backend == Backend::cpu ? 2 : 3;
  for (const float scale : {0.75f, 1.5f, 2.0f, 4.0f}) {
    finder.set_options(scaled(scale));
    const Result result = finder.find(boxes);
    EXPECT_EQ(result.found, planned.found) << result.message;
    const double wanted = std::pow(double{scale}, axes);
    EXPECT_NEAR(cells(planned) / cells(result) / wanted, 1, 0.35) << scale;
    if (scale > 1) {
      EXPECT_GT(result.comparisons, planned.comparisons) << scale;
    }
  }
  finder.set_options(scaled(1 / 64.0f));
  const Result finest = finder.find(boxes);
  EXPECT_EQ(finest.found, planned.found) << finest.message;
  EXPECT_GT(cells(finest), 1.5 * cells(planned));
  finder.set_options(scaled(64));
  const Result coarsest = finder.find(boxes);
  EXPECT_EQ(coarsest.found, planned.found) << coarsest.message;
  EXPECT_LT(cells(coarsest), 0.01 * cells(planned) + 40);
}

// Boxes as large as many cells would be binned into each of them.
TEST_P(CellScaleOfMany, LargeBoxesInSmallCells) {
  BoxList boxes = uniform_boxes(3000, 8);
  for (std::size_t i = 0; i < boxes.size(); i += 3) {
    for (int k = 0; k < 3; ++k) (&boxes[i].upper.x)[k] += 9;
  }
  expect_exact(boxes, config(), reference_pairs(boxes));
  Finder finder(scaled(1 / 64.0f));
  const Result result = finder.find(boxes);
  expect_pairs(result, config(), reference_pairs(boxes), to_vector(finder.pairs()), boxes.size());
  if (config().backend == Backend::cpu) {
    EXPECT_LT(finder.memory_bytes(), 200 * 16 * boxes.size() + 8 * result.found + (1 << 20));
  }
}

THRONG_INSTANTIATE(CellScaleOfMany, single_configs);

}  // namespace
}  // namespace throng::tests
