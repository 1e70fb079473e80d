// The worst ratio of each family and call over many draws, as text.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "work/measure.hpp"

namespace throng::tests {

// A scene drawn from a seed: its family, unless one is given, and up to `most` boxes.
struct WorkDraw {
  std::string family;
  std::uint32_t objects = 0;
  std::uint64_t seed = 0;
};
WorkDraw draw_work(std::uint64_t seed, std::uint32_t least, std::uint32_t most,
                   const std::string& family = {});

class WorstRatios {
 public:
  // Measures the draw; returns false if a result was wrong.
  bool add(const WorkDraw& draw);

  std::uint64_t draws() const noexcept { return draws_; }
  // Every family and call above its bound, one per line; empty if there is none.
  std::string violations() const { return text(true); }
  // Every family and call: its worst ratio, and the draw that gave it.
  std::string table() const { return text(false); }
  // Per call the worst ratio over all families without a bound of their own, as rows of
  // work_bounds.hpp.
  std::string rows() const;
  const std::string& wrong() const noexcept { return wrong_; }

 private:
  struct Worst {
    WorkSample sample{};
    WorkDraw draw;
    std::size_t boxes = 0;
  };
  std::string text(bool only_violations) const;

  std::map<std::pair<std::string, Work>, Worst> worst_;
  std::uint64_t draws_ = 0;
  std::string wrong_;
};

}  // namespace throng::tests
