// The threads of one call. The executor is called once, before there is work for all tasks, and its
// threads stay until the call is over. So threads wake up while the call still plans, and no phase
// starts threads again.
#pragma once

#include <atomic>
#include <exception>

#include <throng/options.hpp>

#include "base/threads.hpp"

namespace throng::base {

class ParallelRegion {
 public:
  // Runs body(executor) on one thread of `outer`. The other tasks help whenever the body runs tasks
  // on the executor passed to it. Rethrows the body's exception.
  template <class F>
  static void run(const Executor& outer, unsigned tasks, const F& body) {
    if (tasks <= 1) return body(outer);
    ParallelRegion region(outer);
    std::exception_ptr thrown;
    auto task = [&](unsigned) {
      if (region.started_.exchange(true, std::memory_order_relaxed)) return region.help();
      try {
        body(region.executor_);
      } catch (...) {
        thrown = std::current_exception();
      }
      region.phase_count_.store(over, std::memory_order_release);
    };
    run_tasks(outer, tasks, task);
    if (thrown) std::rethrow_exception(thrown);
  }

 private:
  // Tasks claimed dynamically by the threads present. Stays valid while `helpers_inside_` is not 0.
  struct Phase {
    unsigned count;
    void (*task)(void*, unsigned);
    void* context;
    alignas(64) std::atomic<unsigned> next{0};
    void work() noexcept;
  };
  static constexpr unsigned over = ~0u;

  explicit ParallelRegion(const Executor& outer) noexcept
      : executor_{outer.concurrency, run_phase, this} {}
  static void run_phase(void* self, unsigned count, void (*task)(void*, unsigned), void* context);
  void help() noexcept;

  Executor executor_;
  std::atomic<bool> started_{false};
  // The number of phases so far, or `over`; the open phase; and the number of helpers inside: on
  // two cache lines, as the leader writes the first and helpers the second. A helper increments
  // `helpers_inside_` before it reads `phase_`, and the leader clears `phase_` before it reads
  // `helpers_inside_`, so at least one of them sees the other.
  alignas(64) std::atomic<unsigned> phase_count_{0};
  std::atomic<Phase*> phase_{nullptr};
  alignas(64) std::atomic<unsigned> helpers_inside_{0};
};

}  // namespace throng::base
