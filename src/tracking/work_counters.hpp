// Work counters of a search.
#pragma once

#include <cstdint>

namespace throng::tracking {

struct Work {
  std::uint64_t compared = 0;  // boxes, empty places of a line included
  std::uint64_t visited = 0;   // cells and tree nodes
  std::uint64_t far = 0;       // cells among them where block data would help

  Work& operator+=(const Work& other) noexcept {
    compared += other.compared;
    visited += other.visited;
    far += other.far;
    return *this;
  }
  std::uint64_t total() const noexcept { return compared + visited; }
};

}  // namespace throng::tracking
