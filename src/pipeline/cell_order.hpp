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

// How cells are parted into buckets. The last of the cells is no cell: there are the boxes that
// take no part.
struct Buckets {
  static constexpr int digit = 8;       // bits of a pass of the sort
  static constexpr int most_bits = 14;  // 2^14 counts are what a block has memory for
  static constexpr std::uint32_t most_cells = 1u << most_bits;

  std::uint32_t none;  // cells before the last
  int bits;            // a bucket has 2^bits cells
  int key_bits;        // of all cells

  // As few passes as can be; then as small as these allow, but that a bucket is worth a block.
  static Buckets of(std::size_t cells) noexcept {
    const auto none = static_cast<std::uint32_t>(cells - 1);
    const int all = std::bit_width(none);
    const int passes = std::max(1, (all - most_bits + digit - 1) / digit);
    return {none, std::max(all - passes * digit, passes == 1 ? 10 : 12), all};
  }
  // Bits to be sorted by: from `bits` on, one at least.
  int sorted_end() const noexcept { return std::max(key_bits, bits + 1); }
  std::uint32_t count() const noexcept { return (none >> bits) + 1; }
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
  std::uint32_t* occupied;  // a group and class; cleared
  Report* report;
  std::uint32_t none;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (!in.wants_grid()) return;
    ids[i] = i;
    if (in.has_worlds) tell_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) {
      cells[i] = none;
      return tell_inactive(*report, i, nan);
    }
    const Home home = home_of(in, *grid, i, box);
    cells[i] = home.cell;
    raise(occupied + home.class_index);
  }
};

// What the threads of a block do for a bucket, whose boxes are those from first(bucket) to
// first(bucket + 1): `next` has its counts, cleared; after count() of each these are summed up,
// each is told to tell(), and then says where the next box of that cell goes.
struct PlaceBuckets {
  Input in;
  Buckets buckets;
  const std::uint32_t *cells, *ids;  // sorted by bucket
  std::uint32_t* start;              // of each cell's records, none included
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
    if (cell > buckets.none) return;
    start[cell] = at;
    if (cell == buckets.none) report->active = at;
  }
  // The i-th box, and where it goes; false: nowhere.
  THRONG_HD bool take(std::uint32_t i, std::uint32_t* next, Record& record,
                      std::uint32_t& to) const noexcept {
    if (cells[i] == buckets.none) return false;
    Box box;
    bool nan;
    const std::uint32_t id = ids[i];
    (void)read_box(in, id, box, nan);
    to = fetch_add(next + buckets.within(cells[i]), 1u);
    record = {box.lower, id, box.upper, 0};
    return true;
  }
};

}  // namespace throng::pipeline
