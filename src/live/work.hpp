// What a search looked at.
#pragma once

#include <cstdint>

namespace throng::live {

struct Work {
  std::uint64_t compared = 0;  // boxes, each place of a line
  std::uint64_t visited = 0;   // cells and tree nodes

  Work& operator+=(const Work& other) noexcept {
    compared += other.compared;
    visited += other.visited;
    return *this;
  }
  std::uint64_t total() const noexcept { return compared + visited; }
};

}  // namespace throng::live
