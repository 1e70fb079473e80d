// Memory: each allocation fails in turn, and a failed call changes nothing; all allocations use the
// resource; warm frames allocate nothing; snapshots.
#include <gtest/gtest.h>

#include "broad_phase/actor.hpp"
#include "broad_phase/many_movers.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/failing_resource.hpp"
#include "support/heap_count.hpp"
#include "support/in_turn.hpp"

namespace throng::tests {
namespace {

Options options_of(FailingResource& memory, unsigned threads) {
  Options options;
  options.memory = &memory;
  options.threads = threads;
  return options;
}

TEST(BroadPhaseMemory, FailsAtEveryAllocation) {
  FailingResource memory;
  const Options options = options_of(memory, 2);
  Actor actor(options, 3, 14);
  Random& random = actor.random;
  const auto see = [&] { return Snapshot(actor.broad_phase); };
  std::size_t failures = 0, searched = 0, updates_failed = 0;
  for (int step = 0; step < 60; ++step) {
    // Grows in steps, to force allocations; few and many objects move in turn.
    if (step % 10 == 0) {
      BoxList boxes;
      for (int k = 0; k < 80 + 10 * step; ++k) boxes.push_back(actor.any_box());
      std::vector<ObjectId> ids(boxes.size());
      failures +=
          until_it_works(memory, see, [&] { return actor.broad_phase.add(boxes, ids.data()); });
      for (std::size_t i = 0; i < ids.size(); ++i)
        ASSERT_TRUE(actor.model.add(ids[i], boxes[i], {}));
    }
    ASSERT_TRUE(actor.move(step % 10 < 2 ? 5000 : 1 + random.below(10)));
    if (step % 7 == 3) {
      ASSERT_TRUE(actor.remove(3));
    }
    Result r;
    const std::size_t failed =
        until_it_works(memory, see, [&] { return r = actor.broad_phase.update(); });
    updates_failed += failed;
    searched += failed != 0 && was_incremental(r);
    actor.model.update();
    ASSERT_TRUE(actor.model.check_update(r)) << "step " << step;
    ASSERT_TRUE(actor.model.check(actor.broad_phase)) << "step " << step;
  }
  EXPECT_GT(failures, 10u);
  EXPECT_GT(updates_failed, 20u);
  EXPECT_GT(searched, 2u) << "no failure in an incremental search";
}

// In a parallel incremental search, the allocation of any thread may fail.
TEST(BroadPhaseMemory, FailsInParallelSearches) {
  FailingResource memory;
  const Options options = options_of(memory, 3);
  BroadPhase b(options);
  ManyMovers movers;
  ASSERT_TRUE(b.add(movers.boxes, nullptr).ok());
  std::size_t failed_together = 0;
  for (int step = 0; step < 50; ++step) {
    movers.move();
    ASSERT_TRUE(b.move(movers.ids.data(), movers.moved).ok());
    Result r;
    const auto see = [&] { return std::pair(plain(b.begun()), plain(b.ended())); };
    const std::size_t failed = until_it_works(memory, see, [&] { return r = b.update(); });
    if (was_incremental(r) && r.plan.threads == options.threads) failed_together += failed;
  }
  EXPECT_GT(failed_together, 5u);
  EXPECT_EQ(plain(b.pairs()), movers.pairs());
}

// Building cells for queries fails. Later queries work without cells, and do not use the columns of
// an outdated update.
TEST(BroadPhaseMemory, FailedOverlapsLeaveNoHits) {
  FailingResource memory;
  const Options options = options_of(memory, 1);
  BoxList boxes;
  for (int i = 0; i < 300; ++i) boxes.push_back({{i * 1.0f, 0, 0}, {i + 0.5f, 1, 1}});
  BroadPhase all(options);
  ASSERT_TRUE(all.add(boxes, nullptr).ok());
  ASSERT_TRUE(all.update().ok());
  const Box region = {{0, 0, 0}, {50, 1, 1}};
  std::size_t refused = 0;
  for (std::size_t allowed = 0; allowed < 20; ++allowed) {
    BroadPhase b(all);
    memory.fail(allowed, true);
    const Result r = b.find_overlaps(Boxes(&region, 1));
    memory.calm();
    refused += !r.ok();
    EXPECT_EQ(b.overlaps().size(), r.ok() ? 51u : 0u);
    EXPECT_TRUE(b.hits().empty()) << "after " << allowed << " requests";
  }
  EXPECT_GT(refused, 1u);
}

TEST(BroadPhaseMemory, QueriesRunOut) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  FailingResource memory;
  const Options options = options_of(memory, 1);
  Actor actor(options, 8, 24);
  ASSERT_TRUE(actor.add(1500, false));
  ASSERT_TRUE(actor.move(1500));
  ASSERT_TRUE(actor.update());
  Result r;
  for (int k = 0; k < 60 || !was_incremental(r); ++k) {
    ASSERT_LT(k, 400);
    ASSERT_TRUE(actor.move(20));
    r = actor.broad_phase.update();
    ASSERT_TRUE(r.ok());
  }
  const auto run_queries = [&] {
    for (int k = 0; k < 30; ++k) {
      const BoxList boxes = {cube(actor.random.point(0, 22), 2)};
      ASSERT_TRUE(same_overlaps(actor.broad_phase, actor.model, boxes, {}, false)) << k;
    }
  };
  const Box region = cube(5, 5, 5, 2);
  for (int k = 0; r.ok(); ++k) {
    ASSERT_LT(k, 400);
    run_queries();
    ASSERT_TRUE(actor.broad_phase.update().ok());
    ASSERT_TRUE(actor.add(20, false));
    memory.fail(0, true);
    r = actor.broad_phase.find_overlaps(Boxes(&region, 1));
    memory.calm();
  }
  EXPECT_EQ(r.status, Status::out_of_memory);
  EXPECT_NE(std::string(r.message).find("query fewer"), std::string::npos) << r.message;
  run_queries();
}

// The suggested fix applies to the call: an update cannot deliver pairs in blocks.
TEST(BroadPhaseMemory, TheSuggestedFixFitsTheCall) {
  FailingResource memory;
  BroadPhase b(options_of(memory, 1));
  const BoxList boxes = uniform_boxes(2000, 1);
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  memory.fail(0, true);
  const Result r = b.update();
  memory.calm();
  EXPECT_EQ(r.status, Status::out_of_memory);
  const std::string message = r.message;
  EXPECT_NE(message.find("keep fewer objects"), std::string::npos) << message;
  EXPECT_EQ(message.find("blocks"), std::string::npos) << message;
  EXPECT_NE(message.find(std::to_string(r.bytes_needed)), std::string::npos) << message;
}

TEST(BroadPhaseMemory, CopiesRunOutToo) {
  Actor actor({}, 5, 10);
  ASSERT_TRUE(actor.add(400, true));
  ASSERT_TRUE(actor.update());
  for (int k = 0; k < 40; ++k) {
    ASSERT_TRUE(actor.move(2));
    ASSERT_TRUE(actor.update());
  }
  FailingResource memory;
  Options options;
  options.memory = &memory;
  BroadPhase copy(options);
  ASSERT_TRUE(copy.add(BoxList{cube(0, 0, 0, 1), cube(0, 0, 0, 2)}, nullptr).ok());
  ASSERT_TRUE(copy.update().ok());
  EXPECT_GT(until_it_works(
                memory, [&] { return Snapshot(copy); },
                [&] { return copy.copy_from(actor.broad_phase); }),
            3u);
  EXPECT_EQ(Snapshot(copy), Snapshot(actor.broad_phase));
  // A repetition allocates nothing.
  memory.fail(0, true);
  EXPECT_TRUE(copy.copy_from(actor.broad_phase).ok());
  memory.calm();
  EXPECT_GT(memory.held(), 0u);
  EXPECT_EQ(copy.memory_bytes(), memory.held());
}

// A copy of a copy of a copy needs no more than a copy: memory per object does not grow with the
// number of copies.
TEST(BroadPhaseMemory, CopiesOfCopiesStaySmall) {
  Actor actor({}, 6, 10);
  ASSERT_TRUE(actor.add(400, true));
  for (int k = 0; k < 40; ++k) {
    ASSERT_TRUE(actor.move(2));
    ASSERT_TRUE(actor.update());
  }
  BroadPhase copy(actor.broad_phase);
  const std::size_t first = copy.memory_bytes();
  EXPECT_LE(first, 2 * actor.broad_phase.memory_bytes());
  for (int k = 0; k < 20; ++k) {
    copy = BroadPhase(copy);
    ASSERT_LE(copy.memory_bytes(), first) << "copy " << k;
  }
  EXPECT_EQ(Snapshot(copy), Snapshot(actor.broad_phase));
}

// Blocks smaller than a large page, of one, and of several and a fraction: every byte is usable.
TEST(BroadPhaseMemory, LargePages) {
  std::pmr::memory_resource& memory = *large_pages();
  constexpr std::size_t page = std::size_t{2} << 20;
  for (const std::size_t bytes : {std::size_t{64}, page - 1, page, 3 * page + 100}) {
    for (const std::size_t alignment : {std::size_t{16}, std::size_t{64}, 2 * page}) {
      void* block = memory.allocate(bytes, alignment);
      EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % alignment, 0u);
      std::memset(block, 7, bytes);
      memory.deallocate(block, bytes, alignment);
    }
  }
  EXPECT_EQ(large_pages(), &memory);
  Options options;
  options.memory = &memory;
  BroadPhase b(options);
  ManyMovers movers;
  ASSERT_TRUE(b.add(movers.boxes, nullptr).ok());
  for (int step = 0; step < 20; ++step) {
    movers.move();
    ASSERT_TRUE(b.move(movers.ids.data(), movers.moved).ok());
    ASSERT_TRUE(b.update().ok());
  }
  EXPECT_EQ(plain(b.pairs()), movers.pairs());
}

// A snapshot is independent; after a rollback the same calls give the same results, including slots
// and ids.
TEST(BroadPhaseMemory, SnapshotAndRollback) {
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed) {
    Options options;
    options.threads = 1 + seed % 2;
    Actor actor(options, seed, 9);
    ASSERT_TRUE(actor.add(200, seed % 2));
    for (int k = 0; k < 30; ++k) {
      ASSERT_TRUE(actor.move(1 + actor.random.below(k % 3 ? 3 : 200)));
      ASSERT_TRUE(actor.update());
    }
    ASSERT_TRUE(actor.move(5));  // unreported changes are part of it
    ASSERT_TRUE(actor.remove(2));
    const BroadPhase saved = actor.broad_phase;
    const Actor saved_actor = actor;
    std::vector<Snapshot> first;
    for (int round = 0; round < 2; ++round) {
      for (int k = 0; k < 30; ++k) {
        ASSERT_TRUE(actor.move(1 + actor.random.below(k % 3 ? 3 : 200)));
        if (k % 5 == 0) {
          ASSERT_TRUE(actor.add(3, seed % 2));
        }
        if (k % 7 == 0) {
          ASSERT_TRUE(actor.remove(4));
        }
        ASSERT_TRUE(actor.update());
        if (round == 0)
          first.emplace_back(actor.broad_phase);
        else
          ASSERT_EQ(Snapshot(actor.broad_phase), first[static_cast<std::size_t>(k)]);
      }
      actor = saved_actor;
      actor.broad_phase = saved;
    }
  }
}

TEST(BroadPhaseMemory, Moves) {
  Actor actor({}, 1, 5);
  ASSERT_TRUE(actor.add(50, false));
  ASSERT_TRUE(actor.update());
  const Snapshot before(actor.broad_phase);
  BroadPhase taken = std::move(actor.broad_phase);
  EXPECT_EQ(Snapshot(taken), before);
  BroadPhase other;
  other = std::move(taken);
  EXPECT_EQ(Snapshot(other), before);
}

// HeapCount does not count its allocations.
class UncountedResource : public CountingResource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    const bool counting = HeapCount::pause();
    void* memory = CountingResource::do_allocate(bytes, alignment);
    HeapCount::resume(counting);
    return memory;
  }
};

TEST(BroadPhaseMemory, WarmFramesAllocateNothing) {
  if (thread_sanitized) GTEST_SKIP() << one_thread;
  UncountedResource memory;
  const Executor executor = in_turn(3);
  Options options;
  options.memory = &memory;
  options.executor = &executor;
  BoxList boxes = uniform_boxes(9000, 1), moved = boxes;
  HeapCount::start();
  BroadPhase b(options);
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  std::size_t warm = 0;
  const auto frames = [&](std::size_t share) {
    Random random(9);
    for (int f = 0; f < 60; ++f) {
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        const bool moves = random.below(static_cast<std::uint32_t>(share)) == 0;
        const float by = f % 2 || !moves ? 0.0f : 0.25f;
        moved[i] = {{boxes[i].lower.x + by, boxes[i].lower.y, boxes[i].lower.z},
                    {boxes[i].upper.x + by, boxes[i].upper.y, boxes[i].upper.z}};
      }
      ASSERT_TRUE(b.move_all(moved).ok());
      ASSERT_TRUE(b.update().ok());
      (void)b.pairs();
    }
  };
  for (int round = 0; round < 3; ++round) {
    if (round == 2) warm = memory.allocations();
    frames(1);
    frames(200);
  }
  EXPECT_EQ(memory.allocations(), warm) << "a warm frame allocates";
  EXPECT_EQ(HeapCount::stop(), 0u) << "allocations outside the resource";
  EXPECT_EQ(b.memory_bytes(), memory.held());
  // 9000 objects and 4500 pairs.
  EXPECT_LT(memory.held(), 9000u * 400 + 4500u * 300 + 2000000u);
}

}  // namespace
}  // namespace throng::tests
