// What ends a command early: a message that names the value and the remedy, and an exit status.
#pragma once

#include <stdexcept>
#include <string>

namespace throng::paper {

// 0: done. 1: a check found a difference. 2: bad input, bad usage, or something that is not here.
inline constexpr int exit_done = 0;
inline constexpr int exit_differs = 1;
inline constexpr int exit_bad = 2;

class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace throng::paper
