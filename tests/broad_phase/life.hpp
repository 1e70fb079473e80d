// Bytes become calls on a BroadPhase, good ones and wrong ones, and the same on its model. Whatever
// is told must be what the model tells; a wrong call must be refused and change nothing.
#pragma once

#include <cstdint>

#include "support/bytes.hpp"

namespace throng::tests {

// What a life compared: an object counts once an update whose whole answer was held against the
// model's; a pair likewise.
struct LifeCount {
  std::uint64_t updates = 0, boxes = 0, pairs = 0, questions = 0;
};

// Throws Difference.
LifeCount live(Bytes& bytes);

}  // namespace throng::tests
