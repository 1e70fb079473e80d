// Radix sorts against std::sort, at counts and limits of one to several digits.
#include "tracking/radix_sort.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "support/random.hpp"

namespace throng::tracking {
namespace {

using tests::Random;

constexpr std::size_t counts[] = {
    0, 1, radix_sort_threshold - 1, radix_sort_threshold, 300, 4095, 4096, 9000};
constexpr std::uint32_t limits[] = {1, 100, 5000, 70'000, 3'000'000, 0xfffffff0u};

std::uint32_t any_id(Random& random, std::uint32_t limit) {
  return static_cast<std::uint32_t>((random.next() >> 20) % limit);
}

TEST(RadixSort, Hits) {
  Random random(1);
  for (const std::size_t count : counts) {
    for (const std::uint32_t limit : limits) {
      std::vector<SweepHit> hits(count), scratch(count);
      for (SweepHit& hit : hits) hit = {3, any_id(random, limit), random.in(0, 1)};
      std::vector<SweepHit> want = hits;
      std::stable_sort(want.begin(), want.end(),
                       [](const SweepHit& a, const SweepHit& b) { return a.object < b.object; });
      sort_hits(hits.data(), scratch.data(), count, limit);
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(hits[i].object, want[i].object) << count << " below " << limit;
        ASSERT_EQ(hits[i].sweep, 3u);
        // With few hits, the order among equal objects is unspecified.
        if (count >= radix_sort_threshold) {
          ASSERT_EQ(hits[i].time, want[i].time);
        }
      }
    }
  }
}

TEST(RadixSort, Pairs) {
  Random random(2);
  for (const std::size_t count : counts) {
    for (const std::uint32_t limit : limits) {
      std::vector<LivePair> pairs(count), scratch(count);
      std::uint32_t slot = 0;
      for (LivePair& p : pairs) p = {any_id(random, limit), any_id(random, limit), slot++};
      std::vector<LivePair> want = pairs;
      std::stable_sort(want.begin(), want.end(), pair_less);
      sort_pairs(pairs.data(), scratch.data(), count, limit);
      std::uint64_t sum = 0;
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(pairs[i].first, want[i].first) << count << " below " << limit;
        ASSERT_EQ(pairs[i].second, want[i].second) << count << " below " << limit;
        sum += pairs[i].slot;
      }
      EXPECT_EQ(sum, std::uint64_t{count} * (count - (count != 0)) / 2);
    }
  }
}

}  // namespace
}  // namespace throng::tracking
