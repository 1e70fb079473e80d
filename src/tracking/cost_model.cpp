#include "tracking/cost_model.hpp"

#include <algorithm>
#include <utility>

#include "base/atomics.hpp"

namespace throng::tracking {
namespace {

// All costs are ns, measured on the machine of docs/explanation/benchmarks.md; only the ratios
// matter.

// Building cells and a forest, per object; linking one pair.
constexpr double cell_ns = 35, forest_ns = 250, link_ns = 30;
// A search around one box; per comparison in it; per cache line of cells that it visits.
constexpr double search_ns = 80, comparison_ns = 6, line_ns = 15;
// Per changed object: placing it in a cell (forest) and reporting its events; per pair that it had.
constexpr double place_ns = 70, place_in_forest_ns = 600, previous_pair_ns = 45;
// Full search, per object and per pair; fraction of a thread's speed that each further thread adds.
constexpr double find_object_ns = 18, find_pair_ns = 14, thread_efficiency = 0.7;
// Per comparison of a full search; matters where comparisons far outnumber objects.
constexpr double full_comparison_ns = 0.25;
// A forest search costs as much as this many comparisons in cells, plus this many per pair.
constexpr double allowed_per_search = 512, allowed_per_pair = 16;
// Below this many objects a forest saves too little.
constexpr std::size_t min_forest_objects = 256;
// Decay, per full search, of a comparison estimate that caused it; and the longest interval, in
// updates, after which the incremental search is tried again.
constexpr double estimate_decay = 0.01;
constexpr std::uint32_t max_wait_updates = 8;
// Longest backoff: cells are tried again after this many changes per object. Doubles each time the
// waste reached the cost of a forest.
constexpr std::size_t max_retry_interval = 64;
// An incremental search is not aborted before this much work.
constexpr double min_work = 4096;
// Cells count as outdated when a search compares twice as many boxes per pair as in new cells, and
// more than this.
constexpr double outdated_comparisons = 64;
// Number of searches after which the weight of older ones has halved.
constexpr double estimate_half_life = 256;
// Overlaps of many boxes with all objects as a two-set search, per object; one query in cells.
constexpr double search_object_ns = 8, cell_query_ns = 1500;
// Without an index: visiting a column record; comparing a box.
constexpr double record_ns = 1, compared_ns = 5;
// Scanning a pair for those of one object; building PairsByObject, per pair and per object.
constexpr double scan_pair_ns = 0.5, build_pair_ns = 6, build_object_ns = 2;
// Building block data costs, per object, as much as visiting this many cells.
constexpr double block_build_cells = 0.5;

double pairs_per_object(const CostModel::Sizes& sizes) noexcept {
  return 2 * static_cast<double>(sizes.pairs) /
         static_cast<double>(std::max<std::size_t>(sizes.objects, 1));
}

}  // namespace

double CostModel::allowed_comparisons(const Sizes& sizes) noexcept {
  return allowed_per_search + allowed_per_pair * pairs_per_object(sizes);
}

CostModel::Choice CostModel::choose(const Sizes& sizes, std::size_t changed, unsigned tasks,
                                    Index index) noexcept {
  const auto objects = static_cast<double>(sizes.objects), pairs = static_cast<double>(sizes.pairs);
  const double threads = 1 + thread_efficiency * (tasks - 1);
  const double all =
      (objects * std::max(find_object_ns, s_.full_search_ns) + pairs * find_pair_ns) / threads;
  const double place = index == Index::forest ? place_in_forest_ns : place_ns;
  const auto incremental_cost = [&](double comparisons) {
    const double search =
        search_ns + comparison_ns * comparisons + previous_pair_ns * pairs_per_object(sizes);
    return static_cast<double>(changed) * (place + search / threads);
  };
  double few = incremental_cost(s_.expected_comparisons);
  if (few >= all) {
    // These searches may be cheaper than earlier ones, so they are tried now and then.
    if (index != Index::forest) {
      const double least = std::min(s_.expected_comparisons, allowed_comparisons(sizes));
      add_waste(all - incremental_cost(least));
    }
    s_.expected_comparisons += estimate_decay * (initial_comparisons - s_.expected_comparisons);
    few = incremental_cost(initial_comparisons);
    if (few >= all || --s_.retry_countdown != 0) return {};
    s_.retry_countdown = 1;
  }
  return {true, all - few, all / line_ns, all * threads};
}

std::uint64_t CostModel::max_work(double budget_ns, unsigned tasks) noexcept {
  return static_cast<std::uint64_t>(std::max(budget_ns / comparison_ns / tasks, min_work));
}

bool CostModel::building_pays(const Sizes& sizes, double saved_ns) noexcept {
  s_.regret_ns += saved_ns;
  const double cost =
      static_cast<double>(sizes.objects) * cell_ns + static_cast<double>(sizes.pairs) * link_ns;
  return s_.regret_ns >= cost || forest_pays(sizes);
}

bool CostModel::cells_are_poor(const Sizes& sizes) const noexcept {
  return forest_pays(sizes) || s_.regret_ns > static_cast<double>(sizes.objects) * cell_ns;
}

void CostModel::cells_were_retried(bool built) noexcept {
  if (built) s_.rebuilt_once = true;
  s_.changed_since_build = 0;
}

bool CostModel::note_too_wide() noexcept {
  s_.regret_ns = 0;
  return std::exchange(s_.changed_too_wide, true);
}

void CostModel::add_waste(double ns) noexcept {
  if (ns > 0) base::add(wasted_ns_, ns);
}

bool CostModel::forest_pays(const Sizes& sizes) const noexcept {
  return wasted_ns_.load(std::memory_order_relaxed) >
         forest_ns * static_cast<double>(std::max(sizes.objects, min_forest_objects));
}

void CostModel::begin_forest() noexcept {
  wasted_ns_ = 0;
  s_.changed_since_build = 0;
}

bool CostModel::begin_build(const Sizes& sizes, Index index, bool links_valid) noexcept {
  // Many changes since the cells were built may explain the waste; accepted as the reason only
  // once.
  const bool outdated =
      index == Index::cells && s_.changed_since_build > sizes.objects / 8 && !s_.rebuilt_once;
  const bool try_cells = outdated || !forest_pays(sizes);
  s_.rebuilt_once = outdated && forest_pays(sizes);
  if (!try_cells) s_.retry_interval = std::min(2 * s_.retry_interval, max_retry_interval);
  if (links_valid) s_.regret_ns = 0;
  s_.new_cell_comparisons = 0;
  // If the cells were not outdated, new ones would waste as much.
  if (outdated) wasted_ns_ = 0;
  s_.changed_since_build = 0;
  return try_cells;
}

void CostModel::note_searches(const Sizes& sizes, const Work& work, std::size_t searched,
                              bool in_forest) noexcept {
  const auto searches = static_cast<double>(searched);
  const auto compared = static_cast<double>(in_forest ? work.total() : work.compared);
  s_.expected_comparisons +=
      (compared / searches - s_.expected_comparisons) * searches / (searches + estimate_half_life);
  if (in_forest) return;
  add_waste(comparison_ns * (compared - allowed_comparisons(sizes) * searches));
  const double pairs = 1 + pairs_per_object(sizes);
  const double allowed =
      std::max(outdated_comparisons, 2 * s_.new_cell_comparisons * pairs) * searches;
  if (s_.new_cell_comparisons == 0) {
    s_.new_cell_comparisons = (compared / searches + 1) / pairs;
  } else {
    s_.regret_ns += comparison_ns * std::max(0.0, compared - allowed);
  }
}

void CostModel::incremental_search_ended(bool completed) noexcept {
  s_.retry_wait = completed ? 1 : std::min(2 * s_.retry_wait, max_wait_updates);
  s_.retry_countdown = s_.retry_wait;
}

void CostModel::end_full_search(const Sizes& sizes, std::uint64_t comparisons) noexcept {
  s_.full_search_ns = full_comparison_ns * static_cast<double>(comparisons) /
                      static_cast<double>(std::max<std::size_t>(sizes.objects, 1));
}

double CostModel::two_set_search_ns(std::size_t objects) noexcept {
  return search_object_ns * static_cast<double>(objects);
}
double CostModel::searches_ns(std::size_t boxes) noexcept {
  return search_ns * static_cast<double>(boxes);
}
double CostModel::unindexed_ns(const Work& work) noexcept {
  return record_ns * static_cast<double>(work.visited) +
         compared_ns * static_cast<double>(work.compared);
}

CostModel::Cells CostModel::note_query_cost(const Sizes& sizes, std::size_t queries,
                                            double ns) noexcept {
  const double saved = std::max(0.0, ns - cell_query_ns * static_cast<double>(queries));
  const double cells = cell_ns * static_cast<double>(sizes.objects);
  double sum = query_savings_ns_.load(std::memory_order_relaxed);
  if (sum <= cells) sum = base::add(query_savings_ns_, saved);
  if (std::max(sum, s_.earlier_savings_ns) <= cells) return Cells::do_not_pay;
  return saved > cells ? Cells::pay_for_this_call : Cells::pay;
}

void CostModel::note_queries_in_cells(const Work& work, std::size_t queries,
                                      std::size_t hits) noexcept {
  const double allowed = allowed_per_search * static_cast<double>(queries) +
                         allowed_per_pair * static_cast<double>(hits);
  add_waste(comparison_ns * (static_cast<double>(work.total()) - allowed));
}

bool CostModel::blocks_pay(const Sizes& sizes, std::uint64_t cells) noexcept {
  cells_visited_ += cells;
  return block_build_cells * static_cast<double>(sizes.objects) <=
         static_cast<double>(cells_visited_);
}

bool CostModel::lists_pay(const Sizes& sizes, std::size_t limit) noexcept {
  const auto pairs = static_cast<double>(sizes.pairs);
  const auto scanned = static_cast<double>(pairs_scanned_ += sizes.pairs);
  return scan_pair_ns * scanned >=
         build_pair_ns * pairs + build_object_ns * static_cast<double>(limit);
}

void CostModel::copy(const CostModel& other) noexcept {
  s_ = other.s_;
  wasted_ns_ = other.wasted_ns_.load();
  query_savings_ns_ = other.query_savings_ns_.load();
  cells_visited_ = 0;
  pairs_scanned_ = 0;
}

}  // namespace throng::tracking
