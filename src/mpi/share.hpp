// What a rank searches: its region's boxes and those that reach into it; and of the pairs found
// those whose home corner lies in the region.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <throng/finder.hpp>
#include <throng/mpi.hpp>

#include "mpi/bisect.hpp"
#include "mpi/local.hpp"
#include "mpi/parts.hpp"
#include "mpi/regions.hpp"

namespace throng::mpi {

class Share {
 public:
  // Of one set or two; `in_parts`: where gaps are, on the CPU. Result::comparisons and times are
  // those of all parts, the plan that of the largest.
  Result search(const Options& options, bool in_parts, const Bounds& region,
                const LocalSet* const* sets, int count);

  // Of the last search. Home: boxes whose lower corner lies in the region; known: all of them;
  // searched: those, and copies of boxes that cross from part to part; handled: those, and once
  // more each box that was dealt out to parts, which takes as long as a box takes to be searched.
  std::size_t home() const noexcept { return home_; }
  std::size_t known() const noexcept { return known_; }
  std::size_t searched() const noexcept { return searched_; }
  std::size_t handled() const noexcept { return searched_ + (parts_ > 1 ? known_ : 0); }
  std::size_t parts() const noexcept { return parts_; }

  // The pairs, and the boxes at home, each with the cost of its pairs. They are given once, for
  // lists whose memory the next search uses.
  void swap(std::vector<Pair64>& pairs, std::vector<Point>& points) noexcept {
    pairs_.swap(pairs);
    points_.swap(points);
  }

 private:
  bool may_part(const Options& options);
  void deal(const Parts& parts, const LocalSet& set, std::vector<LocalSet>& dealt);
  Result search_part(const Bounds& part, const LocalSet* const* sets, int count);

  throng::Finder finder_;
  float margin_ = 0;
  std::vector<Pair64> pairs_;
  std::vector<Point> points_;
  std::size_t home_ = 0, known_ = 0, searched_ = 0, parts_ = 0;
  int has_gpu_ = -1;                // not asked yet
  std::vector<LocalSet> dealt_[2];  // by part
  std::vector<std::vector<std::uint32_t>> lists_;
  // Of a part. Bit k of above: on axis k the lower corner is not below the part. Halves of pairs
  // that were told.
  std::vector<std::uint8_t> above_[2];
  std::vector<std::uint32_t> halves_[2];
};

}  // namespace throng::mpi
