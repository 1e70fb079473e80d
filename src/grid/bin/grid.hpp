// The grid: boxes binned into columns, each column swept along the third axis.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "base/mutex.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"
#include "grid/emit/worker.hpp"
#include "grid/plan/planner.hpp"
#include "grid/search.hpp"

namespace throng::grid {

struct RecordWords;

// A box that touches too many columns for one record in each: its quantized bounds on three axes.
struct WideBox {
  std::int32_t lower[3];
  std::int32_t upper[3];
  std::uint32_t id;
  std::uint32_t column_offset;  // as in RecordOutput
};

// The memory of one grid, kept between calls.
class BinnedGrid {
 public:
  explicit BinnedGrid(base::Memory& memory) noexcept;

  // Bins all boxes of a problem, on `task_count` tasks. Reports allocation failure
  // through the search.
  void bin(Search&, const Problem&, const GridPlan&, Worker* const* workers, unsigned task_count,
           BinReport&);
  // Finds the pairs of all columns, and those of wide boxes.
  void find(Search&, const Problem&, const GridPlan&, Worker* const* workers, unsigned task_count,
            unsigned depth);

  // Estimates the number of pairs of find(); see estimate_pair_count.hpp.
  std::size_t estimate_pair_count(Search&, const Problem&, const GridPlan&, Worker&);

  void match(const BinnedGrid& other);
  std::size_t held() const noexcept {
    return pool_.bytes() + regions_.bytes() + tails_.bytes() + order_.bytes() + sizes_.bytes() +
           wide_[0].bytes() + wide_[1].bytes() + wide_ids_[0].bytes() + wide_ids_[1].bytes() +
           wide_labels_[0].bytes() + wide_labels_[1].bytes();
  }
  // An upper bound of the records of the last binning.
  std::size_t record_bound() const noexcept {
    return used_blocks_ * (block_bytes_ / sizeof(Record));
  }

 private:
  friend class ColumnSearch;
  friend class GridQuery;
  friend class RecordPrefetcher;
  struct Block {              // header: a block's first 16 bytes
    std::uintptr_t previous;  // address of the column's previous block, or 0
    std::uint64_t before;     // records in all previous blocks
  };
  // A task's part of the pool, so that it reuses its own memory in each call.
  struct alignas(64) Region {
    std::atomic<std::size_t> used{0};
  };
  // Takes block_batch contiguous blocks, from the task's own region first; 0 if the pool is
  // exhausted.
  std::uintptr_t take_blocks(unsigned task) noexcept;
  friend struct BinTask;
  void prepare(const Search&, const GridPlan&, std::size_t boxes, unsigned task_count);
  unsigned choose_buffers(const Search&, double records) const noexcept;
  static void flush_buffer(const BinTask&, std::uint32_t column);
  void bin_side(Search&, const BoxSubset&, unsigned side, const GridPlan&, Worker&, unsigned task,
                base::ChunkQueue&, BinReport&);
  void bin_tile_of(Search&, const char* boxes, std::size_t stride, const std::uint32_t* ids,
                   std::uint32_t first, std::uint32_t count, unsigned side, const base::Quantizer&,
                   Worker&, BinReport&);
  void bin_spanning(const base::Quantizer&, BinTask&, unsigned side, const Box&, const Record&,
                    std::uint32_t place);
  static void append(BinTask&, std::uint32_t column, const RecordWords&);
  std::uintptr_t* tails(unsigned task, unsigned side) const noexcept {
    return tails_.data() + (std::size_t{task} * 2 + side) * columns_;
  }
  std::uint64_t count_records();
  std::span<const std::uint32_t> largest_first();
  void find_wide(Search&, const Problem&, Worker&);
  // The block of a chain's tail. The chain is not empty.
  std::uintptr_t block_of(std::uintptr_t tail) const noexcept {
    return (tail - 1) & ~(block_bytes_ - 1);
  }
  // Calls f(segment) for each block of a chain, the last first.
  template <class F>
  void each_segment(std::uintptr_t tail, F&& f) const {
    std::uintptr_t block = tail ? block_of(tail) : 0;
    std::uintptr_t end = tail;
    while (block) {
      const std::uintptr_t previous = reinterpret_cast<const Block*>(block)->previous;
      base::prefetch_l1(reinterpret_cast<const void*>(previous ? previous : block));
      const std::uintptr_t first = block + sizeof(Block);
      f(Segment{reinterpret_cast<const Record*>(first),
                static_cast<std::uint32_t>((end - first) / sizeof(Record))});
      block = previous;
      end = block + block_bytes_;
    }
  }
  // Calls f(record) for all records of the first subset in a column.
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
  std::size_t used_blocks_ = 0;  // requested, including failed requests
  std::atomic<bool> pool_exhausted_{false};
  base::Buffer<char> pool_;
  base::Buffer<Region> regions_;
  base::Buffer<std::uintptr_t> tails_;
  base::Buffer<std::uint32_t> order_, sizes_;  // sizes_: records per column, once counted
  base::Buffer<WideBox> wide_[2];
  base::Buffer<std::uint32_t> wide_ids_[2], wide_labels_[2];
  std::uint32_t wide_count_[2] = {0, 0};
  std::uint32_t id_offset_[2] = {0, 0};  // offset of a subset's labels, see Problem
  base::Mutex wide_mutex_;
};

}  // namespace throng::grid
