// Counts every allocation of the process while it is on; see heap_count.cpp.
#pragma once

#include <cstddef>

namespace throng::tests {

struct HeapCount {
  static void start();
  // Returns the number since start().
  static std::size_t stop();
  // Stops counting temporarily; pass the result of pause() to resume().
  static bool pause();
  static void resume(bool counting);
  // True if malloc is counted too, not only operator new.
  static bool complete();
};

}  // namespace throng::tests
