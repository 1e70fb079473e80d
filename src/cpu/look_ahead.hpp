// A column's records asked for while the column before it is sorted, a line for each line: they
// were written long ago, and a column that begins with waiting for memory waits for most of its
// time.
#pragma once

#include <algorithm>
#include <cstdint>

#include "cpu/grid.hpp"
#include "cpu/prefetch.hpp"

namespace throng::cpu {

class LookAhead {
 public:
  // The records of the first side that lie in this column, those entered last first; with
  // `no_column` none.
  static constexpr std::uint32_t no_column = 0xffffffffu;
  void aim(const GridSpace& space, std::uint32_t column) noexcept {
    count_ = now_ = 0;
    if (column == no_column) return;
    left_ = most_lines;
    for (unsigned t = 0; t < space.tasks_ && count_ < most_runs; ++t) {
      count_ += space.chain(space.tails(t, 0)[column], runs_ + count_, most_runs - count_);
    }
  }

  // Asks for the next line.
  void step() noexcept {
    if (now_ == count_ || left_ == 0) return;
    Segment& run = runs_[now_];
    prefetch_to_read(run.records);
    --left_;
    run.records += records_a_step;
    run.count -= std::min(run.count, records_a_step);
    now_ += run.count == 0;
  }
  static constexpr std::uint32_t records_a_step = 4;

 private:
  static_assert(records_a_step * sizeof(Record) == 64);  // a line
  // What the hardware has by itself once it reads on is left to it, and the second level of cache
  // has more to hold.
  static constexpr std::uint32_t most_lines = 512, most_runs = 16;

  Segment runs_[most_runs] = {};
  std::uint32_t count_ = 0, now_ = 0, left_ = 0;
};

}  // namespace throng::cpu
