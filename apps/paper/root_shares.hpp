// How often a fast square root has the wrong integer part: the paper's Table 3.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/paper/roots.hpp"

namespace throng::paper {

struct FastRootChoice {
  std::uint32_t constant = carmack_constant;
  int steps = 2;
  bool wide = true;  // Newton steps in double, stored as float; else in float
  LastOperation last = LastOperation::product;
};

// For each N of `tests`, ascending: the number of i in 0 .. N - 1 whose fast root has an integer
// part other than the hardware's root of the same float.
std::vector<std::uint64_t> wrong_roots(const FastRootChoice& choice,
                                       const std::vector<std::uint64_t>& tests);

}  // namespace throng::paper
