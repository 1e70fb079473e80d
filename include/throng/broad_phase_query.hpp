// BroadPhaseQuery: queries against persistent objects, from several threads at once.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>

#include <throng/export.h>
#include <throng/broad_phase.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

// The queries of one thread, and their results. Any number of threads may query one BroadPhase
// concurrently, each with its own BroadPhaseQuery, for example between two steps of an engine.
// Queries do not change the observable state of the BroadPhase. One BroadPhaseQuery can query
// several of them in turn.
//
// While a query runs, any other call on the BroadPhase except const ones is refused with
// Status::busy, and queries are refused during such a call. So is a call during another one on the
// same BroadPhaseQuery.
//
// See BroadPhase for the queries. The same Options apply, except margin and capture; they are those
// given here. By default a large batch is divided among threads. Within a task of the scheduler
// behind the executor, set `threads` to 1: a thread that waits for other tasks may be given another
// task, which would find the BroadPhaseQuery in use. Each BroadPhaseQuery allocates from its own
// `memory`, which must be thread-safe if shared; what the BroadPhase needs for queries comes from
// its own.
class THRONG_API BroadPhaseQuery {
 public:
  BroadPhaseQuery() noexcept = default;
  explicit BroadPhaseQuery(const Options& options) noexcept : options_(options) {}
  ~BroadPhaseQuery();
  BroadPhaseQuery(BroadPhaseQuery&& other) noexcept;
  BroadPhaseQuery& operator=(BroadPhaseQuery&& other) noexcept;

  // Cost, here and below: as in BroadPhase.
  Result find_overlaps(const BroadPhase& objects, const Boxes& boxes,
                       ObjectFilter filter = {}) noexcept;
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
