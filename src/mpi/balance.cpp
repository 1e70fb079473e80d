#include "mpi/balance.hpp"

#include <algorithm>
#include <cstring>

#include "mpi/ids.hpp"

namespace throng::mpi {

void add_point(std::vector<Point>& points, const Reach& reach, std::uint64_t weight) {
  if (!is_somewhere(reach)) return;
  points.push_back({{reach.lower[0], reach.lower[1], reach.lower[2]}, point_weight(weight)});
}

// Takes a hashed position in each run of `step`, since the caller's order may have that period.
void thin_out(std::vector<Point>& points) {
  const std::size_t step = (points.size() + most_points - 1) / most_points;
  if (step <= 1) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    Point point = points[std::min(i + mixed(i) % step, points.size() - 1)];
    const std::uint64_t weight = std::uint64_t{point.weight} * step;
    point.weight = static_cast<std::uint32_t>(std::min<std::uint64_t>(weight, 0xffffffffu));
    points[kept++] = point;
  }
  points.resize(kept);
}

// As bisect() in bisect.cpp, with each sum taken over the ranks of the node. The ranks of the left
// half then continue with the points left of the cut, whichever rank held them.
Regions bisect(Link& link, std::vector<Point> points) {
  link.make_nodes();
  std::vector<Cut> mine(1);
  for (int level = 0; level + 1 < link.levels(); ++level) {
    const Link::Node& n = link.node(level);
    const int m = Regions::middle(n.begin, n.end);
    Extent extent;
    for (const Point& point : points) extent.add(point);
    static_assert(sizeof(Extent) == 6 * sizeof(std::int64_t));
    std::int64_t ends[6];
    std::memcpy(ends, &extent, sizeof ends);
    link.most(level, ends, 6);
    std::memcpy(&extent, ends, sizeof ends);
    CutSearch search(extent, extent.longest(), m - n.begin, n.end - n.begin);
    CutSearch::Histogram histogram;
    do {
      histogram.fill(0);
      search.count(points.data(), points.size(), histogram);
      link.sum(level, histogram.data(), static_cast<int>(CutSearch::bins));
    } while (search.narrow(histogram));
    if (link.rank() == m) mine[0] = search.cut();
    const std::size_t left = split(points.data(), points.size(), search.cut());
    const bool stays_left = link.rank() < m;
    const Point* first = points.data() + (stays_left ? left : 0);
    const std::size_t count = stays_left ? points.size() - left : left;
    Bytes across(count * sizeof(Point)), got;
    if (count) std::memcpy(across.data(), first, across.size());
    link.swap(level, across, got);
    if (stays_left) {
      points.resize(left);
    } else {
      points.erase(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(left));
    }
    const std::size_t kept = points.size();
    points.resize(kept + got.size() / sizeof(Point));
    if (!got.empty()) std::memcpy(points.data() + kept, got.data(), got.size());
  }
  Regions regions(link.size());
  link.gather(mine.data(), sizeof(Cut), regions.data());
  return regions;
}

}  // namespace throng::mpi
