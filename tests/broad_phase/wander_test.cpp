// Objects that leave the region that cells were planned for, slightly and very far, in all
// directions: the same pairs as from scratch, and searches visit no more than elsewhere.
#include <cfloat>
#include <limits>
#include <vector>

#include "broad_phase/state.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

constexpr int object_count = 6000;
constexpr float range = 36;  // of uniform_boxes() of this count

struct Herd {
  BoxList boxes = uniform_boxes(object_count, 5);
  std::vector<std::int32_t> worlds;
  BroadPhase broad_phase;

  explicit Herd(Vec3 at) {
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
  std::vector<Pair> anew() const {
    Options canonical;
    canonical.order = Order::canonical;
    return find_pairs(view(), canonical);
  }
};

// Movers go to where cells wrap around: near each corner of the range, and some ranges beyond.
// Every 16th object stays.
void wander(Herd& herd, Vec3 at) {
  herd.start();
  Random random(17);
  constexpr float places[] = {-41 * range, -2 * range, -1, 0.4f * range, range, 3.1f * range};
  const auto place = [&] { return places[random.below(sizeof places / sizeof *places)]; };
  int searched = 0;
  constexpr int frames = 60;
  for (int frame = 0; frame < frames; ++frame) {
    const Vec3 centre = {at.x + place(), at.y + place(), at.z + place()};
    for (int k = 0; k < object_count / 100; ++k) {
      const Vec3 by = random.point(-3, 3);
      herd.move(1 + random.below(object_count / 16) * 16 + random.below(15),
                cube({centre.x + by.x, centre.y + by.y, centre.z + by.z}, 1));
    }
    const Result r = herd.broad_phase.update();
    ASSERT_TRUE(r.ok()) << r.message;
    searched += searched_around(r);
    ASSERT_EQ(plain(herd.broad_phase.pairs()), herd.anew()) << "in frame " << frame;
  }
  EXPECT_GT(searched, frames / 2);
}

TEST(Wanderers, AreFoundWhereverTheyGo) {
  for (const Vec3 at : {Vec3{0, 0, 0}, Vec3{-1000, 500, -20}, Vec3{30000, -30000, 1}}) {
    Herd herd(at);
    wander(herd, at);
  }
}

TEST(Wanderers, AreFoundInTheirWorldsAndInThoseOfAll) {
  const Vec3 at = {-50, 7, 1000};
  Herd herd(at);
  // Those of world -1 stay: a search around one visits all cells.
  for (int i = 0; i < object_count; ++i) herd.worlds.push_back(i % 16 == 0 ? -1 : i % 3);
  wander(herd, at);
}

// One at a time: at the limits of float, too, a search visits few lines of cells.
TEST(Wanderers, AreLookedForInAFewCells) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Herd herd({0, 0, 0});
  herd.start();
  // Until updates are incremental.
  for (int frame = 0; frame < 200; ++frame) {
    herd.move(static_cast<ObjectId>(frame), herd.boxes[static_cast<std::size_t>(frame) + 1]);
    ASSERT_TRUE(herd.broad_phase.update().ok());
  }
  for (const float x : {-1e6f, 1e6f, -1e30f, 1e30f, -FLT_MAX, FLT_MAX, -infinity, infinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      Box b = cube(18, 18, 18, 1);
      (axis == 0 ? b.lower.x : axis == 1 ? b.lower.y : b.lower.z) = x;
      (axis == 0 ? b.upper.x : axis == 1 ? b.upper.y : b.upper.z) = x;
      herd.move(0, b);
      const Result r = herd.broad_phase.update();
      ASSERT_TRUE(r.ok()) << r.message;
      ASSERT_TRUE(searched_around(r));
      EXPECT_LE(r.comparisons, 200u) << x << " along axis " << axis;
      ASSERT_EQ(plain(herd.broad_phase.pairs()), herd.anew());
    }
  }
}

}  // namespace
}  // namespace throng::tests
