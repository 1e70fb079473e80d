// The search of one column of a grid: its boxes made strips (strips.cpp), which are swept
// (column.cpp).
#pragma once

#include <cstdint>
#include <span>

#include "cpu/grid.hpp"
#include "cpu/kinds.hpp"
#include "cpu/look_ahead.hpp"

namespace throng::cpu {

// Counts of a column fit 32 bits: a side's box is entered into a column once at most, so a side has
// max_box_count records there at most, and what is read beyond them, too, has a number. Of both
// sides together that need not be so: nothing adds them up in 32 bits unless labels are raised.
static_assert(max_box_count + strip_padding + 63 <= 0xffffffffu);

// Where the bits stand that tell the sets of a strip of two: above those of the column itself, as
// no grid lies within.
constexpr unsigned side_bit = 3;
static_assert(side_bit + 2 <= Kinds::first_bit);

// One worker's way through columns.
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

  // `next`: which will be run after it, or LookAhead::no_column.
  void run(std::uint32_t column, std::uint32_t next);

 private:
  // A column's boxes of one side, as they lie.
  struct Raw {
    std::uint32_t first_segment, segment_count, records;
  };
  Raw collect(std::uint32_t column, unsigned side);
  std::span<const Segment> segments(const Raw& raw) const {
    return {level_.segments.data() + raw.first_segment, raw.segment_count};
  }
  Raw thin_out(const Raw& many, const Raw& few);
  // A strip to be, of the boxes of one side or of both.
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

  // Those that words tell of.
  const Kinds* words_of_kinds() const {
    return search_.kinds && search_.kinds->words_tell() ? search_.kinds : nullptr;
  }
  // Of raised labels the lesser one is a query's.
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
  bool mixed_ = false;                      // the strip that is swept has boxes of both sides
  std::uint32_t pass_by_ = 0, passed_ = 0;  // columns before that is tried again, and so far
  LookAhead ahead_;
};

}  // namespace throng::cpu
