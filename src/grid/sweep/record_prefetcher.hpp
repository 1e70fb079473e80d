// Prefetches a column's records while the column before it is sorted, line by line. They were
// written long ago; without prefetching, a column spends most of its time waiting for memory.
#pragma once

#include <cstdint>

#include "base/prefetch.hpp"
#include "grid/bin/grid.hpp"

namespace throng::grid {

class RecordPrefetcher {
 public:
  static constexpr std::uint32_t no_column = 0xffffffffu;
  // Starts with this column's records of the first side, latest first; with `no_column`, with none.
  void start(const BinnedGrid& grid, std::uint32_t column) noexcept {
    grid_ = &grid;
    column_ = column;
    left_ = column == no_column ? 0 : max_lines;
    task_ = 0;
    block_ = line_ = end_ = 0;
  }

  // Prefetches the next line.
  void step() noexcept {
    if (left_ == 0 || (line_ >= end_ && !enter_block())) return;
    base::prefetch_l2(reinterpret_cast<const void*>(line_));
    line_ += line_bytes;
    --left_;
  }
  static constexpr std::uint32_t records_per_step = 4;

 private:
  static constexpr std::uintptr_t line_bytes = records_per_step * sizeof(Record);
  static_assert(line_bytes == 64);
  // The L2 cache must hold other data, too.
  static constexpr std::uint32_t max_lines = 2048;

  // Moves to the previous block of the chain (its address is in the first line of this block, which
  // has been prefetched), or to the last block of the next task's chain.
  bool enter_block() noexcept {
    block_ = block_ ? reinterpret_cast<const BinnedGrid::Block*>(block_)->previous : 0;
    end_ = block_ + grid_->block_bytes();
    for (; !block_ && task_ < grid_->task_count(); ++task_) {
      end_ = grid_->tail(task_, 0, column_);
      if (end_) block_ = grid_->block_of(end_);
    }
    line_ = block_;
    if (!block_) left_ = 0;
    return block_ != 0;
  }

  const BinnedGrid* grid_ = nullptr;
  std::uint32_t column_ = no_column, left_ = 0;
  unsigned task_ = 0;
  std::uintptr_t block_ = 0, line_ = 0, end_ = 0;
};

}  // namespace throng::grid
