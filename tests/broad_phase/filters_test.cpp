// Filters when few objects move: few filter classes, owners, and more filters than classes.
#include <gtest/gtest.h>

#include <vector>

#include "broad_phase/snapshot.hpp"
#include "support/cases.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

// Moves a few objects at a time, for incremental updates; compares all pairs.
void move_few(Set set, unsigned filters, std::uint64_t seed) {
  Random random(seed);
  set.boxes = snapped_boxes(600, 9, 1, seed);
  BoxList& boxes = set.boxes;
  BroadPhase phase;
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(phase.add(set.view(filters), ids.data()).ok());
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
    around += was_incremental(result);
    ASSERT_TRUE(same_pairs(plain(phase.pairs()), reference_pairs(set.view(filters)).pairs))
        << "frame " << frame;
  }
  EXPECT_GT(around, 0);
}

TEST(BroadPhaseFilters, FewLayers) {
  Set v;
  for (std::uint32_t i = 0; i < 600; ++i) {
    v.group.push_back(1u << i % 3);
    v.mask.push_back(i % 3 == 2 ? 3u : 7u);
    v.is_static.push_back(i % 5 == 0);
  }
  move_few(v, with_group | with_mask | with_static, 1);
}

TEST(BroadPhaseFilters, OnlyOwners) {
  Set v;
  for (int i = 0; i < 600; ++i) v.owner.push_back(i % 7 - 1);
  move_few(v, with_owner, 2);
}

TEST(BroadPhaseFilters, MoreThanFilterClasses) {
  Set v;
  for (std::uint32_t i = 0; i < 600; ++i) {
    v.group.push_back(1u << i % 8);
    v.mask.push_back(i * 0x9e3779b1u >> 24);
  }
  move_few(v, with_group | with_mask, 3);
  v = {};
  for (int i = 0; i < 600; ++i) v.world.push_back(i % 50 - 1);
  move_few(v, with_world, 4);
}

}  // namespace
}  // namespace throng::tests
