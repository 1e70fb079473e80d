// Tests of the test tools: the reference sweep, the comparison, the scenes.
#include <gtest/gtest.h>

#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

TEST(Support, SweepAgreesWithDoubleLoop) {
  for (const HardScene& scene : hard_scenes(1500)) {
    const Answer plain = reference_pairs(scene.boxes);
    for (int axis = 0; axis < 3; ++axis) {
      const Answer swept = swept_pairs(scene.boxes, axis);
      EXPECT_TRUE(same_pairs(swept.pairs, plain.pairs)) << scene.name;
      EXPECT_EQ(swept.inactive, plain.inactive) << scene.name;
    }
  }
}

TEST(Support, DoubleLoopMatchesHandCounts) {
  const BoxList boxes = {cube(0, 0, 0, 1),
                         cube(1, 1, 1, 1),
                         cube(2.5f, 1, 1, 1),
                         cube(0, 0, 0, 9),
                         {{1, 0, 0}, {0, 1, 1}}};
  const Answer answer = reference_pairs(boxes);
  const std::vector<Pair> want = {{0, 1}, {0, 3}, {1, 3}, {2, 3}};
  EXPECT_TRUE(same_pairs(answer.pairs, want));
  EXPECT_EQ(answer.inactive, 1u);
  EXPECT_EQ(reference_pairs(boxes, 0.25f).pairs.size(), 5u) << "1 and 2 touch, 0.25 + 0.25 apart";
  EXPECT_EQ(reference_pairs(boxes, 0.2f).pairs.size(), 4u);
  EXPECT_EQ(reference_pairs(boxes, boxes).pairs.size(), 2 * 4u + 4u);
}

TEST(Support, ComparisonDetectsEveryDifference) {
  const std::vector<Pair> want = {{0, 1}, {0, 2}, {4, 7}};
  EXPECT_TRUE(same_pairs({{4, 7}, {0, 1}, {0, 2}}, want));
  EXPECT_FALSE(same_pairs({{0, 1}, {0, 2}}, want));
  EXPECT_FALSE(same_pairs({{0, 1}, {0, 2}, {4, 7}, {4, 7}}, want));
  EXPECT_FALSE(same_pairs({{0, 1}, {0, 2}, {4, 7}, {5, 7}}, want));
  EXPECT_FALSE(same_pairs({{0, 1}, {0, 1}, {4, 7}}, want));
  EXPECT_FALSE(same_pairs({{1, 0}, {0, 2}, {4, 7}}, want));
  const std::string text = same_pairs({{0, 1}, {0, 1}, {9, 9}}, want).message();
  EXPECT_NE(text.find("2 missing: (0, 2) (4, 7)"), std::string::npos) << text;
  EXPECT_NE(text.find("1 extra: (9, 9)"), std::string::npos) << text;
  EXPECT_NE(text.find("1 duplicate: (0, 1)"), std::string::npos) << text;
}

TEST(Support, ScenesHavePairs) {
  for (const HardScene& scene : hard_scenes(600))
    EXPECT_GT(reference_pairs(scene.boxes).pairs.size(), 4u) << scene.name;
}

TEST(Support, LatticesTouch) {
  std::size_t pairs = 0, touches = 0, narrow = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Lattice lattice = random_lattice(seed, 2000);
    const BoxList boxes = make_lattice(lattice);
    EXPECT_GT(boxes.size(), 400u) << lattice.describe();
    EXPECT_LT(boxes.size(), 4000u) << lattice.describe();
    narrow += lattice.count[0] <= 3 || lattice.count[1] <= 3 || lattice.count[2] <= 3;
    for (const Pair& pair : swept_pairs(boxes).pairs) {
      ++pairs;
      touches += touching(boxes[pair.first], boxes[pair.second]);
    }
  }
  EXPECT_GT(narrow, 10u);
  EXPECT_GT(touches, pairs / 2);
}

}  // namespace
}  // namespace throng::tests
