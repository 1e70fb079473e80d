// The search of one column of a grid: its boxes are arranged as strips (strips.cpp), which are
// swept (column.cpp).
#pragma once

#include <cstdint>
#include <span>

#include "cpu/grid.hpp"
#include "cpu/kinds.hpp"
#include "cpu/look_ahead.hpp"

namespace throng::cpu {

// Counts of a column fit 32 bits: each box of a subset is in a column at most once, so there are at
// most max_box_count records, and padding indices fit, too. Both subsets together may exceed 32
// bits: the sum is only formed if labels are offset.
static_assert(max_box_count + strip_padding + 63 <= 0xffffffffu);

// The bits that mark the set of a box in a mixed strip: above those of the column, as no nested
// grid is used.
constexpr unsigned side_bit = 3;
static_assert(side_bit + 2 <= Kinds::first_bit);

// One worker's search through columns.
class ColumnSearch {
 public:
  ColumnSearch(Search& search, const Problem& problem, const core::GridPlan& plan, GridSpace& space,
               Worker& worker, unsigned depth)
      : search_(search),
        problem_(problem),
        plan_(plan),
        space_(space),
        worker_(worker),
        level_(worker.level(depth)),
        depth_(depth) {}

  // `next`: the column after it, to prefetch, or LookAhead::no_column.
  void run(std::uint32_t column, std::uint32_t next);

 private:
  // A column's boxes of one subset, as stored.
  struct Raw {
    std::uint32_t first_segment, segment_count, records;
  };
  Raw collect(std::uint32_t column, unsigned side);
  std::span<const Segment> segments(const Raw& raw) const {
    return {level_.segments.data() + raw.first_segment, raw.segment_count};
  }
  Raw thin_out(const Raw& many, const Raw& few);
  // A strip under construction, of one subset or of both.
  struct Part {
    std::span<const Raw> raw;
    unsigned side;
    StripSpace& room;
    Strip strip = {};
  };
  struct Range {
    std::uint32_t least, most;
  };
  Range words(std::span<const Part> parts) const;
  void set_buckets(Range words, std::uint32_t wanted, Strip& strip) const;
  template <class F>
  void each_record(const Segment& segment, const F& f);
  void count(Part& part);
  bool crowded(std::span<const Part> parts) const;
  void arrange(Part& part);
  void sort(std::span<Part> parts);
  bool sweep_mixed(std::uint32_t column, std::span<const Raw> sides);
  void fill(Strip& strip, unsigned side, StripSpace& room) const;
  void sweep(Sweep args);
  void cross(const Strip& from, const Strip& to, bool skip_own_bucket, Orientation orientation);
  void sweep_wide(std::uint32_t column, unsigned side, const Strip& targets, Orientation);

  // The filter classes, if the records' bits can represent them.
  const Kinds* words_of_kinds() const {
    return search_.kinds && search_.kinds->words_tell() ? search_.kinds : nullptr;
  }
  // With offset labels the lesser one is a query's.
  Orientation forward() const {
    return problem_.raised_by ? Orientation::unordered : search_.forward();
  }
  Orientation backward() const {
    return problem_.raised_by ? Orientation::unordered : search_.backward();
  }

  Search& search_;
  const Problem& problem_;
  const core::GridPlan& plan_;
  GridSpace& space_;
  Worker& worker_;
  Level& level_;
  unsigned depth_;
  bool mixed_ = false;                      // the current strip has boxes of both sets
  std::uint32_t pass_by_ = 0, passed_ = 0;  // columns to skip before the next attempt, and skipped
                                            // so far
  LookAhead ahead_;
};

}  // namespace throng::cpu
