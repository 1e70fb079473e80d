#include "cpu/team.hpp"

#include <chrono>
#include <thread>

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#endif

namespace throng::cpu {
namespace {

// Back-off: spins, yields, then sleeps. Most waits are short; a long one should give up
// the core.
class Wait {
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

}  // namespace

void Team::Phase::work() noexcept {
  for (unsigned i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) task(context, i);
}

void Team::run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
  Team& team = *static_cast<Team*>(self);
  Phase phase{count, task, context};
  team.phase_ = &phase;
  team.opened_.fetch_add(1, std::memory_order_release);
  phase.work();
  // An exchange, as QEMU 7.2 on x86 lets an ARM load pass a plain store, though neither C++ nor ARM
  // does.
  team.phase_.exchange(nullptr);
  for (Wait wait; team.inside_ != 0;) wait();
}

void Team::help() noexcept {
  Wait wait;
  for (unsigned seen = 0;;) {
    const unsigned opened = opened_.load(std::memory_order_acquire);
    if (opened == over) return;
    if (opened == seen) {
      wait();
      continue;
    }
    seen = opened;
    ++inside_;
    if (Phase* const phase = phase_) phase->work();
    --inside_;
    wait = {};
  }
}

}  // namespace throng::cpu
