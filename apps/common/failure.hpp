// The error that ends a command early: a message that names the value and the fix, and an exit
// status.
#pragma once

#include <stdexcept>
#include <string>

namespace throng::common {

// 0: done. 1: a check found a difference. 2: bad input, bad usage, failed output, or a missing
// feature.
inline constexpr int exit_done = 0;
inline constexpr int exit_differs = 1;
inline constexpr int exit_bad = 2;

class Failure : public std::runtime_error {
 public:
  explicit Failure(const std::string& message, int status = exit_bad)
      : std::runtime_error(message), status_(status) {}
  int status() const noexcept { return status_; }

 private:
  int status_;
};

}  // namespace throng::common
