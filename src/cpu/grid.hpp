// The grid: boxes binned into columns, each column swept along the third axis.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "core/planner.hpp"
#include "cpu/prefetch.hpp"
#include "cpu/search.hpp"
#include "cpu/threads.hpp"
#include "cpu/worker.hpp"

namespace throng::cpu {

struct RecordWords;

// The memory of one grid, kept from call to call.
class GridSpace {
 public:
  explicit GridSpace(Memory& memory) noexcept;

  // Enters all boxes of a problem into columns, on `task_count` tasks of the team.
  // Fails through the search where memory does.
  void bin(Search&, const Problem&, const core::GridPlan&, Worker* const* team, unsigned task_count,
           BinReport&);
  // Finds the pairs of all columns, and those of boxes that span too many.
  void find(Search&, const Problem&, const core::GridPlan&, Worker* const* team,
            unsigned task_count, unsigned depth);

  // How many pairs find() will tell; see foretell.hpp.
  std::size_t foretell(Search&, const Problem&, const core::GridPlan&, Worker&);

  void match(const GridSpace& other);
  std::size_t held() const noexcept {
    return pool_.bytes() + regions_.bytes() + tails_.bytes() + order_.bytes() + sizes_.bytes() +
           wide_[0].bytes() + wide_[1].bytes() + wide_ids_[0].bytes() + wide_ids_[1].bytes() +
           wide_labels_[0].bytes() + wide_labels_[1].bytes();
  }
  // Records that the last binning asked room for, or more.
  std::size_t record_bound() const noexcept {
    return used_blocks_ * (block_bytes_ / sizeof(Record));
  }

 private:
  friend class ColumnSearch;
  friend class GridLook;
  friend class LookAhead;
  struct Block {              // a block's first 16 bytes
    std::uintptr_t previous;  // address of the column's block before this, or 0
    std::uint64_t before;     // records in all blocks before this
  };
  // A task's part of the pool, so that it writes from call to call where it has written.
  struct alignas(64) Region {
    std::atomic<std::size_t> used{0};
  };
  // Some blocks in a row, of the task's own part first; 0 where the pool is short.
  std::uintptr_t take_blocks(unsigned task) noexcept;
  static std::uintptr_t next_block(BinTarget* target, std::uint32_t column);
  void prepare(const Search&, const core::GridPlan&, std::size_t boxes, unsigned task_count);
  unsigned choose_buffers(const Search&, double records) const noexcept;
  static void empty_buffer(const BinTask&, std::uint32_t column);
  void bin_side(Search&, const Side&, unsigned side, const core::GridPlan&, Worker&, unsigned task,
                Shares&, BinReport&);
  void bin_tile_of(Search&, const char* boxes, std::size_t stride, const std::uint32_t* ids,
                   std::uint32_t first, std::uint32_t count, unsigned side, const core::Quantiser&,
                   Worker&, BinReport&);
  void enter_spanning(const core::Quantiser&, BinTask&, unsigned side, const Box&, const Record&,
                      std::uint32_t place);
  static void append(BinTask&, std::uint32_t column, const RecordWords&);
  std::uintptr_t* tails(unsigned task, unsigned side) const noexcept {
    return tails_.data() + (std::size_t{task} * 2 + side) * columns_;
  }
  std::uint64_t count_records();
  std::span<const std::uint32_t> densest_first();
  void find_wide(Search&, const Problem&, Worker&);
  // The block that a chain's tail lies in; not of a chain that has none.
  std::uintptr_t block_of(std::uintptr_t tail) const noexcept {
    return (tail - 1) & ~(block_bytes_ - 1);
  }
  // f(segment) for each block of a chain, the last first.
  template <class F>
  void each_segment(std::uintptr_t tail, F&& f) const {
    std::uintptr_t block = tail ? block_of(tail) : 0;
    std::uintptr_t end = tail;
    while (block) {
      const std::uintptr_t previous = reinterpret_cast<const Block*>(block)->previous;
      prefetch_to_stream(reinterpret_cast<const void*>(previous ? previous : block));
      const std::uintptr_t first = block + sizeof(Block);
      f(Segment{reinterpret_cast<const Record*>(first),
                static_cast<std::uint32_t>((end - first) / sizeof(Record))});
      block = previous;
      end = block + block_bytes_;
    }
  }
  // f(record) for all of the first side that are in a column.
  template <class F>
  void each_record(std::uint32_t column, F&& f) const {
    for (unsigned t = 0; t < tasks_; ++t) {
      each_segment(tails(t, 0)[column], [&](const Segment& segment) {
        for (std::uint32_t i = 0; i < segment.count; ++i) f(segment.records[i]);
      });
    }
  }

  std::uint32_t columns_ = 0;
  unsigned tasks_ = 0;
  std::uintptr_t block_bytes_ = 0;
  unsigned buffer_bits_ = 0;  // see choose_buffers()
  std::uintptr_t pool_begin_ = 0;
  std::size_t pool_blocks_ = 0;
  std::size_t used_blocks_ = 0;  // that were asked for, had there been so many
  std::atomic<bool> pool_short_{false};
  Buffer<char> pool_;
  Buffer<Region> regions_;
  Buffer<std::uintptr_t> tails_;
  Buffer<std::uint32_t> order_, sizes_;  // sizes_: records of each column, once counted
  Buffer<Spanning> wide_[2];
  Buffer<std::uint32_t> wide_ids_[2], wide_labels_[2];
  std::uint32_t wide_count_[2] = {0, 0};
  std::uint32_t raised_by_[2] = {0, 0};  // what labels of a side were, see Problem
  std::mutex wide_mutex_;
};

// A worker's scratch at one depth.
struct Level {
  explicit Level(Memory& memory) noexcept;
  void match(const Level& other);

  StripSpace query_strip, target_strip, wide_strip;
  Buffer<Record> clipped;   // of wide_strip
  Buffer<Record> near_few;  // of a column where one side has few boxes, the other's that are near
  Buffer<Segment> segments;
  std::uint32_t segment_count = 0;
  Buffer<std::uint32_t> starts;
  // Of a problem that this worker solves alone: a column, or a world.
  GridSpace space;
  Buffer<std::uint32_t> ids, labels;  // the queries, then the targets
  Buffer<std::uint16_t> before;
};

// Of so many boxes a plan is made.
constexpr std::uint32_t sample_size(std::uint64_t boxes) noexcept {
  return boxes < 4096 ? 64 : (boxes < 65536 ? 256 : core::max_sample);
}
// Plans from a sample of a problem's boxes.
core::GridPlan make_plan(const Search&, const Problem&, Algorithm forced);

// Solves a problem with one worker: a column of a grid of depth - 1, or one world of many.
void solve_alone(Search&, const Problem&, const core::GridPlan&, Worker&, unsigned depth);

}  // namespace throng::cpu
