#include "tracking/cell_map.hpp"

#include <algorithm>
#include <cmath>

namespace throng::tracking {
namespace {

constexpr std::size_t max_buckets = std::size_t{1} << 30;

}  // namespace

// Dense numbering where there are at most two cells per box; otherwise about one bucket per box.
// Each world starts at a different bucket. At one to two boxes per cell most boxes are in the
// bucket's own line, and the lines stay in the cache.
void CellMap::assign_storage(const CellPlan& plan, std::size_t objects) noexcept {
  scale_ = static_cast<float>(std::clamp((1 << span_bits) / plan.span, 1e-30, 1e30));
  // 27 cells of one or two boxes rather than 8 of many, which would have long chains.
  cell_bits_ = plan.clustered ? 4 : 5;
  thin_ = plan.thin;
  top_ = classes - 1;
  spans_ = {};
  const auto limit = static_cast<double>(std::clamp<std::size_t>(objects, 64, max_buckets));
  double cells[3], all = 1;
  for (int k = 0; k < 3; ++k) {
    cells[k] = std::floor(units(plan.extent[k].length) / (1 << cell_bits_)) + 2;
    all *= cells[k];
  }
  const bool full = all <= 2 * limit;
  buckets_ = static_cast<std::uint32_t>(
      std::max(full ? all : 1.4 * limit, plan.worlds ? 1.4 * limit : limit / 2));
  std::uint32_t stride = 1;
  for (int k = 0; k < 3; ++k) {
    Axis& axis = axis_[k];
    axis.period = full ? static_cast<std::uint32_t>(cells[k]) : k == 0 ? buckets_ : 0;
    axis.stride = stride;
    axis.period_bias = static_cast<std::uint32_t>(k)
                       << 30;  // if hashed, only distinguishes y from z
    if (axis.period == 0) continue;
    stride *= axis.period;
    const double most = max_units;
    axis.origin = static_cast<std::int32_t>(std::clamp(units(plan.extent[k].begin), -most, most)) -
                  (1 << cell_bits_);
    axis.period_bias = ((1u << 26) / axis.period + 1) * axis.period;
  }
}

}  // namespace throng::tracking
