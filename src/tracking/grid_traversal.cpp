#include "tracking/grid_traversal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::tracking {

GridTraversal::GridTraversal(const Cells& cells, const BlockOccupancy* blocks, Cells::Worlds worlds,
                             const base::MovingBox& sweep, const base::SweptBounds& cover,
                             bool to_first) noexcept
    : cells_(cells),
      blocks_(blocks),
      worlds_(worlds),
      sweep_(sweep),
      cover_(cover),
      list_target_(to_first ? list_target_first : list_target_all),
      interval_(base::contact_interval(sweep, cells.bounds())),
      left_(cells.line_count() / lines_per_cell + most) {
  if (worlds.all) return;
  if (interval_.enter <= interval_.leave) init_cursors();
  select_next();
  list_cells();
}

void GridTraversal::init_cursors() noexcept {
  const CellMap& map = cells_.map();
  const double scale = map.units(1);
  whole_range_ = map.quantize(cover_(interval_.enter, interval_.leave));
  const bool clamped = map.is_clamped(whole_range_);
  double inverse[3], slack[3];
  for (int k = 0; k < 3; ++k) {
    const double furthest = 1 + std::max(std::fabs(static_cast<double>(whole_range_.lower[k])),
                                         std::fabs(static_cast<double>(whole_range_.upper[k])));
    slack[k] = 1 + furthest * 0x1p-22;
    lower_[k] = cover_.lower(k, interval_.leave) * scale - furthest * 0x1p-22;
    upper_[k] = cover_.upper(k, interval_.leave) * scale + furthest * 0x1p-22;
    by_[k] = cover_.by(k) * scale;
    inverse[k] = 1 / by_[k];
  }
  cells_.each_class([&](int c) {
    const auto crossed = [&](int k) {  // cells crossed, times 2^28
      return std::fabs(by_[k]) * static_cast<double>(1 << (28 - map.shift(c, k)));
    };
    int axis = crossed(0) < crossed(1) ? 1 : 0;
    if (crossed(axis) < crossed(2)) axis = 2;
    const CellMap::Range range = map.cells_of(whole_range_, c);
    LayerCursor& cursor = cursors_[cursor_count_];
    cursor.size_class = static_cast<std::int16_t>(c);
    cursor.axis = static_cast<std::int8_t>(axis);
    cursor.direction = by_[axis] < 0 ? -1 : 1;
    cursor.layer = by_[axis] < 0 ? range.upper[axis] : range.lower[axis];
    cursor.layers = range.upper[axis] - range.lower[axis] + 1;
    cursor.covers_all_time = by_[axis] == 0 || clamped;
    if (cursor.covers_all_time) {
      cursor.first = interval_.enter;
      cursor.length = interval_.leave - interval_.enter;
      cursor.step = 0;
    } else {
      const double size = 1 << map.shift(c, axis);
      const double out = slack[axis] + 0x1p-22 * size;
      const double lower = cursor.layer * size - out;
      const double upper = lower + size + map.span(c, axis) + 2 * out;
      const double a = (lower - upper_[axis]) * inverse[axis];
      const double b = (upper - lower_[axis]) * inverse[axis];
      cursor.first = std::min(a, b);
      cursor.length = std::fabs(a - b);
      cursor.step = size * std::fabs(inverse[axis]);
    }
    cursor.begin = cursor.first;
    cursor.passed = 0;
    cursor.next_block_check = blocks_ && !cursor.covers_all_time
                                  ? block_check_layers
                                  : std::numeric_limits<std::int32_t>::max();
    if (advance_to_reached(cursor)) ++cursor_count_;
  });
}

// Advances to the first layer that the sweep reaches; false: none is left.
bool GridTraversal::advance_to_reached(LayerCursor& cursor) const noexcept {
  while (cursor.passed < cursor.layers && cursor.begin + cursor.length < interval_.enter)
    cursor.pass();
  if (cursor.passed >= cursor.next_block_check) skip_empty(cursor);
  return cursor.passed < cursor.layers && cursor.begin <= interval_.leave;
}

// The cells that the sweep may need of this many layers, from the next one on. `last`: time at
// which the last of them begins.
inline void GridTraversal::find_cells(const LayerCursor& cursor, std::int32_t layers, double last,
                                      CellMap::Range& cells) const noexcept {
  const CellMap& map = cells_.map();
  if (cursor.covers_all_time) {
    cells = map.cells_of(whole_range_, cursor.size_class);
  } else {
    const double begin = std::max(cursor.begin, interval_.enter);
    const double end = std::min(last + cursor.length, interval_.leave);
    for (int k = 0; k < 3; ++k) {
      const double a = by_[k] * begin, b = by_[k] * end;
      const auto lower = static_cast<std::int32_t>(lower_[k] + std::min(a, b));
      const auto upper = static_cast<std::int32_t>(upper_[k] + std::max(a, b));
      const int shift = map.shift(cursor.size_class, k);
      cells.lower[k] = (lower - map.span(cursor.size_class, k)) >> shift;
      cells.upper[k] = upper >> shift;
    }
  }
  const std::int32_t end = cursor.layer + cursor.direction * (layers - 1);
  cells.lower[cursor.axis] = std::min(cursor.layer, end);
  cells.upper[cursor.axis] = std::max(cursor.layer, end);
}

// Skips layers up to the end of a block, preferably a larger one, if no box is stored in the cells
// that the sweep may need of them. The cells needed of several layers contain those needed of each,
// because all steps are monotonic.
void GridTraversal::skip_empty(LayerCursor& cursor) const noexcept {
  while (cursor.passed < cursor.layers && cursor.begin <= interval_.leave) {
    std::int32_t empty = 0, checked = 0;
    for (int level = 1; level <= BlockOccupancy::levels; ++level) {
      const std::int32_t length = BlockOccupancy::length(level),
                         within = cursor.layer & (length - 1);
      checked = std::min(cursor.direction > 0 ? length - within : within + 1,
                         cursor.layers - cursor.passed);
      const double last = cursor.first + cursor.step * (cursor.passed + checked - 1);
      CellMap::Range cells;
      find_cells(cursor, checked, last, cells);
      if (blocks_->any(cells, cursor.size_class, level)) break;
      empty = checked;
    }
    if (empty == 0) {
      cursor.next_block_check = cursor.passed + checked;
      return;
    }
    cursor.pass(empty);
  }
}

// Selects the cursor with the earliest layer, and computes its cells.
void GridTraversal::select_next() noexcept {
  if (is_over()) return;
  next_ = 0;
  for (unsigned i = 1; i < cursor_count_; ++i) {
    if (cursors_[i].begin < cursors_[next_].begin) next_ = i;
  }
  const LayerCursor& cursor = cursors_[next_];
  find_cells(cursor, 1, cursor.begin, range_);
}

// Lists none if the next layer has more cells than the capacity.
void GridTraversal::list_cells() noexcept {
  while (!is_over() && count_ < list_target_) {
    const std::uint64_t more = next_cells();
    if (count_ + more > most || more >= left_) break;
    take_layer([&](std::uint32_t bucket) {
      cells_.prefetch(bucket);
      buckets_[count_++] = bucket;
    });
  }
}

}  // namespace throng::tracking
