// FilterClassTable against the filters themselves.
#include "tracking/filter_class_table.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/random.hpp"

namespace throng::tracking {
namespace {

using tests::Random;

// One of `combinations` filters, some of which differ in one value only.
Filter some_filter(Random& random, std::uint32_t combinations) {
  const std::uint32_t k = random.below(combinations);
  Filter f;
  f.group = 1u << k % 3;
  f.mask = k / 3 % 2 ? 3u : 0xffffffffu;
  f.world = static_cast<std::int32_t>(k / 6 % 3) - 1;
  f.is_static = k / 18 % 2 ? 5 : 0;
  if (k >= 36) f.group |= k << 3;
  f.owner = random.between(-1, 3);
  return f;
}

void check_random_changes(std::uint32_t combinations, std::size_t objects, bool overflow_allowed) {
  Random random(combinations);
  struct Object {
    Filter filter;
    std::uint8_t filter_class;
  };
  std::vector<Object> all;
  FilterClassTable table;
  bool had_overflow = false;
  for (int step = 0; step < 3000; ++step) {
    if (all.size() < objects && !random.one_in(3)) {
      const Filter f = some_filter(random, combinations);
      all.push_back({f, table.add(f)});
      ASSERT_LE(all.back().filter_class, FilterClassTable::overflow_class);
    } else if (!all.empty()) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(all.size()));
      table.remove(all[at].filter_class);
      all[at] = all.back();
      all.pop_back();
    }
    had_overflow |= table.has_overflow();
    for (int k = 0; k < 20 && !all.empty(); ++k) {
      const Object& a = all[random.below(static_cast<std::uint32_t>(all.size()))];
      const Object& b = all[random.below(static_cast<std::uint32_t>(all.size()))];
      Filter of_a = a.filter, of_b = b.filter;
      of_a.owner = of_b.owner = -1;
      const bool undecided = a.filter_class == FilterClassTable::overflow_class ||
                             b.filter_class == FilterClassTable::overflow_class;
      ASSERT_EQ(table.allow(a.filter_class, b.filter_class), undecided || allows(of_a, of_b));
      if (a.filter_class == b.filter_class && !undecided) {
        ASSERT_EQ(of_a.group, of_b.group);
        ASSERT_EQ(of_a.mask, of_b.mask);
        ASSERT_EQ(of_a.world, of_b.world);
        ASSERT_EQ(of_a.is_static != 0, of_b.is_static != 0);
      }
    }
  }
  EXPECT_EQ(had_overflow, overflow_allowed);
}

TEST(FilterClassTable, Few) { check_random_changes(30, 200, false); }
TEST(FilterClassTable, ReusesClasses) { check_random_changes(100, 12, false); }
TEST(FilterClassTable, OverflowClass) { check_random_changes(60, 200, true); }

}  // namespace
}  // namespace throng::tracking
