// The decisions of CostModel from work that is given as numbers.
#include "tracking/cost_model.hpp"

#include <gtest/gtest.h>

namespace throng::tracking {
namespace {

constexpr CostModel::Sizes many{10000, 20000};

// Searches that compare `each` boxes.
Work work_of(std::size_t searches, std::uint64_t each) { return {searches * each, 0}; }

TEST(CostModel, SearchesAroundFewChangedObjects) {
  CostModel costs;
  EXPECT_TRUE(costs.choose(many, 100, 1, Index::cells).incremental);
  EXPECT_FALSE(costs.choose(many, 10000, 1, Index::cells).incremental);
  const CostModel::Choice few = costs.choose(many, 10, 1, Index::cells);
  const CostModel::Choice more = costs.choose(many, 100, 1, Index::cells);
  EXPECT_GT(few.saved_ns, more.saved_ns);
  EXPECT_EQ(few.budget_ns, more.budget_ns);
}

TEST(CostModel, MoreThreadsAllowMoreWork) {
  CostModel costs;
  const CostModel::Choice one = costs.choose(many, 100, 1, Index::cells);
  const CostModel::Choice four = costs.choose(many, 100, 4, Index::cells);
  EXPECT_LT(four.saved_ns, one.saved_ns);
  EXPECT_DOUBLE_EQ(four.budget_ns, one.budget_ns);
  EXPECT_EQ(CostModel::max_work(6e6, 1), 1000000u);
  EXPECT_EQ(CostModel::max_work(6e6, 4), 250000u);
  EXPECT_EQ(CostModel::max_work(0, 1), 4096u);
}

TEST(CostModel, RetriesAfterAnExpensiveSearch) {
  CostModel costs;
  costs.note_searches(many, work_of(100000, 1000), 100000, false);
  int skipped = 0;
  while (!costs.choose(many, 500, 1, Index::cells).incremental) ++skipped;
  EXPECT_EQ(skipped, 0);
  for (int wait = 1; wait < 8; wait = 2 * wait + 1) {
    costs.incremental_search_ended(false);
    for (skipped = 0; !costs.choose(many, 500, 1, Index::cells).incremental;) ++skipped;
    EXPECT_EQ(skipped, wait);
  }
  costs.incremental_search_ended(false);  // the longest interval
  for (skipped = 0; !costs.choose(many, 500, 1, Index::cells).incremental;) ++skipped;
  EXPECT_EQ(skipped, 7);
  costs.incremental_search_ended(true);
  EXPECT_TRUE(costs.choose(many, 500, 1, Index::cells).incremental);
}

TEST(CostModel, AnIndexIsBuiltOnceItWouldHaveSavedItsCost) {
  CostModel costs;
  const double cost = 10000 * 35.0 + 20000 * 30.0;
  EXPECT_FALSE(costs.building_pays(many, cost / 2));
  EXPECT_FALSE(costs.building_pays(many, cost / 4));
  EXPECT_TRUE(costs.building_pays(many, cost / 4));
  costs.index_is_ready();
  EXPECT_FALSE(costs.building_pays(many, cost / 2));
}

TEST(CostModel, AForestPaysOnceCellsWastedItsCost) {
  CostModel costs;
  const auto allowed = static_cast<std::uint64_t>(CostModel::allowed_comparisons(many));
  EXPECT_EQ(allowed, 512u + 16 * 4);
  costs.note_searches(many, work_of(1000, allowed), 1000, false);
  EXPECT_FALSE(costs.forest_pays(many));
  costs.note_searches(many, work_of(1000, allowed + 1000), 1000, false);
  EXPECT_TRUE(costs.forest_pays(many));
  EXPECT_TRUE(costs.cells_are_poor(many));
  EXPECT_FALSE(costs.begin_build(many, Index::cells, true));
  costs.forest_is_built();
  EXPECT_FALSE(costs.forest_pays(many));
}

TEST(CostModel, QueriesInCellsMayMakeAForestPay) {
  CostModel costs;
  costs.note_queries_in_cells(work_of(1000, 512), 1000, 0);
  EXPECT_FALSE(costs.forest_pays(many));
  costs.note_queries_in_cells(work_of(1000, 1512), 1000, 0);
  EXPECT_TRUE(costs.forest_pays(many));
  costs.begin_forest();
  EXPECT_FALSE(costs.forest_pays(many));
}

// Cells that many changes made poor are built once more, but not twice in a row.
TEST(CostModel, OutdatedCellsAreTriedOnceMore) {
  CostModel costs;
  const auto waste = [&] { costs.note_queries_in_cells(work_of(1000, 2000), 1000, 0); };
  costs.add_changed(5000);
  waste();
  EXPECT_TRUE(costs.begin_build(many, Index::cells, true));
  EXPECT_FALSE(costs.forest_pays(many)) << "the waste counts from the new cells on";
  costs.add_changed(5000);
  waste();
  EXPECT_FALSE(costs.begin_build(many, Index::cells, true));
  // From a forest, cells are tried after twice as many changes each time.
  costs.forest_is_built();
  costs.add_changed(20000);
  EXPECT_FALSE(costs.retry_of_cells_is_due(many));
  costs.add_changed(1);
  EXPECT_TRUE(costs.retry_of_cells_is_due(many));
  costs.cells_were_retried(false);
  EXPECT_FALSE(costs.retry_of_cells_is_due(many));
}

TEST(CostModel, CellsThatFitWorseThanNewOnesArePoor) {
  CostModel costs;
  costs.note_searches(many, work_of(1000, 20), 1000, false);
  costs.note_searches(many, work_of(1000, 64), 1000, false);
  EXPECT_FALSE(costs.cells_are_poor(many));
  costs.note_searches(many, work_of(1000, 264), 1000, false);
  EXPECT_TRUE(costs.cells_are_poor(many));
  EXPECT_FALSE(costs.forest_pays(many));
}

TEST(CostModel, CellsPayForManyQueries) {
  CostModel costs;
  const double cells = 10000 * 35.0;
  using enum CostModel::Cells;
  EXPECT_EQ(costs.note_query_cost(many, 1, cells / 2 + 1500), do_not_pay);
  EXPECT_EQ(costs.note_query_cost(many, 1, cells + 1500), pay);
  costs.begin_full_search();
  EXPECT_EQ(costs.note_query_cost(many, 1, 0), pay) << "they had paid before the full search";
  costs.begin_full_search();
  EXPECT_EQ(costs.note_query_cost(many, 1, 0), do_not_pay);
  EXPECT_EQ(costs.note_query_cost(many, 1, 2 * cells), pay_for_this_call);
}

TEST(CostModel, BlocksAndListsAreBuiltAfterWorkOfTheSameCost) {
  CostModel costs;
  EXPECT_FALSE(costs.blocks_pay(many, 4999));
  EXPECT_TRUE(costs.blocks_pay(many, 1));
  costs.begin_blocks();
  EXPECT_FALSE(costs.blocks_pay(many, 1));
  const auto scans_until_lists = [&] {
    int scans = 1;
    while (!costs.lists_pay(many, 10000)) ++scans;
    return scans;
  };
  EXPECT_EQ(scans_until_lists(), 14);  // (6 * 20000 + 2 * 10000) / (0.5 * 20000)
  costs.begin_lists();
  EXPECT_EQ(scans_until_lists(), 14);
}

TEST(CostModel, ChangesTooWideForCellsCountFromTheSecondTime) {
  CostModel costs;
  EXPECT_FALSE(costs.note_too_wide());
  EXPECT_TRUE(costs.note_too_wide());
}

TEST(CostModel, ACopyDecidesAlike) {
  CostModel costs, copy;
  costs.note_queries_in_cells(work_of(1000, 2000), 1000, 0);
  costs.add_changed(20001);
  (void)costs.note_too_wide();
  (void)costs.note_query_cost(many, 1, 1e9);
  copy.copy(costs);
  EXPECT_TRUE(copy.forest_pays(many));
  EXPECT_TRUE(copy.retry_of_cells_is_due(many));
  EXPECT_TRUE(copy.note_too_wide());
  EXPECT_EQ(copy.note_query_cost(many, 1, 0), CostModel::Cells::pay);
}

}  // namespace
}  // namespace throng::tracking
