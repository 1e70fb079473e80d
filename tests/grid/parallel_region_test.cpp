// The threads of one call, for different executors.
#include "base/parallel_region.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace throng::grid {
namespace {

using RunTasks = void (*)(void*, unsigned, void (*)(void*, unsigned), void*);

// All tasks on the caller, the last first: waiting for a task that has not begun would deadlock.
void run_inline(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  for (unsigned i = count; i-- > 0;) task(context, i);
}
void run_on_threads(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < count; ++i) threads.emplace_back(task, context, i);
  for (std::thread& t : threads) t.join();
}
// Each task begins some time after the one before it.
void run_late(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < count; ++i) {
    threads.emplace_back(task, context, i);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  for (std::thread& t : threads) t.join();
}

void lead(RunTasks run, unsigned tasks, const std::function<void(const Executor&)>& body) {
  base::ParallelRegion::run({tasks, run, nullptr}, tasks, body);
}

TEST(ParallelRegion, RunsEachTaskOnce) {
  for (const RunTasks run : {run_inline, run_on_threads, run_late}) {
    for (const unsigned tasks : {1u, 2u, 3u, 8u}) {
      for (int call = 0; call < 50; ++call) {
        int bodies = 0;
        std::size_t wrong = 0;
        lead(run, tasks, [&](const Executor& region) {
          ++bodies;
          EXPECT_EQ(region.concurrency, tasks);
          for (unsigned count = 0; count < 2 * tasks + 2; ++count) {
            std::vector<unsigned char> ran(count + 1, 0);
            auto task = [&](unsigned i) { ++ran[i]; };
            base::run_tasks(region, count, task);
            for (unsigned i = 0; i <= count; ++i) wrong += ran[i] != (i < count ? 1 : 0);
          }
        });
        EXPECT_EQ(bodies, 1);
        EXPECT_EQ(wrong, 0u) << tasks << " tasks";
      }
    }
  }
}

// Two tasks, each of which ends only after the other has begun.
TEST(ParallelRegion, LateThreadsHelp) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  lead(run_on_threads, 2, [&](const Executor& region) {
    for (int phase = 0; phase < 20; ++phase) {
      std::atomic<int> begun{0};
      auto task = [&](unsigned) {
        ++begun;
        while (begun < 2 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
        EXPECT_EQ(begun, 2);
      };
      base::run_tasks(region, 2, task);
    }
  });
}

// A body may run a nested region on its region.
TEST(ParallelRegion, Nests) {
  for (const RunTasks run : {run_inline, run_on_threads}) {
    std::atomic<int> ran{0};
    lead(run, 3, [&](const Executor& outer) {
      base::ParallelRegion::run(outer, 3, [&](const Executor& inner) {
        auto task = [&](unsigned) { ++ran; };
        base::run_tasks(inner, 3, task);
      });
      auto task = [&](unsigned) { ++ran; };
      base::run_tasks(outer, 3, task);
    });
    EXPECT_EQ(ran, 6);
  }
}

TEST(ParallelRegion, BodyExceptionsPropagate) {
  for (const RunTasks run : {run_inline, run_on_threads}) {
    for (const unsigned tasks : {1u, 3u}) {
      std::string caught;
      try {
        lead(run, tasks, [](const Executor&) { throw std::runtime_error("no space"); });
      } catch (const std::runtime_error& e) {
        caught = e.what();
      }
      EXPECT_EQ(caught, "no space") << tasks << " tasks";
    }
  }
}

}  // namespace
}  // namespace throng::grid
