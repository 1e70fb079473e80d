// A column's records asked for while the column before it is sorted, a line for each line: they
// were written long ago, and a column that begins with waiting for memory waits for most of its
// time.
#pragma once

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
    space_ = &space;
    column_ = column;
    left_ = column == no_column ? 0 : most_lines;
    task_ = 0;
    block_ = line_ = end_ = 0;
  }

  // Asks for the next line.
  void step() noexcept {
    if (left_ == 0 || (line_ >= end_ && !enter_block())) return;
    prefetch_to_read(reinterpret_cast<const void*>(line_));
    line_ += line_bytes;
    --left_;
  }
  static constexpr std::uint32_t records_a_step = 4;

 private:
  static constexpr std::uintptr_t line_bytes = records_a_step * sizeof(Record);
  static_assert(line_bytes == 64);
  // The second level of cache has more to hold.
  static constexpr std::uint32_t most_lines = 2048;

  // The next block of the chain, which the first line of this one tells, and that has been asked
  // for; or the last of the next task's.
  bool enter_block() noexcept {
    block_ = block_ ? reinterpret_cast<const GridSpace::Block*>(block_)->previous : 0;
    end_ = block_ + space_->block_bytes_;
    for (; !block_ && task_ < space_->tasks_; ++task_) {
      end_ = space_->tails(task_, 0)[column_];
      if (end_) block_ = space_->block_of(end_);
    }
    line_ = block_;
    if (!block_) left_ = 0;
    return block_ != 0;
  }

  const GridSpace* space_ = nullptr;
  std::uint32_t column_ = no_column, left_ = 0;
  unsigned task_ = 0;
  std::uintptr_t block_ = 0, line_ = 0, end_ = 0;
};

}  // namespace throng::cpu
