// State shared by the parts of one call to an Engine.
#pragma once

#include <chrono>

#include "grid/doubles.hpp"
#include "grid/engine.hpp"

namespace throng::grid {

class Clock {
 public:
  explicit Clock(bool on) noexcept : on_(on) { last_ = now(); }
  double lap() noexcept {
    if (!on_) return 0;
    const auto before = last_;
    last_ = now();
    return std::chrono::duration<double, std::milli>(last_ - before).count();
  }

 private:
  std::chrono::steady_clock::time_point now() const noexcept {
    return on_ ? std::chrono::steady_clock::now() : std::chrono::steady_clock::time_point{};
  }
  bool on_;
  std::chrono::steady_clock::time_point last_;
};

struct Engine::Call {
  explicit Call(const Options& o) : options(o), clock(o.measure_stages) {}
  const Options& options;
  Clock clock;
  Doubles doubles;
  Boxes rounded[2];  // float boxes in place of doubles
  Search search;
  Problem problem;
  GridPlan plan;
  unsigned tasks = 1;
  bool partitioned = false;
  Result result;
};

}  // namespace throng::grid
