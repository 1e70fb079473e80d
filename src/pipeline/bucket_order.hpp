// Many boxes, before they are sorted into cells: stored once in a coarse order of these, by
// buckets, each a part of the table of cells that is small beside a device's caches. Boxes that are
// counted and placed in that order go to places near one another; in the order of a caller, which
// may be any, each would go to memory by itself.
//
// A tile of boxes claims its places together: its threads count the tile's boxes of each bucket,
// claim so many places of each, and store. There are few buckets, so that a tile has several boxes
// of each, which are written side by side.
#pragma once

#include <bit>
#include <cstdint>

#include "core/class_grid.hpp"
#include "pipeline/atomic.hpp"
#include "pipeline/input.hpp"
#include "pipeline/stages.hpp"

namespace throng::pipeline {

// Of a hundred million boxes one has 12 MB of records and 3 MB of cells.
constexpr std::uint32_t bucket_count = 256;

// Flags, one for each group and class.
constexpr std::uint32_t occupied_flags = 8 * core::max_size_classes;

// The upper bits of a cell: at least half of the buckets are used where the cells are. Cells of a
// hashed row that reach beyond the table are of the last one.
THRONG_HD inline std::uint32_t bucket_of(const core::ClassGrid& grid, bool has_worlds,
                                         std::uint32_t cell) noexcept {
  const std::uint32_t parts = core::group_count(grid.present) * (has_worlds ? grid.world_slots : 1);
  const std::uint32_t cells = grid.hashed ? grid.table_cells : parts * grid.world_cells;
  const int bits = std::bit_width(cells - 1) - std::bit_width(bucket_count - 1);
  const std::uint32_t bucket = cell >> (bits > 0 ? bits : 0);
  return bucket < bucket_count ? bucket : bucket_count - 1;
}

// Counts each bucket's boxes, and tells of those that are wrong. Threads that share memory count
// there first.
struct CountBuckets {
  Input in;
  const core::ClassGrid* grid;
  std::uint32_t* counts;    // a bucket; cleared
  std::uint32_t* occupied;  // a group and class; cleared
  Report* report;

  static constexpr std::uint32_t shared_count = bucket_count + occupied_flags;  // cleared

  THRONG_HD void operator()(std::uint64_t index, std::uint32_t* shared) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (in.has_worlds) tell_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) return tell_inactive(*report, i, nan);
    const Home home = home_of(in, *grid, i, box);
    fetch_add(shared + bucket_of(*grid, in.has_worlds, home.cell), 1u);
    fetch_add(shared + bucket_count + home.class_index, 1u);
  }
  // What these threads have, k below shared_count.
  THRONG_HD void add(std::uint32_t k, const std::uint32_t* shared) const noexcept {
    if (shared[k] == 0) return;
    if (k < bucket_count)
      fetch_add(counts + k, shared[k]);
    else
      raise(occupied + (k - bucket_count));
  }
};

// Stores the active boxes by buckets, in any order within one, each with the cell that it is for.
struct FillBuckets {
  Input in;
  const core::ClassGrid* grid;
  std::uint32_t* next;  // where a bucket's next box goes
  Record* records;
  std::uint32_t* cells;  // of these, once more: they are all that is needed to count

  static constexpr std::uint32_t none = ~0u;
  // A box on its way.
  struct Held {
    Box box;
    std::uint32_t cell;
    std::uint32_t rank;  // among the tile's boxes of its bucket; none: takes no part
  };
  // Only that: no box's loads wait for those of the one before.
  THRONG_HD void read(std::uint64_t i, Held& held) const noexcept {
    const auto k = static_cast<std::uint32_t>(i < in.count ? i : in.count - 1);
    held.box = in.set_of(k).box(in.local(k));
  }
  // `counts`: of the tile's boxes in each bucket, cleared.
  THRONG_HD void count(std::uint64_t i, Held& held, std::uint32_t* counts) const noexcept {
    held.rank = none;
    bool nan;
    if (i >= in.count || !check_box(in, held.box, nan)) return;
    held.cell = home_of(in, *grid, static_cast<std::uint32_t>(i), held.box).cell;
    held.rank = fetch_add(counts + bucket(held.cell), 1u);
  }
  // Where the first of a tile's `count` boxes of a bucket goes.
  THRONG_HD std::uint32_t claim(std::uint32_t bucket, std::uint32_t count) const noexcept {
    return count == 0 ? 0 : fetch_add(next + bucket, count);
  }
  THRONG_HD std::uint32_t bucket(std::uint32_t cell) const noexcept {
    return bucket_of(*grid, in.has_worlds, cell);
  }
  THRONG_HD static Record record(std::uint64_t i, const Held& held) noexcept {
    return {held.box.lower, static_cast<std::uint32_t>(i), held.box.upper, held.cell};
  }
};

// What CountBoxes and PlaceBoxes do, of boxes that stand by buckets: so many as are active. What is
// read for the last time leaves a device's cache first, so that a bucket's cells and places stay.
struct CountRecords {
  const std::uint32_t* active;
  std::uint32_t* counts;  // a cell; cleared
  std::uint32_t* ranks;   // a record; its cell until then

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i >= *active) return;
    stream_out(ranks + i, fetch_add(counts + stream_in(ranks + i), 1u));
  }
};
// Two threads a record, as PlaceBoxes has.
struct PlaceRecords {
  const Record* records;
  const std::uint32_t* active;
  const std::uint32_t* start;  // a cell
  const std::uint32_t* ranks;
  Record* placed;
  Report* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const std::uint64_t i = index / 2;
    if (index == 0) report->active = *active;
    if (i >= *active) return;
    const Record* from = records + i;
    const std::uint32_t at = start[stream_in(&from->cell)] + stream_in(ranks + i);
    copy_half(placed + at, index % 2 != 0, from);
  }
};

}  // namespace throng::pipeline
