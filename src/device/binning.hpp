// The per-thread steps before the search: read a box, compute its cell, store it.
#pragma once

#include <cstdint>
#include <limits>

#include "base/bounds.hpp"
#include "base/size_class_grid.hpp"
#include "device/atomic.hpp"
#include "device/input.hpp"

namespace throng::device {

// Expands the box as it is compared; returns false if it takes no part.
THRONG_HD inline bool check_box(const Input& in, Box& box, bool& nan) noexcept {
  nan = base::has_nan(box);
  if (!base::is_active(box)) return false;  // a NaN compares false
  if (in.margin != 0) box = base::expand(box, in.margin);
  return true;
}
THRONG_HD inline bool read_box(const Input& in, std::uint32_t i, Box& box, bool& nan) noexcept {
  box = in.set_of(i).box(in.local(i));
  return check_box(in, box, nan);
}

// Replaces a box that takes no part: it overlaps nothing.
THRONG_HD inline Box no_box() noexcept {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  return {{none, none, none}, {none, none, none}};
}

THRONG_HD inline void report_inactive(Report& report, std::uint32_t i, bool nan) noexcept {
  fetch_add(&report.inactive, std::uint64_t{1});
  if (!nan) return;
  fetch_add(&report.nan_count, std::uint64_t{1});
  fetch_max(&report.nan_mark, ~i);
}

// Reports a world below -1.
THRONG_HD inline void report_bad_world(const Input& in, Report& report, std::uint32_t i) noexcept {
  const Set& s = in.set_of(i);
  if (!s.world || s.world[in.local(i)] >= -1) return;
  fetch_add(&report.bad_worlds, std::uint64_t{1});
  fetch_max(&report.bad_world_mark, ~i);
}

// Where a box is stored: its storage cell.
struct StorageCell {
  std::uint32_t cell, class_index;  // (group, class)
};
THRONG_HD inline StorageCell storage_cell_of(const Input& in, const base::SizeClassGrid& grid,
                                             std::uint32_t i, const Box& box) noexcept {
  const base::CellSpan span = base::cells_of(grid, box);
  const std::uint32_t size_class = base::class_of(grid, span);
  const std::uint32_t bits = grid.present ? in.group_bits(i) : 0;
  const std::uint32_t group = base::pack_group(grid.present, bits);
  const std::uint32_t world =
      in.has_worlds && !(bits & base::everywhere_bit) ? static_cast<std::uint32_t>(in.world(i)) : 0;
  const base::SizeClass& c = grid.classes[size_class];
  const std::uint32_t row =
      base::row_start(grid, base::part_of(grid, world, group, size_class),
                      span.lower[1] >> c.shift[1], span.lower[2] >> c.shift[2]);
  return {row + static_cast<std::uint32_t>(span.lower[0] >> c.shift[0]),
          group * base::max_size_classes + size_class};
}

// Records that a group and class contains this box.
THRONG_HD inline void mark_occupied(const Input& in, std::uint32_t* occupied,
                                    std::uint32_t class_index, const Box& box) noexcept {
  set_flag(occupied + class_index);
  if (!in.bounds_occupied()) return;
  std::uint32_t* const most = occupied + occupied_flags + 6 * class_index;
  const float ends[6] = {-box.lower.x, -box.lower.y, -box.lower.z,
                         box.upper.x,  box.upper.y,  box.upper.z};
  for (int k = 0; k < 6; ++k) raise_max(most + k, in_order(ends[k]));
}

// Where a box is stored: its cell and its rank among the boxes of that cell. no_cell: it takes no
// part.
struct Place {
  std::uint32_t cell, rank;
};
constexpr std::uint32_t no_cell = ~0u;

// Counts the boxes per cell.
struct CountBoxes {
  Input in;
  const base::SizeClassGrid* grid;
  std::uint32_t* counts;    // per cell; zeroed
  std::uint32_t* occupied;  // see occupied_flags; zeroed
  Place* places;            // per box
  Report* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (!in.wants_grid()) return;
    if (in.has_worlds) report_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) {
      places[i] = {no_cell, 0};
      return report_inactive(*report, i, nan);
    }
    const StorageCell storage_cell = storage_cell_of(in, *grid, i, box);
    places[i] = {storage_cell.cell, fetch_add(counts + storage_cell.cell, 1u)};
    mark_occupied(in, occupied, storage_cell.class_index, box);
  }
};

// Stores each box at its cell's start plus its rank. Two adjacent threads per box, so that a sector
// is written whole in one transaction.
struct PlaceBoxes {
  Input in;
  const std::uint32_t* start;  // per cell, and one entry more for the total
  const Place* places;
  Record* records;
  Report* report;
  std::uint32_t cells;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index / 2);
    if (!in.wants_grid()) return;
    if (index == 0) report->active = start[cells];
    const Place place = places[i];
    if (place.cell == no_cell) return;
    Box box;
    bool nan;
    (void)read_box(in, i, box, nan);
    store_half(records + (start[place.cell] + place.rank), index % 2 != 0,
               Record{box.lower, i, box.upper, 0});
  }
};

// For brute force: stores every box at its own index. An inactive one overlaps nothing.
struct LoadBoxes {
  Input in;
  Record* records;
  Report* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    Box box;
    bool nan;
    if (in.has_worlds) report_bad_world(in, *report, i);
    if (!read_box(in, i, box, nan)) {
      box = no_box();
      report_inactive(*report, i, nan);
    }
    records[i] = Record{box.lower, i, box.upper, 0};
  }
};

// Counts the pairs per first index, for the consumer form, which delivers them in blocks.
template <class Search>
struct CountFirsts {
  Search search;
  std::uint32_t* counts;  // per index of the first set; zeroed

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i >= search.count()) return;
    Pair pair{};
    for (auto walk = search.begin(i); !walk.over();)
      if (walk.step(pair)) fetch_add(counts + pair.first, 1u);
  }
};

}  // namespace throng::device
