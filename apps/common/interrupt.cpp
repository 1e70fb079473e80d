#include "apps/common/interrupt.hpp"

#include <csignal>

namespace throng::common {
namespace {

#ifdef SIGHUP
constexpr int signals[] = {SIGINT, SIGTERM, SIGHUP};
#else
constexpr int signals[] = {SIGINT, SIGTERM};
#endif

std::atomic<bool> interrupted{false};
std::atomic<int> by_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler sets them");

extern "C" void on_interrupt(int signal) {
  by_signal = signal;
  interrupted = true;
  std::signal(signal, SIG_DFL);  // the second signal kills
}

void set_write_signal_handlers([[maybe_unused]] void (*what)(int)) {
#ifdef SIGPIPE
  std::signal(SIGPIPE, what);
#endif
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, what);
#endif
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupted = false;
  bool* handled = handled_;
  for (const int signal : signals) {
    *handled = std::signal(signal, on_interrupt) != SIG_IGN;
    if (!*handled++) std::signal(signal, SIG_IGN);
  }
}

InterruptGuard::~InterruptGuard() {
  const bool* handled = handled_;
  for (const int signal : signals) {
    if (*handled++) std::signal(signal, SIG_DFL);
  }
}

void InterruptGuard::check() const {
  if (interrupted) throw Interrupted{by_signal};
}

const std::atomic<bool>& InterruptGuard::flag() noexcept { return interrupted; }

void ignore_write_signals() { set_write_signal_handlers(SIG_IGN); }
void restore_write_signals() { set_write_signal_handlers(SIG_DFL); }

}  // namespace throng::common
