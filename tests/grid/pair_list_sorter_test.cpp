// Sorted lists on each instruction set against std::sort.
#include "grid/order/pair_list_sorter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "base/memory.hpp"
#include "base/threads.hpp"
#include "grid/order/pair_sorter.hpp"
#include "support/configs.hpp"

namespace throng::grid {
namespace {

std::vector<const Kernels*> kernels_with_lists() {
  std::vector<const Kernels*> all;
  for (const Isa isa : tests::supported_isas()) {
    const Kernels* const kernels = find_kernels(isa);
    if (kernels->sort_lists) all.push_back(kernels);
  }
  return all;
}

// Lists of lengths up to `rows`, one after another, with a guard behind each; their
// seconds are elsewhere, or in the second half of the output memory.
TEST(SortedLists, MatchSeparateSorts) {
  std::mt19937 random(3);
  constexpr Pair guard{77, 78};
  for (const Kernels* kernels : kernels_with_lists()) {
    for (std::uint32_t rows = 8; rows <= 1104; rows += rows < 160 ? 8 : 104) {
      for (const bool in_place : {false, true}) {
        const std::uint32_t most = rows % 16 == 0 ? 3u : 0xfffffffeu;
        std::vector<Pair> pairs;
        std::vector<std::uint32_t> seconds;
        std::uint32_t counts[lists_per_sort];
        for (std::uint32_t i = 0; i < lists_per_sort; ++i) {
          counts[i] = i == 5 ? rows : static_cast<std::uint32_t>(random()) % (rows + 1);
          for (std::uint32_t k = 0; k < counts[i]; ++k) {
            pairs.push_back({1000 + i, static_cast<std::uint32_t>(random()) & most});
          }
          pairs.push_back(guard);
        }
        std::vector<Pair> want = pairs;
        PairList lists[lists_per_sort];
        std::size_t at = 0;
        for (const Pair& pair : pairs) seconds.push_back(pair.second);
        for (std::uint32_t i = 0; i < lists_per_sort; ++i) {
          Pair* const to = pairs.data() + at;
          std::uint32_t* const half = &to->first + counts[i];
          if (in_place) std::copy_n(seconds.data() + at, counts[i], half);
          lists[i] = {in_place ? half : seconds.data() + at, to, counts[i], 1000 + i};
          std::sort(want.begin() + static_cast<std::ptrdiff_t>(at),
                    want.begin() + static_cast<std::ptrdiff_t>(at + counts[i]));
          at += counts[i] + 1;
        }
        std::vector<std::uint32_t> scratch(rows * lists_per_sort + 1, 12345);
        kernels->sort_lists(lists, rows, scratch.data());
        ASSERT_EQ(scratch.back(), 12345u);
        ASSERT_EQ(pairs, want) << to_string(kernels->isa) << " " << rows << " rows";
      }
    }
  }
}

TEST(SortedLists, MayBeEmpty) {
  for (const Kernels* kernels : kernels_with_lists()) {
    const PairList none[lists_per_sort];
    std::uint32_t scratch[16 * lists_per_sort] = {};
    kernels->sort_lists(none, 8, scratch);
    kernels->sort_lists(none, 16, scratch);
  }
}

struct Scene {
  const char* name;
  std::vector<std::uint32_t> lengths;  // list length per first
  std::uint64_t second_count;
};

std::vector<Scene> scenes() {
  std::mt19937 random(5);
  std::vector<Scene> all;
  const auto add = [&](const char* name, std::size_t firsts, std::uint64_t second_count,
                       const auto& length) {
    Scene scene{name, {}, second_count};
    for (std::size_t f = 0; f < firsts; ++f) scene.lengths.push_back(length(f));
    all.push_back(std::move(scene));
  };
  const auto any = [&](std::uint32_t most) {
    return [&random, most](std::size_t) { return static_cast<std::uint32_t>(random()) % most; };
  };
  add("short", 3000, 100000, any(24));
  add("about a hundred", 1500, 1u << 19, any(200));
  add("of every length class", 700, 0xffffffff, [](std::size_t f) { return std::uint32_t(f); });
  add("one list", 1, 1u << 20, [](std::size_t) { return 30000u; });
  add("one short list", 1, 1u << 20, [](std::size_t) { return 3000u; });
  // One list sorted by digits among others, longer than the cached sort takes.
  add("long", 2000, 1u << 31, [&](std::size_t f) { return f == 700 ? 5000u : f % 40; });
  add("longest", 2000, 0xffffffff, [&](std::size_t f) { return f == 1999 ? 200000u : f % 9; });
  add("all but one in a hundred empty", 1000, 5000,
      [](std::size_t f) { return f % 100 == 99 ? 1500u : 0u; });
  return all;
}

TEST(PairSorter, EqualsASortOfPairs) {
  std::mt19937 random(6);
  std::size_t checked = 0;
  for (const Scene& scene : scenes()) {
    std::vector<Pair> pairs;
    for (std::size_t f = 0; f < scene.lengths.size(); ++f) {
      for (std::uint32_t k = 0; k < scene.lengths[f]; ++k) {
        const std::uint64_t second =
            (std::uint64_t{random()} << 32 | random()) % scene.second_count;
        pairs.push_back({static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(second)});
      }
    }
    std::shuffle(pairs.begin(), pairs.end(), random);
    std::vector<Pair> want = pairs;
    std::sort(want.begin(), want.end());
    for (const Isa isa : tests::supported_isas()) {
      for (const unsigned tasks : {1u, 2u, 5u}) {
        base::Memory memory(std::pmr::new_delete_resource(), 0);
        PairSorter sorter(memory);
        std::vector<Pair> from = pairs;
        constexpr Pair guard{77, 78};
        std::vector<Pair> to(pairs.size() + 1, guard);
        sorter.sort(*find_kernels(isa), base::default_executor(), tasks, from.data(), to.data(),
                    pairs.size(), scene.lengths.size(), scene.second_count);
        ASSERT_EQ(to.back(), guard);
        to.pop_back();
        ASSERT_EQ(to, want) << scene.name << ", " << to_string(isa) << ", " << tasks << " tasks";
        EXPECT_LE(sorter.held(), PairSorter::bytes_for(pairs.size(), tasks)) << scene.name;
        ++checked;
      }
    }
  }
  EXPECT_GE(checked, 8u * 3);
}

}  // namespace
}  // namespace throng::grid
