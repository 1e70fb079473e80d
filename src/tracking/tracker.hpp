// Owns what a BroadPhase keeps (objects, pairs, indexes) and chooses how an update runs.
//
// Few objects changed: an index finds the boxes around each of them, and the result is compared
// with its previous pairs. Many changed: all pairs are found from scratch, as by a Finder, and
// merged with the previous pairs. That leaves the index stale; it is rebuilt once the time that it
// would have saved since then equals the cost of building it. Queries can use the columns of the
// last full search.
//
// The index is Cells where boxes are spread out, otherwise a BvhForest. Work of searches in cells
// beyond `allowed_comparisons()` counts as waste. When the waste reaches the cost of a forest, a
// forest is built. So the total cost is less than twice that of the better index, for any input.
// Cells are tried again after as many changes as there are objects, with exponential backoff.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>

#include <throng/broad_phase.hpp>
#include <throng/finder.hpp>

#include "grid/engine.hpp"
#include "tracking/bvh_forest.hpp"
#include "tracking/cells.hpp"
#include "tracking/local_update.hpp"
#include "tracking/objects.hpp"
#include "tracking/pair_set.hpp"
#include "tracking/pairs_by_object.hpp"
#include "tracking/queries.hpp"

namespace throng::tracking {

class Tracker {
 public:
  // `already_held`: bytes of the owning object, included in the memory count.
  Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept;

  const Objects& objects() const noexcept { return objects_; }
  // Mutable access; the index becomes stale.
  Objects& mutable_objects() noexcept {
    placement_valid_ = false;
    return objects_;
  }
  PairSet& pairs() noexcept { return pairs_; }
  grid::Memory& memory() noexcept { return engine_.memory(); }

  // Throws grid::AllocationFailed and then changes nothing.
  void update(const Options& options, Result& result);
  // Whether any box contains a NaN.
  static bool has_nan(const Boxes& boxes, const Options& options) noexcept;
  // Stores the new box of each object whose box differs; uses several threads for many objects.
  void move_all(const Boxes& boxes, const Options& options) noexcept;

  // Returns how many pairs the object has; writes them in sorted order if `capacity` is enough.
  // Thread-safe against itself and against queries.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t capacity) noexcept;

  // Queries; see query.hpp. Thread-safe against each other with one Queries each, while no other
  // call runs. Throw grid::AllocationFailed.
  void find_overlaps(Queries& caller, const Boxes& boxes, const Options& options, Result& result);
  void find_hits(Queries& caller, const Sweeps& sweeps, const Options& options, Result& result);
  Queries& queries() noexcept { return queries_; }

  void reserve_for(const Tracker& other);
  void copy(const Tracker& other) noexcept;

 private:
  void apply_changes(const Options& options, unsigned tasks, Result& result);
  bool prepare_incremental(const Options& options, unsigned tasks, double& budget_ns);
  void build_index(const Options& options);
  void build_forest(bool others_unset);
  bool place_dirty(const Options& options, double max_lines);
  bool place_in_cells(const ObjectId* dirty, std::size_t count, double max_lines) noexcept;
  void place_in_forest(const ObjectId* dirty, std::size_t count);
  double allowed_comparisons() const noexcept;
  void add_waste(double ns) noexcept;
  bool forest_pays() const noexcept;
  bool search_incrementally(const Options& options, unsigned tasks, double budget_ns,
                            Result& result);
  void update_estimates(const Work& work, std::size_t searched) noexcept;
  void find_all(const Options& options, unsigned tasks, Result& result);
  static Result find_into(grid::Engine& engine, PodVector<Pair>& found, const Boxes& a,
                          const Boxes* b, float margin, const Options& options);

  // Defined in tracker_questions.cpp.
  Options preparation_options(const Queries& caller, const Options& options) const noexcept;
  void place_for_queries(const Queries& caller, const Options& options);
  void note_query_cost(const Queries& caller, std::size_t count, double ns, const Options& options);
  void note_cells_visited(std::uint64_t cells) noexcept;
  void note_excess_cost(const Queries& caller, const Work& work, double expected,
                        const Options& options) noexcept;
  void note_query_work(const Work& work, std::size_t queries, std::size_t hits) noexcept;
  bool build_object_pairs() noexcept;
  std::optional<Columns> columns() noexcept;
  QueryIndex query_index() noexcept;

  grid::Engine engine_;  // its memory resource serves all members
  Objects objects_;
  PairSet pairs_;
  PairsByObject by_object_;
  Cells cells_;
  BvhForest forest_;
  PodVector<ObjectId> insert_queue_;  // scratch: objects to insert into the forest
  Queries queries_;
  grid::PerThread<LocalUpdate> local_updates_;
  PodVector<Pair> found_;
  std::mutex prepare_mutex_;                  // guards what concurrent queries share
  std::atomic<bool> placement_valid_{false};  // changed objects are in the index
  enum class Index : std::uint8_t { absent, cells, forest };
  std::atomic<Index> index_{Index::absent};      // contains all objects except changed ones
  std::atomic<bool> blocks_valid_{false};        // cells_.blocks() is up to date
  std::atomic<bool> object_pairs_valid_{false};  // by_object_ matches the sorted pairs
  bool links_valid_ = false;    // the linked form of pairs_ is valid; otherwise the sorted form is
  bool columns_valid_ = false;  // the engine's columns hold all objects except those changed since
  double regret_ = 0;           // ns that an index, or a better layout of cells, would have saved
  // ns that a forest would have saved; changes of objects since this index was built.
  std::atomic<double> wasted_ns_{0};
  std::size_t changed_since_build_ = 0;
  // cells were already rebuilt once since the last forest or reset of the waste
  bool rebuilt_once_ = false;
  std::size_t retry_interval_ = 1;  // cells are tried again after this many changes per object
  bool changed_too_wide_ = false;   // the last changed objects were too wide for cells
  double full_search_ns_ = 0;       // comparison cost per object of the last full search
  // Updates until the incremental search is tried again, and the next such interval.
  std::uint32_t retry_countdown_ = 1, retry_wait_ = 1;
  // ns that cells would have saved queries: since the last full search, and in the period before
  // it. Counted only as far as it affects the decision.
  std::atomic<double> query_savings_ns_{0};
  double earlier_savings_ns_ = 0;
  std::atomic<std::uint64_t> cells_visited_{0};  // cells that sweeps visited without block data
  std::atomic<std::uint64_t> pairs_scanned_{0};  // pairs scanned by pairs_of()
  // Cost model, ns; measured on the machine of docs/benchmarks.md; only the ratios matter. Building
  // cells and a forest, per object; a search around one box, and per comparison in it.
  static constexpr double cell_ns = 35, forest_ns = 250, search_ns = 80, comparison_ns = 6;
  // A forest search costs as much as this many comparisons in cells, plus this many per pair.
  static constexpr double allowed_per_search = 512, allowed_per_pair = 16;
  // Expected comparisons per search around a changed object: the initial value and the running
  // estimate.
  static constexpr double initial_comparisons = 24;
  double expected_comparisons_ = initial_comparisons;
  // Comparisons per search in newly built cells, divided by (pairs per object + 1); 0: not
  // measured.
  double new_cell_comparisons_ = 0;
};

}  // namespace throng::tracking
