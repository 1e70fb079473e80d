// Queries with an exact test per object, by a BroadPhase and a BroadPhaseQuery.
#include <gtest/gtest.h>

#include <limits>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"

namespace throng::tests {
namespace {

// Some are hit later than their boxes, some never, one earlier, which is ignored.
double some_later(void*, std::uint32_t sweep, ObjectId object, double time) {
  switch ((sweep * 7 + object * 5) % 8) {
    case 0:
      return std::numeric_limits<double>::quiet_NaN();
    case 1:
      return 2;
    case 2:
      return time - 1;
    case 3:
      return time + 0.25;
    case 4:
      return 1;
    case 5:
      return 0.5;  // several at the same time, earlier than some boxes
    default:
      return time;
  }
}

TEST(BroadPhaseConcurrentQueries, ExactTestPerObject) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) {
    Options options;
    options.threads = seed % 2 ? 1 : 3;
    Actor actor(options, seed, 14);
    const bool filtered = seed % 3 == 2;
    ASSERT_TRUE(actor.add(700, filtered));
    BroadPhaseQuery query(options);
    QueryClient client{actor.broad_phase, query};
    const SweepTest test{some_later, nullptr};
    for (int step = 0; step < 8; ++step) {
      ASSERT_TRUE(actor.move(step % 2 ? 700 : 9));
      if (step % 3 != 2) {
        ASSERT_TRUE(actor.update());
      }
      const RandomQueries q(actor, step % 4 == 0 ? 100 : 2, filtered);
      ASSERT_TRUE(same_answers(actor.broad_phase, actor.model, q, test)) << "step " << step;
      ASSERT_TRUE(same_answers(client, actor.model, q, test)) << "step " << step;
    }
  }
}

// A ray through a thousand boxes in a row whose first is a hit tests few of them. A ray without a
// hit tests each once, except those at the ends of its pieces.
TEST(BroadPhaseConcurrentQueries, IrrelevantObjectsAreNotTested) {
  BroadPhase b;
  BoxList row;
  for (int k = 0; k < 1000; ++k) row.push_back(cube(static_cast<float>(2 * k), 0, 0, 1.9f));
  ASSERT_TRUE(b.add(row, nullptr).ok());
  BoxList others;  // for which cells are built
  Random random(3);
  for (int k = 0; k < 30000; ++k) {
    const Vec3 at = random.point(0, 1);
    others.push_back(cube(2000 * at.x, 10 + 90 * at.y, 90 * at.z, 1));
  }
  ASSERT_TRUE(b.add(others, nullptr).ok());
  BoxList planks;  // across many pieces of the ray
  for (int k = 0; k < 40; ++k) {
    const auto y = static_cast<float>(10 + k);
    planks.push_back({{1000, y, -10}, {1001, y + 40, -9}});
  }
  ASSERT_TRUE(b.add(planks, nullptr).ok());
  ASSERT_TRUE(b.update().ok());  // makes columns
  const Sweep ray{{{-1, 0.5f, 0.5f}, {-1, 0.5f, 0.5f}}, {2000, 0, 0}};
  const Sweep along{{{1000.5f, 0, -9.5f}, {1000.5f, 0, -9.5f}}, {0, 100, 0}};
  BroadPhaseQuery query;
  for (int round = 0; round < 200; ++round) {  // before cells are built, and after
    std::atomic<std::size_t> count{0};
    const auto test = [&](double (*when)(void*, std::uint32_t, ObjectId, double)) {
      count = 0;
      const SweepTest t{when, &count};
      ASSERT_TRUE(query.find_hits(b, &ray, 1, SweepHits::first, {}, t).ok());
    };
    test([](void* context, std::uint32_t, ObjectId, double time) {
      ++*static_cast<std::atomic<std::size_t>*>(context);
      return time;
    });
    ASSERT_EQ(query.hits().size(), 1u);
    EXPECT_EQ(query.hits()[0].object, 0u);
    EXPECT_LE(count, 200u);
    test([](void* context, std::uint32_t, ObjectId, double) {
      ++*static_cast<std::atomic<std::size_t>*>(context);
      return 2.0;
    });
    EXPECT_TRUE(query.hits().empty());
    EXPECT_GE(count, 1000u);
    EXPECT_LE(count, 1020u);
    count = 0;
    const SweepTest t{[](void* context, std::uint32_t, ObjectId, double time) {
                        ++*static_cast<std::atomic<std::size_t>*>(context);
                        return time;
                      },
                      &count};
    ASSERT_TRUE(query.find_hits(b, &along, 1, SweepHits::all, {}, t).ok());
    EXPECT_EQ(query.hits().size(), 40u);
    EXPECT_LE(count, 50u);
  }
}

}  // namespace
}  // namespace throng::tests
