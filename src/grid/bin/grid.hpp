// The step "bin": every box into every column that it touches, or apart if these are very many.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "base/mutex.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"
#include "grid/job.hpp"

namespace throng::grid {

// A box that touches too many columns for one record in each: its quantized bounds on three axes.
struct WideBox {
  std::int32_t lower[3];
  std::int32_t upper[3];
  std::uint32_t id;
  std::uint32_t column_offset;  // as in RecordOutput
};

// Records in a row.
struct Segment {
  const Record* records;
  std::uint32_t count;
};

struct BinTask;

// Boxes binned into columns: what binning writes, sweeps and queries read. Keeps its memory between
// calls.
class BinnedGrid {
 public:
  explicit BinnedGrid(base::Memory& memory) noexcept;
  void match(const BinnedGrid& other);
  std::size_t held() const noexcept {
    return pool_.bytes() + regions_.bytes() + tails_.bytes() + order_.bytes() + sizes_.bytes() +
           wide_[0].bytes() + wide_[1].bytes();
  }

  // Bins all boxes of a problem. Reports allocation failure through the search.
  BinReport bin(const Job&);

  // After bin(). Side 0 is the problem's queries, 1 its targets.
  std::uint32_t column_count() const noexcept { return columns_; }
  // The boxes that are in no column.
  std::span<const WideBox> wide(unsigned side) const noexcept {
    return {wide_[side].data(), wide_count_[side]};
  }
  // An upper bound of the records.
  std::size_t record_bound() const noexcept {
    return used_blocks_ * (block_bytes_ / sizeof(Record));
  }
  // The number of records of each column, of both sides. Counts on each call; the result is valid
  // until the next one.
  std::span<const std::uint32_t> count_records();
  // The non-empty columns by decreasing size, so that no large one is left for the end. Empty if
  // sizes are similar: keep their order.
  std::span<const std::uint32_t> largest_first();

  // A column's records are in one chain of blocks per task and side. Its tail is the address after
  // its last record, 0 if it has none.
  struct Block {              // header: a block's first 16 bytes
    std::uintptr_t previous;  // address of the chain's previous block, or 0
    std::uint64_t before;     // records in all previous blocks
  };
  unsigned task_count() const noexcept { return tasks_; }
  std::uintptr_t tail(unsigned task, unsigned side, std::uint32_t column) const noexcept {
    return tails(task, side)[column];
  }
  std::uintptr_t block_bytes() const noexcept { return block_bytes_; }
  // The block of a chain's tail. The chain is not empty.
  std::uintptr_t block_of(std::uintptr_t tail) const noexcept {
    return (tail - 1) & ~(block_bytes_ - 1);
  }
  // The number of a chain's blocks.
  std::size_t block_count(std::uintptr_t tail) const noexcept {
    return reinterpret_cast<const Block*>(block_of(tail))->before / records_per_block() + 1;
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
  // Calls f(record) for all records of a side in a column.
  template <class F>
  void each_record(std::uint32_t column, unsigned side, F&& f) const {
    for (unsigned t = 0; t < tasks_; ++t) {
      each_segment(tail(t, side, column), [&](const Segment& segment) {
        for (std::uint32_t i = 0; i < segment.count; ++i) f(segment.records[i]);
      });
    }
  }

  // For BinTask: starts a chain's next block. Returns the address of its first record.
  std::uintptr_t start_block(BinTask&, std::uint32_t column);

 private:
  // A task's part of the pool, so that it reuses its own memory in each call.
  struct alignas(64) Region {
    std::atomic<std::size_t> used{0};
  };
  // Takes block_batch contiguous blocks, from the task's own region first; 0 if the pool is
  // exhausted.
  std::uintptr_t take_blocks(unsigned task) noexcept;
  void prepare(const Job&, std::size_t boxes);
  unsigned choose_buffers(const Search&, double records) const noexcept;
  void bin_side(const Job&, unsigned side, unsigned task, base::ChunkQueue&, BinReport&);
  void bin_tile_of(const Job&, unsigned side, const BinInput&, BinTask&, BinReport&);
  void bin_spanning(const base::Quantizer&, BinTask&, unsigned side, const Box&, const Record&,
                    std::uint32_t column_offset);
  std::size_t records_per_block() const noexcept { return block_bytes_ / sizeof(Record) - 1; }
  std::uintptr_t* tails(unsigned task, unsigned side) const noexcept {
    return tails_.data() + (std::size_t{task} * 2 + side) * columns_;
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
  base::Buffer<std::uint32_t> order_, sizes_;  // of largest_first() and count_records()
  base::Buffer<WideBox> wide_[2];
  std::uint32_t wide_count_[2] = {0, 0};
  base::Mutex wide_mutex_;
};

}  // namespace throng::grid
