// What a BroadPhase keeps: objects, pairs, cells, and which way an update goes.
//
// Few changed: each of them is compared with the pairs it had and with the boxes around it, which
// Cells find. Many changed: all pairs are found anew, as a Finder does, and merged with those there
// were. After the latter the cells are stale; making them anew is put off until what they would
// have saved since is as much as that costs. Questions have the columns in which pairs were found.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>

#include <throng/broad_phase.hpp>
#include <throng/finder.hpp>

#include "cpu/engine.hpp"
#include "live/around.hpp"
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
  bool few_changed(const Options& options, unsigned tasks);
  void make_cells(const Options& options);
  void require_cells(const Options& options);
  bool settle_cells(const Options& options, double most_lines);
  bool settle_listed(const ObjectId* dirty, std::size_t count, double most_lines) noexcept;
  void search_around(const Options& options, unsigned tasks, Result& result);
  void learn(double compared) noexcept;
  void find_all(const Options& options, unsigned tasks, Result& result);
  static Result find_into(cpu::Engine& engine, List<Pair>& found, const Boxes& a, const Boxes* b,
                          float margin, const Options& options);

  // In tracker_questions.cpp.
  Options to_prepare(const Queries& by, const Options& options) const noexcept;
  void get_ready(const Queries& by, const Options& options);
  void asked(const Queries& by, std::size_t count, double ns, const Options& options);
  void walked(std::uint64_t cells) noexcept;
  bool index_pairs() noexcept;
  std::optional<Columns> columns() noexcept;
  Ground ground() noexcept;

  cpu::Engine engine_;  // its memory is that of all
  Objects objects_;
  PairSet pairs_;
  PairsByObject by_object_;
  Cells cells_;
  Queries queries_;
  cpu::EachTask<Around> around_;
  List<Pair> found_;
  std::mutex preparing_;              // what those who ask share
  std::atomic<bool> ready_{false};    // what changed is where questions look for it
  std::atomic<bool> placed_{false};   // cells are kept
  std::atomic<bool> blocked_{false};  // and which blocks of them are empty
  std::atomic<bool> indexed_{false};  // which of the pairs, as they are in order, an object has
  bool linked_ = false;               // pairs are linked; where not, they are in order
  bool columned_ = false;             // the engine's columns hold all but what has changed since
  double regret_ = 0;  // ns that cells would have saved, or better cells than those there are
  // What cells would have saved questions, ns, as far as that makes a difference: since all pairs
  // were last found anew, and from the time before that.
  std::atomic<double> asked_{0};
  double asked_before_ = 0;
  std::atomic<std::uint64_t> walked_{0};  // cells that sweeps looked into, without blocks
  std::atomic<std::uint64_t> looked_{0};  // pairs that were looked at for those of one object
  // What things cost, in ns, measured on the machine of docs/benchmarks.md; only the ratios matter.
  // Making cells, an object; searching around a box, and each comparison there.
  static constexpr double cell_ns = 35, search_ns = 80, comparison_ns = 6;
  // What a box is compared with in a search around an object that changed: before the first, and
  // as searches have shown it.
  static constexpr double first_comparisons = 24;
  double comparisons_ = first_comparisons;
  double usual_comparisons_ = 0;  // of a search, in cells as they were when new; 0: not known yet
};

}  // namespace throng::live
