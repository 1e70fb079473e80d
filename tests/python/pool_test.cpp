// The Python module's thread pool: every task once, concurrent and nested callers, a polling
// caller.
#include "python/pool.hpp"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <throng/throng.hpp>

namespace throng::python {
namespace {

struct Counts {
  explicit Counts(unsigned count) : of(count) {}
  std::vector<std::atomic<int>> of;
  static void task(void* self, unsigned index) { ++static_cast<Counts*>(self)->of[index]; }
  void expect_once() const {
    for (const auto& count : of) EXPECT_EQ(count, 1);
  }
};

TEST(Pool, EachTaskOnce) {
  for (const unsigned count : {0u, 1u, 2u, 3u, 64u, 1000u}) {
    Counts counts(count);
    executor().run(executor().self, count, Counts::task, &counts);
    counts.expect_once();
  }
}

TEST(Pool, CallersAtOnce) {
  std::vector<std::thread> callers;
  for (int c = 0; c < 6; ++c) {
    callers.emplace_back([] {
      for (unsigned round = 0; round < 200; ++round) {
        Counts counts(1 + round % 9);
        pool().run(1 + round % 9, Counts::task, &counts);
        counts.expect_once();
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
}

// A search on a pool thread distributes tasks itself; so may all searches, more than there are
// threads.
TEST(Pool, BackgroundAndNested) {
  std::vector<std::thread> callers;
  for (int c = 0; c < 8; ++c) {
    callers.emplace_back([] {
      for (int round = 0; round < 50; ++round) {
        Counts counts(7);
        const auto body = [](void* inner) { pool().run(7, Counts::task, inner); };
        ASSERT_TRUE(pool().run_in_background(
            body, &counts, [](void*) {}, nullptr));
        counts.expect_once();
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
}

TEST(Pool, CallerPolls) {
  struct Long {
    std::atomic<bool> stop{false};
    int polls = 0;
  } self;
  const auto body = [](void* s) {
    while (!static_cast<Long*>(s)->stop) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  const auto poll = [](void* s) {
    if (++static_cast<Long*>(s)->polls == 3) static_cast<Long*>(s)->stop = true;
  };
  ASSERT_TRUE(pool().run_in_background(body, &self, poll, &self));
  EXPECT_GE(self.polls, 3);
}

TEST(Pool, ForgottenThreadsAreRestarted) {
  Pool* before = &pool();
  forget_threads();
  EXPECT_NE(&pool(), before);
  Counts counts(20);
  pool().run(20, Counts::task, &counts);
  counts.expect_once();
}

TEST(Pool, SearchesOnIt) {
  std::vector<Box> boxes;
  for (int i = 0; i < 20000; ++i) {
    const auto x = static_cast<float>(i);
    boxes.push_back({{x, 0, 0}, {x + 1, 1, 1}});
  }
  Options options;
  options.executor = &executor();
  options.threads = 5;
  Finder finder(options);
  for (int round = 0; round < 20; ++round) EXPECT_EQ(finder.find(boxes).found, 19999u);
}

}  // namespace
}  // namespace throng::python
