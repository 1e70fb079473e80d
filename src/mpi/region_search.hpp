// The local search of a rank: searches owned boxes and ghosts, keeps the pairs whose reference
// corner lies in the region.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <throng/finder.hpp>
#include <throng/mpi.hpp>

#include "mpi/bisect.hpp"
#include "mpi/gap_partition.hpp"
#include "mpi/local_set.hpp"
#include "mpi/regions.hpp"

namespace throng::mpi {

class RegionSearch {
 public:
  // One or two sets; `in_parts`: split the region at gaps, on the CPU. Result::comparisons and
  // times are sums over all parts, the plan is that of the largest.
  Result search(const Options& options, bool in_parts, const Bounds& region,
                const LocalSet* const* sets, int count);

  // Of the last search: owned boxes (lower corner in the region); all boxes (owned and ghosts);
  // boxes searched, incl. copies that cross parts; and boxes handled: searched, plus all boxes once
  // more if they were distributed to parts, which takes as long per box as the search.
  std::size_t owned() const noexcept { return owned_; }
  std::size_t owned_and_ghost() const noexcept { return owned_and_ghost_; }
  std::size_t searched() const noexcept { return searched_; }
  std::size_t handled() const noexcept { return searched_ + (parts_ > 1 ? owned_and_ghost_ : 0); }
  std::size_t parts() const noexcept { return parts_; }

  // Moves out the pairs, and the owned boxes with the costs of their pairs. Takes lists whose
  // memory the next search reuses.
  void swap(std::vector<Pair64>& pairs, std::vector<Point>& points) noexcept {
    pairs_.swap(pairs);
    points_.swap(points);
  }

 private:
  bool may_split(const Options& options);
  void distribute(const GapPartition& parts, const LocalSet& set,
                  std::vector<LocalSet>& distributed);
  Result search_part(const Bounds& part, const LocalSet* const* sets, int count);

  throng::Finder finder_;
  float margin_ = 0;
  std::vector<Pair64> pairs_;
  std::vector<Point> points_;
  std::size_t owned_ = 0, owned_and_ghost_ = 0, searched_ = 0, parts_ = 0;
  int has_gpu_ = -1;                      // not queried yet
  std::vector<LocalSet> distributed_[2];  // by part
  std::vector<std::vector<std::uint32_t>> lists_;
  // Of one part. above: bit k is set if the lower corner is not below the part on axis k. halves:
  // half-pairs charged to each box.
  std::vector<std::uint8_t> above_[2];
  std::vector<std::uint32_t> halves_[2];
};

}  // namespace throng::mpi
