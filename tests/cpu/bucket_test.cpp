// Buckets of the canonical order, beside std::sort.
#include "cpu/bucket.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace throng::cpu {
namespace {

// Sorts with so much room, and with guards behind it and behind the pairs.
void expect_sorted(std::vector<Pair> pairs, Bucket bucket, std::size_t room_count) {
  std::vector<Pair> want = pairs;
  std::sort(want.begin(), want.end());
  constexpr Pair guard{77, 78};
  constexpr std::uint64_t room_guard = 0x0123456789abcdef;
  bucket.count = pairs.size();
  pairs.push_back(guard);
  bucket.pairs = pairs.data();
  std::vector<std::uint64_t> room(room_count + 1, room_guard);
  sort_bucket(bucket, room.data(), room_count);
  ASSERT_EQ(pairs.back(), guard);
  ASSERT_EQ(room.back(), room_guard);
  pairs.pop_back();
  ASSERT_EQ(pairs, want) << bucket.count << " pairs, " << bucket.first_bits << " + "
                         << bucket.second_bits << " bits";
}

enum class Lists { even, random, one_long, empty_between };

// Pairs of a bucket, in any order; about `seconds` for each first.
std::vector<Pair> make_pairs(const Bucket& bucket, Lists lists, std::uint32_t seconds,
                             std::mt19937& random) {
  std::vector<Pair> pairs;
  const std::uint64_t second_count = std::uint64_t{1} << bucket.second_bits;
  for (std::uint32_t f = 0; f < 1u << bucket.first_bits; ++f) {
    std::uint32_t n = seconds;
    if (lists == Lists::random) n = static_cast<std::uint32_t>(random()) % (2 * seconds + 1);
    if (lists == Lists::one_long && f == 1) n = 100 * seconds;
    if (lists == Lists::empty_between && f % 3 != 0) n = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      pairs.push_back(
          {bucket.first_above | f, static_cast<std::uint32_t>(random() % second_count)});
    }
  }
  std::shuffle(pairs.begin(), pairs.end(), random);
  return pairs;
}

TEST(Buckets, AreSortedWhateverTheirLists) {
  std::mt19937 random(1);
  for (const unsigned first_bits : {0u, 1u, 3u, 5u, 10u, 11u}) {
    for (const unsigned second_bits : {7u, 19u, 27u, 32u}) {
      for (const std::uint32_t seconds : {1u, 9u, 70u}) {
        for (const Lists lists :
             {Lists::even, Lists::random, Lists::one_long, Lists::empty_between}) {
          const Bucket bucket{nullptr, 0, first_bits, 5u << 12, second_bits};
          const auto pairs = make_pairs(bucket, lists, seconds, random);
          const std::size_t enough = Bucket::room_for(pairs.size(), bucket.key_bits());
          for (const std::size_t room : {enough, pairs.size(), 16 * enough}) {
            expect_sorted(pairs, bucket, room);
            if (HasFatalFailure()) return;
          }
        }
      }
    }
  }
}

TEST(Buckets, KeepTheGreatestIds) {
  std::mt19937 random(2);
  const Bucket bucket{nullptr, 0, 4, 0xfffffff0u, 32};
  std::vector<Pair> pairs;
  for (std::uint32_t first = 0xfffffff0u; first != 0xffffffffu; ++first)
    for (std::uint32_t k = 2; k < 40 + first % 7; ++k) pairs.push_back({first, 0xffffffffu - k});
  pairs.push_back({0xfffffffeu, 0xfffffffeu});
  std::shuffle(pairs.begin(), pairs.end(), random);
  expect_sorted(pairs, bucket, 16 * pairs.size());
}

}  // namespace
}  // namespace throng::cpu
