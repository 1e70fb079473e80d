// Candidates that the fat and inner boxes leave undecided: only these are compared while no object
// leaves its fat box, and no begin or end event is missed.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "device/device_actor.hpp"
#include "device/object_stages.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

using device::ObjectView;

TEST(UncertainCandidates, ABoxContainsItsInnerBox) {
  ObjectView objects{};
  const float inf = std::numeric_limits<float>::infinity();
  for (const float margin : {0.0f, 1e-3f, 0.25f, 7.0f, 1e20f})
    for (const float grown : {0.0f, 0.5f})
      for (const float at : {0.0f, -0.0f, 1e-40f, 1.0f, -3.7f, 16777217.0f, -1e20f, 1e30f, 3e38f}) {
        objects.fat_margin = margin;
        objects.margin = grown;
        for (const float e : {0.0f, 1e-3f, 1.0f, 1e6f, inf}) {
          const Box box = {{at, at, -float_max}, {at + e, at + 2 * e, float_max}};
          const Box fat = objects.fat_box(box), inner = objects.inner_box(fat);
          EXPECT_TRUE(ObjectView::inside(objects.grown(box), fat));
          // Where floats are about as coarse as the margin, the difference may be rounded away.
          if (margin == 0 || margin > 3 * std::fabs(at + 2 * e) * 0x1p-23f) {
            EXPECT_TRUE(ObjectView::inside(inner, objects.grown(box)))
                << at << ' ' << e << ' ' << margin;
          }
        }
      }
  objects.fat_margin = 0.5f;
  const Box all = {{-inf, -inf, -inf}, {inf, inf, inf}};
  EXPECT_TRUE(ObjectView::inside(objects.inner_box(objects.fat_box(all)), all));
}

// Boxes move in steps of an eighth around positions on multiples of a quarter, so that faces touch
// often.
class JitteredGrid {
 public:
  JitteredGrid(const Options& options, std::uint64_t seed, float fat_margin, int side)
      : emulated_(options, fat_margin), model_(options.margin), random_(seed) {
    for (int x = 0; x < side; ++x)
      for (int y = 0; y < side; ++y)
        for (int z = 0; z < side; ++z) {
          const auto about = [&](int k) {
            return static_cast<float>(k) + 0.25f * static_cast<float>(random_.below(3));
          };
          rest_.push_back({about(x), about(y), about(z)});
          boxes_.push_back(cube(rest_.back(), width));
        }
    EXPECT_TRUE(emulated_.add(boxes_, nullptr).ok());
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      EXPECT_TRUE(model_.add(static_cast<ObjectId>(i), boxes_[i], {}));
    update();
  }

  // Moves about one box in `one_in`, by up to `steps` eighths from its rest position.
  void jitter(unsigned one_in, int steps) {
    for (ObjectId id = 0; id < boxes_.size(); ++id) {
      if (!random_.one_in(one_in)) continue;
      const auto by = [&] { return 0.125f * static_cast<float>(random_.between(-steps, steps)); };
      const Vec3 rest = rest_[id];
      set(id, cube({rest.x + by(), rest.y + by(), rest.z + by()}, width));
    }
  }
  void set(ObjectId id, const Box& box) {
    if (!model_.alive(id)) return;
    boxes_[id] = box;
    model_.at(id).box = box;
  }
  ObjectId some() { return random_.below(static_cast<std::uint32_t>(boxes_.size())); }
  void remove(ObjectId id) {
    if (!model_.alive(id)) return;
    ASSERT_TRUE(emulated_.remove(&id, 1).ok());
    model_.remove(id);
  }
  void filter(ObjectId id) {
    if (!model_.alive(id)) return;
    std::vector<Filter> f(1);
    f[0].is_static = true;
    model_.at(id).filter = f[0];
    ASSERT_TRUE(emulated_.set_filters(&id, 1, view_of(f)).ok());
  }
  // Passes all boxes to one call or the other.
  void pass_boxes() {
    emulated_.combine_with_update(random_.one_in(2));
    if (!random_.one_in(4)) {
      ASSERT_TRUE(emulated_.move_all(boxes_).ok());
      return;
    }
    const std::vector<ObjectId> ids = model_.ids();
    BoxList list;
    for (const ObjectId id : ids) list.push_back(boxes_[id]);
    ASSERT_TRUE(emulated_.move(ids.data(), list).ok());
  }
  void update() {
    const Result r = emulated_.update();
    EXPECT_TRUE(r.ok());
    model_.update();
    EXPECT_TRUE(model_.check(emulated_)) << r.plan.reason;
    update_counts.count(r.plan.reason);
    const std::uint64_t all = emulated_.candidate_count();
    if (std::string(r.plan.reason).find("compared again") != std::string::npos)
      fewer += r.comparisons > all / 4 && r.comparisons < all * 9 / 10;
  }

  UpdateCounts update_counts;
  std::size_t fewer = 0;  // updates that compared only some candidates, though most objects moved

 private:
  static constexpr float width = 1.625f;
  EmulatedBroadPhase emulated_;
  Model model_;
  Random random_;
  std::vector<Vec3> rest_;
  BoxList boxes_;
};

TEST(UncertainCandidates, NothingIsMissed) {
  const float nan = std::nanf("");
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) {
    Options options;
    options.nan = NanPolicy::inactive;
    options.algorithm = seed % 2 ? Algorithm::grid : Algorithm::automatic;
    options.margin = seed % 3 == 1 ? 0.125f : 0.0f;
    JitteredGrid scene(options, seed, 0.125f, 6);
    for (int step = 0; step < 160; ++step) {
      if (step % 40 == 0)
        scene.jitter(1, 0);  // rest position: fat boxes are made around it
      else
        scene.jitter(step % 5 ? 1 : 20, step % 40 < 36 ? 1 : 3);
      if (step % 40 == 12) scene.set(scene.some(), {{0, 0, 0}, {1, nan, 1}});
      if (step % 40 == 13) scene.set(scene.some(), {{1, 1, 1}, {-1, -1, -1}});
      if (step % 40 == 24) scene.set(scene.some(), {{2, 2, 2}, {2.125f, 2.125f, 2.125f}});
      scene.pass_boxes();
      if (step % 40 == 30) scene.remove(scene.some());
      if (step % 80 == 38) scene.filter(scene.some());
      scene.update();
      ASSERT_FALSE(testing::Test::HasFailure()) << "step " << step << " seed " << seed;
    }
    EXPECT_GT(scene.fewer, 60u) << seed;
    EXPECT_GT(scene.update_counts.found + scene.update_counts.repaired, 10u) << seed;
  }
}

// A box that shrinks within its fat box, or is inactive for a while, and others that move
// meanwhile.
TEST(UncertainCandidates, ShrunkOrInactiveBoxesAreUncertain) {
  for (const int how : {0, 1, 2}) {
    EmulatedBroadPhase m({}, 0.25f);
    BoxList boxes = {cube(0, 0, 0, 4), cube(2, 0, 0, 4), cube(50, 0, 0, 1), cube(50.5f, 0, 0, 1)};
    Model model;
    ASSERT_TRUE(m.add(boxes, nullptr).ok());
    for (ObjectId id = 0; id < 4; ++id) ASSERT_TRUE(model.add(id, boxes[id], {}));
    const auto update = [&](std::size_t begun, std::size_t ended) {
      for (ObjectId id = 0; id < 4; ++id) model.at(id).box = boxes[id];
      ASSERT_TRUE(m.move_all(boxes).ok());
      ASSERT_TRUE(m.update().ok());
      model.update();
      ASSERT_TRUE(model.check(m)) << how << ' ' << m.last_reason();
      EXPECT_EQ(m.begun().size(), begun) << how;
      EXPECT_EQ(m.ended().size(), ended) << how;
    };
    const auto move_the_other = [&] {
      for (int k = 0; k < 4; ++k) {
        boxes[1].lower.y = k % 2 ? 0.0f : 0.125f;
        update(0, 0);
      }
    };
    update(2, 0);
    move_the_other();
    const Box before = boxes[0];
    if (how == 0) boxes[0].upper.x = 1;
    if (how == 1) boxes[0] = {{1, 1, 1}, {0, 0, 0}};
    if (how == 2) boxes[0].lower = {3.75f, 0, 0};  // still a pair
    update(0, how == 2 ? 0 : 1);
    move_the_other();
    if (how == 2) {
      boxes[1].upper.x = 3.5f;  // it shrinks away from the rest of the other
      update(0, 1);
      boxes[1].upper.x = 6;
    }
    boxes[0] = before;
    update(1, 0);
    move_the_other();
  }
}

}  // namespace
}  // namespace throng::tests
