#include "mpi/balance.hpp"

#include <algorithm>
#include <cstring>

#include <throng/checksum.hpp>

#include "mpi/ids.hpp"

namespace throng::mpi {

void add_point(std::vector<Point>& points, const KeyBox& key_box, std::uint64_t weight) {
  if (!is_finite(key_box)) return;
  points.push_back({{key_box.lower[0], key_box.lower[1], key_box.lower[2]}, point_weight(weight)});
}

// Takes a hashed position in each run of `step`, since the caller's order may have that period.
void subsample(std::vector<Point>& points) {
  const std::size_t step = (points.size() + max_points - 1) / max_points;
  if (step <= 1) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    Point point = points[std::min(i + mix64(i) % step, points.size() - 1)];
    const std::uint64_t weight = std::uint64_t{point.weight} * step;
    point.weight = static_cast<std::uint32_t>(std::min<std::uint64_t>(weight, 0xffffffffu));
    points[kept++] = point;
  }
  points.resize(kept);
}

// As bisect() in bisect.cpp, with each sum taken over the ranks of the node. The ranks of the left
// half then continue with the points left of the cut, whichever rank held them.
Regions bisect(Communicator& communicator, std::vector<Point> points) {
  communicator.make_nodes();
  std::vector<Cut> mine(1);
  for (int level = 0; level + 1 < communicator.levels(); ++level) {
    const Communicator::Node& n = communicator.node(level);
    const int m = Regions::middle(n.begin, n.end);
    Extent extent;
    for (const Point& point : points) extent.add(point);
    static_assert(sizeof(Extent) == 6 * sizeof(std::int64_t));
    std::int64_t ends[6];
    std::memcpy(ends, &extent, sizeof ends);
    communicator.all_reduce_max(level, ends, 6);
    std::memcpy(&extent, ends, sizeof ends);
    CutSearch search(extent, extent.longest(), m - n.begin, n.end - n.begin);
    CutSearch::Histogram histogram;
    do {
      histogram.fill(0);
      search.count(points.data(), points.size(), histogram);
      communicator.all_reduce_sum(level, histogram.data(), static_cast<int>(CutSearch::bins));
    } while (search.narrow(histogram));
    if (communicator.rank() == m) mine[0] = search.cut();
    const std::size_t left = split(points.data(), points.size(), search.cut());
    const bool stays_left = communicator.rank() < m;
    const Point* first = points.data() + (stays_left ? left : 0);
    const std::size_t count = stays_left ? points.size() - left : left;
    Bytes across(count * sizeof(Point)), got;
    if (count) std::memcpy(across.data(), first, across.size());
    communicator.swap_halves(level, across, got);
    if (stays_left) {
      points.resize(left);
    } else {
      points.erase(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(left));
    }
    const std::size_t kept = points.size();
    points.resize(kept + got.size() / sizeof(Point));
    if (!got.empty()) std::memcpy(points.data() + kept, got.data(), got.size());
  }
  Regions regions(communicator.size());
  communicator.all_gather(mine.data(), sizeof(Cut), regions.data());
  return regions;
}

}  // namespace throng::mpi
