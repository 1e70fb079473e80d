#include "live/cell_walk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::live {

void CellWalk::start(const Cells& cells, const Blocks* blocks, Cells::Worlds worlds,
                     const Sweep& sweep, const core::Cover& cover, bool to_first) noexcept {
  cells_ = &cells;
  sweep_ = &sweep;
  cover_ = &cover;
  blocks_ = blocks;
  worlds_ = worlds;
  far_ = 0;
  if (worlds.all) return;
  left_ = cells.line_count() / lines_a_cell + most;
  enough_ = to_first ? enough_to_first : enough_of_all;
  count_ = 0;
  way_count_ = 0;
  inside_ = core::touch(sweep, cells.bounds());
  if (inside_.enter <= inside_.leave) add_ways(cover);
  choose();
  list();
}

void CellWalk::add_ways(const core::Cover& cover) noexcept {
  const CellMap& map = cells_->map();
  const double scale = map.units(1);
  whole_ = map.quantise(cover(inside_.enter, inside_.leave));
  const bool cut_off = map.is_cut_off(whole_);
  double inverse[3], slack[3];
  for (int k = 0; k < 3; ++k) {
    const double furthest = 1 + std::max(std::fabs(static_cast<double>(whole_.lower[k])),
                                         std::fabs(static_cast<double>(whole_.upper[k])));
    slack[k] = 1 + furthest * 0x1p-22;
    lower_[k] = cover.lower(k, inside_.leave) * scale - furthest * 0x1p-22;
    upper_[k] = cover.upper(k, inside_.leave) * scale + furthest * 0x1p-22;
    by_[k] = cover.by(k) * scale;
    inverse[k] = 1 / by_[k];
  }
  cells_->each_class([&](int c) {
    const auto crossed = [&](int k) {  // cells crossed, times 2^28
      return std::fabs(by_[k]) * static_cast<double>(1 << (28 - map.shift(c, k)));
    };
    int axis = crossed(0) < crossed(1) ? 1 : 0;
    if (crossed(axis) < crossed(2)) axis = 2;
    const CellMap::Range range = map.cells_of(whole_, c);
    Way& way = ways_[way_count_];
    way.size_class = static_cast<std::int16_t>(c);
    way.axis = static_cast<std::int8_t>(axis);
    way.on = by_[axis] < 0 ? -1 : 1;
    way.layer = by_[axis] < 0 ? range.upper[axis] : range.lower[axis];
    way.layers = range.upper[axis] - range.lower[axis] + 1;
    way.timeless = by_[axis] == 0 || cut_off;
    if (way.timeless) {
      way.first = inside_.enter;
      way.length = inside_.leave - inside_.enter;
      way.step = 0;
    } else {
      const double size = 1 << map.shift(c, axis);
      const double out = slack[axis] + 0x1p-22 * size;
      const double lower = way.layer * size - out;
      const double upper = lower + size + map.span(c, axis) + 2 * out;
      const double a = (lower - upper_[axis]) * inverse[axis];
      const double b = (upper - lower_[axis]) * inverse[axis];
      way.first = std::min(a, b);
      way.length = std::fabs(a - b);
      way.step = size * std::fabs(inverse[axis]);
    }
    way.begin = way.first;
    way.passed = 0;
    way.known = blocks_ && !way.timeless ? patience : std::numeric_limits<std::int32_t>::max();
    if (is_reached(way)) ++way_count_;
  });
}

// Advances to the first layer that the sweep reaches; false: none is left.
bool CellWalk::is_reached(Way& way) const noexcept {
  while (way.passed < way.layers && way.begin + way.length < inside_.enter) way.pass();
  if (way.passed >= way.known) skip_empty(way);
  return way.passed < way.layers && way.begin <= inside_.leave;
}

// The cells that the sweep may need of this many layers, from the next one on. `last`: time at
// which the last of them begins.
inline void CellWalk::find_cells(const Way& way, std::int32_t layers, double last,
                                 CellMap::Range& cells) const noexcept {
  const CellMap& map = cells_->map();
  if (way.timeless) {
    cells = map.cells_of(whole_, way.size_class);
  } else {
    const double begin = std::max(way.begin, inside_.enter);
    const double end = std::min(last + way.length, inside_.leave);
    for (int k = 0; k < 3; ++k) {
      const double a = by_[k] * begin, b = by_[k] * end;
      const auto lower = static_cast<std::int32_t>(lower_[k] + std::min(a, b));
      const auto upper = static_cast<std::int32_t>(upper_[k] + std::max(a, b));
      const int shift = map.shift(way.size_class, k);
      cells.lower[k] = (lower - map.span(way.size_class, k)) >> shift;
      cells.upper[k] = upper >> shift;
    }
  }
  const std::int32_t end = way.layer + way.on * (layers - 1);
  cells.lower[way.axis] = std::min(way.layer, end);
  cells.upper[way.axis] = std::max(way.layer, end);
}

// Skips layers up to the end of a block, preferably a larger one, if no box is stored in the cells
// that the sweep may need of them. The cells needed of several layers contain those needed of each,
// because all steps are monotonic.
void CellWalk::skip_empty(Way& way) const noexcept {
  while (way.passed < way.layers && way.begin <= inside_.leave) {
    std::int32_t empty = 0, asked = 0;
    for (int level = 1; level <= Blocks::levels; ++level) {
      const std::int32_t length = Blocks::length(level), within = way.layer & (length - 1);
      asked = std::min(way.on > 0 ? length - within : within + 1, way.layers - way.passed);
      const double last = way.first + way.step * (way.passed + asked - 1);
      CellMap::Range cells;
      find_cells(way, asked, last, cells);
      if (blocks_->any(cells, way.size_class, level)) break;
      empty = asked;
    }
    if (empty == 0) {
      way.known = way.passed + asked;
      return;
    }
    way.pass(empty);
  }
}

// Selects the cursor with the earliest layer, and computes its cells.
void CellWalk::choose() noexcept {
  if (is_over()) return;
  next_ = 0;
  for (unsigned i = 1; i < way_count_; ++i) {
    if (ways_[i].begin < ways_[next_].begin) next_ = i;
  }
  const Way& way = ways_[next_];
  find_cells(way, 1, way.begin, range_);
}

// Lists none if the next layer has more cells than the capacity.
void CellWalk::list() noexcept {
  while (!is_over() && count_ < enough_) {
    const std::uint64_t more = next_cells();
    if (count_ + more > most || more >= left_) break;
    take_layer([&](std::uint32_t home) {
      cells_->prefetch(home);
      homes_[count_++] = home;
    });
  }
}

}  // namespace throng::live
