// What shift_origin() moves and refuses, and what a copy keeps.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/guarded_resource.hpp"

namespace throng::tests {
namespace {

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

// Unused ids stay unused: even if the shift collapses all boxes to one place, they are not reported
// then, nor when the ids are reused.
TEST(BroadPhaseShift, UnusedIdsStayUnused) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Actor actor({}, seed, 6);
    ASSERT_TRUE(actor.add(4 + actor.random.below(60), seed % 2));
    ASSERT_TRUE(actor.update());
    for (int step = 0; step < 6; ++step) {
      ASSERT_TRUE(actor.remove(1 + actor.random.below(4)));
      if (actor.random.one_in(2)) {
        ASSERT_TRUE(actor.update());
      }
      Vec3 by = actor.random.point(-9, 9);
      if (step % 2) (&by.x)[actor.random.below(3)] = actor.random.one_in(2) ? 1e12f : -1e12f;
      for (const ObjectId id : actor.model.ids()) {
        Box& b = actor.model.at(id).box;
        b = shifted_box(b, by);
      }
      ASSERT_TRUE(actor.model.check_call(actor.broad_phase.shift_origin(by)));
      ASSERT_TRUE(actor.update()) << "seed " << seed << " step " << step;
      for (const ObjectId id : actor.model.ids()) {
        const Box got = actor.broad_phase.box(id), want = actor.model.at(id).box;
        EXPECT_TRUE(std::memcmp(&got, &want, sizeof got) == 0) << id;
      }
      ASSERT_TRUE(actor.add(actor.random.below(3), seed % 2));
      ASSERT_TRUE(actor.update());
    }
  }
}

// Each coordinate, each non-finite value; nothing changes.
TEST(BroadPhaseShift, NonFiniteIsRefused) {
  Actor actor({}, 3, 6);
  ASSERT_TRUE(actor.add(50, true));
  ASSERT_TRUE(actor.update());
  const Snapshot before(actor.broad_phase);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float bad : {nan_value, infinity, -infinity}) {
      Vec3 by = {0, 1, 2};
      (&by.x)[axis] = bad;
      const Result r = actor.broad_phase.shift_origin(by);
      EXPECT_EQ(r.status, Status::bad_option) << axis << ' ' << bad;
      EXPECT_NE(std::string(r.message).find("finite"), std::string::npos) << r.message;
      EXPECT_EQ(r.found, 0u);
      EXPECT_EQ(Snapshot(actor.broad_phase), before) << axis << ' ' << bad;
    }
  }
  EXPECT_TRUE(actor.broad_phase.shift_origin({float_max, -float_max, 0}).ok());
}

// Objects with a margin, copied in every way: the pairs respect the margin. A new object copies all
// options; an existing one keeps its own except for the margin.
TEST(BroadPhaseCopy, KeepsOptions) {
  const BoxList apart = {cube(0, 0, 0, 1), cube(1.5f, 0, 0, 1), cube(9, 0, 0, 1)};
  for (const float margin : {0.0f, 0.5f, 20.0f}) {
    std::atomic<bool> stop{false};
    Options options;
    options.margin = margin;
    options.nan = NanPolicy::inactive;
    options.threads = 2;
    options.measure_stages = false;
    options.stop = &stop;
    BroadPhase from(options);
    ASSERT_TRUE(from.add(apart, nullptr).ok());
    ASSERT_TRUE(from.update().ok());
    const std::size_t pairs = margin == 0 ? 0 : margin == 0.5f ? 1 : 3;
    ASSERT_EQ(from.pair_count(), pairs);

    const auto still_works = [&](BroadPhase& b) {
      EXPECT_EQ(b.options().margin, margin);
      EXPECT_EQ(Snapshot(b), Snapshot(from));
      ASSERT_TRUE(b.shift_origin({64, 0, 0}).ok());  // a full search
      ASSERT_TRUE(b.update().ok());
      EXPECT_EQ(b.pair_count(), pairs);
    };
    BroadPhase constructed(from);
    EXPECT_EQ(constructed.options().nan, NanPolicy::inactive);
    EXPECT_EQ(constructed.options().threads, 2u);
    EXPECT_EQ(constructed.options().measure_stages, false);
    EXPECT_EQ(constructed.options().stop, &stop);
    still_works(constructed);

    Options others;
    others.margin = 7;
    others.threads = 1;
    others.isa = Isa::scalar;
    GuardedResource memory;
    others.memory = &memory;
    BroadPhase assigned(others), copied(others), of_nothing(others);
    for (BroadPhase* b : {&assigned, &copied, &of_nothing}) {
      ASSERT_TRUE(b->add(apart, nullptr).ok());
      ASSERT_TRUE(b->update().ok());
      EXPECT_EQ(b->pair_count(), 3u);
    }
    assigned = from;
    const Result r = copied.copy_from(from);
    ASSERT_TRUE(r.ok());
    EXPECT_EQ(r.found, 3u);
    for (BroadPhase* b : {&assigned, &copied}) {
      EXPECT_EQ(b->options().threads, 1u);
      EXPECT_EQ(b->options().isa, Isa::scalar);
      EXPECT_EQ(b->options().nan, NanPolicy::refuse);
      EXPECT_EQ(b->options().memory, &memory);
      still_works(*b);
      const Box bad = {{0, 0, nan_value}, {1, 1, 1}};
      EXPECT_EQ(b->move(0, bad), Status::nan_box);
    }
    // A BroadPhase without objects has options, too.
    const BroadPhase empty(options);
    ASSERT_TRUE(of_nothing.copy_from(empty).ok());
    EXPECT_EQ(of_nothing.options().margin, margin);
    EXPECT_EQ(of_nothing.object_count(), 0u);
    ASSERT_TRUE(of_nothing.add(apart, nullptr).ok());
    ASSERT_TRUE(of_nothing.update().ok());
    EXPECT_EQ(of_nothing.pair_count(), pairs);
  }
}

}  // namespace
}  // namespace throng::tests
