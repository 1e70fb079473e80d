// The one seam to threads.
#pragma once

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

}  // namespace throng::cpu
