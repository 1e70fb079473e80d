// Per-task objects, kept between calls.
#pragma once

#include "base/memory.hpp"
#include "base/threads.hpp"

namespace throng::base {

template <class T>
class PerThread {
 public:
  explicit PerThread(Memory& memory) noexcept : memory_(&memory) {}
  ~PerThread() {
    for (T* one : all_) memory_->destroy(one);
  }
  PerThread(const PerThread&) = delete;
  PerThread& operator=(const PerThread&) = delete;

  // Creates the missing objects of the first `count` tasks.
  T* const* make(unsigned count) {
    for (unsigned t = 0; t < count; ++t) {
      if (!all_[t]) all_[t] = memory_->create<T>(*memory_);
    }
    return all_;
  }
  // Precondition: created by make().
  T& operator[](unsigned task) const noexcept { return *all_[task]; }
  // Grows all of the first `count` objects to the largest capacity of any, as tasks get different
  // work in each call. The first collects the maximum.
  void match(unsigned count) {
    for (unsigned t = 1; t < count; ++t) all_[0]->match(*all_[t]);
    for (unsigned t = 1; t < count; ++t) all_[t]->match(*all_[0]);
  }

 private:
  Memory* memory_;
  T* all_[max_workers] = {};
};

// Runs body(task) for several tasks. If memory runs out in any, throws AllocationFailed after all
// have ended.
template <class F>
void run_tasks_or_throw(const Executor& executor, unsigned tasks, const F& body) {
  std::atomic<std::uint64_t> failed{0};
  auto task = [&](unsigned t) {
    try {
      body(t);
    } catch (const AllocationFailed& e) {
      failed = e.bytes;
    }
  };
  run_tasks(executor, tasks, task);
  if (failed != 0) throw AllocationFailed{failed};
}

}  // namespace throng::base
