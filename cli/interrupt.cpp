#include "cli/interrupt.hpp"

#include <csignal>

namespace throng::cli {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

extern "C" void note_interrupt(int signal) {
  interrupted = true;
  std::signal(signal, SIG_DFL);  // the second one kills
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupted = false;
  std::signal(SIGINT, note_interrupt);
  std::signal(SIGTERM, note_interrupt);
#ifdef SIGHUP
  hangs_up_ = std::signal(SIGHUP, note_interrupt) != SIG_IGN;
  if (!hangs_up_) std::signal(SIGHUP, SIG_IGN);  // nohup
#endif
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
#ifdef SIGHUP
  if (hangs_up_) std::signal(SIGHUP, SIG_DFL);
#endif
}

void InterruptGuard::check() const {
  if (interrupted) throw Interrupted{};
}

const std::atomic<bool>& InterruptGuard::flag() noexcept { return interrupted; }

void ignore_write_signals() {
#ifdef SIGPIPE
  std::signal(SIGPIPE, SIG_IGN);
#endif
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, SIG_IGN);
#endif
}

void restore_write_signals() {
#ifdef SIGPIPE
  std::signal(SIGPIPE, SIG_DFL);
#endif
#ifdef SIGXFSZ
  std::signal(SIGXFSZ, SIG_DFL);
#endif
}

}  // namespace throng::cli
