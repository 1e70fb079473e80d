// The per-thread work of the pair search. begin(i) returns a walk, and step() tests its next
// candidate. The device decides what to do with a hit, so that a warp can gather its hits while a
// host thread writes its own. In a grid a walk consists of row queries, whose steps a warp takes
// together.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "base/bounds.hpp"
#include "base/pair_index.hpp"
#include "device/input.hpp"

namespace throng::device {

// A check of hits accepts or refuses a pair; this one accepts all. Others also have
// add_candidates(n), which a thread calls for n pairs that it has checked or will check.
struct AcceptAll {
  THRONG_HD bool operator()(std::uint32_t, std::uint32_t) const noexcept { return true; }
};

// Limits the search to pairs whose first index is one of `count` from `begin`.
struct FirstRange {
  std::uint32_t begin = 0, count = ~0u;
  THRONG_HD bool holds(std::uint32_t first) const noexcept { return first - begin < count; }
  THRONG_HD bool holds_all() const noexcept { return begin == 0 && count == ~0u; }
};

// Which boxes search a size-class grid (base/size_class_grid.hpp). Box i in storage order searches
// for its partners: `plain`, one set without filters; `filtered`, any input. `around`: boxes
// outside the grid search for all boxes in it; without worlds.
enum class GridSearchMode : std::uint8_t { plain, filtered, around };

template <GridSearchMode mode>
struct GridSearchOf {
  static constexpr bool is_around = mode == GridSearchMode::around,
                        is_plain = mode == GridSearchMode::plain;

  Input in;
  const base::SizeClassGrid* grid;
  const std::uint32_t* start;     // first record of each cell, and one entry more
  const std::uint32_t* occupied;  // see occupied_flags
  const Record* records;
  const Report* report;
  FirstRange range;
  // With `around`: the query boxes, and which objects they report: (states[id] & state_mask) ==
  // wanted_state.
  const Record* queries = nullptr;
  std::uint64_t query_count = 0;
  const std::uint8_t* states = nullptr;
  std::uint8_t state_mask = 0, wanted_state = 0;

  THRONG_HD std::uint64_t count() const noexcept {
    return is_around ? query_count : report->active;
  }

  // Index of a group and class to search.
  THRONG_HD static constexpr std::uint32_t target(std::uint32_t group,
                                                  std::uint32_t size_class) noexcept {
    return group * base::max_size_classes + size_class;
  }
  static constexpr std::uint32_t max_targets = 8 * base::max_size_classes;

  // Records from `begin` to `end`. `row`: their row, needed if `mixed` (GridQuery).
  struct Range {
    std::uint32_t begin, end, row;
  };
  // Row numbers of a hashed grid, with at most 2^13 per axis; and a number for all rows.
  static constexpr int row_bits = 26;
  static constexpr std::uint32_t all_rows = 1u << row_bits;
  THRONG_HD static std::uint32_t row_of(std::int32_t y, std::int32_t z) noexcept {
    return (static_cast<std::uint32_t>(y) | static_cast<std::uint32_t>(z) << row_bits / 2) &
           (all_rows - 1);
  }

  // Whether an overlapping box that was found in a row of a target makes a pair to report.
  template <bool mixed>
  THRONG_HD bool allows(const base::SizeClassGrid& cells, std::uint32_t own, const Record& c,
                        std::uint32_t current_target, std::uint32_t row) const noexcept {
    if constexpr (is_around)
      if ((states[c.id] & state_mask) != wanted_state) return false;
    if (!is_plain && !in.allowed(own, c.id)) return false;
    // Boxes of other targets may be stored in the same cells.
    if (mixed && (cells.hashed || row == all_rows) && !is_stored_in(cells, c, current_target, row))
      return false;
    return is_plain || range.holds(pair(own, c).first);
  }
  THRONG_HD Pair pair(std::uint32_t own, const Record& c) const noexcept {
    if constexpr (is_plain) return own < c.id ? Pair{own, c.id} : Pair{c.id, own};
    return in.pair(own, c.id);
  }
  // Within a row each x has a cell of its own.
  THRONG_HD bool is_stored_in(const base::SizeClassGrid& cells, const Record& c,
                              std::uint32_t current_target, std::uint32_t row) const noexcept {
    const base::CellSpan span = base::cells_of(cells, c.box());
    const std::uint32_t size_class = base::class_of(cells, span);
    const base::SizeClass& k = cells.classes[size_class];
    const std::uint32_t group = is_plain ? 0 : base::pack_group(cells.present, in.group_bits(c.id));
    return current_target == target(group, size_class) &&
           (row == all_rows ||
            row == row_of(span.lower[1] >> k.shift[1], span.lower[2] >> k.shift[2]));
  }

  // The search of one box: target by target, and within a target row by row. Results belong to the
  // current target: if `mixed`, ranges must be tested before the next select_target(). The lanes of
  // a warp go through the same targets together. `mixed`: records of other rows may be stored among
  // those of a row. Only plain searches of a dense grid have no such records.
  template <bool mixed>
  class GridQuery {
   public:
    THRONG_HD GridQuery(const GridSearchOf& search, const base::SizeClassGrid& cells,
                        std::uint64_t i) noexcept
        : s_(search),
          cells_(cells),
          index_(static_cast<std::uint32_t>(i)),
          box_(load((is_around ? search.queries : search.records) + i)) {
      span_ = base::cells_of(cells_, box_.box());
      class_ = base::class_of(cells_, span_);
      if constexpr (is_plain) return;
      bits_ = cells_.present ? s_.in.group_bits(box_.id) : 0;
      if (s_.in.has_worlds && !(bits_ & base::everywhere_bit))
        world_ = static_cast<std::uint32_t>(s_.in.world(box_.id));
    }

    // `around`: a query box, which set_box() may replace. `bits`: its group; `world`: its world or
    // 0.
    THRONG_HD GridQuery(const GridSearchOf& search, const base::SizeClassGrid& cells,
                        const Box& box, std::uint32_t bits, std::uint32_t world) noexcept
        : s_(search), cells_(cells), index_(0), class_(0), bits_(bits), world_(world) {
      set_box(box);
    }
    THRONG_HD void set_box(const Box& box) noexcept {
      box_ = Record{box.lower, 0, box.upper, 0};
      span_ = base::cells_of(cells_, box);
    }

    // Selects a target; returns the number of rows to search.
    THRONG_HD std::uint32_t select_target(std::uint32_t target) noexcept {
      const std::uint32_t group = is_plain ? 0 : target / base::max_size_classes;
      const std::uint32_t size_class = is_plain ? target : target % base::max_size_classes;
      const std::uint32_t present = is_plain ? 0 : cells_.present;
      const std::uint32_t bits = base::unpack_group(present, group);
      all_records_ = false;
      base::SearchMode how =
          bits_ & bits & base::static_bit ? base::SearchMode::no : base::SearchMode::all;
      if constexpr (!is_around) how = base::search_mode(present, bits_, class_, bits, size_class);
      if (how == base::SearchMode::no) return 0;
      // Boxes beyond the outermost cells share cells with boxes in them, such as movers far from a
      // heap of static boxes.
      if (present != 0 && !base::overlaps(box_.box(), occupied_bounds(s_.occupied, target)))
        return 0;
      target_ = target;
      part_ = base::part_of(cells_, bits & base::everywhere_bit ? 0 : world_, group, size_class);
      const base::SizeClass& c = cells_.classes[size_class];
      const std::int32_t x = span_.lower[0] >> c.shift[0], y = span_.lower[1] >> c.shift[1],
                         z = span_.lower[2] >> c.shift[2];
      const std::int32_t z_last = span_.upper[2] >> c.shift[2];
      x_first_ = x > 0 ? x - 1 : 0;
      x_last_ = span_.upper[0] >> c.shift[0];
      y_first_ = y > 0 ? y - 1 : 0;
      y_last_ = span_.upper[1] >> c.shift[1];
      own_row_ = how == base::SearchMode::forward;
      z_ = own_row_ || z == 0 ? z : z - 1;
      y_ = own_row_ ? y : y_first_;
      // In the first slab the rows from y_ on, in the others all.
      const std::uint64_t all =
          rows(y_last_ - y_first_ + 1, z_last - z_) + rows(y_last_ - y_ + 1, 1);
      // A large box may search a fine class of another group. If that has more rows than there are
      // boxes, or in a hashed grid more cells than the table, going through all boxes costs less.
      all_records_ = mixed && !own_row_ &&
                     (all > s_.report->active ||
                      (cells_.hashed && all * static_cast<std::uint32_t>(x_last_ - x_first_ + 1) >
                                            cells_.table_cells));
      return all_records_ ? 1 : static_cast<std::uint32_t>(all);
    }
    THRONG_HD bool all_records() const noexcept { return all_records_; }

    // Returns the records of the next row.
    THRONG_HD Range row() noexcept {
      if (all_records_) return {0, s_.report->active, all_rows};
      const std::uint32_t row =
          mixed ? base::row_start(cells_, part_, y_, z_) : base::dense_row_start(part_, y_, z_);
      const Range found{
          own_row_ ? index_ + 1 : s_.start[row + static_cast<std::uint32_t>(x_first_)],
          s_.start[row + static_cast<std::uint32_t>(x_last_) + 1], row_of(y_, z_)};
      own_row_ = false;
      if (y_++ == y_last_) {
        y_ = y_first_;
        ++z_;
      }
      return found;
    }

    THRONG_HD const Record& box() const noexcept { return box_; }

    // Whether this candidate overlaps and makes a pair to report.
    THRONG_HD bool accepts(const Record& c, std::uint32_t row) const noexcept {
      return base::overlaps(box_.box(), c.box()) &&
             s_.template allows<mixed>(cells_, box_.id, c, target_, row);
    }

   private:
    THRONG_HD static std::uint64_t rows(std::int32_t y, std::int32_t z) noexcept {
      return static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(z);
    }

    const GridSearchOf& s_;
    const base::SizeClassGrid& cells_;
    std::uint32_t index_;
    Record box_;
    base::CellSpan span_;
    std::uint32_t class_, bits_ = 0, world_ = 0, target_ = 0;
    base::Part part_{0, 0, 0};
    std::int32_t x_first_ = 0, x_last_ = 0, y_first_ = 0, y_last_ = 0;
    std::int32_t y_ = 0, z_ = 0;  // of the next row
    bool own_row_ = false, all_records_ = false;
  };

  // The same for a single thread.
  class Walk {
   public:
    THRONG_HD Walk(const GridSearchOf& search, std::uint64_t i) noexcept
        : s_(search), query_(search, *search.grid, i) {
      advance();
    }
    THRONG_HD bool over() const noexcept { return range_.begin == range_.end; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }
    // Tests the next candidate; returns true for a pair. Requires !over().
    THRONG_HD bool step(Pair& pair) noexcept {
      ++comparisons_;
      const Record c = load(s_.records + range_.begin++);
      const bool hit = query_.accepts(c, range_.row);
      if (hit) pair = s_.pair(query_.box().id, c);
      advance();
      return hit;
    }

   private:
    // Moves to the next non-empty range, if any.
    THRONG_HD void advance() noexcept {
      const std::uint32_t targets = target(base::group_count(s_.grid->present), 0);
      while (range_.begin == range_.end) {
        if (rows_ > 0) {
          range_ = query_.row();
          --rows_;
        } else if (next_ < targets) {
          if (s_.occupied[next_]) rows_ = query_.select_target(next_);
          ++next_;
        } else {
          return;
        }
      }
    }

    const GridSearchOf& s_;
    GridQuery<true> query_;
    Range range_{0, 0, 0};
    std::uint32_t next_ = 0, rows_ = 0, comparisons_ = 0;
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

using GridSearch = GridSearchOf<GridSearchMode::filtered>;

// Brute force over pairs of tiles of boxes. Thread i owns one box of one tile and goes through
// those of the other, which all threads of a tile read together.
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
    const base::TileFold fold{tiles(in.count)};
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
        const base::TileFold fold{tiles(s_.in.count)};
        const base::TileFold::Cell cell =
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
      if (!base::overlaps(box_.box(), c.box()) || !s_.in.allowed(box_.id, c.id)) return false;
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

}  // namespace throng::device
