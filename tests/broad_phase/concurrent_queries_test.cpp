// Concurrent queries by BroadPhaseQuery.
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/failing_resource.hpp"

namespace throng::tests {
namespace {

constexpr std::size_t client_count = 4;

// Calls run(k) for each query object, on threads that start together.
template <class Query>
void at_once(const Query& run) {
  std::atomic<std::size_t> ready{0};
  const auto begin = [&](std::size_t k) {
    ++ready;
    while (ready != client_count) std::this_thread::yield();
    run(k);
  };
  std::vector<std::thread> threads;
  for (std::size_t k = 1; k < client_count; ++k) threads.emplace_back(begin, k);
  begin(0);
  for (std::thread& thread : threads) thread.join();
}

// Covers moves before an update, cells built by one query while others run, columns after all
// objects moved, and none of these.
void query_concurrently(std::uint64_t seed, bool filtered, std::size_t objects,
                        std::size_t query_count) {
  Options options;
  options.threads = 1;
  Actor actor(options, seed, 14);
  actor.in_worlds = filtered;
  ASSERT_TRUE(actor.add(objects, filtered));
  BroadPhaseQuery queries[client_count];
  for (BroadPhaseQuery& query : queries) query = BroadPhaseQuery(options);
  for (int step = 0; step < 12; ++step) {
    if (step % 3 == 1) {
      ASSERT_TRUE(actor.move_all(40));
    } else if (step % 4 != 0) {
      ASSERT_TRUE(actor.move(step % 4 == 1 ? objects : 5));
    }
    if (step % 5 == 4) {
      ASSERT_TRUE(actor.remove(3));
      ASSERT_TRUE(actor.add(7, filtered));
    }
    if (step % 3 != 2) {
      ASSERT_TRUE(actor.update());
    }
    const Snapshot before(actor.broad_phase);
    std::vector<RandomQueries> batches;
    for (std::size_t k = 0; k < client_count; ++k)
      batches.emplace_back(actor, query_count, filtered);
    testing::AssertionResult results[client_count] = {
        testing::AssertionSuccess(), testing::AssertionSuccess(), testing::AssertionSuccess(),
        testing::AssertionSuccess()};
    at_once([&](std::size_t k) {
      QueryClient client{actor.broad_phase, queries[k]};
      for (int again = 0; again < 3 && results[k]; ++again)
        results[k] = same_answers(client, actor.model, batches[k]);
    });
    for (const testing::AssertionResult& t : results) ASSERT_TRUE(t) << "step " << step;
    ASSERT_EQ(Snapshot(actor.broad_phase), before);
  }
  ASSERT_TRUE(actor.update());
}
TEST(BroadPhaseConcurrentQueries, AtOnce) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) query_concurrently(seed, false, 600, 5);
}
TEST(BroadPhaseConcurrentQueries, AtOnceManyQueriesFewObjects) {
  query_concurrently(3, false, 200, 40);
}
TEST(BroadPhaseConcurrentQueries, AtOnceWithFilters) {
  for (std::uint64_t seed = 4; seed < 6; ++seed) query_concurrently(seed, true, 400, 5);
}

// Every thread runs all queries, from a different start, on objects without an index.
void query_unindexed_objects(const BoxList& boxes, const std::vector<Sweep>& sweeps) {
  BroadPhase original;
  ASSERT_TRUE(original.add(boxes, nullptr).ok());
  ASSERT_TRUE(original.find_hits(sweeps.data(), sweeps.size()).ok());
  const std::vector<SweepHit> want(original.hits().begin(), original.hits().end());
  ASSERT_GT(want.size(), 60u);
  for (int round = 0; round < 16; ++round) {
    BroadPhase b;
    ASSERT_TRUE(b.add(boxes, nullptr).ok());
    if (round % 2) {
      ASSERT_TRUE(b.update().ok());  // makes columns
    }
    std::atomic<std::size_t> wrong{0};
    at_once([&](std::size_t client) {
      Options options;
      options.threads = 1;
      BroadPhaseQuery query(options);
      for (std::size_t k = 0; k < sweeps.size(); ++k) {  // each starts at another one
        const std::size_t i = (15 * client + k) % sweeps.size();
        const Result r = query.find_hits(b, &sweeps[i], 1);
        const auto mine = std::find_if(want.begin(), want.end(),
                                       [&](const SweepHit& hit) { return hit.sweep >= i; });
        const auto end =
            std::find_if(mine, want.end(), [&](const SweepHit& hit) { return hit.sweep > i; });
        wrong += !r.ok() || !std::equal(query.hits().begin(), query.hits().end(), mine, end,
                                        [](const SweepHit& x, const SweepHit& y) {
                                          return x.object == y.object && x.time == y.time;
                                        });
      }
    });
    ASSERT_EQ(wrong, 0u) << "round " << round;
  }
}

// One query builds cells while others loop over all objects or use columns.
TEST(BroadPhaseConcurrentQueries, OneBuildsCellsDuringQueries) {
  Random random(7);
  BoxList boxes;
  for (int k = 0; k < 6000; ++k) boxes.push_back(cube(random.point(0, 40), random.in(0, 2)));
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 60; ++k) {
    const Vec3 at = random.point(0, 40);
    sweeps.push_back({{at, at}, random.point(-9, 9)});
  }
  query_unindexed_objects(boxes, sweeps);
}

// One query builds block data while others traverse the cells in between.
TEST(BroadPhaseConcurrentQueries, OneBuildsBlocksDuringQueries) {
  Random random(8);
  BoxList boxes;
  for (int k = 0; k < 30; ++k) {
    const Vec3 m = random.point(0, 5000);
    for (int i = 0; i < 100; ++i) {
      const Vec3 at = random.point(0, 9);
      boxes.push_back(cube({m.x + at.x, m.y + at.y, m.z + at.z}, 1));
    }
  }
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 60; ++k) {
    const Vec3 from = boxes[random.below(3000)].lower, to = boxes[random.below(3000)].lower;
    sweeps.push_back({{from, from}, {to.x - from.x, to.y - from.y, to.z - from.z}});
  }
  query_unindexed_objects(boxes, sweeps);
}

// Expected overlaps of some boxes and hits of some sweeps, by loops over all objects.
struct ExpectedByLoop {
  std::vector<std::vector<ObjectId>> overlaps, hits;

  ExpectedByLoop(const BoxList& all, const BoxList& boxes, const std::vector<Sweep>& sweeps) {
    const auto ids = [&](auto&& is_found) {
      std::vector<ObjectId> found;
      for (std::size_t id = 0; id < all.size(); ++id) {
        if (is_found(all[id])) found.push_back(static_cast<ObjectId>(id));
      }
      return found;
    };
    for (const Box& box : boxes) {
      const Item a = item_of(box, {});
      overlaps.push_back(ids([&](const Box& b) { return !disjoint(a, item_of(b, {})); }));
    }
    for (const Sweep& sweep : sweeps) {
      double time = 0;
      hits.push_back(ids([&](const Box& b) { return meets(sweep, b, time); }));
    }
  }
};

// Large queries cost so much in cells that one of them builds a forest while others still search
// the cells. Afterwards the same queries do little work, and later changes are placed correctly.
void query_while_index_changes(float margin, bool updated) {
  constexpr std::uint32_t heap = 10000, spread = 10000;
  Random random(12);
  BoxList all;
  for (std::uint32_t k = 0; k < heap; ++k) all.push_back(cube(random.point(0, 30), 1));
  for (std::uint32_t k = 0; k < spread; ++k) all.push_back(cube(random.point(0, 2000), 1));
  BoxList boxes;
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 40; ++k) {
    const bool small = k % 4 == 0;
    boxes.push_back(small ? cube(random.point(0, 30), 1) : cube(random.point(0, 1700), 300));
    const Vec3 at = random.point(0, 30);
    sweeps.push_back({{at, at}, random.point(-30, 30)});
  }
  Options options, of_query;
  options.margin = margin;
  options.threads = of_query.threads = 1;
  BroadPhase b(options);
  ASSERT_TRUE(b.add(all, nullptr).ok());
  if (updated) {
    ASSERT_TRUE(b.update().ok());
  }
  const auto looked = [](const Result& r) { return r.comparisons + r.visited; };
  const auto cost = [&](BroadPhaseQuery& query) {  // of a large query
    const Result r = query.find_overlaps(b, Boxes(&boxes[1], 1));
    EXPECT_TRUE(r.ok()) << r.message;
    return looked(r);
  };
  BroadPhaseQuery queries[client_count];
  for (BroadPhaseQuery& query : queries) query = BroadPhaseQuery(of_query);
  // Repeat the small query, which wastes nothing, until cells exist.
  for (int k = 0; k < 1000; ++k) {
    ASSERT_TRUE(queries[0].find_overlaps(b, Boxes(boxes.data(), 1)).ok());
  }
  const std::uint64_t in_cells = cost(queries[0]);
  ASSERT_GT(in_cells, heap + spread) << "cells were not used";

  const auto expect_found = [&] {
    const ExpectedByLoop want(all, boxes, sweeps);
    std::atomic<std::size_t> wrong{0};
    at_once([&](std::size_t k) {
      for (std::size_t n = 0; n < boxes.size(); ++n) {
        const std::size_t i = (n + 10 * k) % boxes.size();
        BroadPhaseQuery& query = queries[k];
        const bool ok = query.find_overlaps(b, Boxes(&boxes[i], 1)).ok();
        const Pairs overlaps = query.overlaps();
        wrong += !ok || !std::equal(overlaps.begin(), overlaps.end(), want.overlaps[i].begin(),
                                    want.overlaps[i].end(),
                                    [](const Pair& p, ObjectId id) { return p.second == id; });
        const bool met = query.find_hits(b, &sweeps[i], 1).ok();
        const SweepHitList hits = query.hits();
        wrong +=
            !met || !std::equal(hits.begin(), hits.end(), want.hits[i].begin(), want.hits[i].end(),
                                [](const SweepHit& h, ObjectId id) { return h.object == id; });
      }
    });
    EXPECT_EQ(wrong, 0u);
  };
  expect_found();
  EXPECT_LT(cost(queries[0]), in_cells / 50) << "the forest was not built";
  for (int round = 0; round < 3; ++round) {
    for (int k = 0; k < 40; ++k) {
      const ObjectId id = random.below(heap + spread);
      all[id] = cube(random.point(0, random.one_in(2) ? 30 : 2000), 1);
      ASSERT_EQ(b.move(id, all[id]), Status::ok);
    }
    expect_found();
  }
  EXPECT_LT(cost(queries[0]), in_cells / 50);
}
TEST(BroadPhaseConcurrentQueries, OneBuildsAForestDuringQueries) {
  query_while_index_changes(0, false);
}
TEST(BroadPhaseConcurrentQueries, OneBuildsAForestOfBoxesWithAMargin) {
  query_while_index_changes(0.25f, true);
}

// A scheduler may give a thread that waits for tasks another task, which also runs a query.
TEST(BroadPhaseConcurrentQueries, QueriesInTasksOfAWaitingThread) {
  struct Scheduler {
    const BroadPhase* b = nullptr;
    BroadPhaseQuery query;
    std::vector<Sweep> sweeps;
    std::size_t nested_queries = 0;
    static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
      auto& me = *static_cast<Scheduler*>(self);
      if (me.b) {
        const Result r = me.query.find_hits(*me.b, me.sweeps.data(), 1);
        EXPECT_TRUE(r.ok()) << r.message;
        ++me.nested_queries;
      }
      for (unsigned i = 0; i < count; ++i) task(context, i);
    }
  } scheduler;
  Random random(11);
  BoxList boxes;
  for (int k = 0; k < 25000; ++k) boxes.push_back(cube(random.point(0, 60), 1));
  for (int k = 0; k < 100; ++k) {
    const Vec3 at = random.point(0, 60);
    scheduler.sweeps.push_back({{at, at}, random.point(-9, 9)});
  }
  BroadPhase b;
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  scheduler.b = &b;
  const Executor executor{4, &Scheduler::run, &scheduler};
  Options options;
  options.threads = 4;
  options.executor = &executor;
  BroadPhaseQuery query(options);
  for (int k = 0; k < 3; ++k) {  // the first one builds cells
    ASSERT_TRUE(query.find_hits(b, scheduler.sweeps.data(), scheduler.sweeps.size()).ok());
  }
  EXPECT_EQ(scheduler.nested_queries, 3u);
  const std::size_t found = query.hits().size();
  ASSERT_TRUE(b.find_hits(scheduler.sweeps.data(), scheduler.sweeps.size()).ok());
  EXPECT_EQ(b.hits().size(), found);
}

// Calls from within a query, on its thread.
TEST(BroadPhaseConcurrentQueries, ChangesAreRefusedDuringQueries) {
  struct ReentrantCaller {
    BroadPhase b;
    BroadPhaseQuery query, other;
    const BoxList boxes = {cube(0, 0, 0, 1), cube(3, 0, 0, 1)};
    const Sweep ray{{{-1, 0, 0}, {-1, 0, 0}}, {2, 0, 0}};
    std::vector<Status> refused;
    std::vector<std::uint64_t> found;

    static double when(void* self, std::uint32_t, ObjectId, double time) {
      static_cast<ReentrantCaller*>(self)->call_reentrantly();
      return time;
    }
    void call_reentrantly() {
      refused = {b.update().status,
                 b.move(0, boxes[1]),
                 b.find_overlaps(boxes).status,
                 BroadPhase().copy_from(b).status,
                 query.find_overlaps(b, boxes).status,
                 query.find_hits(b, &ray, 1).status};
      const Result r = other.find_overlaps(b, boxes);
      EXPECT_TRUE(r.ok()) << r.message;
      found.push_back(r.found);
    }
  } m;
  ASSERT_TRUE(m.b.add(m.boxes, nullptr).ok());
  ASSERT_TRUE(m.b.update().ok());
  const SweepTest test{&ReentrantCaller::when, &m};
  ASSERT_TRUE(m.query.find_hits(m.b, &m.ray, 1, SweepHits::first, {}, test).ok());
  EXPECT_EQ(m.query.hits().size(), 1u);
  EXPECT_EQ(m.refused, std::vector<Status>(6, Status::busy));
  EXPECT_EQ(m.found, std::vector<std::uint64_t>{2});
  // During a query by the BroadPhase itself, other queries are refused.
  struct QueryingTest {
    ReentrantCaller& m;
    Result got;
    static double when(void* self, std::uint32_t, ObjectId, double time) {
      auto& me = *static_cast<QueryingTest*>(self);
      me.got = me.m.other.find_overlaps(me.m.b, me.m.boxes);
      return time;
    }
  } querying{m, {}};
  const SweepTest test_that_queries{&QueryingTest::when, &querying};
  ASSERT_TRUE(m.b.find_hits(&m.ray, 1, SweepHits::first, {}, test_that_queries).ok());
  EXPECT_EQ(querying.got.status, Status::busy);
  EXPECT_NE(std::string(querying.got.message).find("BroadPhase"), std::string::npos);
  EXPECT_TRUE(m.other.overlaps().size() == 2) << "earlier results were lost";
  // The state is unchanged.
  EXPECT_TRUE(m.b.update().ok());
  EXPECT_TRUE(m.other.find_overlaps(m.b, m.boxes).ok());
}

TEST(BroadPhaseConcurrentQueries, InvalidQueries) {
  BroadPhase b;
  const BoxList boxes = {cube(0, 0, 0, 1), cube(1, 0, 0, std::nanf(""))};
  BroadPhaseQuery query;
  EXPECT_TRUE(query.overlaps().empty() && query.hits().empty());
  EXPECT_EQ(query.memory_bytes(), 0u);
  const Sweep sweeps[2] = {{boxes[0], {1, 0, 0}}, {boxes[0], {0, infinity, 0}}};
  EXPECT_TRUE(query.find_overlaps(b, Boxes(boxes.data(), 1)).ok()) << "nothing was ever added";
  EXPECT_TRUE(query.find_hits(b, sweeps, 1).ok());
  EXPECT_TRUE(query.overlaps().empty() && query.hits().empty());
  ASSERT_TRUE(b.add(Boxes(boxes.data(), 1), nullptr).ok());
  EXPECT_TRUE(query.find_overlaps(b, Boxes(boxes.data(), 1)).ok());
  EXPECT_EQ(query.overlaps().size(), 1u);
  const Result r = query.find_overlaps(b, boxes);
  EXPECT_EQ(r.status, Status::nan_box);
  EXPECT_EQ(r.first_invalid, 1u);
  EXPECT_TRUE(query.overlaps().empty());
  EXPECT_TRUE(query.find_hits(b, sweeps, 1).ok());
  EXPECT_EQ(query.hits().size(), 1u);
  EXPECT_EQ(query.find_hits(b, sweeps, 2).status, Status::nan_box);
  EXPECT_TRUE(query.hits().empty());
  EXPECT_EQ(query.find_hits(b, nullptr, 2).status, Status::bad_boxes);
  EXPECT_EQ(query.find_hits(b, sweeps, 1, static_cast<SweepHits>(9)).status, Status::bad_option);
  Options options;
  options.backend = Backend::cuda;
  const Result no = BroadPhaseQuery(options).find_hits(b, sweeps, 1);
  EXPECT_EQ(no.status, Status::bad_option);
  EXPECT_NE(std::string(no.message).find("BroadPhaseQuery"), std::string::npos) << no.message;
  std::atomic<bool> stop{true};
  options = {};
  options.stop = &stop;
  BroadPhaseQuery stopped(options);
  EXPECT_EQ(stopped.find_hits(b, sweeps, 1).status, Status::stopped);
  EXPECT_EQ(stopped.find_overlaps(b, Boxes(boxes.data(), 1)).status, Status::stopped);
  EXPECT_TRUE(stopped.overlaps().empty() && stopped.hits().empty());
}

TEST(BroadPhaseConcurrentQueries, MemoryRunsOut) {
  Actor actor({}, 8, 24);
  ASSERT_TRUE(actor.add(900, false));
  ASSERT_TRUE(actor.update());
  const RandomQueries few(actor, 4, false), many(actor, 150, false);
  for (const RandomQueries* q : {&few, &many}) {
    FailingResource memory;
    Options options;
    options.threads = 1;
    options.memory = &memory;
    {
      BroadPhaseQuery query(options);
      std::size_t failed = 0;
      for (std::size_t allowed = 0;; ++allowed) {
        ASSERT_LT(allowed, 100u);
        memory.fail(allowed, true);
        const Result a = query.find_overlaps(actor.broad_phase, q->boxes);
        const Result b =
            query.find_hits(actor.broad_phase, q->sweeps.data(), q->sweeps.size(), SweepHits::all);
        memory.calm();
        if (!a.ok()) {
          EXPECT_EQ(a.status, Status::out_of_memory) << a.message;
          EXPECT_TRUE(query.overlaps().empty());
        }
        if (!b.ok()) {
          EXPECT_EQ(b.status, Status::out_of_memory) << b.message;
          EXPECT_TRUE(query.hits().empty());
        }
        if (a.ok() && b.ok()) break;
        ++failed;
      }
      EXPECT_GT(failed, 1u);
      // Once warm, it allocates nothing.
      QueryClient client{actor.broad_phase, query};
      ASSERT_TRUE(same_answers(client, actor.model, *q));
      const std::size_t allocations = memory.allocations();
      ASSERT_TRUE(same_answers(client, actor.model, *q));
      EXPECT_EQ(memory.allocations(), allocations);
      EXPECT_EQ(query.memory_bytes(), memory.held());
      BroadPhaseQuery moved(std::move(query));
      EXPECT_TRUE(query.hits().empty());  // NOLINT(bugprone-use-after-move): as new
      EXPECT_FALSE(moved.hits().empty());
      query = std::move(moved);
      EXPECT_FALSE(query.hits().empty());
    }
    EXPECT_EQ(memory.held(), 0u);
  }
}

}  // namespace
}  // namespace throng::tests
