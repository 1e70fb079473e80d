// What a BroadPhase keeps: objects, pairs, cells, and which way an update goes.
//
// Few changed: each of them is compared with the pairs it had and with the boxes around it, which
// an index finds. Many changed: all pairs are found from scratch, as a Finder does, and merged with
// those there were. After the latter the index is stale; building it again is put off until what it
// would have saved since is as much as that costs. Queries have the columns in which pairs were
// found.
//
// The index is Cells where boxes are spread out, and a BvhForest where they are not. Searches in
// cells are counted: what they look at beyond `fair_comparisons()` is waste. Once the waste is as
// much as a forest costs, there is one. So whatever the boxes, less than twice is paid of what the
// better index would have cost. After as many changes as there are objects cells are tried again,
// and later and later where they do not suit.
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
  // `already_held`: bytes of whoever owns this, which count too.
  Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept;

  const Objects& objects() const noexcept { return objects_; }
  // To change them.
  Objects& change() noexcept {
    ready_ = false;
    return objects_;
  }
  PairSet& pairs() noexcept { return pairs_; }
  cpu::Memory& memory() noexcept { return engine_.memory(); }

  // Throws cpu::NoMemory, having changed nothing.
  void update(const Options& options, Result& result);
  // Whether one of the boxes has a NaN.
  static bool has_nan(const Boxes& boxes, const Options& options) noexcept;
  // Gives the objects of `boxes` that moved their new ones, on several threads where that pays.
  void move_all(const Boxes& boxes, const Options& options) noexcept;

  // The pairs of an object in canonical order, if `out` has room for them all; how many there are.
  // Several threads may ask at once, and beside questions.
  std::size_t pairs_of(ObjectId id, LivePair* out, std::size_t room) noexcept;

  // Questions; see query.hpp. While nothing else is called several may be asked at once, each by
  // Queries of its own. Throw cpu::NoMemory.
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

  // In tracker_questions.cpp.
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

  cpu::Engine engine_;  // its memory is that of all
  Objects objects_;
  PairSet pairs_;
  PairsByObject by_object_;
  Cells cells_;
  BvhForest forest_;
  List<ObjectId> entering_;  // room for objects that go into the forest
  Queries queries_;
  cpu::EachTask<Around> around_;
  List<Pair> found_;
  std::mutex preparing_;            // what those who ask share
  std::atomic<bool> ready_{false};  // what changed is where questions look for it
  enum class Index : std::uint8_t { absent, cells, forest };
  std::atomic<Index> index_{Index::absent};  // what all objects but those that changed are in
  std::atomic<bool> blocked_{false};         // and which blocks of them are empty
  std::atomic<bool> indexed_{false};  // which of the pairs, as they are in order, an object has
  bool linked_ = false;               // pairs are linked; where not, they are in order
  bool columned_ = false;             // the engine's columns hold all but what has changed since
  double regret_ = 0;  // ns that an index would have saved, or better cells than those there are
  // ns that a forest would have saved; and objects that changed since there has been this index.
  std::atomic<double> wasted_{0};
  std::size_t changed_ = 0;
  bool retried_ = false;      // these cells are not the first since there was a forest, or waste
  std::size_t patience_ = 1;  // after so many changes per object cells are tried again
  bool too_wide_ = false;     // what changed has been so for cells
  double all_ns_ = 0;         // what comparing cost an object when all pairs were last found
  // Searching around what changed is tried again in so many updates; the next time in so many.
  std::uint32_t try_in_ = 1, try_wait_ = 1;
  // What cells would have saved questions, ns, as far as that makes a difference: since all pairs
  // were last found anew, and from the time before that.
  std::atomic<double> asked_{0};
  double asked_before_ = 0;
  std::atomic<std::uint64_t> walked_{0};  // cells that sweeps looked into, without blocks
  std::atomic<std::uint64_t> looked_{0};  // pairs that were looked at for those of one object
  // What things cost, in ns, measured on the machine of docs/benchmarks.md; only the ratios matter.
  // Making cells, and a forest, an object; searching around a box, and each comparison there.
  static constexpr double cell_ns = 35, forest_ns = 250, search_ns = 80, comparison_ns = 6;
  // A search in a forest takes as long as so many comparisons in cells, and so many for each pair.
  static constexpr double fair_search = 512, fair_per_pair = 16;
  // What a box is compared with in a search around an object that changed: before the first, and
  // as searches have shown it.
  static constexpr double first_comparisons = 24;
  double comparisons_ = first_comparisons;
  // Of a search, in cells as they were when new, per pair of an object and one more; 0: not known
  // yet.
  double usual_comparisons_ = 0;
};

}  // namespace throng::live
