// Questions to boxes that move, as the benchmark of them sees it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/broad_phase.hpp>

#include "moving.hpp"

namespace throng::bench {

// Rays are the lower corners of their boxes.
struct Questions {
  enum Kind { first, all, region };  // what a ray meets first, all it meets, what is in a box
  Kind kind = first;
  bool at_once = false;  // in one call, for who can
  std::vector<Sweep> rays;
  std::vector<Box> regions;

  std::size_t size() const { return kind == region ? regions.size() : rays.size(); }
};

class Answerer {
 public:
  virtual ~Answerer() = default;
  virtual std::string name() const = 0;
  virtual bool answers(Questions::Kind kind) const = 0;
  virtual void start(const std::vector<Box>& boxes) = 0;
  // Both timed: told what moved; and asked. The latter gives how many objects all questions found.
  virtual void frame(const Moves& moves) = 0;
  virtual std::uint64_t ask(const Questions& questions) = 0;
};

// Those that were found when this was built.
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<Answerer>> answering_rivals();

}  // namespace throng::bench
