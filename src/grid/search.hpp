// The state of one call's search: its input, its workers' shared data, its failure.
#pragma once

#include <atomic>
#include <cstdint>

#include <throng/boxes.hpp>
#include <throng/options.hpp>

#include "base/bounds.hpp"
#include "base/cost_table.hpp"
#include "base/memory.hpp"
#include "base/mutex.hpp"
#include "base/quantize.hpp"
#include "grid/bin/filter_classes.hpp"
#include "grid/doubles.hpp"
#include "grid/emit/pair_output.hpp"
#include "grid/emit/pair_sink.hpp"
#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

// Some boxes of a view: all, or a list of ids. A grid identifies a box by its label; without
// labels, by its id.
struct BoxSubset {
  const Boxes* boxes = nullptr;
  const std::uint32_t* ids = nullptr;  // null: 0 .. count-1
  std::uint32_t count = 0;
  const std::uint32_t* labels = nullptr;

  std::uint32_t id(std::uint32_t i) const noexcept { return ids ? ids[i] : i; }
  std::uint32_t label(std::uint32_t i) const noexcept { return labels ? labels[i] : id(i); }
};

// The column of a coarser grid inside which a search runs, with boxes labelled 0, 1, ... A pair is
// reported only if that column is its owner cell (the one cell that reports the pair; others may
// hold both boxes too): on no axis do both boxes start in an earlier column (base/quantize.hpp).
struct ParentCell {
  const std::uint32_t* ids = nullptr;  // by label
  const RejectMask* masks = nullptr;   // by label: of this column and the enclosing ones
};

// Finds the pairs of queries with targets and, if `self`, of queries among themselves.
struct Problem {
  BoxSubset queries, targets;
  bool self = true;
  const ParentCell* parent = nullptr;
  // Offset that a grid adds to the labels of targets; if not 0, all labels are distinct.
  std::uint32_t target_id_offset = 0;

  std::uint32_t id_offset(unsigned side) const noexcept { return side == 0 ? 0 : target_id_offset; }
  const BoxSubset& subset(unsigned side) const noexcept { return side == 0 ? queries : targets; }
};
inline std::uint64_t box_count(const Problem& p) noexcept {
  return std::uint64_t{p.queries.count} + p.targets.count;
}
// The number of comparisons of brute force, for so many queries and targets of a problem.
inline double brute_force_comparisons(const Problem& p, double queries, double targets) noexcept {
  return (p.self ? queries * queries / 2 : 0) + queries * targets;
}
inline double brute_force_comparisons(const Problem& p) noexcept {
  return brute_force_comparisons(p, p.queries.count, p.targets.count);
}

// Counts of the boxes that take no part.
struct BinReport {
  std::uint64_t inactive = 0;  // lower > upper, or NaN
  std::uint64_t nan_count = 0;
  std::uint64_t first_nan = ~std::uint64_t{0};  // the least index; queries come before targets
  bool nan_in_targets = false;

  // Independent of the order of calls: a finished task helps with earlier boxes.
  void add_inactive(std::uint64_t id, bool nan, bool is_target) noexcept {
    BinReport one;
    one.inactive = 1;
    if (nan) {
      one.nan_count = 1;
      one.first_nan = id;
      one.nan_in_targets = is_target;
    }
    add(one);
  }
  // Merges two parts of the same boxes.
  void add(const BinReport& other) noexcept {
    const bool earlier = other.nan_in_targets != nan_in_targets ? !other.nan_in_targets
                                                                : other.first_nan < first_nan;
    if (other.nan_count && (!nan_count || earlier)) {
      first_nan = other.first_nan;
      nan_in_targets = other.nan_in_targets;
    }
    inactive += other.inactive;
    nan_count += other.nan_count;
  }
};

// A further test of pairs of overlapping boxes, of what the boxes contain.
class PairTest {
 public:
  // Moves the pairs that pass to the front, in any order, and returns their number. Called from any
  // thread, with at most staging_pairs + PairOutput::slack pairs.
  virtual std::size_t keep(Pair* pairs, std::size_t count) const = 0;
  // Called before each pass over all pairs: what was counted before is void.
  virtual void restart() noexcept = 0;

 protected:
  ~PairTest() = default;
};

// Shared by all workers of a call.
struct Search {
  const Boxes* a = nullptr;  // pair.first is of a, pair.second of b
  const Boxes* b = nullptr;  // equals a if there is one set
  bool two_sets = false;
  const Doubles* doubles = nullptr;    // the exact boxes that a and b approximate, if any
  std::uint32_t target_id_offset = 0;  // see PairOutput
  float margin = 0;
  float cell_scale = 1;
  bool flat = false;                              // all boxes are 2-D
  const FilterClasses* filter_classes = nullptr;  // set if static, group or mask forbid anything
  PairTest* pair_test = nullptr;                  // applied last; null: none
  bool owners = false;                            // two boxes may have the same owner
  // Boxes of different worlds may be compared: two that span too many columns, or any two.
  bool wide_worlds = false, any_worlds = false;
  const Kernels* kernels = nullptr;
  double stream_bytes = base::cost.stream_bytes;
  const Executor* executor = nullptr;
  base::Memory* memory = nullptr;
  Sink* sink = nullptr;
  const std::atomic<bool>* stop = nullptr;

  // The box as it is compared: expanded by the margin.
  Box box(const Boxes& view, std::uint32_t id) const noexcept {
    const Box box = view[id];
    return margin != 0 ? base::expand(box, margin) : box;
  }
  Orientation forward() const noexcept {
    return two_sets ? Orientation::query_first : Orientation::unordered;
  }
  Orientation backward() const noexcept {
    return two_sets ? Orientation::target_first : Orientation::unordered;
  }

  // Records the first failure of any worker; the others stop at their next check.
  void fail(Status status, std::uint64_t bytes) noexcept {
    const std::lock_guard<base::Mutex> lock(mutex_);
    if (status_ != Status::ok) return;
    status_ = status;
    bytes_ = bytes;
    failed_ = true;
  }
  bool over() noexcept {
    if (stop && stop->load(std::memory_order_relaxed)) fail(Status::stopped, 0);
    return failed_.load(std::memory_order_relaxed) || (sink && sink->stopped());
  }
  bool failed() const noexcept { return failed_; }
  Status status() const noexcept { return status_; }
  std::uint64_t bytes() const noexcept { return bytes_; }

  // Runs `body`; turns the library's exceptions into a failure.
  template <class F>
  void guarded(F&& body) {
    try {
      body();
    } catch (const base::AllocationFailed& e) {
      fail(Status::out_of_memory, e.bytes);
    } catch (const base::CapExceeded& e) {
      fail(Status::memory_cap_too_small, e.bytes_needed);
    }
  }

 private:
  base::Mutex mutex_;
  std::atomic<bool> failed_{false};
  Status status_ = Status::ok;
  std::uint64_t bytes_ = 0;
};

// Of both sets.
inline std::uint64_t box_count(const Search& s) noexcept {
  return std::uint64_t{s.a->size()} + (s.two_sets ? s.b->size() : 0);
}

}  // namespace throng::grid
