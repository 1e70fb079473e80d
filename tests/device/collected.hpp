// A consumer that keeps all pairs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <throng/types.hpp>

namespace throng::device {

struct Collected {
  std::vector<Pair> pairs;
  std::size_t largest = 0;  // of the blocks
  bool operator()(const Pair* block, std::size_t count) {
    pairs.insert(pairs.end(), block, block + count);
    largest = std::max(largest, count);
    return true;
  }
};

}  // namespace throng::device
