// Objects that leave the region that cells were planned for, slightly and very far, in all
// directions: the same pairs as from scratch, and searches visit no more than elsewhere.
#include <cfloat>
#include <limits>
#include <vector>

#include "broad_phase/snapshot.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

constexpr int object_count = 6000;
constexpr float range = 36;  // of uniform_boxes() of this count

struct MovingObjects {
  BoxList boxes = uniform_boxes(object_count, 5);
  std::vector<std::int32_t> worlds;
  BroadPhase broad_phase;

  explicit MovingObjects(Vec3 at) {
    for (Box& b : boxes) b = cube({b.lower.x + at.x, b.lower.y + at.y, b.lower.z + at.z}, 1);
  }
  Boxes view() const {
    Boxes all(boxes);
    if (!worlds.empty()) all.filters.world = {worlds.data(), worlds.size()};
    return all;
  }
  void start() {
    ASSERT_TRUE(broad_phase.add(view(), nullptr).ok());
    ASSERT_TRUE(broad_phase.update().ok());
  }
  void move(ObjectId id, const Box& to) {
    boxes[id] = to;
    ASSERT_EQ(broad_phase.move(id, to), Status::ok);
  }
  std::vector<Pair> from_scratch() const {
    Options canonical;
    canonical.order = Order::canonical;
    return find_pairs(view(), canonical);
  }
};

// Movers go to where cells wrap around: near each corner of the range, and some ranges beyond.
// Every 16th object stays.
void leave_and_return(MovingObjects& moving, Vec3 at) {
  moving.start();
  Random random(17);
  constexpr float places[] = {-41 * range, -2 * range, -1, 0.4f * range, range, 3.1f * range};
  const auto place = [&] { return places[random.below(sizeof places / sizeof *places)]; };
  int searched = 0;
  constexpr int frames = 60;
  for (int frame = 0; frame < frames; ++frame) {
    const Vec3 centre = {at.x + place(), at.y + place(), at.z + place()};
    for (int k = 0; k < object_count / 100; ++k) {
      const Vec3 by = random.point(-3, 3);
      moving.move(1 + random.below(object_count / 16) * 16 + random.below(15),
                  cube({centre.x + by.x, centre.y + by.y, centre.z + by.z}, 1));
    }
    const Result r = moving.broad_phase.update();
    ASSERT_TRUE(r.ok()) << r.message;
    searched += was_incremental(r);
    ASSERT_EQ(plain(moving.broad_phase.pairs()), moving.from_scratch()) << "in frame " << frame;
  }
  EXPECT_GT(searched, frames / 2);
}

TEST(RegionLeavers, AreFoundAnywhere) {
  for (const Vec3 at : {Vec3{0, 0, 0}, Vec3{-1000, 500, -20}, Vec3{30000, -30000, 1}}) {
    MovingObjects moving(at);
    leave_and_return(moving, at);
  }
}

TEST(RegionLeavers, AreFoundInAllWorlds) {
  const Vec3 at = {-50, 7, 1000};
  MovingObjects moving(at);
  // Those of world -1 stay: a search around one visits all cells.
  for (int i = 0; i < object_count; ++i) moving.worlds.push_back(i % 16 == 0 ? -1 : i % 3);
  leave_and_return(moving, at);
}

// One at a time: at the limits of float, too, a search visits few lines of cells.
TEST(RegionLeavers, AreFoundInFewCells) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  MovingObjects moving({0, 0, 0});
  moving.start();
  // Until updates are incremental.
  for (int frame = 0; frame < 200; ++frame) {
    moving.move(static_cast<ObjectId>(frame), moving.boxes[static_cast<std::size_t>(frame) + 1]);
    ASSERT_TRUE(moving.broad_phase.update().ok());
  }
  for (const float x : {-1e6f, 1e6f, -1e30f, 1e30f, -FLT_MAX, FLT_MAX, -infinity, infinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      Box b = cube(18, 18, 18, 1);
      (axis == 0 ? b.lower.x : axis == 1 ? b.lower.y : b.lower.z) = x;
      (axis == 0 ? b.upper.x : axis == 1 ? b.upper.y : b.upper.z) = x;
      moving.move(0, b);
      const Result r = moving.broad_phase.update();
      ASSERT_TRUE(r.ok()) << r.message;
      ASSERT_TRUE(was_incremental(r));
      EXPECT_LE(r.comparisons, 200u) << x << " along axis " << axis;
      ASSERT_EQ(plain(moving.broad_phase.pairs()), moving.from_scratch());
    }
  }
}

}  // namespace
}  // namespace throng::tests
