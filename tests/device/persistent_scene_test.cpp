// Persistent objects on a device, emulated on the host: long random call sequences against the
// model, and byte for byte against throng::BroadPhase.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "device/device_actor.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// A few objects move a little for a while, then many move far: fat boxes hold at first, then do
// not.
void run_calls(const Options& options, float fat_margin, std::uint64_t seed, std::size_t objects,
               float side, bool filtered, std::size_t steps,
               UpdateCounts* update_counts = nullptr) {
  DeviceActor actor(options, seed, side, fat_margin);
  actor.in_worlds = options.algorithm != Algorithm::grid;
  Random& random = actor.random;
  ASSERT_TRUE(actor.add(objects, filtered));
  ASSERT_TRUE(actor.update());
  for (std::size_t step = 0; step < steps; ++step) {
    const bool calm = step / 24 % 3 != 2;
    ASSERT_TRUE(actor.some_calls(calm, objects, filtered, false));
    // No call may come between boxes that are held back and their update.
    actor.broad_phase.combine_with_update(random.one_in(2));
    if (random.one_in(2)) {
      ASSERT_TRUE(actor.move_all(calm ? 300 : 2));
    }
    ASSERT_TRUE(actor.update(random.one_in(2))) << "step " << step << " seed " << seed;
    if (update_counts) update_counts->count(actor.broad_phase.last_reason());
  }
}

TEST(PersistentScene, Plain) {
  for (std::uint64_t seed = 0; seed < 3; ++seed)
    run_calls({}, seed % 2 ? 0.0f : 1.0f, seed, 250, 12, false, 100);
}
TEST(PersistentScene, Filtered) {
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed)
    run_calls({}, seed % 2 ? 0.0f : 1.0f, seed, 200, 8, true, 100);
}
// In a grid without worlds, candidates of a few objects that leave their fat boxes are repaired.
TEST(PersistentScene, Grid) {
  UpdateCounts update_counts;
  constexpr std::uint64_t lives = seeds(6);
  for (std::uint64_t seed = 0; seed < lives; ++seed) {
    Options options;
    options.algorithm = Algorithm::grid;
    options.margin = seed % 3 == 2 ? 0.1f : 0.0f;
    run_calls(options, 0.7f, seed, 250, 8, seed % 2, 120, &update_counts);
  }
  EXPECT_GT(update_counts.compared, 17 * lives);
  EXPECT_GT(update_counts.repaired, 17 * lives);
  EXPECT_GT(update_counts.found, 17 * lives);
}

// ---- against throng::BroadPhase -----------------------------------------------------------------

// Runs both; a call fails if the results differ.
class HostAndDevice {
 public:
  HostAndDevice(const Options& options, float fat_margin)
      : device_(options, fat_margin), host_(options) {}

  Result add(const Boxes& boxes, ObjectId* ids) {
    std::vector<ObjectId> other(boxes.size());
    const Result r = both([&](auto& b) {
      using Implementation = std::decay_t<decltype(b)>;
      return b.add(boxes, std::is_same_v<Implementation, BroadPhase> ? other.data() : ids);
    });
    EXPECT_TRUE(std::equal(other.begin(), other.end(), ids)) << "other ids";
    return r;
  }
  Result remove(const ObjectId* ids, std::size_t n) {
    return both([&](auto& b) { return b.remove(ids, n); });
  }
  Result move(const ObjectId* ids, const Boxes& boxes) {
    return both([&](auto& b) { return b.move(ids, boxes); });
  }
  Result move_all(const Boxes& boxes) {
    return both([&](auto& b) { return b.move_all(boxes); });
  }
  Result set_filters(const ObjectId* ids, std::size_t n, const Filters& filters) {
    return both([&](auto& b) { return b.set_filters(ids, n, filters); });
  }
  Result shift_origin(const Vec3& by) {
    return both([&](auto& b) { return b.shift_origin(by); });
  }
  Result update() {
    const Result r = both([&](auto& b) { return b.update(); });
    EXPECT_TRUE(same_bytes(device_.begun(), host_.begun()));
    EXPECT_TRUE(same_bytes(device_.ended(), host_.ended()));
    EXPECT_TRUE(same_bytes(device_.pairs(), host_.pairs()));
    EXPECT_EQ(device_.slot_limit(), host_.slot_limit());
    return r;
  }
  LivePairs begun() const { return device_.begun(); }
  LivePairs ended() const { return device_.ended(); }
  LivePairs pairs() { return device_.pairs(); }
  std::uint64_t object_count() const { return device_.object_count(); }
  std::uint64_t id_limit() const { return device_.id_limit(); }
  std::uint64_t pair_count() const { return device_.pair_count(); }
  std::uint64_t slot_limit() const { return device_.slot_limit(); }

 private:
  template <class F>
  Result both(const F& f) {
    const Result want = f(host_), got = f(device_);
    EXPECT_EQ(want.status, got.status);
    EXPECT_EQ(want.found, got.found);
    EXPECT_EQ(want.first_invalid, got.first_invalid);
    EXPECT_EQ(want.invalid_count, got.invalid_count);
    return got;
  }
  EmulatedBroadPhase device_;
  BroadPhase host_;
};

TEST(PersistentScene, SameBytesAsTheBroadPhase) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Options options;
    options.threads = 1;
    options.margin = seed == 3 ? 0.05f : 0.0f;
    options.algorithm = seed < 2 ? Algorithm::grid : Algorithm::automatic;
    ActorOf<HostAndDevice> actor(options, seed, 9, 0.6f);
    actor.in_worlds = seed >= 2;
    Random& random = actor.random;
    ASSERT_TRUE(actor.add(200, seed % 2));
    for (int step = 0; step < 60; ++step) {
      ASSERT_TRUE(actor.move(1 + random.below(step % 3 ? 5 : 200)));
      if (step % 5 == 0) {
        ASSERT_TRUE(actor.add(random.below(20), seed % 2));
      }
      if (step % 7 == 0) {
        ASSERT_TRUE(actor.remove(random.below(30)));
      }
      if (seed % 2 && step % 6 == 0) {
        ASSERT_TRUE(actor.set_filters(5));
      }
      if (step % 9 == 0) {
        ASSERT_TRUE(actor.move_all(4));
      }
      if (step == 40) {
        const Vec3 by = {1000.3f, -7, 0.1f};
        ASSERT_TRUE(actor.broad_phase.shift_origin(by).ok());
        for (ObjectId id : actor.model.ids()) {
          Box& b = actor.model.at(id).box;
          b.lower = {b.lower.x + by.x, b.lower.y + by.y, b.lower.z + by.z};
          b.upper = {b.upper.x + by.x, b.upper.y + by.y, b.upper.z + by.z};
        }
      }
      ASSERT_TRUE(actor.update()) << "step " << step << " seed " << seed;
      ASSERT_FALSE(testing::Test::HasFailure()) << "step " << step << " seed " << seed;
    }
  }
}

// ---- what is refused ----------------------------------------------------------------------------

TEST(PersistentScene, WhatIsRefusedChangesNothing) {
  DeviceActor actor({}, 1, 6, 0.5f);
  EmulatedBroadPhase& m = actor.broad_phase;
  ASSERT_TRUE(actor.add(300, true));
  ASSERT_TRUE(actor.remove(5));
  ASSERT_TRUE(actor.update());
  const VisibleState before(m);
  const auto refused = [&](const Result& r, Status status, std::uint64_t first,
                           std::uint64_t count) {
    EXPECT_EQ(r.status, status) << to_string(r.status);
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_EQ(r.invalid_count, count);
    EXPECT_TRUE(VisibleState(m) == before);
  };
  const std::vector<ObjectId> alive = actor.model.ids();
  ObjectId dead = 0;
  while (actor.model.alive(dead)) ++dead;
  const float nan = std::nanf("");
  BoxList boxes(6, cube(0, 0, 0, 1));
  const std::vector<ObjectId> twice = {alive[0], alive[1], alive[2], alive[1], alive[1], alive[3]};
  refused(m.move(twice.data(), boxes), Status::bad_id, 3, 2);
  const std::vector<ObjectId> gone = {alive[0], alive[1], dead, 300, 0xffffffffu, alive[3]};
  refused(m.remove(gone.data(), gone.size()), Status::bad_id, 2, 3);
  boxes[4].upper.y = nan;
  boxes[5].lower.z = nan;
  refused(m.move(alive.data(), boxes), Status::nan_box, 4, 2);
  refused(m.add(boxes, nullptr), Status::nan_box, 4, 2);
  const std::vector<std::int32_t> worlds = {0, 1, -1, -2, 5, -3};
  Filters filters;
  filters.world = {worlds.data(), worlds.size()};
  refused(m.set_filters(alive.data(), 6, filters), Status::bad_filter, 3, 2);
  Boxes in_worlds(boxes.data(), 6);
  in_worlds.filters = filters;
  refused(m.add(in_worlds, nullptr), Status::bad_filter, 3, 2);
  std::vector<ObjectId> many(alive.size() + 1, alive[0]);
  refused(m.remove(many.data(), many.size()), Status::bad_id, 0, many.size());

  // Invalid boxes in move_all(), alone and with an update; ids that are not alive do not count.
  BoxList all(m.id_limit(), Box{{nan, 0, 0}, {1, 1, 1}});
  for (const ObjectId id : alive) all[id] = actor.moved(actor.model.at(id).box);
  all[alive[7]].lower.x = nan;
  for (const bool at_once : {false, true}) {
    m.combine_with_update(at_once);
    Result r = m.move_all(all);
    if (at_once) r = m.update();
    refused(r, Status::nan_box, alive[7], 1);
  }
  // None of it has been applied.
  m.combine_with_update(false);
  ASSERT_TRUE(actor.move(3));
  ASSERT_TRUE(actor.update());
  // If NaNs are allowed, such a box overlaps nothing.
  Options lax;
  lax.nan = NanPolicy::inactive;
  DeviceActor other(lax, 2, 5, 0.5f);
  ASSERT_TRUE(other.add(100, false));
  ASSERT_TRUE(other.update());
  for (int k = 0; k < 20; ++k) {
    const ObjectId id = other.some_ids(1)[0];
    Box& box = other.model.at(id).box;
    box = k % 2 ? other.any_box() : Box{{0, 0, 0}, {1, 1, nan}};
    ASSERT_TRUE(other.broad_phase.move(&id, Boxes(&box, 1)).ok());
    ASSERT_TRUE(other.update());
  }
}

}  // namespace
}  // namespace throng::tests
