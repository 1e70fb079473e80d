// The threads of one call. The executor is called once, before there is work for all tasks, and its
// threads stay until the call is over. So threads wake up while the call still plans, and no phase
// starts threads again.
#pragma once

#include <atomic>
#include <exception>

#include <throng/options.hpp>

#include "cpu/threads.hpp"

namespace throng::cpu {

class Team {
 public:
  // Runs body(executor) on one thread of `outer`. The other tasks help whenever the body runs tasks
  // on the executor passed to it. Rethrows the body's exception.
  template <class F>
  static void lead(const Executor& outer, unsigned tasks, const F& body) {
    if (tasks <= 1) return body(outer);
    Team team(outer);
    std::exception_ptr thrown;
    auto task = [&](unsigned) {
      if (team.led_.exchange(true, std::memory_order_relaxed)) return team.help();
      try {
        body(team.executor_);
      } catch (...) {
        thrown = std::current_exception();
      }
      team.opened_.store(over, std::memory_order_release);
    };
    run_tasks(outer, tasks, task);
    if (thrown) std::rethrow_exception(thrown);
  }

 private:
  // Tasks claimed dynamically by the threads present. Stays valid while `inside_` is not 0.
  struct Phase {
    unsigned count;
    void (*task)(void*, unsigned);
    void* context;
    alignas(64) std::atomic<unsigned> next{0};
    void work() noexcept;
  };
  static constexpr unsigned over = ~0u;

  explicit Team(const Executor& outer) noexcept : executor_{outer.concurrency, run, this} {}
  static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context);
  void help() noexcept;

  Executor executor_;
  std::atomic<bool> led_{false};
  // The number of phases so far, or `over`; the open phase; and the number of helpers inside: on
  // two cache lines, as the leader writes the first and helpers the second. A helper increments
  // `inside_` before it reads `phase_`, and the leader clears `phase_` before it reads `inside_`,
  // so at least one of them sees the other.
  alignas(64) std::atomic<unsigned> opened_{0};
  std::atomic<Phase*> phase_{nullptr};
  alignas(64) std::atomic<unsigned> inside_{0};
};

}  // namespace throng::cpu
