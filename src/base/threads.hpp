// The only interface to threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <throng/options.hpp>

namespace throng::base {

// oneTBB, or std::thread or the caller alone if the build says so. Starts nothing before its first
// use.
const Executor& default_executor() noexcept;

// Maximum number of tasks of a search.
constexpr unsigned max_workers = 256;

// The executor of these options, and the number of tasks, 1 to max_workers.
template <class AnyOptions>
const Executor& executor_of(const AnyOptions& options) noexcept {
  return options.executor ? *options.executor : default_executor();
}
template <class AnyOptions>
unsigned threads_of(const AnyOptions& options) noexcept {
  const unsigned wanted = options.threads ? options.threads : executor_of(options).concurrency;
  return std::clamp(wanted, 1u, max_workers);
}

// Runs body(index) for index 0 .. count-1 on the executor, each in the library's float state; a
// single one on the caller's thread. The body must not throw.
void run_tasks(const Executor& executor, unsigned count,
               void (*body)(void* context, unsigned index), void* context);

template <class F>
void run_tasks(const Executor& executor, unsigned count, F& body) {
  run_tasks(
      executor, count, [](void* context, unsigned index) { (*static_cast<F*>(context))(index); },
      &body);
}

// Indices 0 .. count-1, claimed dynamically.
class AtomicCounter {
 public:
  // count + number of tasks must fit 64 bits.
  explicit AtomicCounter(std::uint64_t count) noexcept : count_(count) {}
  // Claims the next index; false if none is left.
  bool take(std::uint64_t& index) noexcept {
    index = next_.fetch_add(1, std::memory_order_relaxed);
    return index < count_;
  }

 private:
  std::uint64_t count_;
  std::atomic<std::uint64_t> next_{0};
};

// Start of the p-th of `parts` nearly equal parts of 0 .. count-1.
constexpr std::uint64_t part_begin(std::uint64_t count, std::uint64_t parts,
                                   std::uint64_t p) noexcept {
  return count / parts * p + std::min(p, count % parts);
}

// Indices 0 .. count-1 in one range per task: a task claims its own range's, then steals from other
// ranges. So the data of an index stays in one core's cache from call to call, and a late task
// delays no other.
class StealingRanges {
 public:
  StealingRanges(std::uint64_t count, unsigned tasks) noexcept
      : range_count_(std::min(std::max(tasks, 1u), max_ranges)) {
    for (unsigned p = 0; p < range_count_; ++p) {
      range_[p].next.store(part_begin(count, range_count_, p), std::memory_order_relaxed);
      range_[p].end = part_begin(count, range_count_, p + 1);
    }
  }
  // Claims the next index; false if none is left.
  bool take(unsigned task, std::uint64_t& index) noexcept {
    for (unsigned k = 0; k < range_count_; ++k) {
      Range& range = range_[(task + k) % range_count_];
      // `next` passes the end by at most one per task: it cannot wrap.
      if (range.next.load(std::memory_order_relaxed) >= range.end) continue;
      index = range.next.fetch_add(1, std::memory_order_relaxed);
      if (index < range.end) return true;
    }
    return false;
  }
  // The index that take() would return from the task's own range; false if it is used up.
  bool peek(unsigned task, std::uint64_t& index) const noexcept {
    const Range& range = range_[task % range_count_];
    index = range.next.load(std::memory_order_relaxed);
    return index < range.end;
  }

 private:
  struct alignas(64) Range {
    std::atomic<std::uint64_t> next;
    std::uint64_t end;
  };
  static constexpr unsigned max_ranges = 16;
  unsigned range_count_;
  Range range_[max_ranges];
};

// Runs body(index, task) for index 0 .. count-1, each once; tasks steal from each other.
template <class F>
void parallel_for(const Executor& executor, unsigned tasks, std::size_t count, const F& body) {
  StealingRanges ranges(count, tasks);
  auto take = [&](unsigned task) {
    for (std::uint64_t i; ranges.take(task, i);) body(static_cast<std::size_t>(i), task);
  };
  run_tasks(executor, tasks, take);
}

// Chunks of 0 .. count-1 that tasks claim dynamically, some sixteen per task, so that a late task
// or a slower core delays no other. All but the last have the same size, a multiple of `step`, at
// most max_steps * step.
class ChunkQueue {
 public:
  ChunkQueue(std::size_t count, unsigned tasks, std::size_t step) noexcept
      : count_(count),
        size_(step * std::clamp(count / (std::max<std::size_t>(tasks, 1) * 16) / step,
                                std::size_t{1}, max_steps)),
        ranges_(count / size_ + (count % size_ != 0), tasks) {}
  // Claims the next chunk; false if none is left.
  bool take(unsigned task, std::size_t& begin, std::size_t& end) noexcept {
    std::uint64_t chunk;
    if (!ranges_.take(task, chunk)) return false;
    begin = static_cast<std::size_t>(chunk) * size_;
    end = std::min(count_, begin + size_);
    return true;
  }

 private:
  static constexpr std::size_t max_steps = 64;
  std::size_t count_, size_;
  StealingRanges ranges_;
};

}  // namespace throng::base
