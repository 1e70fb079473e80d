// Cost of updates in which few objects move, in comparisons: on every scene, and with periodic
// patterns of ids.
#include <algorithm>
#include <string>
#include <vector>

#include "apps/scenes/scene.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/configs.hpp"
#include "support/random.hpp"
#include "support/scene_boxes.hpp"

namespace throng::tests {
namespace {

class MovingComparisons : public testing::TestWithParam<std::string> {};

// 1 % moves in each frame. An incremental search compares each with at most 40 boxes, plus 40 per
// pair that it has; where it cannot, it is soon abandoned for full searches.
TEST_P(MovingComparisons, BoundedPerMoverOrAborted) {
  scenes::Spec spec;
  spec.name = GetParam();
  spec.objects = 10000;
  SceneBoxes made(spec);
  std::vector<Box>& boxes = made.boxes;

  Options options;
  options.threads = 1;
  BroadPhase broad_phase(options);
  ASSERT_TRUE(broad_phase.add(made.view(), nullptr).ok());
  ASSERT_TRUE(broad_phase.update().ok());
  Random random(1);
  const std::size_t movers = boxes.size() / 100;
  constexpr int frames = 100, warm = 40;
  double limit = 0, compared = 0;
  int searched = 0;
  for (int frame = 0; frame < frames; ++frame) {
    for (std::size_t k = 0; k < movers; ++k) {
      const auto id = random.below(static_cast<std::uint32_t>(boxes.size()));
      const Vec3 by = random.point(-0.5f, 0.5f);
      Box& b = boxes[id];
      b = {{b.lower.x + by.x, b.lower.y + by.y, b.lower.z + by.z},
           {b.upper.x + by.x, b.upper.y + by.y, b.upper.z + by.z}};
      ASSERT_EQ(broad_phase.move(id, b), Status::ok);
    }
    const Result r = broad_phase.update();
    ASSERT_TRUE(r.ok()) << r.message;
    if (frame < warm || !was_incremental(r)) continue;
    ++searched;
    compared += static_cast<double>(r.comparisons);
    const auto pairs = static_cast<double>(broad_phase.pair_count());
    limit += 40 * static_cast<double>(movers) * (1 + 2 * pairs / static_cast<double>(boxes.size()));
  }
  EXPECT_LE(compared, limit);
  // Axis-aligned rods have cells of their shape.
  if (spec.name != "rods-any") {
    EXPECT_EQ(searched, frames - warm);
  }
}

// In each of sixty frames, two hundred of the first `movers` boxes move a little. Most updates are
// incremental, with at most this many comparisons per search on average.
void expect_compared(BroadPhase& broad_phase, std::vector<Box>& boxes, std::uint32_t movers,
                     Random& random, double at_most) {
  double compared = 0, searches = 0;
  for (int frame = 0; frame < 60; ++frame) {
    for (int k = 0; k < 200; ++k) {
      const ObjectId id = random.below(movers);
      Box& b = boxes[id];
      b.lower.x = nudge(b.lower.x, 1);
      ASSERT_EQ(broad_phase.move(id, b), Status::ok);
    }
    const Result r = broad_phase.update();
    ASSERT_TRUE(r.ok()) << r.message;
    if (!was_incremental(r)) continue;
    compared += static_cast<double>(r.comparisons);
    searches += 200;
  }
  EXPECT_GE(searches, 30 * 200);
  EXPECT_LE(compared, at_most * searches);
}

// Half of the objects are static and in a heap, the others far away. Updates alternate between
// cheap and expensive searches: after a while, when cells have proved unsuitable, each does little
// work.
TEST(Comparisons, OfAlternatingCheapAndExpensiveUpdates) {
  for (const bool removing : {false, true}) {
    SCOPED_TRACE(removing);
    Random random(9);
    const auto in_heap = [&] {
      const Vec3 v = random.point(0, 8);
      return Box{v, {v.x + 4, v.y + 4, v.z + 4}};
    };
    const auto far_away = [&] {
      const Vec3 v = random.point(1000, 2000);
      return Box{v, {v.x + 1, v.y + 1, v.z + 1}};
    };
    Options options;
    options.threads = 1;
    BroadPhase broad_phase(options);
    Filter filter;
    filter.is_static = 1;
    constexpr std::uint32_t half = 4000;
    std::vector<ObjectId> ids(2 * half);
    for (std::uint32_t i = 0; i < 2 * half; ++i)
      ASSERT_EQ(broad_phase.add(i < half ? in_heap() : far_away(), filter, ids[i]), Status::ok);
    ASSERT_TRUE(broad_phase.update().ok());
    double cost = 0;
    constexpr int steps = 400, warm = 200;
    for (int step = 0; step < steps; ++step) {
      const std::uint32_t i = random.below(half);
      if (removing) {
        ASSERT_EQ(broad_phase.remove(ids[i]), Status::ok);
      } else {
        ASSERT_EQ(broad_phase.move(ids[half + i], far_away()), Status::ok);
      }
      const Result cheap = broad_phase.update();
      if (removing) {
        ASSERT_EQ(broad_phase.add(in_heap(), filter, ids[i]), Status::ok);
      } else {
        ASSERT_EQ(broad_phase.move(ids[i], in_heap()), Status::ok);
      }
      const Result dear = broad_phase.update();
      ASSERT_TRUE(cheap.ok() && dear.ok());
      if (step < warm) continue;
      cost += static_cast<double>(cheap.comparisons + cheap.visited);
      cost += static_cast<double>(dear.comparisons + dear.visited);
    }
    EXPECT_LE(cost, 200.0 * 2 * (steps - warm));
  }
}

// Boxes of two sizes that fill twice their world: comparisons per search with cells planned for
// both sizes rather than for the median.
TEST(Comparisons, OfTwoSizes) {
  Random random(2);
  std::vector<Box> boxes(20000);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const float e = i % 2 == 0 ? 1 : 3;
    const Vec3 v = random.point(0, 52);
    boxes[i] = {v, {v.x + e, v.y + e, v.z + e}};
  }
  Options options;
  options.threads = 1;
  BroadPhase broad_phase(options);
  ASSERT_TRUE(broad_phase.add(boxes, nullptr).ok());
  ASSERT_TRUE(broad_phase.update().ok());
  expect_compared(broad_phase, boxes, static_cast<std::uint32_t>(boxes.size()), random, 150);
}

// Worlds at one place, with a plane common to all: searches compare few boxes of other worlds.
TEST(Comparisons, OfWorlds) {
  Random random(3);
  std::vector<Box> boxes;
  std::vector<std::int32_t> world;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 v = random.point(0, 9);
    boxes.push_back({v, {v.x + 1, v.y + 1, v.z + 1}});
    world.push_back(i % 200);
  }
  boxes.push_back({{-50, -1, -50}, {50, 0, 50}});
  world.push_back(-1);
  Options options;
  options.threads = 1;
  BroadPhase broad_phase(options);
  Boxes view(boxes);
  view.filters.world = {world.data(), world.size()};
  ASSERT_TRUE(broad_phase.add(view, nullptr).ok());
  ASSERT_TRUE(broad_phase.update().ok());
  expect_compared(broad_phase, boxes, 20000, random, 45);
}

// Each search compares a few large boxes; once they are many, they get cells.
TEST(Comparisons, OfManyLargeBoxes) {
  const auto meet = [](const Box& a, const Box& b) {
    return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
           b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
  };
  Random random(4);
  std::vector<Box> boxes;
  for (int i = 0; i < 10000; ++i) {
    const Vec3 v = random.point(0, 60);
    boxes.push_back({v, {v.x + 1, v.y + 1, v.z + 1}});
  }
  BroadPhase broad_phase;
  ASSERT_TRUE(broad_phase.add(boxes, nullptr).ok());
  for (int large = 0; large < 300; ++large) {
    const Vec3 v = random.point(0, 60);
    const Box slab = {v, {v.x + 12, v.y + 12, v.z + 0.1f}};
    boxes.push_back(slab);
    broad_phase.add(slab);
    double most = 0;
    for (int frame = 0; frame < 4; ++frame) {
      for (int k = 0; k < 20; ++k) {
        const ObjectId id = random.below(10000);
        boxes[id].lower.x = nudge(boxes[id].lower.x, 1);
        ASSERT_EQ(broad_phase.move(id, boxes[id]), Status::ok);
      }
      const Result r = broad_phase.update();
      ASSERT_TRUE(r.ok()) << r.message;
      if (was_incremental(r)) most = std::max(most, static_cast<double>(r.comparisons));
    }
    EXPECT_LE(most, 21 * 130);
    if (large % 60 != 0) continue;
    std::vector<Pair> want;
    for (std::uint32_t a = 0; a < boxes.size(); ++a) {
      for (std::uint32_t b = a + 1; b < boxes.size(); ++b) {
        if (meet(boxes[a], boxes[b])) want.push_back({a, b});
      }
    }
    EXPECT_EQ(plain(broad_phase.pairs()), want);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, MovingComparisons, testing::ValuesIn(scenes::names()),
                         [](const auto& which) {
                           std::string name = which.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace throng::tests
