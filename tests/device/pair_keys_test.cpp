// Pairs as keys and back, before and after a sort: the per-thread work for sorted order.
#include "device/pair_keys.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/threads.hpp"
#include "device/host_device.hpp"
#include "support/random.hpp"

namespace throng::device {
namespace {

Input sets(std::uint32_t first, std::uint32_t second) {
  Input in;
  in.first_count = first;
  in.count = first + second;
  in.two_sets = second != 0;
  return in;
}
std::vector<Input> all_inputs() {
  return {
      sets(1, 0),          sets(2, 0),          sets(3, 0),         sets(1000, 0),
      sets(1 << 20, 0),    sets(5, 3000),       sets(3000, 5),      sets((1 << 16) + 1, 1 << 16),
      sets(1800000000, 0), sets(1, 1799999999), sets(1799999999, 1)};
}
std::uint32_t seconds_of(const Input& in) {
  return in.two_sets ? in.count - in.first_count : in.count;
}

TEST(PairKeys, TheOrderOfPairsAndBack) {
  tests::Random random(1);
  for (const Input& in : all_inputs()) {
    SCOPED_TRACE(std::to_string(in.first_count) + " of " + std::to_string(in.count));
    const PairKeys shape = PairKeys::of(in);
    std::vector<Pair> pairs = {{0, 0},
                               {in.first_count - 1, seconds_of(in) - 1},
                               {0, seconds_of(in) - 1},
                               {in.first_count - 1, 0}};
    for (int k = 0; k < 200; ++k)
      pairs.push_back({random.below(in.first_count), random.below(seconds_of(in))});
    ASSERT_LE(shape.bits(), 64);
    const std::uint64_t mask = ~std::uint64_t{0} >> (64 - shape.bits());
    for (const Pair& p : pairs) {
      EXPECT_EQ(shape.pair(shape.key(p)), p);
      EXPECT_LT(shape.key(p), shape.none() & mask) << "entries past the last pair sort last";
      for (const Pair& q : pairs) EXPECT_EQ(p < q, (shape.key(p) & mask) < (shape.key(q) & mask));
    }
  }
}

// As after a search with spare capacity, and with too little.
TEST(PairKeys, SortedWhereTheyFit) {
  tests::Random random(2);
  HostDevice device(std::pmr::new_delete_resource(), HostDevice::Run{base::run_tasks});
  device.begin(base::default_executor(), 3);
  constexpr Pair untouched{77, 77};
  for (const Input& in : all_inputs()) {
    for (const std::size_t most : {0, 1, 100, 5000, 30000}) {
      std::vector<Pair> want;
      for (std::size_t k = 0; k < most; ++k)
        want.push_back({random.below(in.first_count), random.below(seconds_of(in))});
      std::sort(want.begin(), want.end());
      want.erase(std::unique(want.begin(), want.end()), want.end());
      std::vector<Pair> pairs = want;
      const std::size_t found = pairs.size();
      for (std::size_t k = found; k > 1; --k)
        std::swap(pairs[k - 1], pairs[random.below(static_cast<std::uint32_t>(k))]);
      Report report;
      report.found = found;
      for (const std::size_t capacity : {found, found + 1, 3 * found + 500}) {
        // Entries past the last pair are arbitrary.
        std::vector<Pair> there = pairs, out(capacity + 1, untouched);
        there.resize(capacity, Pair{0, 0});
        std::vector<std::uint64_t> scratch(HostDevice::sort_bytes(capacity) / 8 + 1);
        device.sort(there.data(), scratch.data(), HostDevice::sort_bytes(capacity), out.data(),
                    capacity, capacity, &report, in);
        EXPECT_TRUE(std::equal(want.begin(), want.end(), out.begin()));
        for (std::size_t k = found; k < out.size(); ++k) EXPECT_EQ(out[k], untouched);
      }
      if (found == 0) continue;
      std::vector<Pair> out(found, untouched);
      std::vector<std::uint64_t> scratch(HostDevice::sort_bytes(found - 1) / 8 + 1);
      device.sort(pairs.data(), scratch.data(), HostDevice::sort_bytes(found - 1), out.data(),
                  found - 1, found - 1, &report, in);
      for (const Pair& p : out) EXPECT_EQ(p, untouched) << "written though they did not fit";
    }
  }
}

}  // namespace
}  // namespace throng::device
