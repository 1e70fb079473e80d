// What one thread of the pair search does, a candidate at a time: begin(i) gives a walk, step()
// tests its next candidate. Whoever runs it decides what becomes of a hit, so that a warp can
// gather its hits, and a host thread write its own.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "core/pair_index.hpp"
#include "pipeline/input.hpp"

namespace throng::pipeline {

// Which pairs are told: those whose first index is one of `count` from `begin`.
struct FirstRange {
  std::uint32_t begin = 0, count = ~0u;
  THRONG_HD bool holds(std::uint32_t first) const noexcept { return first - begin < count; }
};

// Boxes in a class grid (core/class_grid.hpp): box i in the order of storage looks for its
// partners.
struct GridSearch {
  Input in;
  const core::ClassGrid* grid;
  const std::uint32_t* start;     // of each cell's records, and one more
  const std::uint32_t* occupied;  // a flag for each group and class
  const Record* records;
  const Report* report;
  FirstRange range;

  THRONG_HD std::uint64_t count() const noexcept { return report->active; }

  class Walk {
   public:
    THRONG_HD Walk(const GridSearch& search, std::uint64_t i) noexcept
        : s_(search), index_(static_cast<std::uint32_t>(i)), box_(load(search.records + i)) {
      span_ = core::cells_of(*s_.grid, box_.box());
      class_ = core::class_of(*s_.grid, span_);
      bits_ = s_.grid->present ? s_.in.group_bits(box_.id) : 0;
      if (s_.in.has_worlds && !(bits_ & core::everywhere_bit))
        world_ = static_cast<std::uint32_t>(s_.in.world(box_.id));
      // The finest class has the most rows.
      alone_ = s_.grid->hashed || rows(span_.upper[1] - span_.lower[1] + 2,
                                       span_.upper[2] - span_.lower[2] + 2) > s_.report->active;
      next_range();
    }
    THRONG_HD bool over() const noexcept { return at_ == stop_; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }

    // Tests the next candidate; true where it is a pair. Not when over.
    THRONG_HD bool step(Pair& pair) noexcept {
      const Record c = load(s_.records + at_++);
      ++comparisons_;
      bool hit = core::overlaps(box_.box(), c.box());
      if (hit) {
        hit = s_.in.allowed(box_.id, c.id) && (!alone_ || is_home_here(c));
        pair = s_.in.pair(box_.id, c.id);
        hit = hit && s_.range.holds(pair.first);
      }
      next_range();
      return hit;
    }

   private:
    // Rows are looked up some at a time, so that these loads do not wait for one another. One class
    // has at most five. Where is_home_here must know which one it is, one at a time.
    static constexpr int batch = 5;

    THRONG_HD static std::uint64_t rows(std::int32_t y, std::int32_t z) noexcept {
      return static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(z);
    }

    // Where the present range is done: the next that holds something. None: the walk is over.
    THRONG_HD void next_range() noexcept {
      while (at_ == stop_) {
        if (left_ == 0) {
          const int most = alone_ ? 1 : batch;
          for (int k = 0; k < batch; ++k)
            if (k < most && next_row(begin_[k], end_[k])) left_ = k + 1;
          if (left_ == 0) return;
        }
        at_ = begin_[0];
        stop_ = end_[0];
        for (int k = 0; k + 1 < batch; ++k) {
          begin_[k] = begin_[k + 1];
          end_[k] = end_[k + 1];
        }
        --left_;
      }
    }

    // Where others may be stored in the same place. In one row each x has a place of its own.
    THRONG_HD bool is_home_here(const Record& c) const noexcept {
      const core::ClassGrid& grid = *s_.grid;
      const core::CellSpan span = core::cells_of(grid, c.box());
      const core::SizeClass& k = grid.classes[target_class_];
      return core::class_of(grid, span) == target_class_ &&
             core::pack_group(grid.present, s_.in.group_bits(c.id)) == target_group_ &&
             (whole_ ||
              (span.lower[1] >> k.shift[1] == y_ - 1 && span.lower[2] >> k.shift[2] == z_));
    }

    // The next class and group to look into.
    THRONG_HD bool next_target() noexcept {
      const core::ClassGrid& grid = *s_.grid;
      const std::uint32_t all = grid.class_count * core::group_count(grid.present);
      for (; number_ < all; ++number_) {
        target_group_ = number_ / grid.class_count;
        target_class_ = number_ % grid.class_count;
        if (!s_.occupied[target_group_ * core::max_size_classes + target_class_]) continue;
        const std::uint32_t bits = core::unpack_group(grid.present, target_group_);
        const core::Look how = core::look(grid.present, bits_, class_, bits, target_class_);
        if (how == core::Look::no) continue;
        part_ = core::part_of(grid, bits & core::everywhere_bit ? 0 : world_, target_group_,
                              target_class_);
        const core::SizeClass& c = grid.classes[target_class_];
        const std::int32_t x = span_.lower[0] >> c.shift[0], y = span_.lower[1] >> c.shift[1],
                           z = span_.lower[2] >> c.shift[2];
        x_first_ = x > 0 ? x - 1 : 0;
        x_last_ = span_.upper[0] >> c.shift[0];
        y_first_ = y > 0 ? y - 1 : 0;
        y_last_ = span_.upper[1] >> c.shift[1];
        z_last_ = span_.upper[2] >> c.shift[2];
        own_row_ = how == core::Look::forward;
        z_ = own_row_ || z == 0 ? z : z - 1;
        y_ = own_row_ ? y : y_first_;
        ++number_;
        // A large box may look into a fine class of another group: then there may be more rows than
        // boxes, and going through all of these costs less.
        whole_ = rows(y_last_ - y_first_ + 1, z_last_ - z_ + 1) > s_.report->active;
        return true;
      }
      return false;
    }

    THRONG_HD bool next_row(std::uint32_t& begin, std::uint32_t& end) noexcept {
      if (y_ > y_last_) {
        ++z_;
        y_ = y_first_;
      }
      if (z_ > z_last_ && !next_target()) return false;
      if (whole_) {
        begin = 0;
        end = s_.report->active;
        z_ = z_last_;
        y_ = y_last_ + 1;
        return true;
      }
      const std::uint32_t row = core::row_start(*s_.grid, part_, y_, z_);
      begin = own_row_ ? index_ + 1 : s_.start[row + static_cast<std::uint32_t>(x_first_)];
      end = s_.start[row + static_cast<std::uint32_t>(x_last_) + 1];
      own_row_ = false;
      ++y_;
      return true;
    }

    const GridSearch& s_;
    std::uint32_t index_;
    Record box_;
    core::CellSpan span_;
    std::uint32_t class_, bits_;
    std::uint32_t world_ = 0;  // its number, where the box has one
    std::uint32_t target_class_ = 0, target_group_ = 0;
    core::Part part_{0, 0, 0};
    std::int32_t y_ = 0, z_ = 0;  // the next row
    std::uint32_t number_ = 0;    // of the class and group to look into next
    std::int32_t x_first_ = 0, x_last_ = 0, y_first_ = 0, y_last_ = -1, z_last_ = -1;
    bool own_row_ = false, whole_ = false, alone_;
    std::uint32_t at_ = 0, stop_ = 0, comparisons_ = 0;
    int left_ = 0;
    std::uint32_t begin_[batch], end_[batch];
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

// Brute force: the pairs of two tiles of boxes. Thread i has one box of the one tile, and goes
// through those of the other, which all threads of a tile read together.
struct TileSearch {
  static constexpr std::uint32_t side = 64;

  Input in;
  const Record* records;  // an inactive box has NaN corners, and so overlaps nothing
  FirstRange range;

  THRONG_HD static std::uint32_t tiles(std::uint32_t boxes) noexcept {
    return boxes / side + (boxes % side != 0);
  }
  THRONG_HD std::uint64_t count() const noexcept {
    if (in.two_sets)
      return std::uint64_t{tiles(in.first_count)} * tiles(in.count - in.first_count) * side;
    const core::TileFold fold{tiles(in.count)};
    return std::uint64_t{fold.width()} * fold.height() * side;
  }

  class Walk {
   public:
    THRONG_HD Walk(const TileSearch& search, std::uint64_t i) noexcept : s_(search) {
      const std::uint64_t tile = i / side;
      const auto lane = static_cast<std::uint32_t>(i % side);
      std::uint32_t row, column;
      std::uint32_t row_end, column_end;
      if (s_.in.two_sets) {
        const std::uint32_t width = tiles(s_.in.count - s_.in.first_count);
        row = static_cast<std::uint32_t>(tile / width) * side;
        column = s_.in.first_count + static_cast<std::uint32_t>(tile % width) * side;
        row_end = s_.in.first_count;
      } else {
        const core::TileFold fold{tiles(s_.in.count)};
        const core::TileFold::Cell cell =
            fold.tile({static_cast<std::uint32_t>(tile / fold.width()),
                       static_cast<std::uint32_t>(tile % fold.width())});
        row = cell.row * side;
        column = cell.column * side;
        row_end = s_.in.count;
      }
      column_end = s_.in.count;
      const std::uint32_t own = row + lane;
      if (lane >= row_end - row) return;
      end_ = column_end - column > side ? column + side : column_end;
      at_ = !s_.in.two_sets && row == column ? own + 1 : column;
      if (at_ > end_) at_ = end_;
      box_ = load(s_.records + own);
    }
    THRONG_HD bool over() const noexcept { return at_ == end_; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }
    THRONG_HD bool step(Pair& pair) noexcept {
      const Record c = load(s_.records + at_++);
      ++comparisons_;
      if (!core::overlaps(box_.box(), c.box()) || !s_.in.allowed(box_.id, c.id)) return false;
      pair = s_.in.pair(box_.id, c.id);
      return s_.range.holds(pair.first);
    }

   private:
    const TileSearch& s_;
    std::uint32_t at_ = 0, end_ = 0, comparisons_ = 0;
    Record box_{};
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

}  // namespace throng::pipeline
