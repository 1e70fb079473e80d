// The reference search of `check`: two loops. It shares only the public types with the library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <throng/boxes.hpp>

namespace throng::cli {

struct LoopResult {
  std::vector<Pair> pairs;     // sorted by first, then second
  std::uint64_t inactive = 0;  // inverted boxes, and those with a NaN
};

// Pairs of `a` (b null), or of a box of `a` and a box of `*b`, under the filters of both. A box
// with a NaN overlaps nothing. `progress` is called on the calling thread with the number of rows
// done.
LoopResult double_loop(const Boxes& a, const Boxes* b, float margin,
                       const std::function<void(std::size_t)>& progress);

}  // namespace throng::cli
