// State of BroadPhase and BroadPhaseQuery, and the common frame of every call.
#pragma once

#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>

#include <atomic>
#include <functional>
#include <utility>

#include <throng/find_pairs.hpp>
#include <throng/large_pages.hpp>

#include "base/atomics.hpp"
#include "base/float_state.hpp"
#include "base/mutex.hpp"
#include "capture/log.hpp"
#include "inverted_boxes.hpp"
#include "shared_guard.hpp"
#include "tracking/tracker.hpp"
#include "validate.hpp"

namespace throng {

using ull = unsigned long long;

struct BroadPhase::State {
  State(const Options& options, std::pmr::memory_resource* memory) noexcept
      : resource(memory), tracker(memory, options.margin, sizeof(State)) {}

  std::pmr::memory_resource* resource;
  tracking::Tracker tracker;
  SharedGuard guard;
  bool called = false;
  capture::Log log;
};

struct BroadPhaseQuery::State {
  State(const Options&, std::pmr::memory_resource* memory) noexcept
      : resource(memory), engine(memory, sizeof(State)), queries(engine) {}

  std::pmr::memory_resource* resource;
  grid::Engine engine;
  tracking::Queries queries;
  std::atomic<bool> in_call{false};
  const unsigned number = made++;

 private:
  static inline std::atomic<unsigned> made{0};
};

struct BroadPhaseAccess {
  // Runs body(tracker, result) exclusively, in the library's float state; reports memory failures.
  template <class F>
  static Result call(BroadPhase& it, F&& body,
                     const char* if_no_memory = "free some, or keep fewer objects") noexcept {
    const base::FloatState float_state;
    Result r;
    if (!prepare(it, "BroadPhase", r)) return r;
    BroadPhase::State& state = *it.state_;
    if (!state.guard.try_lock()) {
      set_message(r, "another thread is in a call on this BroadPhase; make one call at a time");
      r.status = Status::busy;
      return r;
    }
    if (!std::exchange(state.called, true)) {
      if (const char* folder = capture::folder_of(it.options_)) state.log.open(folder, it.options_);
    }
    attempt(r, if_no_memory, [&] { body(state.tracker, r); });
    state.log.answer(r);
    state.guard.unlock();
    return r;
  }

  static constexpr const char* query_memory_hint = "free some, or query fewer at once";

  // Runs body(queries, tracker, result) likewise, but shared with other queries; the tracker is
  // null if there are no objects.
  template <class F>
  static Result run_query(BroadPhaseQuery& it, const BroadPhase& objects, F&& body) noexcept {
    const base::FloatState float_state;
    Result r;
    if (!prepare(it, "BroadPhaseQuery", r)) return r;
    BroadPhaseQuery::State& state = *it.state_;
    if (state.in_call.exchange(true, std::memory_order_acquire)) {
      set_message(
          r,
          "another thread is in a call on this BroadPhaseQuery; give each thread one of its own");
      r.status = Status::busy;
      return r;
    }
    BroadPhase::State* const target = state_of(objects);
    if (target && !target->guard.try_lock_shared(state.number)) {
      set_message(
          r, "another thread is in a call on the queried BroadPhase; retry when it has returned");
      r.status = Status::busy;
    } else {
      attempt(r, query_memory_hint,
              [&] { body(state.queries, target ? &target->tracker : nullptr, r); });
      if (target) target->guard.unlock_shared(state.number);
    }
    state.in_call.store(false, std::memory_order_release);
    return r;
  }

  // Runs body(tracker, result) shared with queries, on an object that is not changed; the tracker
  // is null if there are no objects.
  template <class F>
  static Result read(const BroadPhase& it, F&& body) noexcept {
    const base::FloatState float_state;
    Result r;
    BroadPhase::State* const state = state_of(it);
    const unsigned reader = base::this_thread_number();
    if (state && !state->guard.try_lock_shared(reader)) {
      set_message(r, "another thread is in a call on this BroadPhase; retry when it has returned");
      r.status = Status::busy;
      return r;
    }
    attempt(r, query_memory_hint, [&] { body(state ? &state->tracker : nullptr, r); });
    if (state) state->guard.unlock_shared(reader);
    return r;
  }

  // The capture log of the running call; written once its arguments are valid.
  static capture::Log& log(BroadPhase& it) noexcept { return it.state_->log; }

  // Creates the state in the first call; thread-safe.
  template <class Handle>
  static bool prepare(Handle& it, const char* name, Result& r) noexcept {
    using State = typename Handle::State;
    base::AtomicRef<State*> shared(it.state_);
    if (shared.load(std::memory_order_acquire)) return true;
    const Options& options = it.options_;
    if (!valid(Boxes(), nullptr, options, r)) return false;
    if (options.backend != Backend::automatic && options.backend != Backend::cpu) {
      set_message(r, "a %s does not support backend '%s'; use Backend::automatic", name,
                  to_string(options.backend));
      return refuse(r, Status::bad_option);
    }
    std::pmr::memory_resource* memory = options.memory;
    if (!memory) memory = large_pages();
    static base::Mutex making;
    const std::lock_guard<base::Mutex> lock(making);
    if (shared.load(std::memory_order_acquire)) return true;
    void* storage = allocate_state(*memory, sizeof(State), alignof(State), r);
    if (!storage) return false;
    shared.store(new (storage) State(options, memory), std::memory_order_release);
    return true;
  }
  template <class Handle>
  static void destroy(Handle& it) noexcept {
    using State = typename Handle::State;
    State* const state = it.state_;
    if (!state) return;
    std::pmr::memory_resource* memory = state->resource;
    state->~State();
    memory->deallocate(state, sizeof(State), alignof(State));
  }

  static const tracking::Objects* objects(const BroadPhase& it) noexcept {
    return it.state_ ? &it.state_->tracker.objects() : nullptr;
  }
  static tracking::PairSet* pairs(const BroadPhase& it) noexcept {
    return it.state_ ? &it.state_->tracker.pairs() : nullptr;
  }

 private:
  // Atomic, because another thread may be in its first call.
  static BroadPhase::State* state_of(const BroadPhase& it) noexcept {
    const base::AtomicRef<BroadPhase::State*> shared(const_cast<BroadPhase&>(it).state_);
    return shared.load(std::memory_order_acquire);
  }
  template <class F>
  static void attempt(Result& r, const char* if_no_memory, F&& body) noexcept {
    try {
      body();
    } catch (const base::AllocationFailed& failure) {
      explain_failure(r, {Status::out_of_memory, failure.bytes}, if_no_memory);
    }
    if (!r.ok()) explain(r, false, false, if_no_memory);
  }
};

// Checks NaN and lower > upper in the boxes for which selected(i) holds.
template <class Wanted>
bool valid_floats(const Boxes& boxes, const Options& options, const Wanted& selected,
                  Result& r) noexcept {
  if (options.nan == NanPolicy::refuse && tracking::Tracker::has_nan(boxes, options)) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (!base::has_nan(boxes[i]) || !selected(i)) continue;
      if (r.invalid_count++ == 0) r.first_invalid = i;
    }
    if (r.invalid_count != 0) return refuse(r, Status::nan_box);
  }
  return options.inverted != InvertedPolicy::refuse || check_not_inverted(boxes, "", selected, r);
}

}  // namespace throng
