// The cost model of a BroadPhase: from counted work it decides which search and which index pay.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "tracking/work_counters.hpp"

namespace throng::tracking {

// What contains all objects except changed ones.
enum class Index : std::uint8_t { absent, cells, forest };

// Decisions affect cost only, never results. Few objects changed: an index finds the boxes around
// each of them. Many changed: all pairs are found from scratch. That leaves the index stale; it is
// rebuilt once the time that it would have saved since then equals the cost of building it.
//
// The index is Cells where boxes are spread out, otherwise a BvhForest. Work of searches in cells
// beyond `allowed_comparisons()` counts as waste. When the waste reaches the cost of a forest, a
// forest is built. So the total cost is less than twice that of the better index, for any input.
// Cells are tried again after as many changes as there are objects, with exponential backoff.
//
// Of the functions, those of queries may be called by several threads.
class CostModel {
 public:
  struct Sizes {
    std::size_t objects = 0, pairs = 0;
  };

  // Comparisons per search in cells that a forest would need, too.
  static double allowed_comparisons(const Sizes& sizes) noexcept;

  // ---- updates ----

  struct Choice {
    bool incremental = false;  // instead of a full search
    double saved_ns = 0;       // by it
    double max_lines = 0;      // of cells: beyond, the full search is cheaper
    double budget_ns = 0;      // abort the incremental search once it has cost this much
  };
  // Estimates both searches of an update. Now and then an incremental search is tried although it
  // seems more expensive: its estimate may be outdated.
  Choice choose(const Sizes& sizes, std::size_t changed, unsigned tasks, Index index) noexcept;
  // Work of each task that spends the budget; an incremental search is not aborted before a
  // minimum.
  static std::uint64_t max_work(double budget_ns, unsigned tasks) noexcept;

  // Without an index or links: adds what they would have saved. Returns whether to build them now.
  bool building_pays(const Sizes& sizes, double saved_ns) noexcept;
  void index_is_ready() noexcept { s_.regret_ns = 0; }
  // Whether cells are to be replaced: by new ones that fit better, or by a forest.
  bool cells_are_poor(const Sizes& sizes) const noexcept;
  // Whether to check if cells have become suitable in place of a forest.
  bool retry_of_cells_is_due(const Sizes& sizes) const noexcept {
    return s_.changed_since_build > s_.retry_interval * sizes.objects;
  }
  void cells_were_retried(bool built) noexcept;
  void add_changed(std::size_t objects) noexcept { s_.changed_since_build += objects; }
  // The changed objects are too wide for cells. Returns whether that happened before.
  bool note_too_wide() noexcept;

  // Before an index replaces `index`. Returns whether to try cells; otherwise build a forest.
  bool begin_build(const Sizes& sizes, Index index, bool links_valid) noexcept;
  void forest_is_built() noexcept { wasted_ns_ = 0; }

  // After the searches of an incremental update: updates the estimates for the next ones.
  void note_searches(const Sizes& sizes, const Work& work, std::size_t searched,
                     bool in_forest) noexcept;
  void incremental_search_ended(bool completed) noexcept;

  void begin_full_search() noexcept { s_.earlier_savings_ns = query_savings_ns_.exchange(0); }
  void end_full_search(const Sizes& sizes, std::uint64_t comparisons) noexcept;

  // ---- queries ----

  // A two-set search for the overlaps of many boxes; searches in an index, one per box.
  static double two_set_search_ns(std::size_t objects) noexcept;
  static double searches_ns(std::size_t boxes) noexcept;
  // Queries without an index that did this work.
  static double unindexed_ns(const Work& work) noexcept;

  enum class Cells : std::uint8_t { do_not_pay, pay, pay_for_this_call };
  // Cells pay once they would have saved the queries their building cost, or had done so before the
  // last full search. This holds for many single queries, too. So the total cost is less than three
  // times that of the best choices.
  Cells note_query_cost(const Sizes& sizes, std::size_t queries, double ns) noexcept;

  // Adds the work of queries in cells beyond that in a forest.
  void note_queries_in_cells(const Work& work, std::size_t queries, std::size_t hits) noexcept;
  bool forest_pays(const Sizes& sizes) const noexcept;
  void begin_forest() noexcept;

  // Adds cells that sweeps visited without block data. Returns whether to build it: with it they
  // skip most.
  bool blocks_pay(const Sizes& sizes, std::uint64_t cells) noexcept;
  void begin_blocks() noexcept { cells_visited_ = 0; }

  // Adds a scan of all pairs for those of one object. Returns whether to build PairsByObject, which
  // has `limit` lists.
  bool lists_pay(const Sizes& sizes, std::size_t limit) noexcept;
  void begin_lists() noexcept { pairs_scanned_ = 0; }

  void copy(const CostModel& other) noexcept;

 private:
  void add_waste(double ns) noexcept;

  // Expected comparisons per search around a changed object, initially.
  static constexpr double initial_comparisons = 24;

  // All but what queries on several threads change.
  struct State {
    double regret_ns = 0;  // that an index, or a better layout of cells, would have saved
    std::size_t changed_since_build = 0;
    bool rebuilt_once = false;       // cells, since the last forest or reset of the waste
    bool changed_too_wide = false;   // the last changed objects were too wide for cells
    std::size_t retry_interval = 1;  // cells are tried again after this many changes per object
    double full_search_ns = 0;       // comparison cost per object of the last full search
    // Updates until the incremental search is tried again, and the next such interval.
    std::uint32_t retry_countdown = 1, retry_wait = 1;
    double earlier_savings_ns = 0;  // query_savings_ns_ of the period before the last full search
    double expected_comparisons = initial_comparisons;
    // Comparisons per search in newly built cells, divided by (pairs per object + 1); 0: not
    // measured.
    double new_cell_comparisons = 0;
  };
  State s_;
  std::atomic<double> wasted_ns_{0};  // that a forest would have saved
  // That cells would have saved queries since the last full search. Counted only as far as it
  // affects the decision.
  std::atomic<double> query_savings_ns_{0};
  std::atomic<std::uint64_t> cells_visited_{0};  // by sweeps without block data
  std::atomic<std::uint64_t> pairs_scanned_{0};  // for the pairs of single objects
};

}  // namespace throng::tracking
