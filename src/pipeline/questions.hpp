// Questions to objects that live on a device: what one thread does for one of them. It looks into a
// grid of the objects' boxes (core/class_grid.hpp), a sweep piece by piece on its way.
//
// Why a sweep loses nothing, and tells nothing twice: its time is cut by numbers that nowhere
// decrease, from 0 to 1. Let touch() say that it meets a box from `enter` on. One piece tells of
// that: the one that begins at `enter` or before and ends after it, or the last. The box overlaps
// the Cover of that piece; who looks for a box in the grid finds all that it overlaps, and each
// once. So what is met first is told by the first piece that tells of anything.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <throng/cuda_broad_phase.hpp>

#include "core/sweep.hpp"
#include "pipeline/search.hpp"
#include "pipeline/stages.hpp"

namespace throng::pipeline {

// What is asked: for boxes, what they overlap; for sweeps, all that they meet, or the first of it.
enum class Question : std::uint8_t { overlaps, all_hits, first_hit };

// Sweeps, with the filters of their boxes; or boxes.
struct Asked {
  Boxes boxes;
  const Sweep* sweeps = nullptr;

  static Asked about(const Sweep* sweeps, std::size_t count, const Filters& filters) noexcept {
    Asked asked{Boxes(sweeps ? &sweeps->box : nullptr, count, sizeof(Sweep)), sweeps};
    asked.boxes.filters = filters;
    return asked;
  }
};

// Where no object is met.
THRONG_HD inline SweepHit no_hit(std::uint32_t sweep) noexcept {
  return {sweep, cuda::no_object, std::numeric_limits<double>::infinity()};
}

// Told as pairs (question, object).
template <Question question>
struct QuestionSearch {
  static constexpr bool Sweeps = question != Question::overlaps;
  static constexpr bool First = question == Question::first_hit;

  Input in;  // of two sets: what is asked about, and the objects
  const Sweep* sweeps;
  GridSearchOf<Looking::around> objects;
  SweepHit* firsts;  // if not null, the first hit goes there, at the sweep's own place

  THRONG_HD std::uint64_t count() const noexcept { return in.first_count; }
  // The world whose cells are looked into, beside those of objects of none; 0 where there are none
  // such, or where all are gone through.
  THRONG_HD std::uint32_t world(std::uint32_t asked) const noexcept {
    const std::int32_t world = meets_worlds() ? in.world(asked) : 0;
    return world < 0 ? 0 : static_cast<std::uint32_t>(world);
  }
  THRONG_HD bool meets_worlds() const noexcept {
    return (objects.grid->present & core::everywhere_bit) != 0;
  }

  class Walk {
   public:
    THRONG_HD Walk(const QuestionSearch& search, std::uint64_t i) noexcept
        : s_(search),
          cells_(*search.objects.grid),
          asked_(static_cast<std::uint32_t>(i)),
          look_(search.objects, cells_, search.in.sets[0].box(asked_), search.in.group_bits(asked_),
                search.world(asked_)) {
      if (!core::is_active(look_.box().box())) return;
      if constexpr (Sweeps) {
        const Sweep sweep = s_.sweeps[asked_];
        if (!core::is_sound(sweep)) return;
        cover_ = core::Cover(sweep);
        cut(sweep);
      }
      // Who meets all worlds does not know their cells; and a piece costs more than so many
      // comparisons.
      everything_ = (s_.meets_worlds() && s_.in.world(asked_) < 0) ||
                    std::uint64_t{inner_} * 16 > s_.objects.report->active;
      pieces_ = everything_ || inner_ == 0 ? 1 : inner_ + 2;
      advance();
    }
    THRONG_HD bool over() const noexcept { return range_.begin == range_.end; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }
    // Tests the next candidate; true where there is a hit to be told. Not when over.
    THRONG_HD bool step(Pair& pair) noexcept {
      ++comparisons_;
      const Record c = load(s_.objects.records + range_.begin++);
      double time = 0;
      bool hit = accepts(c, time);
      pair = {asked_, c.id};
      if constexpr (First) {
        if (hit && (time < first_.time || (time == first_.time && c.id < first_.object)))
          first_ = {asked_, c.id, time};
        advance();
        hit = over() && first_.object != cuda::no_object;
        pair.second = first_.object;
        if (hit && s_.firsts) s_.firsts[asked_] = first_;
      } else {
        advance();
      }
      return hit;
    }

   private:
    THRONG_HD bool accepts(const Record& c, double& time) const noexcept {
      if (!core::overlaps(look_.box().box(), c.box()) ||
          !s_.in.allowed(asked_, s_.in.first_count + c.id))
        return false;
      // Others may be stored in the same place as those that are looked for.
      if (!everything_ && (cells_.hashed || range_.row == s_.objects.all_rows) &&
          !s_.objects.is_home_in(cells_, c, next_ - 1, range_.row))
        return false;
      if constexpr (!Sweeps) return true;
      const core::Touch t = core::touch(s_.sweeps[asked_], c.box());
      time = t.enter;
      return t.enter <= t.leave && begin_ <= t.enter && (t.enter < end_ || piece_ == pieces_);
    }

    // To the next range of records that is not empty, if there is one.
    THRONG_HD void advance() noexcept {
      const std::uint32_t targets = s_.objects.target(core::group_count(cells_.present), 0);
      while (range_.begin == range_.end) {
        if (rows_ > 0) {
          range_ = look_.row();
          --rows_;
        } else if (next_ < targets) {
          if (s_.objects.occupied[next_]) rows_ = look_.aim(next_);
          ++next_;
        } else if (!next_piece()) {
          return;
        }
      }
    }
    // False: there is none that could tell of anything.
    THRONG_HD bool next_piece() noexcept {
      if (piece_ == pieces_ || (First && first_.object != cuda::no_object)) return false;
      if constexpr (Sweeps) {
        do {
          begin_ = end_;
          end_ = end_of(++piece_);
        } while (begin_ == end_ && piece_ < pieces_);
        look_.turn_to(cover_(begin_, end_));
      } else {
        ++piece_;
      }
      if (everything_)
        range_ = {0, s_.objects.report->active, s_.objects.all_rows};
      else
        next_ = 0;
      return true;
    }

    // Into pieces as long as is best where they meet as many cells of one class as of another: of a
    // class whose cells the sweep crosses u of, m pieces look into some (u / m + 2)^2 rows each, in
    // all some m (4 + u^2 / m^2) and what does not depend on m. Before it comes among the cells,
    // and once it has left them, it is one piece.
    THRONG_HD void cut(const Sweep& sweep) noexcept {
      core::SweepAxis axes[3];
      core::axes_of(sweep, axes);
      float ends[2][3];
      for (int k = 0; k < 3; ++k) {
        ends[0][k] = cells_.origin[k];
        ends[1][k] = cells_.origin[k] + (cells_.last[k] + 1) / cells_.scale[k];
      }
      inside_ = core::touch(
          sweep, {{ends[0][0], ends[0][1], ends[0][2]}, {ends[1][0], ends[1][1], ends[1][2]}});
      if (!(inside_.enter < inside_.leave)) return;
      const auto time = static_cast<float>(inside_.leave - inside_.enter);
      float sum = 0, classes = 0;
      for (std::uint32_t c = 0; c < cells_.class_count; ++c) {
        std::uint32_t some = 0;
        for (std::uint32_t group = 0; group < core::group_count(cells_.present); ++group)
          some |= s_.objects.occupied[s_.objects.target(group, c)];
        if (!some) continue;
        float most = 0;
        for (int k = 0; k < 3; ++k) {
          const float crossed = fabsf(axes[k].by) * time * cells_.scale[k] /
                                static_cast<float>(1u << cells_.classes[c].shift[k]);
          most = fmaxf(most, crossed);
        }
        sum += most * most;
        classes += 1;
      }
      // Of a first hit the later ones are mostly not gone through, and they may be shorter.
      constexpr float part = First ? 0.75f : 0.5f, most_pieces = 65536;
      const float pieces = fminf(ceilf(part * sqrtf(sum / classes)), most_pieces);
      if (!(pieces > 1)) return;
      inner_ = static_cast<std::uint32_t>(pieces);
    }
    THRONG_HD double end_of(std::uint32_t piece) const noexcept {
      if (piece == pieces_) return 1;
      const double part = static_cast<double>(piece - 1) / inner_;
      const double end = inside_.enter + (inside_.leave - inside_.enter) * part;
      return end < 1 ? end : 1;
    }

    const QuestionSearch& s_;
    const core::ClassGrid& cells_;
    std::uint32_t asked_;
    GridSearchOf<Looking::around>::Look<true> look_;
    GridSearchOf<Looking::around>::Range range_{0, 0, 0};
    std::uint32_t next_ = GridSearchOf<Looking::around>::most_targets;
    std::uint32_t rows_ = 0, comparisons_ = 0;
    std::uint32_t piece_ = 0, pieces_ = 0, inner_ = 0;  // begun; in all; those among cells
    bool everything_ = false;                           // all objects are gone through
    core::Cover cover_;
    core::Touch inside_{0, 1};
    double begin_ = 0, end_ = 0;
    SweepHit first_ = no_hit(0);
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

// What is wrong with a question; and nothing is met yet.
struct CheckQuestion {
  Input in;
  const Sweep* sweeps;  // null: boxes are asked about
  SweepHit* firsts;
  Report* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    tell_bad_world(in, *report, i);
    const bool bad = sweeps ? !core::is_sound(sweeps[i]) : core::has_nan(in.sets[0].box(i));
    if (bad) {
      fetch_add(&report->nan_count, std::uint64_t{1});
      fetch_max(&report->nan_mark, ~i);
    }
    if (firsts) firsts[i] = no_hit(i);
  }
};

// Pairs (sweep, object) with their times.
struct TimeHits {
  const Sweep* sweeps;
  Set objects;
  const Pair* pairs;
  SweepHit* hits;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = pairs[i];
    hits[i] = {p.first, p.second, core::touch(sweeps[p.first], objects.box(p.second)).enter};
  }
};

}  // namespace throng::pipeline
