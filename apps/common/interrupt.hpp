// Ctrl-C while a file is being written: the writer removes its partial file before the program
// ends.
#pragma once

#include <atomic>

namespace throng::common {

struct Interrupted {
  int signal;
  int status() const noexcept { return 128 + signal; }  // as shells report it
};

// During its lifetime SIGINT, SIGTERM and SIGHUP only set a flag, which the writing loop polls; the
// second signal kills. Otherwise they end the program at once, as there is nothing to clean up. An
// ignored signal stays ignored: in a background job of a script, or under nohup.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  // Throws Interrupted after a signal.
  void check() const;
  // True after a signal; for Options::stop.
  static const std::atomic<bool>& flag() noexcept;

 private:
  bool handled_[3] = {};  // those that were not ignored
};

// Turns SIGPIPE and SIGXFSZ into write errors, so that partial files are removed. Child programs
// get the defaults back.
void ignore_write_signals();
void restore_write_signals();

}  // namespace throng::common
