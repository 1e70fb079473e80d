// Queries of persistent objects on a device: the per-thread work. A query searches a grid of the
// objects' boxes (base/size_class_grid.hpp) class by class; a sweep is searched piece by piece
// along its way.
//
// Proof that a sweep misses nothing and reports nothing twice. For each class its time is cut by
// numbers that never decrease, from 0 to 1. Let contact_interval() report contact with a box of the
// class from `enter` on. Exactly one piece reports the box: the piece that begins at or before
// `enter` and ends after it, or the last. The box overlaps the swept bounds of that piece, and a
// grid search finds each box that overlaps its query once. So the first hit in a class comes from
// the first piece with a hit, and pieces that begin after a hit cannot contain the first one.
// Pieces are skipped if the swept bounds of all of them reach no storage cell. They contain the
// swept bounds of each, because every step of its arithmetic is monotonic. The time that is cut is
// not 0 to 1, but the interval in which the sweep meets the bounds of the class's boxes. All
// contacts with these boxes lie in it: contact_interval() of a contained box begins no earlier and
// ends no later, because every step of its arithmetic is monotonic.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <throng/cuda_broad_phase.hpp>

#include "base/block_bitmap.hpp"
#include "base/swept_box.hpp"
#include "device/binning.hpp"
#include "device/search.hpp"

namespace throng::device {

// The kind of query: boxes overlapping a box; all hits of a sweep; its first hit.
enum class QueryType : std::uint8_t { overlaps, all_hits, first_hit };

// A batch of sweeps, with the filters of their boxes, or of boxes.
struct QueryBatch {
  Boxes boxes;
  const Sweep* sweeps = nullptr;

  static QueryBatch of_sweeps(const Sweep* sweeps, std::size_t count,
                              const Filters& filters) noexcept {
    return {base::boxes_of(sweeps, count, filters), sweeps};
  }
};

// The result of a sweep that hits no object.
THRONG_HD inline SweepHit no_hit(std::uint32_t sweep) noexcept {
  return {sweep, cuda::no_object, std::numeric_limits<double>::infinity()};
}

// Reports pairs (query, object).
template <QueryType query_type>
struct QuerySearch {
  static constexpr bool is_sweep = query_type != QueryType::overlaps;
  static constexpr bool first_only = query_type == QueryType::first_hit;

  Input in;  // two sets: the queries and the objects
  const Sweep* sweeps;
  GridSearchOf<GridSearchMode::around> objects;
  SweepHit* firsts;  // if not null, receives the first hit at the sweep's index
  // The bitmap of occupied blocks, if it exists. And a count of the rows that sweeps searched
  // beyond `pieces_before_blocks` pieces, or would have searched without the bitmap: the rows that
  // it can save.
  base::BlockBitmap blocks;
  bool has_blocks;
  std::uint64_t* far_rows;

  THRONG_HD std::uint64_t count() const noexcept { return in.first_count; }
  // The world whose cells are searched, in addition to objects without world; 0 if there are no
  // worlds, or if all objects are searched.
  THRONG_HD std::uint32_t world(std::uint32_t query_index) const noexcept {
    const std::int32_t world = meets_worlds() ? in.world(query_index) : 0;
    return world < 0 ? 0 : static_cast<std::uint32_t>(world);
  }
  THRONG_HD bool meets_worlds() const noexcept {
    return (objects.grid->present & base::everywhere_bit) != 0;
  }

  class Walk {
   public:
    THRONG_HD Walk(const QuerySearch& search, std::uint64_t i) noexcept
        : s_(search),
          cells_(*search.objects.grid),
          query_index_(static_cast<std::uint32_t>(i)),
          grid_query_(search.objects, cells_, search.in.sets[0].box(query_index_),
                      search.in.group_bits(query_index_), search.world(query_index_)) {
      if (!base::is_active(grid_query_.box().box())) return;
      float pieces = 0;
      if constexpr (is_sweep) {
        const Sweep& sweep = s_.sweeps[query_index_];
        if (!base::is_valid_sweep(sweep)) return;
        cover_ = base::SweptBounds(sweep);
        for (std::uint32_t k = 0; k < targets(); ++k)
          if (meets(k)) pieces += pieces_of(k);
      }
      // A query without world meets all worlds, whose cells it does not know. A piece costs more
      // than 16 comparisons, unless the bitmap skips it.
      const bool far =
          !s_.has_blocks && pieces * 16 > static_cast<float>(s_.objects.report->active);
      if (far) far_ = static_cast<std::uint32_t>(rows_per_piece * pieces);
      all_objects_ = (s_.meets_worlds() && s_.in.world(query_index_) < 0) || far;
      target_ = all_objects_ ? 1 : targets();
      advance();
    }
    THRONG_HD bool over() const noexcept { return range_.begin == range_.end; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }
    // Tests the next candidate; returns true for a hit to report. Requires !over().
    THRONG_HD bool step(Pair& pair) noexcept {
      ++comparisons_;
      const Record c = load(s_.objects.records + range_.begin++);
      double time = 0;
      bool hit = accepts(c, time);
      pair = {query_index_, c.id};
      if constexpr (first_only) {
        if (hit &&
            (time < first_hit_.time || (time == first_hit_.time && c.id < first_hit_.object)))
          first_hit_ = {query_index_, c.id, time};
        advance();
        hit = over() && first_hit_.object != cuda::no_object;
        pair.second = first_hit_.object;
        if (hit && s_.firsts) s_.firsts[query_index_] = first_hit_;
      } else {
        advance();
      }
      return hit;
    }

   private:
    THRONG_HD bool accepts(const Record& c, double& time) const noexcept {
      if (!base::overlaps(grid_query_.box().box(), c.box()) ||
          !s_.in.allowed(query_index_, s_.in.first_count + c.id))
        return false;
      // Other boxes may be stored in the same cells.
      if (!all_objects_ && (cells_.hashed || range_.row == s_.objects.all_rows) &&
          !s_.objects.is_stored_in(cells_, c, target_, range_.row))
        return false;
      if constexpr (!is_sweep) return true;
      const base::ContactInterval t = base::contact_interval(s_.sweeps[query_index_], c.box());
      time = t.enter;
      return t.enter <= t.leave && begin_ <= t.enter && (t.enter < end_ || !has_pieces_);
    }

    // Moves to the next non-empty range of records, if any. Coarse classes come first: a sweep has
    // few pieces in them, and a hit there shortens the others.
    THRONG_HD void advance() noexcept {
      while (range_.begin == range_.end) {
        if (rows_ > 0) {
          range_ = grid_query_.row();
          --rows_;
        } else if (has_pieces_) {
          next_piece();
        } else if (target_ > 0) {
          --target_;
          begin_pieces();
        } else {
          if (far_ != 0) fetch_add(s_.far_rows, std::uint64_t{far_});
          return;
        }
      }
    }
    THRONG_HD std::uint32_t targets() const noexcept {
      return s_.objects.target(base::group_count(cells_.present), 0);
    }
    THRONG_HD const base::SizeClass& class_of(std::uint32_t target) const noexcept {
      return cells_.classes[target % base::max_size_classes];
    }

    // Starts the pieces of the current target.
    THRONG_HD void begin_pieces() noexcept {
      piece_count_ = 0;
      occupied_until_ = 0;
      if (all_objects_) times_ = {0, 1};
      has_pieces_ = all_objects_ || meets(target_);
      end_ = times_.enter;
    }
    // Whether the query meets the bounds of a target's boxes; sets the interval for a sweep.
    THRONG_HD bool meets(std::uint32_t target) noexcept {
      if (!s_.objects.occupied[target]) return false;
      const Box bounds = occupied_bounds(s_.objects.occupied, target);
      if constexpr (!is_sweep) {
        return base::overlaps(grid_query_.box().box(), bounds);
      } else {
        times_ = base::contact_interval(s_.sweeps[query_index_], bounds);
        return times_.enter <= times_.leave;
      }
    }
    THRONG_HD void next_piece() noexcept {
      if constexpr (is_sweep) {
        if (s_.has_blocks && piece_count_ >= pieces_before_blocks && end_ >= occupied_until_)
          skip_empty();
        // No hit from here on can be the first.
        if (first_only && end_ > first_hit_.time) has_pieces_ = false;
        if (!has_pieces_) return;
        begin_ = end_;
        end_ = all_objects_ ? times_.leave : time_after(begin_, 1 / pieces_per_cell);
        has_pieces_ = end_ < times_.leave;
        grid_query_.set_box(cover_(begin_, end_));
      } else {
        has_pieces_ = false;
      }
      ++piece_count_;
      if (all_objects_) {
        range_ = {0, s_.objects.report->active, s_.objects.all_rows};
        return;
      }
      rows_ = grid_query_.select_target(target_);
      const std::uint32_t active = s_.objects.report->active;
      if (is_sweep && has_pieces_ && (grid_query_.all_records() || piece_count_ > active / 16)) {
        // Goes through all boxes, once for all remaining pieces.
        end_ = times_.leave;
        has_pieces_ = false;
        grid_query_.set_box(cover_(begin_, end_));
        rows_ = 0;
        range_ = {0, active, s_.objects.all_rows};
      }
      if (piece_count_ > pieces_before_blocks) far_ += rows_;
    }
    // Skips times in which the sweep needs no occupied cell, in steps of the length of a block, of
    // a larger block where possible.
    THRONG_HD void skip_empty() noexcept {
      const base::SizeClass& c = class_of(target_);
      while (has_pieces_) {
        double empty = end_;
        float cells = 0;
        for (int level = 1; level <= base::BlockBitmap::levels; ++level) {
          const auto length = static_cast<float>(base::BlockBitmap::length(level));
          const double end = time_after(end_, length);
          if (level == 1) occupied_until_ = end;
          const base::CellSpan span = base::cells_of(cells_, cover_(end_, end));
          std::int32_t lower[3], upper[3];
          for (int k = 0; k < 3; ++k) {
            lower[k] = (span.lower[k] >> c.shift[k]) - 1;
            upper[k] = span.upper[k] >> c.shift[k];
          }
          if (s_.blocks.may_contain(lower, upper, target_ % base::max_size_classes, level)) break;
          empty = end;
          cells = length;
        }
        if (cells == 0) return;
        far_ += static_cast<std::uint32_t>(rows_per_piece * pieces_per_cell * cells);
        end_ = empty;
        has_pieces_ = end_ < times_.leave;
      }
    }

    // A piece that crosses u cells searches approximately (u + 2)^2 rows, so two cells per piece
    // are optimal. With first hits most later pieces are never searched, so pieces may be shorter.
    static constexpr float pieces_per_cell = first_only ? 0.75f : 0.5f;

    THRONG_HD float cells_before(const base::SweepAxis& axis, int k, double time) const noexcept {
      return base::cells_before(cells_, k, static_cast<float>(axis.lower + double{axis.by} * time));
    }
    // Approximate number of pieces for a target that it meets.
    THRONG_HD float pieces_of(std::uint32_t target) const noexcept {
      const base::SizeClass& c = class_of(target);
      base::SweepAxis axes[3];
      base::axes_of(s_.sweeps[query_index_], axes);
      float cells = 0;
      for (int k = 0; k < 3; ++k) {
        const float crossed =
            fabsf(cells_before(axes[k], k, times_.leave) - cells_before(axes[k], k, times_.enter));
        cells = fmaxf(cells, crossed / static_cast<float>(1u << c.shift[k]));
      }
      return ceilf(pieces_per_cell * cells);
    }
    // The time at which the sweep is `cells` cells of the current target ahead of its position at
    // `begin`, along any axis; at most the end of its interval.
    THRONG_HD double time_after(double begin, float cells) const noexcept {
      const base::SizeClass& c = class_of(target_);
      base::SweepAxis axes[3];
      base::axes_of(s_.sweeps[query_index_], axes);
      double end = times_.leave;
      for (int k = 0; k < 3; ++k) {
        if (axes[k].by == 0) continue;
        const float at = cells_before(axes[k], k, begin);
        const float way = cells * static_cast<float>(1u << c.shift[k]);
        const float to = axes[k].by > 0 ? at + way : at - way;
        if (!(to >= 0 && to <= cells_.last[k] + 1)) continue;  // it stays in the outermost cells
        const double time = (base::coordinate_before(cells_, k, to) - axes[k].lower) / axes[k].by;
        if (time > begin && time < end) end = time;
      }
      return end;
    }

    // The bitmap is used from this piece on: most sweeps end before.
    static constexpr std::uint32_t pieces_before_blocks = 8;
    static constexpr float rows_per_piece = 12;

    const QuerySearch& s_;
    const base::SizeClassGrid& cells_;
    std::uint32_t query_index_;
    GridSearchOf<GridSearchMode::around>::GridQuery<true> grid_query_;
    GridSearchOf<GridSearchMode::around>::Range range_{0, 0, 0};
    std::uint32_t target_ = 0;  // remaining targets; also the index of the current one
    std::uint32_t rows_ = 0, comparisons_ = 0, far_ = 0;
    std::uint32_t piece_count_ = 0;  // pieces of the current target so far
    bool has_pieces_ = false;        // pieces remain
    bool all_objects_ = false;       // all objects are gone through
    base::SweptBounds cover_;
    // The interval in which the sweep meets the bounds of the current target's boxes.
    base::ContactInterval times_{0, 1};
    // Of the current piece; and the time up to which some cell is known to be occupied.
    double begin_ = 0, end_ = 0, occupied_until_ = 0;
    SweepHit first_hit_ = no_hit(0);
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

// Adds the storage cell of a box in the grid to the bitmap.
struct MarkBlocks {
  const base::SizeClassGrid* grid;
  const Record* records;
  const Report* report;
  base::BlockBitmap blocks;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i >= report->active) return;
    const base::CellSpan span = base::cells_of(*grid, load(records + i).box());
    const std::uint32_t size_class = base::class_of(*grid, span);
    std::int32_t storage_cell[3];
    for (int k = 0; k < 3; ++k)
      storage_cell[k] = span.lower[k] >> grid->classes[size_class].shift[k];
    blocks.add(storage_cell, size_class,
               [](std::uint32_t* word, std::uint32_t bits) { fetch_or(word, bits); });
  }
};

// Reports invalid queries and resets the first hits.
struct CheckQuery {
  Input in;
  const Sweep* sweeps;  // null: box queries
  SweepHit* firsts;
  Report* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    report_bad_world(in, *report, i);
    const bool bad = sweeps ? !base::is_valid_sweep(sweeps[i]) : base::has_nan(in.sets[0].box(i));
    if (bad) {
      fetch_add(&report->nan_count, std::uint64_t{1});
      fetch_max(&report->nan_mark, ~i);
    }
    if (firsts) firsts[i] = no_hit(i);
  }
};

// Adds the times to pairs (sweep, object).
struct TimeHits {
  const Sweep* sweeps;
  Set objects;
  const Pair* pairs;
  SweepHit* hits;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = pairs[i];
    hits[i] = {p.first, p.second,
               base::contact_interval(sweeps[p.first], objects.box(p.second)).enter};
  }
};

}  // namespace throng::device
