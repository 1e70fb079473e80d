// One call's search: what is asked, who works on it, and what went wrong.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include <throng/boxes.hpp>
#include <throng/options.hpp>

#include "core/bounds.hpp"
#include "core/quantise.hpp"
#include "cpu/doubles.hpp"
#include "cpu/emit.hpp"
#include "cpu/kernels.hpp"
#include "cpu/kinds.hpp"
#include "cpu/memory.hpp"
#include "cpu/sink.hpp"

namespace throng::cpu {

// Some boxes of a view: all, or those of a list of ids. A grid knows a box by its label, which is
// its id where no labels are given.
struct Side {
  const Boxes* boxes = nullptr;
  const std::uint32_t* ids = nullptr;  // null: 0 .. count-1
  std::uint32_t count = 0;
  const std::uint32_t* labels = nullptr;

  std::uint32_t id(std::uint32_t i) const noexcept { return ids ? ids[i] : i; }
  std::uint32_t label(std::uint32_t i) const noexcept { return labels ? labels[i] : id(i); }
};

// Stands for a column of a coarser grid within which a search runs, its boxes labelled 0, 1, ... It
// reports a pair only if that column is the pair's home, as another column may hold both boxes too:
// on each axis not both begin before it (core/quantise.hpp).
struct Frame {
  const std::uint32_t* ids = nullptr;  // by label
  const std::uint16_t* before =
      nullptr;  // by label: a bit an axis, of this column and those around
};

// Pairs of `queries` among themselves where `self`, and of queries with targets.
struct Problem {
  Side queries, targets;
  bool self = true;
  const Frame* frame = nullptr;
  // A grid raises the labels of targets by this; where it is not 0, no two boxes have the same.
  std::uint32_t raised_by = 0;
};
inline std::uint64_t box_count(const Problem& p) noexcept {
  return std::uint64_t{p.queries.count} + p.targets.count;
}

// The boxes that take no part.
struct BinReport {
  std::uint64_t inactive = 0;  // lower > upper, or NaN
  std::uint64_t nan_count = 0;
  std::uint64_t first_nan = ~std::uint64_t{0};  // the least index; of the queries, then the targets
  bool nan_in_targets = false;

  // In any order: a task that is through with its own boxes helps with earlier ones.
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
  // Of two parts of the same boxes.
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

// Records of so many bytes leave the last level of cache before they are read again: see BinTarget.
constexpr std::size_t usual_stream_from = std::size_t{64} << 20;

// What all workers of a call share.
struct Search {
  const Boxes* a = nullptr;  // pair.first is of a, pair.second of b
  const Boxes* b = nullptr;  // a itself where there is one set
  bool two_sets = false;
  const Doubles* doubles = nullptr;  // what a and b stand for, if they do
  std::uint32_t second_base = 0;     // see Emit
  float margin = 0;
  float cell_scale = 1;
  bool flat = false;             // all boxes are 2-D
  const Kinds* kinds = nullptr;  // where static, group and mask forbid anything
  bool owners = false;           // two boxes may have the same owner
  // Boxes of two worlds may be compared: two that span too many columns, or any two.
  bool wide_worlds = false, any_worlds = false;
  const Kernels* kernels = nullptr;
  std::size_t stream_from = usual_stream_from;
  const Executor* executor = nullptr;
  Memory* memory = nullptr;
  Sink* sink = nullptr;
  const std::atomic<bool>* stop = nullptr;

  // The box as it is compared: grown by the margin.
  Box box(const Boxes& view, std::uint32_t id) const noexcept {
    const Box box = view[id];
    return margin != 0 ? core::expand(box, margin) : box;
  }
  Orientation forward() const noexcept {
    return two_sets ? Orientation::query_first : Orientation::unordered;
  }
  Orientation backward() const noexcept {
    return two_sets ? Orientation::target_first : Orientation::unordered;
  }

  // The first failure of any worker; the others stop at their next look.
  void fail(Status status, std::size_t bytes) noexcept {
    const std::lock_guard<std::mutex> lock(mutex_);
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
  std::size_t bytes() const noexcept { return bytes_; }

  // Runs `body`, turning what the library throws into a failure.
  template <class F>
  void guarded(F&& body) {
    try {
      body();
    } catch (const NoMemory& e) {
      fail(Status::out_of_memory, e.bytes);
    } catch (const CapExceeded& e) {
      fail(Status::memory_cap_too_small, e.bytes_needed);
    }
  }

 private:
  std::mutex mutex_;
  std::atomic<bool> failed_{false};
  Status status_ = Status::ok;
  std::size_t bytes_ = 0;
};

// Of both sets.
inline std::uint64_t box_count(const Search& s) noexcept {
  return std::uint64_t{s.a->size()} + (s.two_sets ? s.b->size() : 0);
}

}  // namespace throng::cpu
