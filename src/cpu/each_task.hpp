// What each of several tasks has for itself, kept between calls.
#pragma once

#include "cpu/memory.hpp"
#include "cpu/threads.hpp"

namespace throng::cpu {

template <class T>
class EachTask {
 public:
  explicit EachTask(Memory& memory) noexcept : memory_(&memory) {}
  ~EachTask() {
    for (T* one : all_) memory_->destroy(one);
  }
  EachTask(const EachTask&) = delete;
  EachTask& operator=(const EachTask&) = delete;

  // Makes those of the first `count` tasks that there are none of yet.
  T* const* make(unsigned count) {
    for (unsigned t = 0; t < count; ++t) {
      if (!all_[t]) all_[t] = memory_->create<T>(*memory_);
    }
    return all_;
  }
  // Which has been made.
  T& operator[](unsigned task) const noexcept { return *all_[task]; }
  // Whatever room one of the first `count` has, all get: what comes to which task differs from call
  // to call. The first gathers it.
  void match(unsigned count) {
    for (unsigned t = 1; t < count; ++t) all_[0]->match(*all_[t]);
    for (unsigned t = 1; t < count; ++t) all_[t]->match(*all_[0]);
  }

 private:
  Memory* memory_;
  T* all_[max_workers] = {};
};

// Runs body(task) for each of several tasks, of which memory may run out for any: throws NoMemory
// once all have ended.
template <class F>
void run_tasks_or_throw(const Executor& executor, unsigned tasks, const F& body) {
  std::atomic<std::size_t> failed{0};
  auto task = [&](unsigned t) {
    try {
      body(t);
    } catch (const NoMemory& e) {
      failed = e.bytes;
    }
  };
  run_tasks(executor, tasks, task);
  if (failed != 0) throw NoMemory{failed};
}

}  // namespace throng::cpu
