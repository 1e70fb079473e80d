// Counts every allocation of the process while it is on; see heap_count.cpp.
#pragma once

#include <cstddef>

namespace throng::tests {

struct HeapCount {
  static void start();
  // How many there were since start().
  static std::size_t stop();
  // Off for a while: pause() tells what to give resume().
  static bool pause();
  static void resume(bool counting);
  // True where malloc is seen too, not only operator new.
  static bool complete();
};

}  // namespace throng::tests
