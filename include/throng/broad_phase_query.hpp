// BroadPhaseQuery: questions to objects that live, from several threads at once.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>

#include <throng/export.h>
#include <throng/broad_phase.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

// What one thread asks of objects that live, and the answers. Any number of threads may ask one
// BroadPhase at once, each by a BroadPhaseQuery of its own, as between two steps of an engine. It
// changes nothing that can be seen of the BroadPhase, of which several can be asked in turn.
//
// While a question is under way, any other call on the BroadPhase but the const ones is refused
// with Status::busy; during such a call questions are. So is a call during another one on the same
// BroadPhaseQuery.
//
// The questions are those of BroadPhase, where they are told. Of Options the same hold as there but
// for the margin and capture, and those given here: by default a call that asks many shares them
// out among threads. In a task of a scheduler that the executor shares let `threads` be 1: while it
// waits for others its thread may be given another task, which finds the BroadPhaseQuery in use.
// `memory` is asked by each BroadPhaseQuery for itself, so it must be safe for several threads
// where they share it; what the BroadPhase needs for questions is from its own.
class THRONG_API BroadPhaseQuery {
 public:
  BroadPhaseQuery() noexcept = default;
  explicit BroadPhaseQuery(const Options& options) noexcept : options_(options) {}
  ~BroadPhaseQuery();
  BroadPhaseQuery(BroadPhaseQuery&& other) noexcept;
  BroadPhaseQuery& operator=(BroadPhaseQuery&& other) noexcept;

  // Cost: as of BroadPhase's, here and below.
  Result find_overlaps(const BroadPhase& objects, const Boxes& boxes) noexcept;
  Pairs overlaps() const noexcept;
  Result find_hits(const BroadPhase& objects, const Sweep* sweeps, std::size_t count,
                   SweepHits which = SweepHits::all, const Filters& filters = {},
                   const SweepTest& test = {}) noexcept;
  SweepHitList hits() const noexcept;

  const Options& options() const noexcept { return options_; }
  // Bytes that the object holds now.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct BroadPhaseAccess;
  State* state_ = nullptr;
  Options options_;
};

}  // namespace throng
