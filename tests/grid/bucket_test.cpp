// Sorted buckets on each instruction set against std::sort.
#include "grid/order/bucket.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support/configs.hpp"

namespace throng::grid {
namespace {

std::vector<const Kernels*> all_kernels() {
  std::vector<const Kernels*> all;
  for (const Isa isa : tests::supported_isas()) all.push_back(find_kernels(isa));
  return all;
}

// Sorts with exactly this scratch space, with guards behind it and behind the pairs.
void expect_sorted(const Kernels& kernels, std::vector<Pair> pairs, Bucket bucket,
                   std::size_t scratch_count) {
  std::vector<Pair> want = pairs;
  std::sort(want.begin(), want.end());
  constexpr Pair guard{77, 78};
  constexpr std::uint64_t scratch_guard = 0x0123456789abcdef;
  bucket.count = pairs.size();
  pairs.push_back(guard);
  bucket.pairs = pairs.data();
  std::vector<std::uint64_t> scratch(scratch_count + 1, scratch_guard);
  sort_bucket(kernels, bucket, scratch.data(), scratch_count);
  ASSERT_EQ(pairs.back(), guard);
  ASSERT_EQ(scratch.back(), scratch_guard);
  pairs.pop_back();
  ASSERT_EQ(pairs, want) << to_string(kernels.isa) << " " << bucket.count << " pairs, "
                         << bucket.first_bits << " + " << bucket.second_bits << " bits";
}

enum class ListLengths { even, random, one_long, empty_between };

// Pairs of a bucket, unsorted, with about `seconds` per first.
std::vector<Pair> make_pairs(const Bucket& bucket, ListLengths lists, std::uint32_t seconds,
                             std::mt19937& random) {
  std::vector<Pair> pairs;
  const std::uint64_t second_count = std::uint64_t{1} << bucket.second_bits;
  for (std::uint32_t f = 0; f < 1u << bucket.first_bits; ++f) {
    std::uint32_t n = seconds;
    if (lists == ListLengths::random) n = static_cast<std::uint32_t>(random()) % (2 * seconds + 1);
    if (lists == ListLengths::one_long && f == 1) n = 100 * seconds;
    if (lists == ListLengths::empty_between && f % 3 != 0) n = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      pairs.push_back(
          {bucket.first_above | f, static_cast<std::uint32_t>(random() % second_count)});
    }
  }
  std::shuffle(pairs.begin(), pairs.end(), random);
  return pairs;
}

TEST(Buckets, SortedForAnyLists) {
  if (tests::thread_sanitized) GTEST_SKIP() << tests::one_thread;
  std::mt19937 random(1);
  for (const Kernels* kernels : all_kernels()) {
    for (const unsigned first_bits : {0u, 1u, 3u, 5u, 10u, 11u}) {
      for (const unsigned second_bits : {7u, 19u, 27u, 32u}) {
        for (const std::uint32_t seconds : {1u, 9u, 70u}) {
          for (const ListLengths lists : {ListLengths::even, ListLengths::random,
                                          ListLengths::one_long, ListLengths::empty_between}) {
            const Bucket bucket{nullptr, 0, first_bits, 5u << 12, second_bits};
            const auto pairs = make_pairs(bucket, lists, seconds, random);
            const std::size_t enough = Bucket::scratch_size(pairs.size());
            for (const std::size_t scratch : {enough, pairs.size(), 16 * enough}) {
              expect_sorted(*kernels, pairs, bucket, scratch);
              if (HasFatalFailure()) return;
            }
          }
        }
      }
    }
  }
}

// The greatest ids must not be mistaken for the empty entries of a column.
TEST(Buckets, KeepTheGreatestIds) {
  std::mt19937 random(2);
  for (const Kernels* kernels : all_kernels()) {
    const Bucket bucket{nullptr, 0, 4, 0xfffffff0u, 32};
    std::vector<Pair> pairs;
    for (std::uint32_t first = 0xfffffff0u; first != 0xffffffffu; ++first)
      for (std::uint32_t k = 2; k < 40 + first % 7; ++k) pairs.push_back({first, 0xffffffffu - k});
    pairs.push_back({0xfffffffeu, 0xfffffffeu});
    std::shuffle(pairs.begin(), pairs.end(), random);
    expect_sorted(*kernels, pairs, bucket, 16 * pairs.size());
  }
}

// Runs of every length at every position, each of two distinct keys: by the 0-1 principle this
// covers all keys.
TEST(SortedRuns, MatchSeparateSorts) {
  for (const Kernels* kernels : all_kernels()) {
    if (!kernels->sort_runs) continue;
    for (std::uint32_t longest = 1; longest <= 12; ++longest) {
      for (std::uint32_t before = 0; before < 2; ++before) {
        for (std::uint32_t bits = 0; bits < 1u << longest; ++bits) {
          std::vector<std::uint32_t> keys(before + longest + 1 + KeyRuns::padding + 1, 12345);
          std::vector<Pair> want, got(before + longest + 2, Pair{77, 78});
          const auto add = [&](std::uint32_t first, std::uint32_t second) {
            keys[want.size()] = first << 5 | second;
            want.push_back({96 | first, second});
          };
          for (std::uint32_t i = 0; i < before; ++i) add(0, 31);
          for (std::uint32_t i = 0; i < longest; ++i) add(1, bits >> i & 1);
          add(2, 0);
          std::sort(want.begin(), want.end());
          const auto padded = base::PaddedArray<std::uint32_t, KeyRuns::padding>::of(keys.data());
          kernels->sort_runs({padded, want.size(), longest, 96, 5}, got.data());
          ASSERT_EQ(keys.back(), 12345u);
          ASSERT_EQ(got.back(), (Pair{77, 78}));
          got.pop_back();
          ASSERT_EQ(got, want) << to_string(kernels->isa) << " " << longest << " keys " << bits;
        }
      }
    }
  }
}

// The maximum of keys per digit for runs, and one more; and firsts that fill 32 bits together with
// seconds.
TEST(Buckets, MayHaveLongRuns) {
  std::mt19937 random(7);
  for (const Kernels* kernels : all_kernels()) {
    for (const unsigned first_bits : {1u, 6u, 13u}) {
      for (std::uint32_t together = 46; together <= 50; ++together) {
        const Bucket bucket{nullptr, 0, first_bits, 0x40000, 32 - first_bits};
        std::vector<Pair> pairs;
        for (std::uint32_t k = 0; k < together; ++k) pairs.push_back({0x40001, 3000 - k});
        for (std::uint32_t k = 0; k < 2000; ++k) {
          const auto key = static_cast<std::uint32_t>(random());
          pairs.push_back(
              {0x40000 | static_cast<std::uint32_t>(std::uint64_t{key} >> bucket.second_bits),
               key & ((1u << bucket.second_bits) - 1)});
        }
        std::shuffle(pairs.begin(), pairs.end(), random);
        expect_sorted(*kernels, pairs, bucket, Bucket::scratch_size(pairs.size()));
        if (HasFatalFailure()) return;
      }
    }
  }
}

// Lists and their scratch take two 64-bit words per pair; with one word less, digits are
// used.
TEST(Buckets, StayWithinScratch) {
  std::mt19937 random(4);
  for (const Kernels* kernels : all_kernels()) {
    const Bucket bucket{nullptr, 0, 4, 0, 32};
    std::vector<Pair> pairs;
    for (std::uint32_t first = 0; first < 16; ++first)
      for (std::uint32_t k = 0; k < (first == 5 ? 64u : 16u); ++k)
        pairs.push_back({first, static_cast<std::uint32_t>(random())});
    std::shuffle(pairs.begin(), pairs.end(), random);
    const std::size_t enough = Bucket::scratch_size(pairs.size());
    for (std::size_t scratch = enough - 10; scratch <= enough + 10; ++scratch)
      expect_sorted(*kernels, pairs, bucket, scratch);
  }
}

}  // namespace
}  // namespace throng::grid
