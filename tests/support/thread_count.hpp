// Number of running threads.
#pragma once

#include <cstddef>
#include <filesystem>
#include <system_error>

namespace throng::tests {

// The threads of this process; 0 if unknown.
inline std::size_t thread_count() {
  std::error_code error;
  std::size_t count = 0;
  for (auto it = std::filesystem::directory_iterator("/proc/self/task", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error))
    ++count;
  return count;
}

}  // namespace throng::tests
