// An error of the device pipeline; thrown inside the library only. The API layer writes the
// message.
#pragma once

#include <cstdint>

#include <throng/options.hpp>

namespace throng::device {

struct Failure {
  Status status;
  std::uint64_t bytes = 0;     // requested in vain, or needed
  const char* text = nullptr;  // the device's own message
  const char* what = nullptr;  // the array that it concerns
};

}  // namespace throng::device
