#include "live/cell_plan.hpp"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>

namespace throng::live {
namespace {

// Of so many boxes all are looked at for a plan; of more one in eight, but at least so many, and at
// most so many.
constexpr std::size_t whole_sample = 1536, least_sample = 512, most_sample = 4096;
constexpr double crowded = 4;
constexpr int most_halvings = 16;

float finite(float x) noexcept { return std::clamp(x, -FLT_MAX, FLT_MAX); }

// Of all of a sample that is whole, else of the first of it, in whose order there is none.
template <class Of>
double quantile(const List<CellPlan::Sampled>& sample, double q, Of&& of) noexcept {
  double some[whole_sample];
  const std::size_t n = std::min(sample.size(), whole_sample);
  for (std::size_t i = 0; i < n; ++i) some[i] = of(sample[i]);
  const auto at = static_cast<std::size_t>(q * static_cast<double>(n - 1));
  std::nth_element(some, some + at, some + n);
  return some[at];
}

// How likely two of the sample begin in the same of cells that are so long. Sorts it.
double together(List<CellPlan::Sampled>& sample, double length) noexcept {
  for (CellPlan::Sampled& s : sample) {
    s.cell = 0;
    for (const float lower : s.lower) {
      const auto place = std::bit_cast<std::uint64_t>(std::floor(lower / length) + 0.0);
      s.cell = (s.cell ^ place) * 0x9e3779b97f4a7c15u;
      s.cell ^= s.cell >> 29;
    }
  }
  std::sort(sample.begin(), sample.end(),
            [](const CellPlan::Sampled& x, const CellPlan::Sampled& y) { return x.cell < y.cell; });
  double twos = 0;
  for (std::size_t i = 0, same = 0; i + 1 < sample.size(); ++i) {
    same = sample[i].cell == sample[i + 1].cell ? same + 1 : 0;
    twos += static_cast<double>(same);
  }
  const auto n = static_cast<double>(sample.size());
  return sample.size() < 2 ? 0 : 2 * twos / (n * (n - 1));
}

// Equal boxes shall fit into the first class, and smaller ones shall share its cells until the cell
// of a box holds about one other: large boxes look into fewer then. Where boxes lie together in an
// empty world that is less than the world has room for.
void measure(List<CellPlan::Sampled>& sample, std::size_t boxes, CellPlan& plan) noexcept {
  if (sample.empty()) return;
  const auto side_of = [](const CellPlan::Sampled& s) { return s.side; };
  const double side = quantile(sample, 0.25, side_of) * 1.07;
  const double usual = quantile(sample, 0.5, side_of);
  const auto count = static_cast<double>(boxes);
  double volume = 1;
  for (int k = 0; k < 3; ++k) {
    const auto lower = [k](const CellPlan::Sampled& s) { return double{s.lower[k]}; };
    const double begin = quantile(sample, 0.05, lower);
    const double range = quantile(sample, 0.95, lower) - begin;
    const double length = std::max(std::max(range / 0.9, usual), 1e-30);
    plan.extent[k] = {begin - 0.05 * length, length};
    volume *= length;
  }
  plan.span = std::max(side, 0.5 * std::cbrt(volume / count));
  double crowding = count * together(sample, 2 * plan.span);
  for (int k = 0; k < most_halvings && crowding > crowded && plan.span > side; ++k) {
    plan.span = std::max(side, 0.5 * plan.span);
    crowding = count * together(sample, 2 * plan.span);
  }
  plan.crowded = crowding > crowded;
}

}  // namespace

CellPlan CellPlan::of(const Objects& objects, List<Sampled>& sample) {
  const std::size_t limit = objects.limit();
  const std::size_t wanted =
      limit <= whole_sample ? limit : std::clamp(limit / 8, least_sample, most_sample);
  sample.renew(wanted);
  std::size_t thin = 0;
  for (std::uint32_t i = 0; i < wanted; ++i) {
    // By the golden section: evenly, but in no steps of one length, as ids may have a rhythm. None
    // twice where there are three as many.
    const std::uint32_t part = i * 0x9e3779b9u;
    const std::uint64_t at = wanted == limit ? i : std::uint64_t{part} * limit >> 32;
    const auto id = static_cast<ObjectId>(at);
    if (!objects.is_active(id)) continue;
    const Box b = objects.grown(id);
    const float lower[3] = {finite(b.lower.x), finite(b.lower.y), finite(b.lower.z)};
    const float upper[3] = {finite(b.upper.x), finite(b.upper.y), finite(b.upper.z)};
    double side = 0, thickness = DBL_MAX;
    for (int k = 0; k < 3; ++k) {
      const double extent = double{upper[k]} - double{lower[k]};
      side = std::max(side, extent);
      thickness = std::min(thickness, extent);
    }
    if (thickness < side / (1 << thinner)) {
      side /= 1 << thinner;
      ++thin;
    }
    sample.push({side, {lower[0], lower[1], lower[2]}, 0});
  }
  CellPlan plan;
  plan.thin = thin > sample.size() / 2;
  measure(sample, std::max<std::size_t>(objects.count(), 1), plan);
  return plan;
}

}  // namespace throng::live
