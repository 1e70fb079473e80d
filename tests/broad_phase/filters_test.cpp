// Filters of objects of which few move: few of them, so that kinds tell, owners, and more than
// there are kinds.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "broad_phase/state.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

struct Values {
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;

  Boxes on(const BoxList& boxes) const {
    Boxes view = boxes;
    const auto hang = [](auto& filter, const auto& values) {
      if (!values.empty()) filter = {values.data(), values.size()};
    };
    hang(view.filters.group, group);
    hang(view.filters.mask, mask);
    hang(view.filters.owner, owner);
    hang(view.filters.world, world);
    hang(view.filters.is_static, is_static);
    return view;
  }
};

// A few are moved at a time, and are looked around; all pairs are compared.
void wander(const Values& values, std::uint64_t seed) {
  Random random(seed);
  BoxList boxes = snapped_boxes(600, 9, 1, seed);
  BroadPhase phase;
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(phase.add(values.on(boxes), ids.data()).ok());
  ASSERT_TRUE(phase.update().ok());
  int around = 0;
  for (int frame = 0; frame < 40; ++frame) {
    for (int k = 0; k < 5; ++k) {
      const std::uint32_t i = random.below(600);
      boxes[i] = boxes[random.below(600)];
      ASSERT_EQ(phase.move(ids[i], boxes[i]), Status::ok);
    }
    const Result result = phase.update();
    ASSERT_TRUE(result.ok()) << result.message;
    around += searched_around(result);
    ASSERT_TRUE(same_pairs(plain(phase.pairs()), reference_pairs(values.on(boxes)).pairs))
        << "frame " << frame;
  }
  EXPECT_GT(around, 0);
}

TEST(BroadPhaseFilters, FewLayers) {
  Values v;
  for (std::uint32_t i = 0; i < 600; ++i) {
    v.group.push_back(1u << i % 3);
    v.mask.push_back(i % 3 == 2 ? 3u : 7u);
    v.is_static.push_back(i % 5 == 0);
  }
  wander(v, 1);
}

TEST(BroadPhaseFilters, OwnersAlone) {
  Values v;
  for (int i = 0; i < 600; ++i) v.owner.push_back(i % 7 - 1);
  wander(v, 2);
}

TEST(BroadPhaseFilters, MoreThanThereAreKinds) {
  Values v;
  for (std::uint32_t i = 0; i < 600; ++i) {
    v.group.push_back(1u << i % 8);
    v.mask.push_back(i * 0x9e3779b1u >> 24);
  }
  wander(v, 3);
  v = {};
  for (int i = 0; i < 600; ++i) v.world.push_back(i % 50 - 1);
  wander(v, 4);
}

}  // namespace
}  // namespace throng::tests
