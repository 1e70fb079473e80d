#include "base/parallel_region.hpp"

#if !defined(THRONG_THREADS_NONE)
#include <chrono>
#include <thread>
#endif

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#endif

namespace throng::base {
namespace {

#if defined(THRONG_THREADS_NONE)
// Tasks run one after the other, so none waits for another.
struct Backoff {
  void operator()() noexcept {}
};
#else
// Back-off: spins, yields, then sleeps. Most waits are short; a long one should give up
// the core.
class Backoff {
 public:
  void operator()() noexcept {
    if (turns_ < spins) {
#if defined(__SSE2__) || defined(_M_X64)
      _mm_pause();
#endif
    } else if (turns_ < spins + yields) {
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(std::chrono::microseconds(50));
      return;
    }
    ++turns_;
  }

 private:
  static constexpr unsigned spins = 256, yields = 1024;
  unsigned turns_ = 0;
};
#endif

}  // namespace

void ParallelRegion::Phase::work() noexcept {
  for (unsigned i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) task(context, i);
}

void ParallelRegion::run_phase(void* self, unsigned count, void (*task)(void*, unsigned),
                               void* context) {
  ParallelRegion& region = *static_cast<ParallelRegion*>(self);
  Phase phase{count, task, context};
  region.phase_ = &phase;
  region.phase_count_.fetch_add(1, std::memory_order_release);
  phase.work();
  // An exchange, as QEMU 7.2 on x86 lets an ARM load pass a plain store, though neither C++ nor ARM
  // does.
  region.phase_.exchange(nullptr);
  for (Backoff wait; region.helpers_inside_ != 0;) wait();
}

void ParallelRegion::help() noexcept {
  Backoff wait;
  for (unsigned seen = 0;;) {
    const unsigned phase_count = phase_count_.load(std::memory_order_acquire);
    if (phase_count == over) return;
    if (phase_count == seen) {
      wait();
      continue;
    }
    seen = phase_count;
    ++helpers_inside_;
    if (Phase* const phase = phase_) phase->work();
    --helpers_inside_;
    wait = {};
  }
}

}  // namespace throng::base
