// Merging the tasks' reports of inactive and NaN boxes.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "grid/search.hpp"

namespace throng::grid {
namespace {

TEST(BinReport, ReportsTheFirstForAnyOrder) {
  struct Inactive {
    std::uint64_t id;
    bool nan, is_target;
  };
  // The first NaN is index 5 of the queries; lower indices of the targets come after it.
  std::vector<Inactive> all = {
      {3, false, false}, {2, true, true}, {5, true, false}, {9, true, false}};
  std::vector<std::size_t> order = {0, 1, 2, 3};
  do {
    for (std::size_t split = 0; split <= order.size(); ++split) {
      BinReport parts[2];
      for (std::size_t k = 0; k < order.size(); ++k) {
        const Inactive& i = all[order[k]];
        parts[k < split].add_inactive(i.id, i.nan, i.is_target);
      }
      BinReport report;
      for (const BinReport& part : parts) report.add(part);
      EXPECT_EQ(report.inactive, 4u);
      EXPECT_EQ(report.nan_count, 3u);
      EXPECT_EQ(report.first_nan, 5u);
      EXPECT_FALSE(report.nan_in_targets);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

}  // namespace
}  // namespace throng::grid
