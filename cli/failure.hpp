// What ends a command early, and with which exit status.
#pragma once

#include <stdexcept>
#include <string>

namespace throng::cli {

// 0: done. 1: `check` found a difference. 2: bad input, bad usage, or an output that failed.
inline constexpr int exit_done = 0;
inline constexpr int exit_differs = 1;
inline constexpr int exit_bad = 2;
inline constexpr int exit_interrupted = 130;  // 128 + SIGINT, as a shell tells it
inline constexpr int exit_broken_pipe = 141;  // 128 + SIGPIPE

class Failure : public std::runtime_error {
 public:
  explicit Failure(const std::string& message, int status = exit_bad)
      : std::runtime_error(message), status_(status) {}
  int status() const noexcept { return status_; }

 private:
  int status_;
};

}  // namespace throng::cli
