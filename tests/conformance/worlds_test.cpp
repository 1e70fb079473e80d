// Worlds (environments): in one place and in different places, similar and not, with boxes in every
// world, in one set and in two.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Worlds : public Conformance {};

using Numbers = std::vector<std::int32_t>;

Boxes in_worlds(const BoxList& boxes, const Numbers& worlds) {
  Boxes view = boxes;
  view.filters.world = {worlds.data(), worlds.size()};
  return view;
}

// World of box i; some boxes are in every world.
Numbers random_worlds(std::size_t boxes, int worlds, std::uint64_t seed,
                      std::uint32_t one_of_all_in) {
  Random r(seed);
  Numbers numbers;
  for (std::size_t i = 0; i < boxes; ++i)
    numbers.push_back(r.one_in(one_of_all_in) ? -1 : r.between(0, worlds - 1));
  return numbers;
}

// All hard scenes, distributed over worlds in one place: boxes that span many columns, quantization
// ties, inactive boxes.
TEST_P(Worlds, HardScenesInOnePlace) {
  static const std::vector<HardScene> scenes = hard_scenes(1200);
  static std::vector<Answer> answers;  // shared by all configurations
  std::size_t next = 0;
  for (const HardScene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    for (const int count : {2, 30}) {
      const Numbers worlds = random_worlds(scene.boxes.size(), count, 7, 300);
      const Boxes view = in_worlds(scene.boxes, worlds);
      if (answers.size() == next) answers.push_back(reference_pairs(view));
      expect_exact(view, config(), answers[next++]);
    }
  }
}

// Worlds with many columns, finer than planned, and overlapping boxes over most of them, of one
// world and of every world.
TEST_P(Worlds, WideAmongMany) {
  static const BoxList boxes = [] {
    BoxList all = uniform_boxes(15000, 33);
    Random random(34);
    for (int k = 0; k < 40; ++k) {
      const Vec3 at = random.point(-5, 25);
      all[random.below(15000)] = {at, {at.x + 28, at.y + 28, at.z + 28}};
    }
    return all;
  }();
  static const Numbers worlds = random_worlds(boxes.size(), 3, 12, 3000);
  const Boxes view = in_worlds(boxes, worlds);
  static const Answer answer = reference_pairs(view);
  for (const float scale : {1.0f, 0.3f}) {
    Options finer = options();
    finer.cell_scale = scale;
    Finder finder(finer);
    const Result result = finder.find(view);
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), boxes.size());
  }
}

// World sizes: all equal, one with half of all boxes, one box each, numbers with gaps.
TEST_P(Worlds, OfAnySize) {
  const BoxList boxes = snapped_boxes(3000, 12, 1, 3);
  static std::vector<Answer> answers;
  for (int shape = 0; shape < 4; ++shape) {
    SCOPED_TRACE(std::to_string(shape));
    Random r(60);
    Numbers worlds;
    for (int i = 0; i < static_cast<int>(boxes.size()); ++i) {
      const int one = shape == 0   ? i / 60
                      : shape == 1 ? (r.one_in(2) ? 5 : r.between(0, 90))
                      : shape == 2 ? i
                                   : r.between(0, 20) * 40;
      worlds.push_back(i == 1000 ? -1 : one);
    }
    Boxes view = in_worlds(boxes, worlds);
    if (answers.size() == static_cast<std::size_t>(shape)) answers.push_back(reference_pairs(view));
    expect_exact(view, config(), answers[static_cast<std::size_t>(shape)]);
  }
}

// Worlds next to each other in space, so dense that comparing two of them in one place would be
// expensive.
TEST_P(Worlds, InDifferentPlaces) {
  BoxList boxes = snapped_boxes(2400, 8, 1, 4);
  Numbers worlds;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const int world = static_cast<int>(i % 12);
    worlds.push_back(world);
    boxes[i].lower.x += 20 * static_cast<float>(world);
    boxes[i].upper.x += 20 * static_cast<float>(world);
  }
  const Boxes view = in_worlds(boxes, worlds);
  static const Answer answer = reference_pairs(view);
  expect_exact(view, config(), answer);
}

// With layers, static boxes and owners in the same call.
TEST_P(Worlds, WithOtherFilters) {
  const BoxList boxes = snapped_boxes(2500, 10, 1, 5);
  const std::size_t n = boxes.size();
  const Numbers worlds = random_worlds(n, 25, 8, 500);
  Numbers owners;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::uint8_t> still;
  for (std::size_t i = 0; i < n; ++i) {
    owners.push_back(static_cast<int>(i / 3 % 200) - 1);
    group.push_back(1u << i % 3);
    mask.push_back(i % 3 == 2 ? 3u : 7u);
    still.push_back(i % 5 == 0);
  }
  Boxes view = in_worlds(boxes, worlds);
  view.filters.is_static = {still.data(), n};
  static const Answer of_static = reference_pairs(view);
  expect_exact(view, config(), of_static);
  view.filters.group = {group.data(), n};
  view.filters.mask = {mask.data(), n};
  view.filters.owner = {owners.data(), n};
  static const Answer of_all = reference_pairs(view);
  expect_exact(view, config(), of_all);
}

TEST_P(Worlds, OfTwoSets) {
  const BoxList a = snapped_boxes(1500, 9, 1, 6), b = snapped_boxes(1100, 9, 1, 7);
  const Numbers of_a = random_worlds(a.size(), 20, 9, 400),
                of_b = random_worlds(b.size(), 30, 10, 400);
  const Boxes first = in_worlds(a, of_a), second = in_worlds(b, of_b);
  static const Answer answer = reference_pairs(first, second);
  expect_exact(first, second, config(), answer);
  static const Answer one_sided = reference_pairs(first, b);
  expect_exact(first, b, config(), one_sided);
}

// Boxes of different worlds are not compared, even if all are in one place.
TEST_P(Worlds, InOnePlaceAreNotCompared) {
  if (config().backend != Backend::cpu || config().algorithm == Algorithm::all_pairs) GTEST_SKIP();
  BoxList boxes = uniform_boxes(20000, 11);
  Numbers worlds;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    worlds.push_back(static_cast<int>(i / 20));
    const Vec3 at = boxes[i / 20].lower;  // the worlds' boxes in as many places
    boxes[i] = {at, {at.x + 1, at.y + 1, at.z + 1}};
  }
  for (const bool ground : {false, true}) {
    if (ground) {
      boxes.push_back({{-100, -100, -1}, {100, 100, 0}});
      worlds.push_back(-1);
    }
    const Boxes view = in_worlds(boxes, worlds);
    Finder finder(options());
    const Result result = finder.find(view);
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_GE(result.found, std::size_t{1000} * 190);
    EXPECT_LE(result.comparisons, 10 * (boxes.size() + result.found));
  }
}

THRONG_INSTANTIATE(Worlds, suite_configs);

}  // namespace
}  // namespace throng::tests
