// Two sets, of equal sizes and of a few against many: hard scenes split, also with filters.
#include <algorithm>
#include <limits>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class TwoSets : public Conformance {};

// The boxes of a scene: the first `first` form one set, the rest the other.
struct SplitScene {
  std::string name;
  BoxList boxes;
  std::size_t first;

  Boxes one() const { return {boxes.data(), first}; }
  Boxes other() const { return {boxes.data() + first, boxes.size() - first}; }
};

const std::vector<SplitScene>& parted_scenes() {
  static std::vector<SplitScene> all;
  if (!all.empty()) return all;
  const int n = sanitized ? 600 : 1500;
  std::vector<HardScene> scenes = hard_scenes(n);
  scenes.push_back({"many", uniform_boxes(4 * n, 8)});
  for (HardScene& scene : scenes) {
    const std::size_t size = scene.boxes.size();
    Random random(size);
    shuffle(scene.boxes, random);  // so that both sets are everywhere
    for (const std::size_t part : {2u, 9u, 60u, 400u}) {
      const std::size_t first = std::max<std::size_t>(1, size / part);
      all.push_back({scene.name + ", 1 in " + std::to_string(part), scene.boxes, first});
      if (part != 2) {
        all.push_back(
            {scene.name + ", all but 1 in " + std::to_string(part), scene.boxes, size - first});
      }
    }
  }
  return all;
}

TEST_P(TwoSets, HardScenesSplit) {
  static std::vector<Answer> answers;  // shared by all configurations
  std::size_t next = 0;
  for (const SplitScene& scene : parted_scenes()) {
    SCOPED_TRACE(scene.name);
    if (answers.size() == next) answers.push_back(reference_pairs(scene.one(), scene.other()));
    expect_exact(scene.one(), scene.other(), config(), answers[next++]);
  }
}

// Two sets that are separate along the sweep axis, except for a few boxes of one: of many boxes few
// are near the other set, and of these in turn few are near the remaining ones.
TEST_P(TwoSets, OverlappingInFewPlaces) {
  static BoxList few, many;
  static Answer answers[2];
  if (few.empty()) {
    Random random(9);
    const auto along = [&](float at) {
      return Box{{at, 0, 0}, {at + random.in(0, 2.5e-3f), 1, 1}};
    };
    for (int i = 0; i < 300; ++i) few.push_back(along(1.5e-3f * static_cast<float>(i)));
    for (int i = 0; i < 10'000; ++i) many.push_back(along(0.55f + 4.5e-5f * static_cast<float>(i)));
    many[0] = few[7];
    answers[0] = reference_pairs(few, many);
    answers[1] = reference_pairs(many, few);
  }
  expect_exact(few, many, config(), answers[0]);
  expect_exact(many, few, config(), answers[1]);
}

// Static boxes, and layers that each collide with others: their reject bits stand next to those of
// the sets.
TEST_P(TwoSets, HardScenesSplitWithFilters) {
  static std::vector<Answer> answers;
  static std::vector<std::uint8_t> still;
  static std::vector<std::uint32_t> group, mask;
  for (std::uint32_t i = static_cast<std::uint32_t>(still.size()); i < 8000; ++i) {
    still.push_back(i % 3 == 0);
    group.push_back(1u << i % 5);
    mask.push_back(i % 5 == 2 ? 3u : 29u);
  }
  std::size_t next = 0;
  for (const SplitScene& scene : parted_scenes()) {
    SCOPED_TRACE(scene.name);
    ASSERT_LE(scene.boxes.size(), still.size());
    Boxes one = scene.one(), other = scene.other();
    const auto hang = [](Boxes& boxes, std::size_t from) {
      boxes.filters.is_static = {still.data() + from, boxes.size()};
      boxes.filters.group = {group.data() + from, boxes.size()};
      boxes.filters.mask = {mask.data() + from, boxes.size()};
    };
    hang(one, 0);
    hang(other, scene.first);
    if (answers.size() == next) answers.push_back(reference_pairs(one, other));
    expect_exact(one, other, config(), answers[next++]);
  }
}

// Invalid boxes are counted in their own set, by their index there.
TEST_P(TwoSets, TheFirstInvalidBoxOfTheSecondSet) {
  BoxList one = uniform_boxes(700, 3), other = uniform_boxes(900, 4);
  other[613].upper.y = std::numeric_limits<float>::quiet_NaN();
  other[790].lower.x = std::numeric_limits<float>::quiet_NaN();
  Finder finder(options());
  const Result result = finder.find(one, other);
  EXPECT_EQ(result.status, Status::nan_box);
  EXPECT_EQ(result.first_invalid, 613u);
  EXPECT_EQ(result.invalid_count, 2u);
}

THRONG_INSTANTIATE(TwoSets, suite_configs);

}  // namespace
}  // namespace throng::tests
