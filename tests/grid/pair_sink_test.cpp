// Each sink alone: it fills its memory to the last element, and never beyond.
#include "grid/emit/pair_sink.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace throng::grid {
namespace {

constexpr Pair untouched{77, 78};

TEST(RangeSinks, FillTheirRangeExactly) {
  std::vector<Pair> all, want;
  for (std::uint32_t first = 0; first < 20; ++first)
    for (std::uint32_t second = 0; second < 5; ++second) all.push_back({first, second});
  // Three slices of four first indices, from 8 on.
  for (const Pair& p : all)
    if (p.first >= 8) want.push_back(p);
  for (const std::size_t capacity :
       {want.size() + 3, want.size(), want.size() - 1, std::size_t{0}}) {
    std::vector<Pair> out(capacity + 1, untouched);
    RangeSink sink(std::uint64_t{8} << 32, 34, out.data(), capacity, 3);
    for (std::size_t k = 0; k < all.size(); k += 7)
      sink.take(all.data() + k, std::min<std::size_t>(7, all.size() - k));
    EXPECT_EQ(sink.found(), want.size());
    for (std::size_t s = 0; s < 3; ++s) EXPECT_EQ(sink.in_slice(s), 20u);
    const std::size_t written = std::min(capacity, want.size());
    EXPECT_TRUE(
        std::equal(want.begin(), want.begin() + static_cast<std::ptrdiff_t>(written), out.begin()));
    for (std::size_t k = written; k < out.size(); ++k) EXPECT_EQ(out[k], untouched);
  }
}

TEST(BufferSinks, FillToTheLastElement) {
  const std::vector<Pair> pairs(10, Pair{1, 2});
  for (const std::size_t capacity : {0, 9, 10, 11}) {
    for (const std::size_t spill_capacity : {0, 1, 4, 20}) {
      std::vector<Pair> out(capacity + 1, untouched), spill(spill_capacity + 1, untouched);
      BufferSink sink(out.data(), capacity, spill.data(), spill_capacity);
      sink.take(pairs.data(), 6);
      sink.take(pairs.data(), 4);
      EXPECT_EQ(sink.found(), 10u);
      EXPECT_EQ(sink.written(), std::min<std::size_t>(capacity, 10));
      for (std::size_t k = 0; k < out.size(); ++k)
        EXPECT_EQ(out[k], k < sink.written() ? pairs[0] : untouched);
      EXPECT_EQ(spill.back(), untouched);
    }
  }
}

TEST(BufferSinks, ExtendABlockAtItsEnd) {
  std::vector<Pair> out(10000);
  BufferSink sink(out.data(), out.size(), nullptr, 0);
  OutputRange one{}, other{};
  ASSERT_TRUE(sink.extend(one));
  EXPECT_EQ(one.begin, out.data());
  const std::size_t before = one.size();
  ASSERT_TRUE(sink.extend(one));
  EXPECT_EQ(one.begin, out.data());
  EXPECT_GT(one.size(), before);
  ASSERT_TRUE(sink.extend(other));
  EXPECT_EQ(other.begin, one.end);
  const OutputRange last = one;
  ASSERT_TRUE(sink.extend(one));
  EXPECT_EQ(one.begin, other.end);
  EXPECT_LT(last.end, one.end);
}

// A worker as seen by the sink: it fills a block up to the slack, then requests the next; at the
// end, its block is filled before any other.
struct Writer {
  BufferSink& sink;
  OutputRange capacity{}, gap{};
  bool is_growing = true;

  void put(Pair pair) {
    if (is_growing && capacity.size() <= PairOutput::slack) grow();
    OutputRange& own = gap.size() != 0 ? gap : capacity;
    if (own.size() != 0)
      *own.begin++ = pair;
    else
      sink.take(&pair, 1);
  }
  void grow() {
    OutputRange more = capacity;
    is_growing = sink.extend(more);
    if (is_growing && more.begin != capacity.begin) gap = capacity;
    if (is_growing) capacity = more;
  }
};

// Workers write the pairs 0, 1, 2, ... For any distribution over them, the output is full to the
// last element.
TEST(BufferSinks, FillGapsOfWorkers) {
  constexpr std::size_t workers = 3;
  const std::size_t shares[][workers] = {{20000, 0, 0}, {0, 0, 20000}, {5000, 9000, 6000},
                                         {3, 19990, 7}, {700, 0, 300}, {1, 0, 0}};
  for (const auto& share : shares) {
    const std::size_t found = share[0] + share[1] + share[2];
    for (const std::size_t capacity : {found + 40000, found + 600, found + 1, found, found - 1,
                                       found - found / 3, found * 3 / 10, found / 9}) {
      std::vector<Pair> out(capacity + 1, untouched);
      const std::size_t spill_capacity = BufferSink::spill_for(workers, capacity);
      std::vector<Pair> spill(spill_capacity + found, untouched);
      BufferSink sink(out.data(), capacity, spill.data(), spill_capacity);
      Writer writers[workers] = {{sink}, {sink}, {sink}};
      for (Writer& writer : writers) writer.grow();
      std::uint32_t next = 0;
      for (std::size_t w = 0; w < workers; ++w)
        for (std::size_t k = 0; k < share[w]; ++k, ++next) writers[w].put({next, next + 1});
      for (const Writer& writer : writers) {
        sink.leave(writer.capacity);
        sink.leave(writer.gap);
      }
      sink.close();
      ASSERT_EQ(sink.found(), found);
      const std::size_t written = std::min(found, capacity);
      ASSERT_EQ(sink.written(), written);
      ASSERT_EQ(out.back(), untouched);
      for (std::size_t k = spill_capacity; k < spill.size(); ++k) ASSERT_EQ(spill[k], untouched);
      std::vector<bool> seen(found);
      for (std::size_t k = 0; k < written; ++k) {
        ASSERT_LT(out[k].first, found);
        ASSERT_EQ(out[k].second, out[k].first + 1);
        ASSERT_FALSE(seen[out[k].first])
            << out[k].first << " twice, of " << found << " in " << capacity;
        seen[out[k].first] = true;
      }
    }
  }
}

}  // namespace
}  // namespace throng::grid
