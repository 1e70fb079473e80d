#include "tracking/cell_plan.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/bounds.hpp"
#include "base/cost_table.hpp"

namespace throng::tracking {
namespace {

// Sample size: all boxes up to `full_sample`; otherwise one in eight within these bounds.
constexpr std::size_t full_sample = 1536, min_sample = 512, max_sample = 4096;
// Boxes per cell of two spans above which cells are made smaller: two full lines.
constexpr double max_occupancy = 4;
constexpr int max_halvings = 16;
// Rounding may lengthen a box by one unit, a sixteenth of a span.
constexpr double fit_factor = 1.07;

// Of a complete sample, or of its first part, whose order is random.
template <class Of>
double quantile(const PodVector<CellPlan::Sampled>& sample, double q, Of&& of) noexcept {
  double some[full_sample];
  const std::size_t n = std::min(sample.size(), full_sample);
  for (std::size_t i = 0; i < n; ++i) some[i] = of(sample[i]);
  const auto at = static_cast<std::size_t>(q * static_cast<double>(n - 1));
  std::nth_element(some, some + at, some + n);
  return some[at];
}

double side_of(const CellPlan::Sampled& s) noexcept { return s.side; }

// Probability that two sampled boxes have the same world and the same cell of this length (0: one
// cell for all). Sorts the sample.
double same_cell_probability(PodVector<CellPlan::Sampled>& sample, double length) noexcept {
  for (CellPlan::Sampled& s : sample) {
    s.cell = static_cast<std::uint32_t>(s.world);
    for (const float lower : s.lower) {
      const double cell = length == 0 ? 0 : std::floor(lower / length) + 0.0;
      s.cell = (s.cell ^ std::bit_cast<std::uint64_t>(cell)) * 0x9e3779b97f4a7c15u;
      s.cell ^= s.cell >> 29;
    }
  }
  std::sort(sample.begin(), sample.end(),
            [](const CellPlan::Sampled& x, const CellPlan::Sampled& y) { return x.cell < y.cell; });
  double equal_pairs = 0;
  for (std::size_t i = 0, same = 0; i + 1 < sample.size(); ++i) {
    same = sample[i].cell == sample[i + 1].cell ? same + 1 : 0;
    equal_pairs += static_cast<double>(same);
  }
  const auto n = static_cast<double>(sample.size());
  return sample.size() < 2 ? 0 : 2 * equal_pairs / (n * (n - 1));
}

// Models the cost of a search, in lines, as a function of the cell size: for the sampled box sizes,
// at uniform density. Visiting a cell costs one line more than its chain, and each class has a
// fixed cost.
class SearchCost {
 public:
  // Span candidates: `base` times 2^(step / steps).
  static constexpr int steps = 4, min_step = -2, max_step = 8;

  SearchCost(const PodVector<CellPlan::Sampled>& sample, double base, double density, double boxes,
             const CellPlan& plan) noexcept
      : base_(base), density_(density), boxes_(boxes), plan_(plan) {
    const std::size_t n = std::min(sample.size(), sample_limit);
    const double one = 1 / static_cast<double>(n);
    // Excludes the few boxes that are so long that they visit much of the occupied region.
    const double longest = quantile(sample, 0.98, side_of);
    for (std::size_t i = 0; i < n; ++i) {
      const double step = std::ceil(steps * std::log2(sample[i].side * fit_factor / base));
      class_share_[static_cast<int>(std::clamp(step, double{min_step}, double{last_step})) -
                   min_step] += one;
      double e[3];
      for (int k = 0; k < 3; ++k) e[k] = std::min(double{sample[i].extent[k]}, longest);
      sums_ += one * (e[0] + e[1] + e[2]);
      areas_ += one * (e[0] * e[1] + e[1] * e[2] + e[2] * e[0]);
      volumes_ += one * e[0] * e[1] * e[2];
    }
  }

  double span(int step) const noexcept { return base_ * std::exp2(step / double{steps}); }

  double operator()(int step, bool clustered) const noexcept {
    double length = span(step) * (clustered ? 1 : 2), buckets = 1;
    for (const CellPlan::Extent& e : plan_.extent) buckets *= std::floor(e.length / length) + 2;
    // As in CellMap::assign_storage().
    const bool full = buckets <= 2 * boxes_ && !plan_.worlds;
    const double boxes_per_bucket = full ? boxes_ / buckets : 1 / 1.4;
    double cost = 0;
    int k = 0;
    for (int c = 0; k < share_count; ++c, length *= 2) {
      double share = 0;
      for (; k < share_count && k + min_step <= step + steps * c; ++k) share += class_share_[k];
      if (share == 0) continue;
      const double own_boxes = share * density_ * length * length * length;
      const double others = (full ? 1 - share : 1) * boxes_per_bucket;
      cost += base::cost.class_lines + cells(length, clustered) * (1 + lines(own_boxes + others));
    }
    return cost;
  }

 private:
  static constexpr std::size_t sample_limit = 512;
  static constexpr int last_step = 64, share_count = last_step - min_step + 1;

  // Average number of cells of a class that a search visits: per axis the length of a box in cells,
  // plus 1.5, or 2.
  double cells(double length, bool clustered) const noexcept {
    const double more = clustered ? 2 : 1.5;
    return more * more * more +
           (more * more * sums_ + (more * areas_ + volumes_ / length) / length) / length;
  }
  // Average lines per bucket for this average number of boxes, two per line, at random positions.
  static double lines(double boxes) noexcept {
    return boxes / 2 + (1 - std::exp(-2 * boxes)) / 4 + std::exp(-boxes);
  }

  double base_, density_, boxes_;
  const CellPlan& plan_;
  double class_share_[share_count] = {};       // by the first step whose span holds a box
  double sums_ = 0, areas_ = 0, volumes_ = 0;  // averages over box extents
};

// Mixed sizes may be cheaper with other cells than those of the median box.
void adapt(const PodVector<CellPlan::Sampled>& sample, double density, double boxes,
           CellPlan& plan) noexcept {
  const SearchCost cost(sample, plan.span, density, boxes, plan);
  double best = cost(0, plan.clustered), span = plan.span;
  for (const bool clustered : {false, true}) {
    for (int step = SearchCost::min_step; step <= SearchCost::max_step; ++step) {
      const double now = cost(step, clustered);
      if (!(now < best)) continue;
      best = now;
      span = cost.span(step);
      plan.clustered = clustered;
    }
  }
  plan.span = span;
}

// Equal boxes fit into the first class. Smaller ones share its cells until a box's cell holds about
// one other box, so that large boxes visit fewer cells. Clustered boxes need smaller cells than the
// average density suggests.
void measure(PodVector<CellPlan::Sampled>& sample, std::size_t boxes, CellPlan& plan) noexcept {
  if (sample.empty()) return;
  const double side = quantile(sample, 0.25, side_of) * fit_factor;
  const double median_side = quantile(sample, 0.5, side_of);
  const auto count = static_cast<double>(boxes);
  double volume = 1;
  for (int k = 0; k < 3; ++k) {
    const auto lower = [k](const CellPlan::Sampled& s) { return double{s.lower[k]}; };
    const double begin = quantile(sample, 0.05, lower);
    const double range = quantile(sample, 0.95, lower) - begin;
    const double length = std::max(std::max(range / 0.9, median_side), 1e-30);
    plan.extent[k] = {begin - 0.05 * length, length};
    volume *= length;
  }
  // Worlds at the same place multiply the volume. Computed here because it sorts the sample by
  // world; the quantiles above need the original order.
  if (plan.worlds) volume /= std::max(same_cell_probability(sample, 0), 1 / count);
  plan.span = std::max(side, 0.5 * std::cbrt(volume / count));
  double occupancy = count * same_cell_probability(sample, 2 * plan.span);
  for (int k = 0; k < max_halvings && occupancy > max_occupancy && plan.span > side; ++k) {
    plan.span = std::max(side, 0.5 * plan.span);
    occupancy = count * same_cell_probability(sample, 2 * plan.span);
  }
  plan.clustered = occupancy > max_occupancy;
  // A search visits 8 cells of two spans, or 27 of one.
  plan.expected_comparisons = (plan.clustered ? 27.0 / 8 : 8) * occupancy;
  if (plan.span < CellPlan::min_span)
    plan.expected_comparisons = std::numeric_limits<double>::max();
  const bool one_class =
      std::all_of(sample.begin(), sample.end(), [&](const auto& s) { return s.side <= plan.span; });
  if (plan.thin || one_class) return;
  adapt(sample, std::max(occupancy / std::pow(2 * plan.span, 3), count / volume), count, plan);
}

}  // namespace

CellPlan CellPlan::of(const Objects& objects, PodVector<Sampled>& sample) {
  const bool sparse = objects.sparse();
  const std::size_t limit = sparse ? objects.alive_ids().size() : objects.limit();
  const std::size_t wanted =
      limit <= full_sample ? limit : std::clamp(limit / 8, min_sample, max_sample);
  sample.reserve_discard(wanted);
  CellPlan plan;
  plan.worlds = objects.in_worlds() != 0;
  std::size_t thin = 0;
  for (std::uint32_t i = 0; i < wanted; ++i) {
    // Golden-ratio sequence: evenly spread, without a fixed stride that could match a pattern of
    // the ids. No id occurs twice if there are three times as many.
    const std::uint32_t part = i * 0x9e3779b9u;
    const std::uint64_t at = wanted == limit ? i : std::uint64_t{part} * limit >> 32;
    const auto id = sparse ? objects.alive_ids()[at] : static_cast<ObjectId>(at);
    if (!objects.is_active(id)) continue;
    const Box b = objects.expanded(id);
    const float lower[3] = {base::clamp_finite(b.lower.x), base::clamp_finite(b.lower.y),
                            base::clamp_finite(b.lower.z)};
    const float upper[3] = {base::clamp_finite(b.upper.x), base::clamp_finite(b.upper.y),
                            base::clamp_finite(b.upper.z)};
    double side = 0, thickness = std::numeric_limits<double>::max();
    for (int k = 0; k < 3; ++k) {
      const double extent = double{upper[k]} - double{lower[k]};
      side = std::max(side, extent);
      thickness = std::min(thickness, extent);
    }
    if (thickness < side / (1 << thin_levels)) {
      side /= 1 << thin_levels;
      ++thin;
    }
    Sampled s{side, {}, {}, plan.worlds ? objects.filter(id).world : -1, 0};
    for (int k = 0; k < 3; ++k) {
      s.lower[k] = lower[k];
      s.extent[k] = base::clamp_finite(upper[k] - lower[k]);
    }
    sample.push(s);
  }
  plan.thin = thin > sample.size() / 2;
  measure(sample, std::max<std::size_t>(objects.count(), 1), plan);
  return plan;
}

}  // namespace throng::tracking
