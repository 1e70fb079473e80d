// Long random call sequences; all results must equal those of the model.
#include <gtest/gtest.h>

#include <cstdlib>

#include "broad_phase/actor.hpp"
#include "broad_phase/many_movers.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/configs.hpp"

namespace throng::tests {
namespace {

// Few objects move for a while, then many, then few: both kinds of update and the transitions.
void run_calls(Options options, std::uint64_t seed, std::size_t objects, float side, bool filtered,
               std::size_t steps, bool thin = false) {
  options.threads = 1;  // SameEverywhere uses several
  Actor actor(options, seed, side);
  actor.thin = thin;
  Random& random = actor.random;
  ASSERT_TRUE(actor.add(objects, filtered));
  ASSERT_TRUE(actor.update());
  bool searched = false, found = false;
  for (std::size_t step = 0; step < steps; ++step) {
    const bool calm = step / 24 % 3 != 2;
    ASSERT_TRUE(actor.some_calls(calm, objects, filtered, true));
    const Result r = BroadPhase(actor.broad_phase).update();
    searched = searched || was_incremental(r);
    found = found || std::string(r.plan.reason).find("changed") == std::string::npos;
    ASSERT_TRUE(actor.update(random.one_in(3))) << "step " << step << " seed " << seed;
  }
  EXPECT_TRUE(searched) << "no update was incremental";
  EXPECT_TRUE(found) << "no update was a full search";
}

TEST(BroadPhaseRandom, Plain) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < seeds(8); ++seed) run_calls({}, seed, 300, 12, false, 150);
}
TEST(BroadPhaseRandom, Filtered) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < seeds(8); ++seed) run_calls({}, seed, 250, 8, true, 150);
}
TEST(BroadPhaseRandom, Margin) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  Options options;
  options.margin = 0.1f;
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed)
    run_calls(options, seed, 200, 8, seed % 2, 100);
}
TEST(BroadPhaseRandom, RodsAndPlates) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < seeds(8); ++seed)
    run_calls({}, seed, 300, 30, seed % 2, 150, true);
}
// First cubes, then rods, then cubes: cells are built for each.
TEST(BroadPhaseRandom, RodsComeAndGo) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed) {
    Options one;
    one.threads = 1;
    Actor actor(one, seed, 20);
    for (int phase = 0; phase < 6; ++phase) {
      actor.thin = phase % 2 == 1;
      ASSERT_TRUE(actor.remove(200));
      ASSERT_TRUE(actor.add(200, seed % 2));
      for (int step = 0; step < 12; ++step) {
        ASSERT_TRUE(actor.move(3));
        ASSERT_TRUE(actor.update(step % 4 == 0)) << "seed " << seed << " phase " << phase;
      }
    }
  }
}
// A rod grows in place; then another moves to touch only its new end, in a copy.
TEST(BroadPhaseRandom, RodsThatGrowAreStillFound) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  Random random(5);
  Options one;
  one.threads = 1;
  Options canonical = one;
  canonical.order = Order::canonical;
  canonical.inverted = InvertedPolicy::inactive;
  const auto rod = [](const Vec3& at, float length) {
    return Box{at, {at.x + length, at.y + 0.5f, at.z + 0.5f}};
  };
  for (int trial = 0; trial < 200; ++trial) {
    BoxList boxes;
    for (int i = 0; i < 300; ++i) boxes.push_back(rod(random.point(0, 60), 8));
    BroadPhase grown(one);
    ASSERT_TRUE(grown.add(boxes, nullptr).ok());
    ASSERT_TRUE(grown.update().ok());
    const auto put = [&](BroadPhase& b, ObjectId id, const Box& box) {
      boxes[id] = box;
      EXPECT_EQ(b.move(id, box), Status::ok);
      const bool searched = was_incremental(b.update());
      EXPECT_EQ(plain(b.pairs()), find_pairs(boxes, canonical)) << "trial " << trial;
      return searched;
    };
    // Repeat until cells pay off and are built.
    for (int k = 0; k < 50 && !put(grown, 2, rod(random.point(0, 60), 8)); ++k) continue;
    EXPECT_TRUE(put(grown, 0, rod(boxes[0].lower, 8.5f)));
    BroadPhase copy(grown);
    const Vec3 at = boxes[0].lower;
    EXPECT_TRUE(put(copy, 1, rod({at.x + 8.25f, at.y, at.z}, 8)));
  }
}
TEST(BroadPhaseRandom, FewObjects) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Options one;
    one.threads = 1;
    Actor actor(one, seed, 2);
    for (int step = 0; step < 60; ++step) {
      switch (actor.random.below(4)) {
        case 0:
          if (actor.model.count() < 9) {
            ASSERT_TRUE(actor.add(actor.random.below(3), seed % 2));
          }
          break;
        case 1:
          ASSERT_TRUE(actor.remove(actor.random.below(3)));
          break;
        default:
          ASSERT_TRUE(actor.move(actor.random.below(4)));
          break;
      }
      if (actor.random.one_in(2)) {
        ASSERT_TRUE(actor.update());
      }
    }
  }
}

using Lists = std::vector<std::vector<LivePair>>;
testing::AssertionResult same_lists(const Lists& a, const Lists& b) {
  const auto same = [](const LivePair& x, const LivePair& y) {
    return x.first == y.first && x.second == y.second && x.slot == y.slot;
  };
  if (a.size() != b.size()) return testing::AssertionFailure() << a.size() << " and " << b.size();
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (!std::equal(a[k].begin(), a[k].end(), b[k].begin(), b[k].end(), same))
      return testing::AssertionFailure() << "list " << k << " differs";
  }
  return testing::AssertionSuccess();
}

// The same calls give the same bytes, including slots, for every thread count and instruction set.
TEST(BroadPhaseRandom, SameEverywhere) {
  Lists first;
  for (const Isa isa : supported_isas()) {
    for (const unsigned threads : {1u, 2u, 5u}) {
      Options options;
      options.isa = isa;
      options.threads = threads;
      BroadPhase b(options);
      Random random(7);
      BoxList boxes = uniform_boxes(12000, 7);
      ASSERT_TRUE(b.add(boxes, nullptr).ok());
      Lists results;
      for (int step = 0; step < 12; ++step) {
        for (Box& box : boxes)
          if (step < 4 || random.one_in(300)) box = cube(random.point(0, 29), 1);
        ASSERT_TRUE(b.move_all(boxes).ok());
        ASSERT_TRUE(b.update().ok());
        for (const LivePairs& p : {b.begun(), b.ended(), b.pairs()})
          results.emplace_back(p.begin(), p.end());
      }
      if (first.empty()) first = results;
      EXPECT_TRUE(same_lists(first, results)) << to_string(isa) << ", " << threads << " threads";
    }
  }
}

TEST(BroadPhaseRandom, ParallelIncrementalUpdates) {
  Lists first;
  for (const unsigned threads : {1u, 2u, 3u}) {
    Options options;
    options.threads = threads;
    BroadPhase b(options);
    ManyMovers movers;
    ASSERT_TRUE(b.add(movers.boxes, nullptr).ok());
    Lists results;
    int shared = 0;
    for (int step = 0; step < 60; ++step) {
      movers.move();
      ASSERT_TRUE(b.move(movers.ids.data(), movers.moved).ok());
      const Result r = b.update();
      ASSERT_TRUE(r.ok()) << r.message;
      shared += was_incremental(r) && r.plan.threads == threads;
      for (const LivePairs& p : {b.begun(), b.ended()}) results.emplace_back(p.begin(), p.end());
    }
    EXPECT_GT(shared, 10) << "incremental updates on " << threads << " threads";
    const LivePairs pairs = b.pairs();
    results.emplace_back(pairs.begin(), pairs.end());
    EXPECT_EQ(plain(pairs), movers.pairs());
    if (first.empty()) first = results;
    EXPECT_TRUE(same_lists(first, results)) << threads << " threads";
  }
}

// THRONG_SOAK: number of random operations, a million for a night; some thousands by default.
TEST(BroadPhaseRandom, Soak) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  const char* wanted = std::getenv("THRONG_SOAK");
  const std::size_t operations = wanted ? std::strtoull(wanted, nullptr, 10) : 4000;
  for (std::size_t done = 0, seed = 100; done < operations; ++seed) {
    Options one;
    one.threads = 1;
    Actor actor(one, seed, static_cast<float>(4 + seed % 9));
    for (int k = 0; k < 1000; ++k, ++done) {
      const std::size_t some = 1 + actor.random.below(actor.random.one_in(30) ? 60 : 3);
      switch (actor.random.below(9)) {
        case 0:
        case 1:
          if (actor.model.count() < 120) {
            ASSERT_TRUE(actor.add(some, seed % 2));
          }
          break;
        case 2:
          ASSERT_TRUE(actor.remove(some));
          break;
        case 3:
          ASSERT_TRUE(actor.set_filters(seed % 2 ? some : 0));
          break;
        case 4:
          ASSERT_TRUE(actor.move_all(20));
          break;
        case 5:
        case 6:
          ASSERT_TRUE(actor.move(some));
          break;
        default:
          ASSERT_TRUE(actor.update(actor.random.one_in(2))) << "seed " << seed << " at " << k;
      }
    }
  }
}

}  // namespace
}  // namespace throng::tests
