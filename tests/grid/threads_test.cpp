// Work distribution among tasks.
#include "base/threads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace throng::grid {
namespace {

TEST(StealingRanges, AreTakenFromTheirTasksFirst) {
  for (const unsigned tasks : {1u, 2u, 3u, 16u, 40u}) {
    for (const std::uint64_t count : {0u, 1u, 2u, 5u, 1000u}) {
      base::StealingRanges ranges(count, tasks);
      std::vector<unsigned> taken(count, 0);
      std::vector<std::uint64_t> first(tasks, count);
      bool any = true;
      for (unsigned round = 0; any; ++round) {
        any = false;
        for (unsigned t = 0; t < tasks; ++t) {
          std::uint64_t index, next_index;
          const bool has_next = ranges.peek(t, next_index);
          if (!ranges.take(t, index)) {
            EXPECT_FALSE(has_next);
            continue;
          }
          ASSERT_LT(index, count);
          if (has_next) {
            EXPECT_EQ(index, next_index);
          }
          if (round == 0) first[t] = index;
          ++taken[index];
          any = true;
        }
      }
      EXPECT_EQ(std::count(taken.begin(), taken.end(), 1u), static_cast<std::ptrdiff_t>(count));
      if (tasks > 16 || count < 16) continue;
      for (unsigned t = 0; t < tasks; ++t) {
        EXPECT_EQ(first[t], count / tasks * t + std::min<std::uint64_t>(t, count % tasks));
      }
    }
  }
}

TEST(ChunkQueue, EachIndexOnceForAnyTask) {
  for (const unsigned tasks : {1u, 2u, 3u, 64u}) {
    for (const std::size_t step : {1, 256, 1024}) {
      for (const std::size_t count : {0, 1, 255, 256, 257, 10000, 1000000}) {
        base::ChunkQueue shares(count, tasks, step);
        std::vector<unsigned char> taken(count, 0);
        std::size_t wrong = 0;
        for (std::size_t begin, end; shares.take(tasks - 1, begin, end);) {
          wrong +=
              begin >= end || end > count || begin % step != 0 || (end != count && end % step != 0);
          for (std::size_t i = begin; i < end; ++i) ++taken[i];
        }
        for (const unsigned char t : taken) wrong += t != 1;
        EXPECT_EQ(wrong, 0u) << tasks << " tasks, " << count << " by " << step;
        std::size_t begin, end;
        EXPECT_FALSE(shares.take(0, begin, end)) << "finished ranges stay finished";
      }
    }
  }
}

// Returns the number of indices not taken exactly once by four concurrent threads.
std::size_t race(std::size_t count, std::size_t step) {
  base::ChunkQueue shares(count, 4, step);
  std::vector<std::atomic<unsigned>> taken(count + 1);  // the last element: out of range
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t begin, end; shares.take(t, begin, end);) {
        if (begin >= end) ++taken[count];
        for (std::size_t i = begin; i < end; ++i) ++taken[std::min(i, count)];
      }
    });
  }
  for (std::thread& t : threads) t.join();
  std::size_t wrong = taken[count];
  for (std::size_t i = 0; i < count; ++i) wrong += taken[i] != 1;
  return wrong;
}

TEST(ChunkQueue, NoIndexTwice) {
  EXPECT_EQ(race(std::size_t{1} << 20, 16), 0u);
  // Races occur at the ends of ranges.
  for (int again = 0; again < 300; ++again) ASSERT_EQ(race(64, 1), 0u);
}

// There are several chunks per task, so that a late task finds little left.
TEST(ChunkQueue, AreMoreThanTasks) {
  base::ChunkQueue shares(100000, 4, 256);
  unsigned count = 0;
  for (std::size_t begin, end; shares.take(2, begin, end);) ++count;
  EXPECT_GE(count, 4 * 8u);
}

}  // namespace
}  // namespace throng::grid
