// Which search an update runs, and which index it uses: choose_update(), a pure function of what
// CostModel measures. Choices affect cost only, never results.
//
// Few objects changed: searches around each of them, in an index. Many changed: a full search. That
// leaves the index stale; it is built again once the time that it would have saved since then
// equals the cost of building it.
//
// The index is Cells where boxes are spread out, otherwise a BvhForest. What cells cost beyond a
// forest is waste. When the waste reaches the cost of a forest, a forest is built. So the total
// cost is less than twice that of the better index, for any input. Any index is built again, as
// cells if they suit, after as many changes per object as make that cheap.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "base/cost_table.hpp"
#include "tracking/work_counters.hpp"

namespace throng::tracking {

// What contains all objects except changed ones.
enum class Index : std::uint8_t { absent, cells, forest };

// Boxes that a search around an object compares, until that has been measured: they cost as much as
// the rest of the search.
inline double initial_comparisons() noexcept {
  return base::cost.local_object_ns / base::cost.comparison_ns;
}

struct UpdateInput {
  std::size_t objects = 0, pairs = 0, changed = 0;
  Index index = Index::absent;
  bool linked = false;  // the pairs are listed by object
  // As CostModel measured.
  double comparisons = initial_comparisons();  // of a search around an object, on average
  double saved_ns = 0, wasted_ns = 0;
  std::size_t changed_since_build = 0;
};

struct UpdateChoice {
  // Prices: of a full search; of searches around the changed objects, and of those in a forest; of
  // the index and the lists of pairs that they need and that do not exist.
  double full_ns = 0, local_ns = 0, forest_ns = 0, build_ns = 0;
  bool local = false;           // search around the changed objects
  Index build = Index::absent;  // and build this first; absent: nothing
};
UpdateChoice choose_update(const UpdateInput& in,
                           const base::CostTable& table = base::cost) noexcept;

// Comparisons per search in cells that a forest would need, too.
double forest_comparisons(std::size_t objects, std::size_t pairs,
                          const base::CostTable& table = base::cost) noexcept;

// What the choices of one BroadPhase are made from. Functions for queries may be called by several
// threads.
class CostModel {
 public:
  // Completes an input.
  UpdateInput measured(UpdateInput in) const noexcept;

  // After an update by this choice: with a full search; around `searched` of the changed objects.
  void add_full_search(const UpdateInput& in, const UpdateChoice& choice) noexcept;
  void add_local_search(const UpdateInput& in, const UpdateChoice& choice, bool in_forest,
                        const Work& work, std::size_t searched) noexcept;
  // Cells did not serve: with a forest this would have been saved.
  void add_waste(double ns) noexcept;
  void add_build(Index built, std::size_t objects) noexcept;

  // Whether to build an index before queries that it saves this much; what it saved, or would have
  // saved.
  bool index_pays(std::size_t objects, double ns) const noexcept;
  void add_saved(double ns) noexcept;
  // The work of queries in cells; whether to replace the cells by a forest.
  void add_queries_in_cells(const Work& work, std::size_t queries, std::size_t hits) noexcept;
  bool forest_pays(std::size_t objects) const noexcept;

  void copy(const CostModel& other) noexcept;

 private:
  double comparisons_ = initial_comparisons();  // of a search around an object, on average
  // After an aborted search, choices of full searches before it is tried again as if nothing were
  // known, and how many there were.
  std::uint32_t wait_ = 0, waited_ = 0;
  std::size_t changed_since_build_ = 0;  // objects
  // What an index saved, or would have saved, since it was last lost to a full search; and the same
  // before that.
  std::atomic<double> saved_ns_{0};
  double saved_before_ns_ = 0;
  std::atomic<double> wasted_ns_{0};  // what a forest would have saved, compared with cells
};

}  // namespace throng::tracking
