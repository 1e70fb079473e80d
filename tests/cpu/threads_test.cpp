// What tasks share out among themselves.
#include "cpu/threads.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace throng::cpu {
namespace {

TEST(Shares, EachIndexIsTakenOnceWhoeverAsks) {
  for (const unsigned tasks : {1u, 2u, 3u, 64u}) {
    for (const std::size_t step : {1, 256, 1024}) {
      for (const std::size_t count : {0, 1, 255, 256, 257, 10000, 1000000}) {
        Shares shares(count, tasks, step);
        std::vector<unsigned char> taken(count, 0);
        std::size_t wrong = 0;
        for (std::size_t begin, end; shares.take(begin, end);) {
          wrong +=
              begin >= end || end > count || begin % step != 0 || (end != count && end % step != 0);
          for (std::size_t i = begin; i < end; ++i) ++taken[i];
        }
        for (const unsigned char t : taken) wrong += t != 1;
        EXPECT_EQ(wrong, 0u) << tasks << " tasks, " << count << " by " << step;
        std::size_t begin, end;
        EXPECT_FALSE(shares.take(begin, end)) << "what is over is over";
      }
    }
  }
}

TEST(Shares, ThreadsTakeNoneTwice) {
  constexpr std::size_t count = 1 << 20;
  Shares shares(count, 4, 16);
  std::vector<unsigned char> taken(count, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (std::size_t begin, end; shares.take(begin, end);) {
        for (std::size_t i = begin; i < end; ++i) ++taken[i];
      }
    });
  }
  for (std::thread& t : threads) t.join();
  std::size_t wrong = 0;
  for (const unsigned char t : taken) wrong += t != 1;
  EXPECT_EQ(wrong, 0u);
}

// A task that comes late finds little left: there are several shares for each.
TEST(Shares, AreMoreThanTasks) {
  Shares shares(100000, 4, 256);
  unsigned count = 0;
  for (std::size_t begin, end; shares.take(begin, end);) ++count;
  EXPECT_GE(count, 4 * 8u);
}

}  // namespace
}  // namespace throng::cpu
