// The threads of one call: the executor is asked for them once, before there is work for all, and
// those who come stay until the call is over. So a thread wakes while the call still plans, and no
// phase waits for one anew.
#pragma once

#include <atomic>
#include <exception>

#include <throng/options.hpp>

#include "cpu/threads.hpp"

namespace throng::cpu {

class Team {
 public:
  // Runs body(executor) on some thread of `outer`, of which each further task helps wherever the
  // body runs tasks on the executor that it is given. What the body throws comes through.
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
  // Tasks that whoever is there takes by turns. Lives while `inside_` is not 0.
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
  // How many phases there have been, or `over`; the one that is open; and how many helpers are in:
  // two lines, as the leader writes one and helpers the other. A helper counts itself in before it
  // looks for the phase, and the leader closes the phase before it looks whether any is in: so one
  // of the two sees the other.
  alignas(64) std::atomic<unsigned> opened_{0};
  std::atomic<Phase*> phase_{nullptr};
  alignas(64) std::atomic<unsigned> inside_{0};
};

}  // namespace throng::cpu
