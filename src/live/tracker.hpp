// Owns what a BroadPhase keeps (objects, pairs, indexes) and chooses how an update runs.
//
// Few objects changed: an index finds the boxes around each of them, and the result is compared
// with its previous pairs. Many changed: all pairs are found from scratch, as by a Finder, and
// merged with the previous pairs. That leaves the index stale; it is rebuilt once the time that it
// would have saved since then equals the cost of building it. Queries can use the columns of the
// last full search.
//
// The index is Cells where boxes are spread out, otherwise a BvhForest. Work of searches in cells
// beyond `fair_comparisons()` counts as waste. When the waste reaches the cost of a forest, a
// forest is built. So the total cost is less than twice that of the better index, for any input.
// Cells are tried again after as many changes as there are objects, with exponential backoff.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>

#include <throng/broad_phase.hpp>
#include <throng/finder.hpp>

#include "cpu/engine.hpp"
#include "live/around.hpp"
#include "live/bvh_forest.hpp"
#include "live/cells.hpp"
#include "live/objects.hpp"
#include "live/pair_set.hpp"
#include "live/pairs_by_object.hpp"
#include "live/query.hpp"

namespace throng::live {

class Tracker {
 public:
  // `already_held`: bytes of the owning object, included in the memory count.
  Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept;

  const Objects& objects() const noexcept { return objects_; }
  // Mutable access; the index becomes stale.
  Objects& change() noexcept {
    ready_ = false;
    return objects_;
  }
  PairSet& pairs() noexcept { return pairs_; }
  cpu::Memory& memory() noexcept { return engine_.memory(); }

  // Throws cpu::NoMemory and then changes nothing.
  void update(const Options& options, Result& result);
  // Whether any box contains a NaN.
  static bool has_nan(const Boxes& boxes, const Options& options) noexcept;
  // Stores the new box of each object whose box differs; uses several threads for many objects.
  void move_all(const Boxes& boxes, const Options& options) noexcept;

  // Returns how many pairs the object has; writes them in sorted order if `room` is enough.
  // Thread-safe against itself and against queries.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t room) noexcept;

  // Queries; see query.hpp. Thread-safe against each other with one Queries each, while no other
  // call runs. Throw cpu::NoMemory.
  void find_overlaps(Queries& by, const Boxes& boxes, const Options& options, Result& result);
  void find_hits(Queries& by, const Sweeps& sweeps, const Options& options, Result& result);
  Queries& queries() noexcept { return queries_; }

  void reserve_for(const Tracker& other);
  void copy(const Tracker& other) noexcept;

 private:
  void catch_up(const Options& options, unsigned tasks, Result& result);
  bool few_changed(const Options& options, unsigned tasks, double& most_ns);
  void make_index(const Options& options);
  void build_forest(bool others_are_none);
  bool settle_all(const Options& options, double most_lines);
  bool settle_in_cells(const ObjectId* dirty, std::size_t count, double most_lines) noexcept;
  void settle_in_forest(const ObjectId* dirty, std::size_t count);
  double fair_comparisons() const noexcept;
  void waste(double ns) noexcept;
  bool forest_pays() const noexcept;
  bool search_around(const Options& options, unsigned tasks, double most_ns, Result& result);
  void learn(const Work& work, std::size_t searched) noexcept;
  void find_all(const Options& options, unsigned tasks, Result& result);
  static Result find_into(cpu::Engine& engine, List<Pair>& found, const Boxes& a, const Boxes* b,
                          float margin, const Options& options);

  // Defined in tracker_questions.cpp.
  Options to_prepare(const Queries& by, const Options& options) const noexcept;
  void get_ready(const Queries& by, const Options& options);
  void asked(const Queries& by, std::size_t count, double ns, const Options& options);
  void walked(std::uint64_t cells) noexcept;
  void cost_more(const Queries& by, const Work& work, double expected,
                 const Options& options) noexcept;
  void looked_at(const Work& work, std::size_t queries, std::size_t hits) noexcept;
  bool index_pairs() noexcept;
  std::optional<Columns> columns() noexcept;
  Ground ground() noexcept;

  cpu::Engine engine_;  // its memory resource serves all members
  Objects objects_;
  PairSet pairs_;
  PairsByObject by_object_;
  Cells cells_;
  BvhForest forest_;
  List<ObjectId> entering_;  // scratch: objects to insert into the forest
  Queries queries_;
  cpu::EachTask<Around> around_;
  List<Pair> found_;
  std::mutex preparing_;            // guards what concurrent queries share
  std::atomic<bool> ready_{false};  // changed objects are in the index
  enum class Index : std::uint8_t { absent, cells, forest };
  std::atomic<Index> index_{Index::absent};  // contains all objects except changed ones
  std::atomic<bool> blocked_{false};         // cells_.blocks() is up to date
  std::atomic<bool> indexed_{false};         // by_object_ matches the sorted pairs
  bool linked_ = false;    // the linked form of pairs_ is valid; otherwise the sorted form is
  bool columned_ = false;  // the engine's columns hold all objects except those changed since
  double regret_ = 0;      // ns that an index, or a better layout of cells, would have saved
  // ns that a forest would have saved; changes of objects since this index was built.
  std::atomic<double> wasted_{0};
  std::size_t changed_ = 0;
  // cells were already rebuilt once since the last forest or reset of the waste
  bool retried_ = false;
  std::size_t patience_ = 1;  // cells are tried again after this many changes per object
  bool too_wide_ = false;     // the last changed objects were too wide for cells
  double all_ns_ = 0;         // comparison cost per object of the last full search
  // Updates until the incremental search is tried again, and the next such interval.
  std::uint32_t try_in_ = 1, try_wait_ = 1;
  // ns that cells would have saved queries: since the last full search, and in the period before
  // it. Counted only as far as it affects the decision.
  std::atomic<double> asked_{0};
  double asked_before_ = 0;
  std::atomic<std::uint64_t> walked_{0};  // cells that sweeps visited without block data
  std::atomic<std::uint64_t> looked_{0};  // pairs scanned by pairs_of()
  // Cost model, ns; measured on the machine of docs/benchmarks.md; only the ratios matter. Building
  // cells and a forest, per object; a search around one box, and per comparison in it.
  static constexpr double cell_ns = 35, forest_ns = 250, search_ns = 80, comparison_ns = 6;
  // A forest search costs as much as this many comparisons in cells, plus this many per pair.
  static constexpr double fair_search = 512, fair_per_pair = 16;
  // Expected comparisons per search around a changed object: the initial value and the running
  // estimate.
  static constexpr double first_comparisons = 24;
  double comparisons_ = first_comparisons;
  // Comparisons per search in newly built cells, divided by (pairs per object + 1); 0: not
  // measured.
  double usual_comparisons_ = 0;
};

}  // namespace throng::live
