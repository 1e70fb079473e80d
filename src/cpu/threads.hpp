// The one seam to threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

namespace throng::cpu {

// oneTBB, or std::thread where the build says so. Starts nothing before its first use.
const Executor& default_executor() noexcept;

// Runs body(index) for index 0 .. count-1 on the executor, each in the library's float state;
// a single one on the caller's thread. The body must not throw.
void run_tasks(const Executor& executor, unsigned count,
               void (*body)(void* context, unsigned index), void* context);

template <class F>
void run_tasks(const Executor& executor, unsigned count, F& body) {
  run_tasks(
      executor, count, [](void* context, unsigned index) { (*static_cast<F*>(context))(index); },
      &body);
}

// The indices 0 .. count-1, which tasks take by turns.
class Turns {
 public:
  // The count and a task each more must fit 64 bits.
  explicit Turns(std::uint64_t count) noexcept : count_(count) {}
  // The next one, of this task alone; false where none is left.
  bool take(std::uint64_t& index) noexcept {
    index = next_.fetch_add(1, std::memory_order_relaxed);
    return index < count_;
  }

 private:
  std::uint64_t count_;
  std::atomic<std::uint64_t> next_{0};
};

// Runs body(index, task) for index 0 .. count-1, each once, by turns.
template <class F>
void run_by_turns(const Executor& executor, unsigned tasks, std::size_t count, const F& body) {
  Turns turns(count);
  auto take = [&](unsigned task) {
    for (std::uint64_t i; turns.take(i);) body(static_cast<std::size_t>(i), task);
  };
  run_tasks(executor, tasks, take);
}

// Ranges of 0 .. count-1 that tasks take by turns, so that one that starts late, or has a slower
// core, holds nobody up: some sixteen for each. All but the last are as long, a multiple of `step`,
// and not above most_steps * step.
class Shares {
 public:
  Shares(std::size_t count, unsigned tasks, std::size_t step) noexcept
      : count_(count),
        size_(step *
              std::clamp(count / (std::size_t{tasks} * 16) / step, std::size_t{1}, most_steps)) {}
  // The next one, of this task alone; false where none is left.
  bool take(std::size_t& begin, std::size_t& end) noexcept {
    // `next_` passes the count by a share a task: it cannot come around.
    begin = next_.load(std::memory_order_relaxed) < count_
                ? next_.fetch_add(size_, std::memory_order_relaxed)
                : count_;
    end = std::min(count_, begin + size_);
    return begin < count_;
  }

 private:
  static constexpr std::size_t most_steps = 64;
  std::size_t count_, size_;
  std::atomic<std::size_t> next_{0};
};

}  // namespace throng::cpu
