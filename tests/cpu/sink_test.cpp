// Where pairs end up, each sink by itself: to the last place there is, and not beyond.
#include "cpu/sink.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace throng::cpu {
namespace {

constexpr Pair untouched{77, 78};

TEST(RangeSinks, TakeTheirRangeToTheLastPlace) {
  std::vector<Pair> all, want;
  for (std::uint32_t first = 0; first < 20; ++first)
    for (std::uint32_t second = 0; second < 5; ++second) all.push_back({first, second});
  // Slices of four first indices, from 8 on: three of them.
  for (const Pair& p : all)
    if (p.first >= 8) want.push_back(p);
  for (const std::size_t room : {want.size() + 3, want.size(), want.size() - 1, std::size_t{0}}) {
    std::vector<Pair> out(room + 1, untouched);
    RangeSink sink(std::uint64_t{8} << 32, 34, out.data(), room, 3);
    for (std::size_t k = 0; k < all.size(); k += 7)
      sink.take(all.data() + k, std::min<std::size_t>(7, all.size() - k));
    EXPECT_EQ(sink.found(), want.size());
    for (std::size_t s = 0; s < 3; ++s) EXPECT_EQ(sink.in_slice(s), 20u);
    const std::size_t written = std::min(room, want.size());
    EXPECT_TRUE(
        std::equal(want.begin(), want.begin() + static_cast<std::ptrdiff_t>(written), out.begin()));
    for (std::size_t k = written; k < out.size(); ++k) EXPECT_EQ(out[k], untouched);
  }
}

TEST(BufferSinks, TakeToTheLastPlace) {
  const std::vector<Pair> pairs(10, Pair{1, 2});
  for (const std::size_t room : {0, 9, 10, 11}) {
    std::vector<Pair> out(room + 1, untouched);
    BufferSink sink(out.data(), room, false);
    sink.take(pairs.data(), 6);
    sink.take(pairs.data(), 4);
    EXPECT_EQ(sink.found(), 10u);
    EXPECT_EQ(sink.written(), std::min<std::size_t>(room, 10));
    for (std::size_t k = 0; k < out.size(); ++k)
      EXPECT_EQ(out[k], k < sink.written() ? pairs[0] : untouched);
  }
}

}  // namespace
}  // namespace throng::cpu
