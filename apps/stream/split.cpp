#include "apps/stream/split.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::stream {
namespace {

constexpr std::size_t run_rows = 16;  // sampled together: a seek costs more than a row
constexpr double fill = 0.85;         // of a slab: a margin for the sample's error

std::vector<Box> sample_boxes(const SplitRequest& request, double& rows_per_sample) {
  std::uint64_t total = 0, seen = 0;
  for (int side = 0; side < request.side_count; ++side) total += request.sides[side]->count();
  std::vector<Box> sample;
  for (int side = 0; side < request.side_count; ++side) {
    Source& source = const_cast<Source&>(*request.sides[side]);
    const std::size_t bytes = request.layouts[side]->bytes;
    const std::uint64_t count = source.count();
    if (count == 0) continue;  // possibly of all sides: there is no share then
    const double share = static_cast<double>(count) / static_cast<double>(total);
    const auto sampled_runs = static_cast<std::uint64_t>(
        std::ceil(share * static_cast<double>(request.sample_rows) / run_rows));
    const std::uint64_t step =
        std::max<std::uint64_t>(run_rows, sampled_runs ? count / sampled_runs : count);
    char rows[run_rows * Layout::max_bytes];
    for (std::uint64_t at = 0; at < count; at += step) {
      const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(run_rows, count - at));
      source.read(at, here, rows);
      seen += here;
      for (std::size_t i = 0; i < here; ++i) {
        const Box box = Rows::box_of(rows + i * bytes);
        if (is_active(box)) sample.push_back(box);
      }
    }
  }
  rows_per_sample = seen ? static_cast<double>(total) / static_cast<double>(seen) : 0;
  return sample;
}

// Number of compared rows if `rows` are processed in blocks, each with itself and all later ones.
double blockwise_cost(double rows, double slab_rows) {
  return rows <= slab_rows ? rows : rows + 2 * rows * rows / slab_rows;
}

// Rows written, read and compared: the cost of a split.
double cost(const Split& split, const std::vector<Box>& sample, double scale, double slab_rows) {
  const auto slabs = static_cast<std::size_t>(split.slabs());
  std::vector<double> owned(slabs), wide(slabs);
  double copies = 0, wide_rows = 0;
  for (const Box& box : sample) {
    const int first = split.owner(box), last = split.last(box, first);
    if (last - first > Split::max_halos) {
      wide_rows += scale;
      for (int s = std::max(0, first - Split::max_halos); s <= last; ++s) {
        wide[static_cast<std::size_t>(s)] += scale;
      }
    } else {
      owned[static_cast<std::size_t>(first)] += scale;
      copies += scale * (last - first);
    }
  }
  const double all = scale * static_cast<double>(sample.size());
  double sum = 2 * (all + copies) + blockwise_cost(wide_rows, slab_rows);
  for (std::size_t s = 0; s < slabs; ++s) {
    double here = blockwise_cost(owned[s], slab_rows);
    // Too many for a slab, but another cut should help.
    if (owned[s] < 0.7 * all) here = std::min(here, 5 * owned[s]);
    sum += here + wide[s];
    if (wide[s] > 0) sum += owned[s] * std::ceil(3 * wide[s] / slab_rows);
  }
  return sum;
}

}  // namespace

double Split::reach(const Box& b) const noexcept {
  const double end = upper(b, axis);
  if (margin == 0) return end;
  // a overlaps b if a.lower - m, rounded down to a float, is <= e = b.upper + m, rounded up. Then
  // a.lower - m is below the float after e. Rounding up and one more float are less than 2^-22 of
  // |e| plus four times the smallest float; this covers the rounding of the doubles here many times
  // over. Where e is infinite everything overlaps.
  const double far = end + 2.0 * margin;
  const double slack = 0x1p-20 * (std::fabs(end) + 2.0 * margin) + 0x1p-140;
  return far + slack >= std::numeric_limits<float>::max() ? std::numeric_limits<double>::infinity()
                                                          : far + slack;
}

int Split::owner(const Box& b) const noexcept {
  // A branch-free std::upper_bound: its branches are unpredictable.
  const float x = lower(b, axis);
  const float* at = borders.data();
  for (std::size_t left = borders.size(); left > 0;) {
    const std::size_t half = (left + 1) / 2;
    at += half * static_cast<std::size_t>(at[half - 1] <= x);
    left -= half;
  }
  return static_cast<int>(at - borders.data());
}

int Split::last(const Box& b, int owner) const noexcept {
  const double end = reach(b);
  auto s = static_cast<std::size_t>(owner);
  if (s == borders.size() || static_cast<double>(borders[s]) > end) return owner;
  const auto at = std::upper_bound(borders.begin() + owner, borders.end(), end,
                                   [](double e, float t) { return e < static_cast<double>(t); });
  return static_cast<int>(at - borders.begin());
}

Split choose_split(const SplitRequest& request) {
  double scale = 0;
  const std::vector<Box> sample = sample_boxes(request, scale);
  Split best;
  best.margin = request.margin;
  if (sample.empty()) return best;
  const double slab_rows = static_cast<double>(request.slab_rows);
  const double all = scale * static_cast<double>(sample.size());
  double least = blockwise_cost(all, slab_rows);
  const auto slabs = static_cast<std::size_t>(
      std::clamp(std::ceil(all / (fill * slab_rows)), 2.0, static_cast<double>(request.max_slabs)));
  std::vector<float> lowers(sample.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < sample.size(); ++i) lowers[i] = lower(sample[i], axis);
    std::sort(lowers.begin(), lowers.end());
    Split split;
    split.axis = axis;
    split.margin = request.margin;
    for (std::size_t k = 1; k < slabs; ++k) {
      const float border = lowers[sample.size() * k / slabs];
      const float before = split.borders.empty() ? lowers.front() : split.borders.back();
      if (border > before) split.borders.push_back(border);
    }
    const double own_cost = cost(split, sample, scale, slab_rows);
    if (!split.borders.empty() && own_cost < least) {
      least = own_cost;
      best = split;
    }
  }
  return best;
}

}  // namespace throng::stream
