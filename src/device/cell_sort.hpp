// Boxes in cell order without global counters that many threads add to. A radix sort of (cell,
// index) brings boxes into the order of buckets of some thousand consecutive cells. Then one thread
// block per bucket counts the boxes per cell in shared memory, writes the cell starts and stores
// each box once, near its neighbours. A bucket may have any number of boxes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "base/size_class_grid.hpp"
#include "device/atomic.hpp"
#include "device/binning.hpp"
#include "device/input.hpp"

namespace throng::device {

// How cells are divided into buckets.
struct Buckets {
  static constexpr int digit = 8;      // bits per pass of the sort
  static constexpr int max_bits = 14;  // a block has shared memory for 2^14 counts
  static constexpr std::uint32_t max_cells = 1u << max_bits;

  std::uint32_t last;  // the last cell; it holds no box, so that its start is the total
  int bits;            // a bucket has 2^bits cells

  // The fewest passes; then the smallest buckets that these allow and that still keep a block busy.
  static Buckets of(std::size_t cells) noexcept {
    const auto last = static_cast<std::uint32_t>(cells - 1);
    const int all = std::bit_width(last + max_cells);  // includes inactive_cell()
    const int passes = std::max(1, (all - max_bits + digit - 1) / digit);
    return {last, std::max(all - passes * digit, passes == 1 ? 10 : 12)};
  }
  std::uint32_t count() const noexcept { return (last >> bits) + 1; }
  // Cell of boxes that take no part. It lies in a bucket of its own, which is never placed.
  std::uint32_t inactive_cell() const noexcept { return count() << bits; }
  // The sort uses the bits from `bits` up to this one.
  int sort_end_bit() const noexcept { return bits + static_cast<int>(std::bit_width(count())); }
  THRONG_HD std::uint32_t bucket_of(std::uint32_t cell) const noexcept { return cell >> bits; }
  THRONG_HD std::uint32_t cells() const noexcept { return 1u << bits; }
  THRONG_HD std::uint32_t within(std::uint32_t cell) const noexcept { return cell & (cells() - 1); }
};

// The sorted cells and indices: two of the four arrays of the sort.
struct SortedCells {
  const std::uint32_t *keys, *values;
};

// Writes each box's cell and index as input of the sort.
struct ComputeCells {
  Input in;
  const base::SizeClassGrid* grid;
  std::uint32_t *cells, *ids;
  std::uint32_t* occupied;  // see occupied_flags; cleared
  Report* report;
  std::uint32_t inactive_cell;  // the cell of boxes that take no part

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (!in.wants_grid()) return;
    ids[i] = i;
    if (in.has_worlds) report_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) {
      cells[i] = inactive_cell;
      return report_inactive(*report, i, nan);
    }
    const StorageCell storage_cell = storage_cell_of(in, *grid, i, box);
    cells[i] = storage_cell.cell;
    mark_occupied(in, occupied, storage_cell.class_index, box);
  }
};

// The steps of one thread block for one bucket, whose boxes are first(bucket) to first(bucket + 1).
// `next` holds the bucket's counts, zeroed. The block calls count() per box, replaces the counts by
// their exclusive sums, passes each sum to set_start(), and calls take() per box.
struct PlaceBuckets {
  Input in;
  Buckets buckets;
  const std::uint32_t *cells, *ids;  // sorted by bucket
  std::uint32_t* start;              // first record of each cell
  Record* records;
  Report* report;

  THRONG_HD bool before(std::uint32_t i, std::uint32_t bucket) const noexcept {
    return buckets.bucket_of(cells[i]) < bucket;
  }
  THRONG_HD void count(std::uint32_t i, std::uint32_t* next) const noexcept {
    fetch_add(next + buckets.within(cells[i]), 1u);
  }
  // `at`: the number of boxes in earlier cells.
  THRONG_HD void set_start(std::uint32_t cell, std::uint32_t at) const noexcept {
    if (cell > buckets.last) return;
    start[cell] = at;
    if (cell == buckets.last) report->active = at;
  }
  // Returns the record of the i-th box; `to` is its place.
  THRONG_HD Record take(std::uint32_t i, std::uint32_t* next, std::uint32_t& to) const noexcept {
    Box box;
    bool nan;
    const std::uint32_t id = ids[i];
    (void)read_box(in, id, box, nan);
    to = fetch_add(next + buckets.within(cells[i]), 1u);
    return {box.lower, id, box.upper, 0};
  }
};

}  // namespace throng::device
