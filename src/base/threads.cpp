#include "base/threads.hpp"

#include "base/float_state.hpp"
#include "base/profile.hpp"

#if defined(THRONG_THREADS_TBB)
#include <atomic>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#elif !defined(THRONG_THREADS_NONE)
#include <thread>
#include <vector>
#endif

namespace throng::base {
namespace {

#if defined(THRONG_THREADS_TBB)
unsigned hardware_threads() noexcept {
  const int n = tbb::this_task_arena::max_concurrency();
  return n > 0 ? static_cast<unsigned>(n) : 1u;
}
void run_default(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  // Each invocation takes the next task. If oneTBB throws (no memory, no threads) the caller runs
  // what is left, and each task runs once. Tasks never throw. Isolated: a consumer that waits for
  // tasks of its own must not run a task of this search, which may block until that consumer
  // returns.
  std::atomic<unsigned> next{0};
  const auto take = [&] {
    const unsigned i = next.fetch_add(1, std::memory_order_relaxed);
    if (i < count) tbb::this_task_arena::isolate([&] { task(context, i); });
    return i < count;
  };
  try {
    tbb::parallel_for(
        0u, count, [&](unsigned) { take(); }, tbb::simple_partitioner{});
  } catch (...) {
  }
  while (take()) {
  }
}
#elif defined(THRONG_THREADS_NONE)
unsigned hardware_threads() noexcept { return 1; }
void run_default(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  for (unsigned i = 0; i < count; ++i) task(context, i);
}
#else
unsigned hardware_threads() noexcept {
  const unsigned n = std::thread::hardware_concurrency();
  return n > 0 ? n : 1u;
}
void run_default(void*, unsigned count, void (*task)(void*, unsigned), void* context) {
  // The caller runs the last task, and those whose thread cannot be started.
  std::vector<std::thread> threads;
  unsigned next = 0;
  try {
    threads.reserve(count);
    for (; next + 1 < count; ++next) threads.emplace_back(task, context, next);
  } catch (...) {
  }
  for (; next < count; ++next) task(context, next);
  for (std::thread& t : threads) t.join();
}
#endif

struct Task {
  void (*body)(void*, unsigned);
  void* context;
};

}  // namespace

const Executor& default_executor() noexcept {
  static const Executor executor{hardware_threads(), run_default, nullptr};
  return executor;
}

void run_tasks(const Executor& executor, unsigned count, void (*body)(void*, unsigned),
               void* context) {
  if (count <= 1) {
    const FloatState state;
    if (count == 1) body(context, 0);
    return;
  }
  Task task{body, context};
  executor.run(
      executor.self, count,
      [](void* t, unsigned index) {
        THRONG_RANGE("task");
        const FloatState state;
        static_cast<Task*>(t)->body(static_cast<Task*>(t)->context, index);
      },
      &task);
}

}  // namespace throng::base
