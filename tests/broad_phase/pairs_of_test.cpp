// pairs_of() against pairs(), in each internal form of the pairs.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/failing_resource.hpp"

namespace throng::tests {
namespace {

std::vector<Row> rows_of(const BroadPhase& b, ObjectId id) {
  std::vector<LivePair> pairs(b.pairs_of(id, nullptr, 0));
  EXPECT_EQ(b.pairs_of(id, pairs.data(), pairs.size()), pairs.size());
  return rows({pairs.data(), pairs.size()});
}

// For all objects and some invalid ids. Calls pairs() on a copy, because that sorts them.
testing::AssertionResult right_of_all(const BroadPhase& b) {
  BroadPhase copy(b);
  const LivePairs all = copy.pairs();
  for (std::uint64_t i = 0; i < b.id_limit() + 2; ++i) {
    const auto id = static_cast<ObjectId>(i);
    std::vector<LivePair> want;
    for (const LivePair& p : all)
      if (p.first == id || p.second == id) want.push_back(p);
    if (rows_of(b, id) != rows({want.data(), want.size()}))
      return testing::AssertionFailure() << "of object " << id << ", which has " << want.size();
  }
  return testing::AssertionSuccess();
}

void live(std::uint64_t seed, bool filtered) {
  Options one;
  one.threads = 1;
  Actor actor(one, seed, 9);
  ASSERT_TRUE(actor.add(250, filtered));
  ASSERT_TRUE(actor.update());
  bool searched = false, found = false;
  for (std::size_t step = 0; step < 72; ++step) {
    const bool calm = step / 12 % 3 != 2;
    ASSERT_TRUE(actor.some_calls(calm, 250, filtered, true));
    if (step % 5 == 0) {  // changes before an update have no effect
      ASSERT_TRUE(right_of_all(actor.broad_phase)) << "before update " << step;
    }
    const bool around = was_incremental(BroadPhase(actor.broad_phase).update());
    (around ? searched : found) = true;
    ASSERT_TRUE(actor.update(step % 3 == 0));
    if (step % 4 == 1) continue;  // pairs() was never called
    ASSERT_TRUE(right_of_all(actor.broad_phase)) << "after update " << step << " seed " << seed;
  }
  EXPECT_TRUE(searched && found);
}
TEST(BroadPhasePairsOf, MatchesPairs) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed) live(seed, seed % 2);
}

TEST(BroadPhasePairsOf, NothingIsWrittenBeyondTheCapacity) {
  BroadPhase b;
  BoxList boxes(40, Box{{0, 0, 0}, {1, 1, 1}});
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  ASSERT_TRUE(b.update().ok());
  EXPECT_EQ(BroadPhase().pairs_of(0, nullptr, 0), 0u);
  for (int again = 0; again < 300; ++again) {  // by scanning, then by an index
    std::vector<LivePair> out(41, LivePair{9, 9, 9});
    for (const std::size_t capacity : {0, 1, 38, 39}) {
      ASSERT_EQ(b.pairs_of(20, out.data(), capacity), 39u);
      for (std::size_t i = capacity; i < out.size(); ++i) ASSERT_EQ(out[i].slot, 9u);
      std::fill(out.begin(), out.end(), LivePair{9, 9, 9});
    }
  }
}

// One thread builds the index while the others scan.
TEST(BroadPhasePairsOf, SeveralThreadsAtOnce) {
  Options one;
  one.threads = 1;
  for (int round = 0; round < 6; ++round) {
    BroadPhase b(one);
    const BoxList boxes = uniform_boxes(3000, static_cast<std::uint64_t>(round));
    ASSERT_TRUE(b.add(boxes, nullptr).ok());
    ASSERT_TRUE(b.update().ok());
    BroadPhase copy(b);
    std::vector<std::vector<Row>> want(boxes.size());
    for (const LivePair& p : copy.pairs())
      for (const ObjectId id : {p.first, p.second})
        want[id].emplace_back(p.first, p.second, p.slot);
    std::atomic<int> wrong{0};
    const auto run_queries = [&](std::size_t from) {
      BroadPhaseQuery query(one);
      for (std::size_t k = 0; k < 700; ++k) {
        const auto id = static_cast<ObjectId>((from + k) % boxes.size());
        if (rows_of(b, id) != want[id]) ++wrong;
        const Sweep ray = {{boxes[id].lower, boxes[id].lower}, {3, 2, 1}};
        if (k % 16 == 0 && !query.find_hits(b, &ray, 1).ok()) ++wrong;
      }
    };
    std::thread other(run_queries, 1500);
    run_queries(0);
    other.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(Snapshot(b), Snapshot(copy));
  }
}

// After a copy the index belongs to another scene, and it does not know objects added later.
TEST(BroadPhasePairsOf, AfterCopiesAndAdditions) {
  Options one;
  one.threads = 1;
  BroadPhase b(one), small(one);
  ASSERT_TRUE(b.add(uniform_boxes(600, 1), nullptr).ok());
  ASSERT_TRUE(b.update().ok());
  for (int again = 0; again < 3; ++again) ASSERT_TRUE(right_of_all(b));
  ASSERT_TRUE(small.add(uniform_boxes(300, 2), nullptr).ok());
  ASSERT_TRUE(small.update().ok());
  ASSERT_TRUE(b.copy_from(small).ok());
  for (int again = 0; again < 3; ++again) ASSERT_TRUE(right_of_all(b));
  ASSERT_TRUE(b.add(uniform_boxes(250, 3), nullptr).ok());
  ASSERT_TRUE(right_of_all(b));
}

// If memory for the index is unavailable, results are the same, and the next update is correct.
TEST(BroadPhasePairsOf, WithoutMemoryForAnIndex) {
  FailingResource memory;
  Options options;
  options.threads = 1;
  options.memory = &memory;
  BroadPhase b(options);
  const BoxList boxes = uniform_boxes(500, 5);
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  ASSERT_TRUE(b.update().ok());
  const std::size_t held = b.memory_bytes();
  const std::vector<Row> before = rows_of(b, 7);
  memory.fail(0, true);
  for (int again = 0; again < 1000; ++again) ASSERT_EQ(rows_of(b, 7), before);
  EXPECT_EQ(b.memory_bytes(), held);
  EXPECT_GT(memory.refused(), 0u);
  memory.calm();
  for (int again = 0; again < 1000; ++again) ASSERT_EQ(rows_of(b, 7), before);
  EXPECT_GT(b.memory_bytes(), held);
  ASSERT_EQ(b.move(7, boxes[8]), Status::ok);
  ASSERT_TRUE(b.update().ok());
  ASSERT_TRUE(right_of_all(b));
}

// A stopped full search leaves the pairs unchanged, linked or sorted.
TEST(BroadPhasePairsOf, AfterAnUpdateThatWasStopped) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  std::atomic<bool> stop{false};
  Options options;
  options.threads = 1;
  options.stop = &stop;
  Actor actor(options, 11, 9);
  ASSERT_TRUE(actor.add(300, false));
  ASSERT_TRUE(actor.update());
  for (int step = 0; step < 60; ++step) {
    ASSERT_TRUE(actor.move(step % 6 == 5 ? 300 : 2));
    stop = step % 3 == 2;
    if (stop) {
      EXPECT_EQ(actor.broad_phase.update().status, Status::stopped);
      ASSERT_TRUE(right_of_all(actor.broad_phase)) << "stopped, step " << step;
      stop = false;
    }
    ASSERT_TRUE(actor.update(step % 4 == 0));
    ASSERT_TRUE(right_of_all(actor.broad_phase)) << "step " << step;
  }
}

}  // namespace
}  // namespace throng::tests
