#include "tracking/cost_model.hpp"

#include <algorithm>

#include "base/atomics.hpp"

namespace throng::tracking {
namespace {

using base::cost;

double pairs_per_object(std::size_t objects, std::size_t pairs) noexcept {
  return 2 * static_cast<double>(pairs) / static_cast<double>(std::max<std::size_t>(objects, 1));
}
bool is_outdated(std::size_t changed_since_build, std::size_t objects,
                 const base::CostTable& table) noexcept {
  return static_cast<double>(changed_since_build) > table.guard * static_cast<double>(objects);
}

}  // namespace

double forest_comparisons(std::size_t objects, std::size_t pairs,
                          const base::CostTable& table) noexcept {
  return table.forest_comparisons +
         table.forest_pair_comparisons * pairs_per_object(objects, pairs);
}

UpdateChoice choose_update(const UpdateInput& in, const base::CostTable& table) noexcept {
  const auto objects = static_cast<double>(in.objects), pairs = static_cast<double>(in.pairs);
  const auto local_ns = [&](double comparisons) {
    // A previous pair costs about as much as two pairs of a full search.
    return static_cast<double>(in.changed) *
           (table.local_object_ns + table.comparison_ns * comparisons +
            2 * table.full_pair_ns * pairs_per_object(in.objects, in.pairs));
  };
  UpdateChoice out;
  out.full_ns = objects * table.full_object_ns + pairs * table.full_pair_ns;
  out.local_ns = local_ns(in.comparisons);
  out.forest_ns =
      local_ns(std::min(in.comparisons, forest_comparisons(in.objects, in.pairs, table)));
  const bool outdated = is_outdated(in.changed_since_build, in.objects, table);
  const bool wasteful = in.wasted_ns > objects * table.forest_build_ns;
  if (in.index == Index::absent || outdated || (in.index == Index::cells && wasteful))
    out.build = wasteful && !outdated ? Index::forest : Index::cells;
  out.build_ns = (in.index == Index::absent ? objects * table.index_build_ns : 0) +
                 (in.linked ? 0 : pairs * table.index_build_ns);
  const double saved_ns = out.full_ns - out.local_ns;
  out.local = saved_ns > 0 && in.saved_ns + saved_ns >= out.build_ns;
  return out;
}

UpdateInput CostModel::measured(UpdateInput in) const noexcept {
  in.comparisons = waited_ < wait_ ? comparisons_ : std::min(comparisons_, initial_comparisons());
  in.saved_ns = std::max(saved_ns_.load(std::memory_order_relaxed), saved_before_ns_);
  in.wasted_ns = wasted_ns_.load(std::memory_order_relaxed);
  in.changed_since_build = changed_since_build_;
  return in;
}

void CostModel::add_full_search(const UpdateInput& in, const UpdateChoice& choice) noexcept {
  if (choice.local_ns < choice.full_ns) return add_saved(choice.full_ns - choice.local_ns);
  saved_before_ns_ = saved_ns_.exchange(0);
  if (in.index != Index::forest) add_waste(choice.full_ns - choice.forest_ns);
  ++waited_;
}

void CostModel::add_local_search(const UpdateInput& in, const UpdateChoice& choice, bool in_forest,
                                 const Work& work, std::size_t searched) noexcept {
  add_saved(choice.full_ns - choice.local_ns);
  changed_since_build_ += in.changed;
  const auto searches = static_cast<double>(searched);
  const auto compared = static_cast<double>(in_forest ? work.total() : work.compared);
  const double average = compared / searches;
  comparisons_ += (average - comparisons_) * searches / (searches + cost.average_searches);
  wait_ =
      searched == in.changed ? 0 : std::min(2 * wait_ + 1, static_cast<std::uint32_t>(cost.guard));
  waited_ = 0;
  if (!in_forest)
    add_waste(cost.comparison_ns *
              (compared - searches * forest_comparisons(in.objects, in.pairs)));
}

void CostModel::add_waste(double ns) noexcept {
  if (ns > 0) base::add(wasted_ns_, ns);
}

void CostModel::add_build(Index built, std::size_t objects) noexcept {
  if (built == Index::forest || is_outdated(changed_since_build_, objects, base::cost)) {
    wasted_ns_ = 0;
    comparisons_ = initial_comparisons();
  }
  changed_since_build_ = 0;
}

bool CostModel::index_pays(std::size_t objects, double ns) const noexcept {
  const double saved = std::max(saved_ns_.load(std::memory_order_relaxed) + ns, saved_before_ns_);
  return saved > cost.index_build_ns * static_cast<double>(objects);
}

void CostModel::add_saved(double ns) noexcept {
  if (ns > 0) base::add(saved_ns_, ns);
}

void CostModel::add_queries_in_cells(const Work& work, std::size_t queries,
                                     std::size_t hits) noexcept {
  const double needed = cost.forest_comparisons * static_cast<double>(queries) +
                        cost.forest_pair_comparisons * static_cast<double>(hits);
  add_waste(cost.comparison_ns * (static_cast<double>(work.total()) - needed));
}

bool CostModel::forest_pays(std::size_t objects) const noexcept {
  return wasted_ns_.load(std::memory_order_relaxed) >
         cost.forest_build_ns * static_cast<double>(objects);
}

void CostModel::copy(const CostModel& other) noexcept {
  comparisons_ = other.comparisons_;
  wait_ = other.wait_;
  waited_ = other.waited_;
  changed_since_build_ = other.changed_since_build_;
  saved_ns_ = other.saved_ns_.load();
  saved_before_ns_ = other.saved_before_ns_;
  wasted_ns_ = other.wasted_ns_.load();
}

}  // namespace throng::tracking
