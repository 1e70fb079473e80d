#include "cli/interrupt.hpp"

#include <csignal>

namespace throng::cli {
namespace {

volatile std::sig_atomic_t interrupted = 0;

extern "C" void note_interrupt(int signal) {
  interrupted = 1;
  std::signal(signal, SIG_DFL);  // the second one kills
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupted = 0;
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
