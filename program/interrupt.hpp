// Ctrl-C while a file is being written: the writer takes its half file away before the program
// ends.
#pragma once

#include <atomic>

namespace throng::program {

struct Interrupted {
  int signal;
  int status() const noexcept { return 128 + signal; }  // as a shell tells it
};

// While one lives, SIGINT, SIGTERM and SIGHUP only set a flag, which the writing loop asks for; the
// second one kills. Everywhere else they end the program at once, as there is nothing to clean up.
// A signal that was ignored stays so: in a background job of a script, or under nohup.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  // Throws Interrupted once a signal came.
  void check() const;
  // True from then on; for Options::stop.
  static const std::atomic<bool>& flag() noexcept;

 private:
  bool heard_[3] = {};  // those that were not ignored
};

// A pipe that nobody reads, and a file that may grow no further, must be errors of the write, not
// the end of the program: half files are to be cleared away. Undone for programs that are started
// from here.
void ignore_write_signals();
void restore_write_signals();

}  // namespace throng::program
