#include "mpi/gap_partition.hpp"

#include <algorithm>
#include <limits>

#include <throng/checksum.hpp>

namespace throng::mpi {
namespace {

// Sampling rate: one of 32 boxes, at least 512 or an eighth of the boxes; no sample for fewer than
// min_boxes.
constexpr std::size_t sample_fraction = 32, min_sample_fraction = 8, min_sample = 512,
                      max_sample = 4096;
constexpr std::size_t min_boxes = 512;
// A part needs at least this fraction of the sample (1/64), and at least two of it.
constexpr std::size_t min_part_fraction = 64, min_part = 2;
// A gap spans at least 1/64 of the range, and so much that 16 boxes are expected in it for a
// uniform distribution: it is empty by chance once in ten million.
constexpr std::size_t min_gap_fraction = 64, min_expected_boxes = 16;
constexpr std::size_t max_bins = 256, few_bins = 64, few_boxes = 1024;

struct Gap {
  double gain = 0;
  Key middle = 0;
};

// The best gap along an axis: wide, and close to the median, which keeps the tree shallow. Its
// position affects only the cost.
Gap best_gap(const KeyBox* sample, std::size_t count, std::size_t least, int axis) {
  constexpr float most = std::numeric_limits<float>::max();
  const auto finite = [=](Key key) { return std::min(std::max(float_of(key), -most), most); };
  Gap gap;
  Key lowest = sample[0].lower[axis], highest = lowest;
  for (std::size_t i = 1; i < count; ++i) {
    lowest = std::min(lowest, sample[i].lower[axis]);
    highest = std::max(highest, sample[i].lower[axis]);
  }
  const std::size_t bins = count < few_boxes ? few_bins : max_bins;
  const std::size_t wanted =
      std::max(bins / min_gap_fraction, (min_expected_boxes * bins + count - 1) / count);
  const float low = finite(lowest), range = finite(highest) - low,
              scale = static_cast<float>(bins) / range, last = static_cast<float>(bins - 1);
  if (!(range > 0 && range <= most && scale <= most)) return gap;
  const auto bin = [&](Key key) {
    return static_cast<std::size_t>(std::min((finite(key) - low) * scale, last));
  };
  std::uint32_t begin[max_bins] = {}, end[max_bins + 1] = {};
  for (std::size_t i = 0; i < count; ++i) {
    ++begin[bin(sample[i].lower[axis])];
    ++end[bin(sample[i].upper[axis]) + 1];
  }
  std::size_t below = 0, ended = 0, width = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    below += begin[i];
    ended += end[i];
    width = below == ended ? width + 1 : 0;
    const std::size_t smaller = std::min(below, count - below);
    const double gain = static_cast<double>(width * smaller);
    if (width < wanted || smaller < least || gain <= gap.gain * static_cast<double>(bins)) continue;
    gap.gain = gain / static_cast<double>(bins);
    gap.middle =
        key_of(low + (static_cast<float>(i + 1) - 0.5f * static_cast<float>(width)) / scale);
  }
  return gap;
}

}  // namespace

std::vector<std::size_t> GapPartition::sample(std::size_t boxes) {
  std::vector<std::size_t> sample;
  if (boxes < min_boxes) return sample;
  const std::size_t count = std::clamp(
      boxes / sample_fraction, std::min(min_sample, boxes / min_sample_fraction), max_sample);
  const std::size_t step = boxes / count;
  sample.reserve(count);
  for (std::size_t i = 0; i < count; ++i) sample.push_back(i * step + mix64(i) % step);
  return sample;
}

GapPartition::GapPartition(const Bounds& region, std::vector<KeyBox> sample) {
  cut(region, sample.data(), sample.size(), 0);
}

void GapPartition::locate(const KeyBox* key_boxes, std::size_t count,
                          std::uint32_t* parts) const noexcept {
  std::uint32_t at[batch] = {};
  bool crosses[batch] = {};
  for (int step = 0; step < depth_; ++step) {
    for (std::size_t i = 0; i < count; ++i) {
      const Node& node = nodes_[at[i]];
      const bool right = key_boxes[i].lower[node.axis] >= node.at;
      crosses[i] = crosses[i] | (!right & (key_boxes[i].upper[node.axis] >= node.at));
      at[i] = node.child[right ? 1 : 0];
    }
  }
  for (std::size_t i = 0; i < count; ++i) parts[i] = crosses[i] ? several : nodes_[at[i]].part;
}

std::uint32_t GapPartition::cut(const Bounds& region, KeyBox* sample, std::size_t count,
                                int depth) {
  const std::size_t least = std::max(count / min_part_fraction, min_part);
  Gap best;
  int axis = 0;
  for (int k = 0; k < 3 && count > min_expected_boxes; ++k) {
    const Gap gap = best_gap(sample, count, least, k);
    if (gap.gain <= best.gain) continue;
    best = gap;
    axis = k;
  }
  const auto left =
      static_cast<std::size_t>(std::partition(sample, sample + count,
                                              [&](const KeyBox& r) {
                                                return best.gain > 0 && r.lower[axis] < best.middle;
                                              }) -
                               sample);
  const auto here = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({});
  depth_ = std::max(depth_, depth);
  if (left == 0 || left == count) {
    nodes_[here].child[0] = nodes_[here].child[1] = here;
    nodes_[here].part = static_cast<std::uint32_t>(bounds_.size());
    bounds_.push_back(region);
    return here;
  }
  nodes_[here].at = best.middle;
  nodes_[here].axis = axis;
  // A gap between ghosts may lie outside the region: take the tighter bound.
  Bounds below = region, above = region;
  below.upper[axis] = std::min(region.upper[axis], best.middle);
  above.lower[axis] = std::max(region.lower[axis], best.middle);
  const std::uint32_t first = cut(below, sample, left, depth + 1);
  const std::uint32_t second = cut(above, sample + left, count - left, depth + 1);
  nodes_[here].child[0] = first;
  nodes_[here].child[1] = second;
  return here;
}

}  // namespace throng::mpi
