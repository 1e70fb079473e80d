// Work counted, space cut by it among ranks, and records handed on along the tree of regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mpi/bisect.hpp"
#include "mpi/link.hpp"

namespace throng::mpi {

// What a search cost, in units of a comparison of two boxes. A uniform box costs 24 ns of a core
// with some 40 comparisons of 1/4 ns (docs/benchmarks.md), which leaves 14 ns, or 56 comparisons,
// for the box; a pair that is written costs some 2 ns. Only ratios matter, and only to balance.
constexpr std::uint64_t box_work = 64, pair_work = 8;
inline std::uint64_t work_of(std::uint64_t boxes, std::uint64_t comparisons,
                             std::uint64_t pairs) noexcept {
  return boxes * box_work + comparisons + pairs * pair_work;
}

// At most so many points a rank stand for all of its objects: of 16,384 the weight of a share is
// right to within 1 %, and what is sent stays below 300 KB a level.
constexpr std::size_t most_points = 16384;

// A point at the reach's lower corner, unless it is infinite.
void add_point(std::vector<Point>& points, const Reach& reach, std::uint64_t weight);

// One point of each k, k times as heavy.
void thin_out(std::vector<Point>& points);

// Collective: the regions that bisect() gives for the points of all ranks together. Each level
// costs two rounds of words and at most five of 2 KB among the ranks of the node, then one message,
// the points that are on the wrong side.
Regions bisect(Link& link, std::vector<Point> points);

// Collective: hands records on along the tree: wanted(begin, end, record) tells whether some rank
// of that node needs it. Gives the records that came to this rank or were here; it may not need
// all. A rank sends one message a level, and a record once for each node that it goes on into.
template <class Wanted>
Bytes hand_on(Link& link, Bytes records, std::size_t record_bytes, Wanted&& wanted) {
  link.make_nodes();
  for (int level = 0; level + 1 < link.levels(); ++level) {
    const Link::Node& n = link.node(level);
    const int m = Regions::middle(n.begin, n.end);
    const bool left = link.rank() < m;
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
    link.swap(level, across, here);
    records = std::move(here);
  }
  return records;
}

}  // namespace throng::mpi
