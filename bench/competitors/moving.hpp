// Methods that keep objects from frame to frame, for frames in which some objects move.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "competitors.hpp"
#include "method.hpp"

namespace throng::bench {

struct Moves {
  std::vector<std::uint32_t> ids;
  std::vector<Box> boxes;
  const std::vector<Box>* all = nullptr;  // if all move: every box, in the order of the ids
};

class MovingMethod {
 public:
  virtual ~MovingMethod() = default;
  virtual std::string name() const = 0;
  virtual void start(const std::vector<Box>& boxes) = 0;
  // Timed.
  virtual void update(const Moves& moves) = 0;
  // True: changes() returns the pairs that began and ended in the last frame. False: it returns the
  // current pairs in `begun`, including some that do not overlap.
  virtual bool reports_changes() const = 0;
  virtual void changes(std::vector<Pair>& begun, std::vector<Pair>& ended) = 0;
};

// Those that were found at build time.
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<MovingMethod>> moving_competitors();

}  // namespace throng::bench
