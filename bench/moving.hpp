// Frames in which some objects move, as the benchmark of them sees it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "contender.hpp"
#include "rivals.hpp"

namespace throng::bench {

struct Moves {
  std::vector<std::uint32_t> ids;
  std::vector<Box> boxes;
  const std::vector<Box>* all = nullptr;  // where all move: every box, for who prefers that
};

class Mover {
 public:
  virtual ~Mover() = default;
  virtual std::string name() const = 0;
  virtual void start(const std::vector<Box>& boxes) = 0;
  // Timed.
  virtual void frame(const Moves& moves) = 0;
  // True: changes() gives the pairs that began and ended in the last frame. False: the pairs there
  // are, and some that do not overlap; begun alone.
  virtual bool tells_changes() const = 0;
  virtual void changes(std::vector<Pair>& begun, std::vector<Pair>& ended) = 0;
};

// Those that were found when this was built.
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<Mover>> moving_rivals();

}  // namespace throng::bench
