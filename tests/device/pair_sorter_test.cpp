// Sorting pairs by buckets, bins and runs: the per-thread work, phase by phase.
#include "device/pair_sorter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <thread>
#include <vector>

#include "device/host_pair_sorter.hpp"
#include "support/random.hpp"

namespace throng::device {
namespace {

constexpr Pair untouched{77, 77};

using Pairs = std::vector<Pair>;

// Removes duplicates and shuffles.
Pairs only_once(Pairs pairs, tests::Random& random) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (std::size_t k = pairs.size(); k > 1; --k)
    std::swap(pairs[k - 1], pairs[random.below(static_cast<std::uint32_t>(k))]);
  return pairs;
}
// first < second, as in one set.
Pairs any_pairs(std::uint32_t boxes, std::size_t count, tests::Random& random) {
  Pairs pairs;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = random.below(boxes), j = random.below(boxes);
    if (i != j) pairs.push_back({std::min(i, j), std::max(i, j)});
  }
  return only_once(pairs, random);
}
// `count` second indices from `begin` on, `every` apart.
void add_list(Pairs& pairs, std::uint32_t first, std::uint32_t begin, std::uint32_t count,
              std::uint32_t every = 1) {
  for (std::uint32_t k = 0; k < count; ++k) pairs.push_back({first, begin + k * every});
}

template <class Sizes>
class PairSorterTest : public testing::Test {
 protected:
  using Tested = PairSorter<Sizes>;

  // Threads that run concurrently.
  static void share(std::uint64_t count, const std::function<void(std::uint32_t)>& body) {
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < 3; ++t)
      threads.emplace_back([&, t] {
        for (std::uint32_t k = t; k < count; k += 3) body(k);
      });
    for (std::thread& thread : threads) thread.join();
  }

  // Sorts with memory for `count` pairs, of which the first are `pairs`; in place or not. Returns
  // the output array.
  static Pairs ordered(const Pairs& pairs, const PairKeys& keys, std::size_t count,
                       std::size_t capacity, bool in_place) {
    Report report;
    report.found = pairs.size();
    Pairs there = pairs, out(count, untouched);
    there.resize(std::max(count, pairs.size()), Pair{0, 0});
    const std::size_t bytes = Tested::bytes(count);
    std::vector<unsigned char> scratch(bytes + 64, 0xa5);
    auto* memory = scratch.data() + (8 - reinterpret_cast<std::uintptr_t>(scratch.data()) % 8) % 8;
    Tested order{there.data(), in_place ? there.data() : out.data(), &report, capacity, keys};
    EXPECT_EQ(order.carve(count, memory), bytes);
    sort_pairs(order, share);
    EXPECT_TRUE(std::all_of(memory + bytes, scratch.data() + scratch.size(), [](unsigned char c) {
      return c == 0xa5;
    })) << "written past the end";
    there.resize(count);
    return in_place ? there : out;
  }
  static void expect_ordered(const Pairs& pairs, const PairKeys& keys) {
    ASSERT_LE(pairs.size(), Tested::max_pairs);
    Pairs want = pairs;
    std::sort(want.begin(), want.end());
    EXPECT_TRUE(ordered(pairs, keys, pairs.size(), pairs.size(), true) == want);
    const std::size_t more = pairs.size() + 500;
    want.resize(more, untouched);
    EXPECT_TRUE(ordered(pairs, keys, more, more, false) == want);
    if (pairs.empty()) return;
    EXPECT_TRUE(ordered(pairs, keys, more, pairs.size() - 1, false) == Pairs(more, untouched))
        << "written though they did not fit";
  }
};

using AllSizes = testing::Types<HostSortSizes, DeviceSortSizes>;
TYPED_TEST_SUITE(PairSorterTest, AllSizes);

TYPED_TEST(PairSorterTest, AnyPairs) {
  using Order = PairSorter<TypeParam>;
  tests::Random random(1);
  for (const std::uint32_t boxes : {2u, 3u, 90u, 5000u, 200000u, 1800000000u}) {
    for (const std::size_t count :
         {0u, 1u, 2u, 99u, 100u, 101u, 300u, 3000u, 4097u, 14000u, 60000u}) {
      SCOPED_TRACE(std::to_string(count) + " of " + std::to_string(boxes));
      if (count > Order::max_pairs) continue;
      this->expect_ordered(any_pairs(boxes, count, random), {boxes, boxes});
    }
  }
}

TYPED_TEST(PairSorterTest, TwoSets) {
  tests::Random random(2);
  for (const auto& [firsts, seconds] : {std::pair<std::uint32_t, std::uint32_t>{1, 100000},
                                        {100000, 1},
                                        {7, 3000},
                                        {3000, 7},
                                        {40000, 90000}}) {
    for (const std::uint32_t count : {100u, 1000u, 13000u}) {
      SCOPED_TRACE(std::to_string(firsts) + " x " + std::to_string(seconds));
      Pairs pairs;
      for (std::uint32_t k = 0; k < count; ++k)
        pairs.push_back({random.below(firsts), random.below(seconds)});
      this->expect_ordered(only_once(pairs, random), {firsts, seconds});
    }
  }
}

// All possible pairs: buckets as full as possible.
TYPED_TEST(PairSorterTest, AllPairsOfFewBoxes) {
  tests::Random random(3);
  for (const std::uint32_t boxes : {2u, 15u, 16u, 60u, 160u}) {
    Pairs pairs;
    for (std::uint32_t i = 0; i < boxes; ++i) add_list(pairs, i, i + 1, boxes - i - 1);
    this->expect_ordered(only_once(pairs, random), {boxes, boxes});
    // The same pairs among very many boxes: all fall into one or two buckets.
    this->expect_ordered(only_once(pairs, random), {1000000, 1000000});
    for (Pair& p : pairs) p = {p.first + 999000, p.second + 999000};
    this->expect_ordered(only_once(pairs, random), {1000000, 1000000});
  }
}

// Lists of one first index with any length, dense, sparse and clustered, alone and among other
// pairs.
TYPED_TEST(PairSorterTest, LongLists) {
  using Order = PairSorter<TypeParam>;
  constexpr std::uint32_t boxes = 1000000, run = Order::run_pairs, block = Order::block_pairs;
  tests::Random random(4);
  const Pairs others = any_pairs(boxes, 3 * Order::single_block_pairs, random);
  for (const std::uint32_t length : {run, run + 1, 4 * run, 4 * run + 1, 17 * run, block - 1, block,
                                     block + 1, 4 * block + 1, 17 * block}) {
    for (const std::uint32_t every : {1u, (boxes - 1000) / length}) {
      for (const bool alone : {true, false}) {
        SCOPED_TRACE(std::to_string(length) + (alone ? " alone" : ""));
        Pairs pairs = alone ? Pairs() : others;
        add_list(pairs, random.below(1000), 1000, length, every);
        this->expect_ordered(only_once(pairs, random), {boxes, boxes});
      }
    }
  }
}

// Several oversized buckets of different sizes, merged in the same passes.
TYPED_TEST(PairSorterTest, ManyClusters) {
  using Order = PairSorter<TypeParam>;
  constexpr std::uint32_t boxes = 1000000, block = Order::block_pairs;
  tests::Random random(5);
  Pairs pairs;
  std::uint32_t first = 10;
  for (const std::uint32_t size : {block / 2, block + 1, 3 * block, 11 * block + 7}) {
    for (std::uint32_t k = 0; k < 8; ++k)
      add_list(pairs, first + k, first + 20 + k, size / 8 + k, k % 2 + 1);
    first += 200000;
  }
  this->expect_ordered(only_once(pairs, random), {boxes, boxes});
}

// The largest number of buckets, and the memory estimate.
TYPED_TEST(PairSorterTest, LargestCounts) {
  using Order = PairSorter<TypeParam>;
  const auto max_buckets = [](std::uint64_t firsts, std::uint64_t seconds) {
    std::uint32_t most = 0;
    Order order{};
    order.keys = {firsts, seconds};
    for (std::uint32_t found = 1; found <= Order::max_pairs; found += 1 + found / 5000)
      if (found <= firsts * seconds) most = std::max(most, order.shape(found).buckets);
    return std::max(most, order.shape(Order::max_pairs).buckets);
  };
  for (const std::uint64_t firsts :
       {3000u, 4096u, 4097u, 1000000u, 1048576u, 1048577u, 1800000000u})
    EXPECT_LE(max_buckets(firsts, firsts), TypeParam::max_buckets);
  EXPECT_LE(max_buckets(1, 1800000000), TypeParam::max_buckets);
  EXPECT_LE(max_buckets(1800000000, 1), TypeParam::max_buckets);
  for (std::size_t count = 0; count < 50000; count += 123) {
    EXPECT_LE(Order::bytes(count), 8 * count + 40000);
    EXPECT_LE(Order::bytes(count), Order::bytes(count + 1));
  }
}

}  // namespace
}  // namespace throng::device
