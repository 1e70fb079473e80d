// choose_update() on small made-up inputs and a table of round numbers; then what CostModel
// measures.
#include "tracking/cost_model.hpp"

#include <gtest/gtest.h>

namespace throng::tracking {
namespace {

constexpr base::CostTable table{.full_object_ns = 10,
                                .full_pair_ns = 5,
                                .local_object_ns = 100,
                                .comparison_ns = 2,
                                .index_build_ns = 20,
                                .forest_build_ns = 200,
                                .forest_comparisons = 100,
                                .forest_pair_comparisons = 10,
                                .guard = 4};

// 1000 objects with two pairs each; all is in place.
UpdateInput many(std::size_t changed) {
  UpdateInput in;
  in.objects = in.pairs = 1000;
  in.changed = changed;
  in.index = Index::cells;
  in.linked = true;
  in.comparisons = 30;
  return in;
}
UpdateChoice choose(const UpdateInput& in) { return choose_update(in, table); }

TEST(ChooseUpdate, ComparesPrices) {
  const UpdateChoice few = choose(many(10));
  EXPECT_TRUE(few.local);
  EXPECT_EQ(few.build, Index::absent);
  EXPECT_DOUBLE_EQ(few.full_ns, 1000 * 10 + 1000 * 5);
  EXPECT_DOUBLE_EQ(few.local_ns, 10 * (100 + 30 * 2 + 2 * 10));
  EXPECT_DOUBLE_EQ(few.forest_ns, few.local_ns);
  EXPECT_DOUBLE_EQ(few.build_ns, 0);
  EXPECT_TRUE(choose(many(83)).local);
  EXPECT_FALSE(choose(many(84)).local);
  EXPECT_FALSE(choose(many(1000)).local);
}

TEST(ChooseUpdate, ManyComparisonsCostMoreThanAFullSearch) {
  UpdateInput in = many(10);
  in.comparisons = 689;
  EXPECT_TRUE(choose(in).local);
  in.comparisons = 690;
  EXPECT_FALSE(choose(in).local);
  EXPECT_DOUBLE_EQ(choose(in).forest_ns, 10 * (100 + 120 * 2 + 2 * 10));
}

// Twenty per object and per pair; one update saves 14820.
TEST(ChooseUpdate, AnIndexIsBuiltOnceItWouldHaveSavedItsCost) {
  UpdateInput in = many(1);
  in.index = Index::absent;
  in.linked = false;
  EXPECT_DOUBLE_EQ(choose(in).build_ns, 40000);
  EXPECT_FALSE(choose(in).local);
  in.saved_ns = 25179;
  EXPECT_FALSE(choose(in).local);
  in.saved_ns = 25180;
  EXPECT_TRUE(choose(in).local);
  EXPECT_EQ(choose(in).build, Index::cells);
  in.changed = 1000;
  EXPECT_FALSE(choose(in).local);

  in = many(1);
  in.linked = false;
  EXPECT_DOUBLE_EQ(choose(in).build_ns, 20000);
  EXPECT_FALSE(choose(in).local);
  in.saved_ns = 20000;
  EXPECT_TRUE(choose(in).local);
  EXPECT_EQ(choose(in).build, Index::absent) << "only links";
}

TEST(ChooseUpdate, WastefulCellsBecomeAForest) {
  UpdateInput in = many(1);
  in.wasted_ns = 200000;
  EXPECT_EQ(choose(in).build, Index::absent);
  in.wasted_ns = 200001;
  EXPECT_EQ(choose(in).build, Index::forest);
  in.index = Index::absent;
  EXPECT_EQ(choose(in).build, Index::forest);
  in.index = Index::forest;
  EXPECT_EQ(choose(in).build, Index::absent);
  EXPECT_TRUE(choose(in).local);
}

TEST(ChooseUpdate, AnOldIndexIsBuiltAgain) {
  for (const Index index : {Index::cells, Index::forest}) {
    UpdateInput in = many(1);
    in.index = index;
    in.changed_since_build = 4000;
    EXPECT_EQ(choose(in).build, Index::absent);
    in.changed_since_build = 4001;
    in.wasted_ns = 1e9;
    EXPECT_EQ(choose(in).build, Index::cells);
    EXPECT_TRUE(choose(in).local);
  }
}

TEST(ChooseUpdate, NothingIsLeft) {
  UpdateInput in = many(5);
  in.objects = in.pairs = 0;
  EXPECT_FALSE(choose(in).local);
  EXPECT_EQ(choose(in).full_ns, 0);
}

// Of CostModel, with the real table.

constexpr std::size_t objects = 10000;

UpdateInput measured(const CostModel& costs, std::size_t changed) {
  return costs.measured({objects, 20000, changed, Index::cells, true});
}
// A local search that compares `each` boxes per object.
void search(CostModel& costs, std::size_t changed, std::uint64_t each, std::size_t searched) {
  const UpdateInput in = measured(costs, changed);
  costs.add_local_search(in, choose_update(in), false, {searched * each, 0, 0}, searched);
}

TEST(CostModel, AveragesComparisons) {
  CostModel costs;
  EXPECT_EQ(measured(costs, 1).comparisons, initial_comparisons());
  for (int k = 0; k < 40; ++k) search(costs, 100, 10, 100);
  EXPECT_NEAR(measured(costs, 1).comparisons, 10, 1);
  EXPECT_EQ(measured(costs, 1).changed_since_build, 4000u);
  EXPECT_EQ(measured(costs, 1).wasted_ns, 0);
}

// After each aborted search, more full searches.
TEST(CostModel, TriesAgainAfterAnAbortedSearch) {
  CostModel costs;
  search(costs, 5000, 1000, 5000);
  const auto full_searches = [&] {
    for (int full = 0;; ++full) {
      const UpdateInput in = measured(costs, 500);
      const UpdateChoice choice = choose_update(in);
      if (choice.local) return full;
      costs.add_full_search(in, choice);
    }
  };
  EXPECT_EQ(full_searches(), 0) << "it was not aborted";
  for (const int wait : {1, 3, 7, 15, 16, 16}) {
    search(costs, 5000, 1000, 2500);
    EXPECT_EQ(full_searches(), wait);
  }
  search(costs, 500, 20, 500);
  EXPECT_EQ(full_searches(), 0);
}

TEST(CostModel, ExpensiveSearchesInCellsAreWaste) {
  CostModel costs;
  const auto allowed = static_cast<std::uint64_t>(forest_comparisons(objects, 20000));
  EXPECT_EQ(allowed, 512u + 16 * 4);
  search(costs, 1000, allowed, 1000);
  EXPECT_FALSE(costs.forest_pays(objects));
  search(costs, 1000, allowed + 1000, 1000);
  EXPECT_TRUE(costs.forest_pays(objects));
  costs.add_build(Index::cells, objects);
  EXPECT_TRUE(costs.forest_pays(objects));
  costs.add_build(Index::forest, objects);
  EXPECT_FALSE(costs.forest_pays(objects));
}

TEST(CostModel, QueriesInCellsMayMakeAForestPay) {
  CostModel costs;
  costs.add_queries_in_cells({1000 * 512, 0, 0}, 1000, 0);
  EXPECT_FALSE(costs.forest_pays(objects));
  costs.add_queries_in_cells({1000 * 1512, 0, 0}, 1000, 0);
  EXPECT_TRUE(costs.forest_pays(objects));
}

// The waste of outdated cells is not that of new ones.
TEST(CostModel, NewCellsInPlaceOfOutdatedOnesStartAnew) {
  CostModel costs;
  costs.add_waste(1e9);
  for (int k = 0; k < 17; ++k) search(costs, objects, 20, objects);
  costs.add_build(Index::cells, objects);
  EXPECT_FALSE(costs.forest_pays(objects));
  EXPECT_EQ(measured(costs, 1).changed_since_build, 0u);
  EXPECT_EQ(measured(costs, 1).comparisons, initial_comparisons());
}

TEST(CostModel, AnIndexPaysForManyQueries) {
  CostModel costs;
  const double build = base::cost.index_build_ns * objects;
  EXPECT_FALSE(costs.index_pays(objects, build));
  EXPECT_TRUE(costs.index_pays(objects, build + 1));
  costs.add_saved(build + 1);
  EXPECT_TRUE(costs.index_pays(objects, 0));
  // A full search discards the index: it pays again, as it did before, but not a second time.
  const UpdateInput all = measured(costs, objects);
  costs.add_full_search(all, choose_update(all));
  EXPECT_TRUE(costs.index_pays(objects, 0));
  costs.add_full_search(all, choose_update(all));
  EXPECT_FALSE(costs.index_pays(objects, 0));
}

TEST(CostModel, ACopyMeasuredTheSame) {
  CostModel costs, copy;
  search(costs, 500, 2000, 500);
  costs.add_saved(1e9);
  copy.copy(costs);
  const UpdateInput a = measured(costs, 1), b = measured(copy, 1);
  EXPECT_EQ(a.comparisons, b.comparisons);
  EXPECT_EQ(a.saved_ns, b.saved_ns);
  EXPECT_EQ(a.wasted_ns, b.wasted_ns);
  EXPECT_EQ(a.changed_since_build, b.changed_since_build);
  EXPECT_GT(a.wasted_ns, 0);
}

}  // namespace
}  // namespace throng::tracking
