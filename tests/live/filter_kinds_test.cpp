// FilterKinds against the filters themselves.
#include "live/filter_kinds.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "support/random.hpp"

namespace throng::live {
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

void live(std::uint32_t combinations, std::size_t objects, bool may_have_others) {
  Random random(combinations);
  struct Object {
    Filter filter;
    std::uint8_t kind;
  };
  std::vector<Object> all;
  FilterKinds kinds;
  bool had_others = false;
  for (int step = 0; step < 3000; ++step) {
    if (all.size() < objects && !random.one_in(3)) {
      const Filter f = some_filter(random, combinations);
      all.push_back({f, kinds.add(f)});
      ASSERT_LE(all.back().kind, FilterKinds::others);
    } else if (!all.empty()) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(all.size()));
      kinds.remove(all[at].kind);
      all[at] = all.back();
      all.pop_back();
    }
    had_others |= kinds.has_others();
    for (int k = 0; k < 20 && !all.empty(); ++k) {
      const Object& a = all[random.below(static_cast<std::uint32_t>(all.size()))];
      const Object& b = all[random.below(static_cast<std::uint32_t>(all.size()))];
      Filter of_a = a.filter, of_b = b.filter;
      of_a.owner = of_b.owner = -1;
      const bool unsure = a.kind == FilterKinds::others || b.kind == FilterKinds::others;
      ASSERT_EQ(kinds.allow(a.kind, b.kind), unsure || allows(of_a, of_b));
      if (a.kind == b.kind && !unsure) {
        ASSERT_EQ(of_a.group, of_b.group);
        ASSERT_EQ(of_a.mask, of_b.mask);
        ASSERT_EQ(of_a.world, of_b.world);
        ASSERT_EQ(of_a.is_static != 0, of_b.is_static != 0);
      }
    }
  }
  EXPECT_EQ(had_others, may_have_others);
}

TEST(FilterKinds, Few) { live(30, 200, false); }
TEST(FilterKinds, OnesThatWereUsedMakeRoom) { live(100, 12, false); }
TEST(FilterKinds, MoreThanThereIsRoomFor) { live(60, 200, true); }

}  // namespace
}  // namespace throng::live
