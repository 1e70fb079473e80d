// Boxes in the order of their cells, without a place of memory that many threads add to. A radix
// sort of (cell, index) brings them into the order of buckets, each some thousand cells that follow
// one another; then a block takes a bucket, counts its boxes a cell in memory of its own, and from
// that writes the cells' starts and stores the boxes, each once, near one another. However many
// boxes a bucket has, it is done in the same way.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "core/class_grid.hpp"
#include "pipeline/atomic.hpp"
#include "pipeline/input.hpp"
#include "pipeline/stages.hpp"

namespace throng::pipeline {

// How cells are parted into buckets.
struct Buckets {
  static constexpr int digit = 8;       // bits of a pass of the sort
  static constexpr int most_bits = 14;  // 2^14 counts are what a block has memory for
  static constexpr std::uint32_t most_cells = 1u << most_bits;

  std::uint32_t last;  // the last cell; no box is stored there, so that its start counts all
  int bits;            // a bucket has 2^bits cells

  // As few passes as can be; then as small as these allow, but that a bucket is worth a block.
  static Buckets of(std::size_t cells) noexcept {
    const auto last = static_cast<std::uint32_t>(cells - 1);
    const int all = std::bit_width(last + most_cells);  // of what is outside, too
    const int passes = std::max(1, (all - most_bits + digit - 1) / digit);
    return {last, std::max(all - passes * digit, passes == 1 ? 10 : 12)};
  }
  std::uint32_t count() const noexcept { return (last >> bits) + 1; }
  // In place of a cell, for boxes that take no part: a bucket of their own, which nobody looks at.
  std::uint32_t outside() const noexcept { return count() << bits; }
  // The bits to be sorted by are those from `bits` on.
  int sorted_end() const noexcept { return bits + static_cast<int>(std::bit_width(count())); }
  THRONG_HD std::uint32_t of_cell(std::uint32_t cell) const noexcept { return cell >> bits; }
  THRONG_HD std::uint32_t cells() const noexcept { return 1u << bits; }
  THRONG_HD std::uint32_t within(std::uint32_t cell) const noexcept { return cell & (cells() - 1); }
};

// The cells and indices once sorted: in two of the four arrays that it took.
struct ByBucket {
  const std::uint32_t *keys, *values;
};

// Each box's cell, and its index, to be sorted.
struct NameCells {
  Input in;
  const core::ClassGrid* grid;
  std::uint32_t *cells, *ids;
  std::uint32_t* occupied;  // see occupied_flags; cleared
  Report* report;
  std::uint32_t outside;  // the cell of boxes that take no part

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (!in.wants_grid()) return;
    ids[i] = i;
    if (in.has_worlds) tell_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) {
      cells[i] = outside;
      return tell_inactive(*report, i, nan);
    }
    const Home home = home_of(in, *grid, i, box);
    cells[i] = home.cell;
    occupy(in, occupied, home.class_index, box);
  }
};

// What the threads of a block do for a bucket, whose boxes are those from first(bucket) to
// first(bucket + 1): `next` has its counts, cleared; after count() of each these are summed up,
// each is told to tell(), and then says where the next box of that cell goes.
struct PlaceBuckets {
  Input in;
  Buckets buckets;
  const std::uint32_t *cells, *ids;  // sorted by bucket
  std::uint32_t* start;              // of each cell's records
  Record* records;
  Report* report;

  THRONG_HD bool before(std::uint32_t i, std::uint32_t bucket) const noexcept {
    return buckets.of_cell(cells[i]) < bucket;
  }
  THRONG_HD void count(std::uint32_t i, std::uint32_t* next) const noexcept {
    fetch_add(next + buckets.within(cells[i]), 1u);
  }
  // `at`: the boxes in cells before this one.
  THRONG_HD void tell(std::uint32_t cell, std::uint32_t at) const noexcept {
    if (cell > buckets.last) return;
    start[cell] = at;
    if (cell == buckets.last) report->active = at;
  }
  // The i-th box, and where it goes.
  THRONG_HD Record take(std::uint32_t i, std::uint32_t* next, std::uint32_t& to) const noexcept {
    Box box;
    bool nan;
    const std::uint32_t id = ids[i];
    (void)read_box(in, id, box, nan);
    to = fetch_add(next + buckets.within(cells[i]), 1u);
    return {box.lower, id, box.upper, 0};
  }
};

}  // namespace throng::pipeline
