// Work counting, partitioning by work across ranks, and forwarding of records along the tree.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mpi/bisect.hpp"
#include "mpi/communicator.hpp"

namespace throng::mpi {

// The cost of a search, in units of one comparison of two boxes. A uniform box takes 24 ns of a
// core with about 40 comparisons of 1/4 ns (docs/explanation/benchmarks.md); this leaves 14 ns, or
// 56 comparisons, for the box. Writing a pair takes about 2 ns. Only ratios matter, and only for
// balance.
constexpr std::uint64_t box_work = 64, pair_work = 8;
inline std::uint64_t work_of(std::uint64_t boxes, std::uint64_t comparisons,
                             std::uint64_t pairs) noexcept {
  return boxes * box_work + comparisons + pairs * pair_work;
}

// The largest rank's work over the mean.
inline double imbalance_of(std::uint64_t largest, std::uint64_t sum, int ranks) noexcept {
  const double mean = static_cast<double>(sum) / ranks;
  return mean > 0 ? static_cast<double>(largest) / mean : 1;
}

// Delays the next repartitioning of space after one that did not help.
class RepartitionBackoff {
 public:
  // Once per call: whether to repartition now.
  bool is_due(double imbalance, double allowed) noexcept {
    if (!(imbalance > allowed) || ++skipped_ <= wait_) return false;
    skipped_ = 0;
    return true;
  }
  // After a call with a new partition. If the gain is below 5 %, the rest of the imbalance is
  // inherent in the scene.
  void evaluate(double imbalance, double before) noexcept {
    wait_ = imbalance < 0.95 * before ? 0 : std::min(2 * wait_ + 1, 1000u);
  }

 private:
  unsigned wait_ = 0, skipped_ = 0;  // calls
};

// Maximum number of sample points per rank. With 16,384 points the weight of a part is accurate to
// 1 %, and a level sends less than 300 KB.
constexpr std::size_t max_points = 16384;

// Appends the lower corner as a point, unless the box is infinite.
void add_point(std::vector<Point>& points, const KeyBox& key_box, std::uint64_t weight);

// Keeps one point of every k, with k times its weight.
void subsample(std::vector<Point>& points);

// Collective. Returns the regions that bisect() computes for the points of all ranks together. Each
// level costs two reductions of a few words and at most five of 2 KB within the node, then one
// message with the points on the wrong side.
Regions bisect(Communicator& communicator, std::vector<Point> points);

// Collective. Forwards records down the tree of regions; wanted(begin, end, record) returns whether
// some rank of that node needs the record. Returns the records that arrived at or stayed on this
// rank, a superset of those it needs. A rank sends one message per level, and a record once per
// node that it enters.
template <class Wanted>
Bytes forward_along_tree(Communicator& communicator, Bytes records, std::size_t record_bytes,
                         Wanted&& wanted) {
  communicator.make_nodes();
  for (int level = 0; level + 1 < communicator.levels(); ++level) {
    const Communicator::Node& n = communicator.node(level);
    const int m = Regions::middle(n.begin, n.end);
    const bool left = communicator.rank() < m;
    Bytes across, here;
    for (std::size_t at = 0; at < records.size(); at += record_bytes) {
      const std::byte* record = records.data() + at;
      if (left ? wanted(m, n.end, record) : wanted(n.begin, m, record)) {
        across.insert(across.end(), record, record + record_bytes);
      }
      if (left ? wanted(n.begin, m, record) : wanted(m, n.end, record)) {
        here.insert(here.end(), record, record + record_bytes);
      }
    }
    communicator.swap_halves(level, across, here);
    records = std::move(here);
  }
  return records;
}

}  // namespace throng::mpi
