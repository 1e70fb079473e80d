// Finds cost cliffs without a clock: comparisons and visited objects, per object, query and result,
// stay below the bounds of one table on scenes of many kinds. measure.hpp defines the counts,
// work_bounds.hpp the bounds; scripts/work_bound draws more and larger scenes.
#include <gtest/gtest.h>

#include <algorithm>

#include "work/work_bounds.hpp"
#include "work/worst_ratios.hpp"

namespace throng::tests {
namespace {

class WorkBounds : public testing::TestWithParam<std::string> {};

// Draws per family: some that are also compared with a double loop, then larger ones.
constexpr std::uint64_t checked_draws = 3, draws = 10;

TEST_P(WorkBounds, Hold) {
  WorstRatios worst_ratios;
  for (std::uint64_t seed = 1; seed <= checked_draws; ++seed)
    worst_ratios.add(draw_work(seed, 300, 600, GetParam()));
  for (std::uint64_t seed = 100; seed < 100 + draws; ++seed)
    worst_ratios.add(draw_work(seed, work_least, 20000, GetParam()));
  EXPECT_EQ(worst_ratios.wrong(), "");
  EXPECT_EQ(worst_ratios.violations(), "")
      << "throng-work-bound with these arguments reproduces one";
}

INSTANTIATE_TEST_SUITE_P(Families, WorkBounds, testing::ValuesIn(work_families()),
                         [](const auto& which) {
                           std::string name = which.param;
                           for (char& c : name)
                             if (c == '-') c = '_';
                           return name;
                         });

// Each call has a bound for any family; each row's family exists.
TEST(WorkBounds, TableIsComplete) {
  for (int w = 0; w < work_count; ++w) {
    int rows = 0;
    for (const WorkBound& b : work_bounds)
      rows += b.family[0] == '\0' && b.work == static_cast<Work>(w);
    EXPECT_EQ(rows, 1) << to_string(static_cast<Work>(w));
  }
  const auto& names = work_families();
  for (const WorkBound& b : work_bounds) {
    if (b.family[0] == '\0') continue;
    EXPECT_NE(std::find(names.begin(), names.end(), b.family), names.end()) << b.family;
    EXPECT_NE(std::string(b.reason), "") << b.family << " needs a reason";
  }
}

}  // namespace
}  // namespace throng::tests
