// Memory that ends at a protected page: a read behind it ends the program.
#pragma once

#include <cstddef>

namespace throng::tests {

class GuardedMemory {
 public:
  explicit GuardedMemory(std::size_t bytes);
  ~GuardedMemory();
  GuardedMemory(const GuardedMemory&) = delete;
  GuardedMemory& operator=(const GuardedMemory&) = delete;
  char* begin() const { return begin_; }

 private:
  std::size_t whole_;
  char *base_, *begin_;
};

}  // namespace throng::tests
