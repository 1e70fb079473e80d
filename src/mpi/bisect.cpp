#include "mpi/bisect.hpp"

#include <algorithm>

namespace throng::mpi {

Extent::Extent() noexcept {
  for (int k = 0; k < 3; ++k) {
    highest[k] = std::numeric_limits<std::int64_t>::min();
    not_lowest[k] = std::numeric_limits<std::int64_t>::min();
  }
}

void Extent::add(const Point& point) noexcept {
  for (int k = 0; k < 3; ++k) {
    const std::int64_t key = point.at[k];
    highest[k] = std::max(highest[k], key);
    not_lowest[k] = std::max(not_lowest[k], ~key);
  }
}

int Extent::longest() const noexcept {
  int best = 0;
  double most = -1;
  for (int k = 0; k < 3 && !empty(); ++k) {
    const double length = static_cast<double>(float_of(static_cast<Key>(highest[k]))) -
                          static_cast<double>(float_of(static_cast<Key>(~not_lowest[k])));
    if (length > most) {
      most = length;
      best = k;
    }
  }
  return best;
}

CutSearch::CutSearch(const Extent& extent, int axis, int left, int parts) noexcept
    : left_(left), parts_(parts) {
  low_ = extent.empty() ? 0 : ~extent.not_lowest[axis];
  const std::int64_t high = extent.empty() ? 0 : extent.highest[axis];
  width_ = (high - low_) / static_cast<std::int64_t>(bins) + 1;
  cut_ = {static_cast<Key>(low_), axis};
}

void CutSearch::count(const Point* points, std::size_t count, Histogram& histogram) const noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t offset = points[i].at[cut_.axis] - low_;
    if (offset < 0) continue;
    const std::int64_t bin = offset / width_;
    if (bin < static_cast<std::int64_t>(bins)) {
      histogram[static_cast<std::size_t>(bin)] += points[i].weight;
    }
  }
}

bool CutSearch::narrow(const Histogram& histogram) noexcept {
  if (first_) {
    first_ = false;
    std::uint64_t total = 0;
    for (const std::uint64_t weight : histogram) total += weight;
    const auto left = static_cast<std::uint64_t>(left_), parts = static_cast<std::uint64_t>(parts_);
    target_ = total / parts * left + total % parts * left / parts;
    enough_ = total >> 11;
  }
  std::size_t bin = 0;
  std::uint64_t below = below_;
  while (bin + 1 < bins && below + histogram[bin] < target_) below += histogram[bin++];
  const std::int64_t start = low_ + static_cast<std::int64_t>(bin) * width_;
  if (width_ == 1 || histogram[bin] <= enough_) {
    // Cut before or after these keys, whichever brings the left side closer to its target.
    const std::uint64_t after = below + histogram[bin];
    const bool include = after >= target_ && after - target_ < target_ - std::min(below, target_);
    cut_.at = static_cast<Key>(start + (include ? width_ : 0));
    return false;
  }
  low_ = start;
  below_ = below;
  width_ = (width_ - 1) / static_cast<std::int64_t>(bins) + 1;
  return true;
}

std::size_t split(Point* points, std::size_t count, const Cut& cut) noexcept {
  return static_cast<std::size_t>(
      std::partition(points, points + count,
                     [&](const Point& p) { return p.at[cut.axis] < cut.at; }) -
      points);
}

namespace {

void bisect(Regions& regions, int begin, int end, Point* points, std::size_t count) {
  if (end - begin == 1) return;
  const int m = Regions::middle(begin, end);
  Extent extent;
  for (std::size_t i = 0; i < count; ++i) extent.add(points[i]);
  CutSearch search(extent, extent.longest(), m - begin, end - begin);
  CutSearch::Histogram histogram;
  do {
    histogram.fill(0);
    search.count(points, count, histogram);
  } while (search.narrow(histogram));
  regions.cut(m) = search.cut();
  const std::size_t left = split(points, count, search.cut());
  bisect(regions, begin, m, points, left);
  bisect(regions, m, end, points + left, count - left);
}

}  // namespace

Regions bisect(Point* points, std::size_t count, int ranks) {
  Regions regions(ranks);
  bisect(regions, 0, ranks, points, count);
  return regions;
}

}  // namespace throng::mpi
