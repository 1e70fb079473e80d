// The search of one column of a grid: its boxes are arranged as strips, which are swept.
#pragma once

#include <cstdint>
#include <span>

#include "grid/bin/filter_classes.hpp"
#include "grid/bin/grid.hpp"
#include "grid/emit/worker.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/sweep/record_prefetcher.hpp"

namespace throng::grid {

// Counts of a column fit 32 bits: each box of a subset is in a column at most once, so there are at
// most max_box_count records, and padding indices fit, too. Both subsets together may exceed 32
// bits: the sum is only formed if labels are offset.
static_assert(max_box_count + Strip::padding + 63 <= 0xffffffffu);

// One worker's search through columns.
class ColumnSearch {
 public:
  ColumnSearch(const Job& job, const BinnedGrid& grid, Worker& worker)
      : search_(job.search),
        problem_(job.problem),
        plan_(job.plan),
        grid_(grid),
        worker_(worker),
        scratch_(worker.scratch(job.depth)),
        depth_(job.depth) {}

  // `next`: the column after it, to prefetch, or RecordPrefetcher::no_column.
  void run(std::uint32_t column, std::uint32_t next);

 private:
  // A column's boxes of one subset, as stored.
  struct ColumnBoxes {
    std::uint32_t first_segment, segment_count, records;
  };
  ColumnBoxes collect(std::uint32_t column, unsigned side);
  std::span<const Segment> segments(const ColumnBoxes& raw) const {
    return {scratch_.segments.data() + raw.first_segment, raw.segment_count};
  }
  ColumnBoxes thin_out(const ColumnBoxes& many, const ColumnBoxes& few);
  // A strip under construction, of one subset or of both.
  struct Part {
    std::span<const ColumnBoxes> raw;
    unsigned side;
    StripStorage& storage;
    Strip strip = {};
  };
  struct Range {
    std::uint32_t least, most;
  };
  Range quantized_range(std::span<const Part> parts) const;
  void set_buckets(Range quantized_range, std::uint32_t wanted, Strip& strip) const;
  template <class F>
  void each_record(const Segment& segment, const F& f);
  void count(Part& part);
  bool clustered(std::span<const Part> parts) const;
  void arrange(Part& part);
  void sort(std::span<Part> parts);
  bool sweep_mixed(std::uint32_t column, std::span<const ColumnBoxes> sides);
  void fill(Strip& strip, unsigned side, StripStorage& storage) const;
  void sweep(SweepArgs args);
  void sweep_against(const Strip& from, const Strip& to, bool skip_own_bucket,
                     Orientation orientation);
  void sweep_wide(std::uint32_t column, unsigned side, const Strip& targets, Orientation);

  // The filter classes, if the records' bits can represent them.
  const FilterClasses* classes_in_masks() const {
    return search_.filter_classes && search_.filter_classes->masks_cover_some()
               ? search_.filter_classes
               : nullptr;
  }
  // With offset labels the lesser one is a query's.
  Orientation forward() const {
    return problem_.target_id_offset ? Orientation::unordered : search_.forward();
  }
  Orientation backward() const {
    return problem_.target_id_offset ? Orientation::unordered : search_.backward();
  }

  Search& search_;
  const Problem& problem_;
  const GridPlan& plan_;
  const BinnedGrid& grid_;
  Worker& worker_;
  RecursionScratch& scratch_;
  unsigned depth_;
  bool mixed_ = false;  // the current strip has boxes of both sets
  RecordPrefetcher ahead_;
};

}  // namespace throng::grid
