// Owns what a BroadPhase keeps (objects, pairs, indexes) and runs updates and queries.
// choose_update() decides how: around the changed objects in an index, compared with their previous
// pairs, or from scratch, as by a Finder, merged with the previous pairs. Queries can use the
// columns of the last full search.
#pragma once

#include <atomic>
#include <cstdint>

#include <throng/broad_phase.hpp>
#include <throng/finder.hpp>
#include <throng/memory_resource.hpp>

#include "base/mutex.hpp"
#include "grid/engine.hpp"
#include "tracking/bvh_forest.hpp"
#include "tracking/cells.hpp"
#include "tracking/cost_model.hpp"
#include "tracking/local_update.hpp"
#include "tracking/objects.hpp"
#include "tracking/pair_set.hpp"
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
  base::Memory& memory() noexcept { return engine_.memory(); }

  // Throws base::AllocationFailed and then changes nothing.
  void update(const Options& options, Result& result);
  // Whether any box contains a NaN.
  static bool has_nan(const Boxes& boxes, const Options& options) noexcept;
  // Stores the new box of each object whose box differs; uses several threads for many objects.
  void move_all(const Boxes& boxes, const Options& options) noexcept;

  // Returns how many pairs the object has; writes them in sorted order if `capacity` is enough.
  // Thread-safe against itself and against queries.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t capacity) noexcept;

  // Queries; see queries.hpp. Thread-safe against each other with one Queries each, while no other
  // call runs. Throw base::AllocationFailed.
  void find_overlaps(Queries& caller, const Boxes& boxes, const Options& options, Result& result);
  void find_hits(Queries& caller, const Sweeps& sweeps, const Options& options, Result& result);
  // Likewise, without a Queries.
  SweepHit find_first_hit(const Cast& cast, const Options& options, Result& result);
  Queries& queries() noexcept { return queries_; }

  void reserve_for(const Tracker& other);
  void copy(const Tracker& other) noexcept;

 private:
  void find_changes(const Options& options, unsigned team, Result& result);
  void build_index(Index wanted, const Options& options);
  void build_forest(bool others_unset);
  void link_pairs();
  void ensure_capacity(const Options& options);
  bool place(const ObjectId* ids, std::size_t count, double max_lines);
  bool search_around_changed(const UpdateInput& in, const UpdateChoice& choice, unsigned tasks,
                             const Options& options, Result& result);
  void find_all(const Options& options, Result& result);
  static Result find_into(grid::Engine& engine, PodVector<Pair>& found, const Boxes& a,
                          const Boxes* b, float margin, const Options& options);

  struct Prepared {
    QueryIndex index;
    double saved_ns;  // by an index
  };
  // `concurrent`: others may run at the same time.
  template <class Query>
  Prepared prepare_queries(bool concurrent, std::size_t count, const Query& query,
                           const Options& options);
  void place_for_queries(const Options& options);
  void note_queries(const Prepared& prepared, const Work& work, std::size_t queries,
                    std::size_t hits, Result& result) noexcept;
  std::optional<Columns> columns() noexcept;

  grid::Engine engine_;  // its memory resource serves all members
  Objects objects_;
  PairSet pairs_;
  Cells cells_;
  BvhForest forest_;
  Queries queries_;
  base::PerThread<LocalUpdate> local_updates_;
  PodVector<Pair> found_;
  base::Mutex prepare_mutex_;                 // guards what concurrent queries share
  std::atomic<bool> placement_valid_{false};  // changed objects are in the index
  std::atomic<Index> index_{Index::absent};   // contains all objects except changed ones
  std::atomic<bool> blocks_valid_{false};     // cells_.blocks() is up to date
  std::atomic<bool> links_valid_{false};      // the linked form of pairs_ is valid; otherwise the
                                              // sorted form is
  std::atomic<std::uint64_t> far_cells_{0};   // that sweeps visited without block data
  std::atomic<std::uint32_t> pair_scans_{0};  // for the pairs of single objects
  bool columns_valid_ = false;  // the engine's columns hold all objects except those changed since
  CostModel costs_;
};

}  // namespace throng::tracking
