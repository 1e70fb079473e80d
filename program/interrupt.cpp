#include "program/interrupt.hpp"

#include <csignal>

namespace throng::program {
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

extern "C" void note_interrupt(int signal) {
  by_signal = signal;
  interrupted = true;
  std::signal(signal, SIG_DFL);  // the second signal kills
}

void on_write_signals(void (*what)(int)) {
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
  bool* heard = heard_;
  for (const int signal : signals) {
    *heard = std::signal(signal, note_interrupt) != SIG_IGN;
    if (!*heard++) std::signal(signal, SIG_IGN);
  }
}

InterruptGuard::~InterruptGuard() {
  const bool* heard = heard_;
  for (const int signal : signals) {
    if (*heard++) std::signal(signal, SIG_DFL);
  }
}

void InterruptGuard::check() const {
  if (interrupted) throw Interrupted{by_signal};
}

const std::atomic<bool>& InterruptGuard::flag() noexcept { return interrupted; }

void ignore_write_signals() { on_write_signals(SIG_IGN); }
void restore_write_signals() { on_write_signals(SIG_DFL); }

}  // namespace throng::program
