// The price of searching with a grid: statistics of the boxes and a number of columns in, expected
// time out. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/cost_table.hpp"
#include "base/quantize.hpp"
#include "grid/plan/stats.hpp"

namespace throng::grid {

using base::SweepCost;

// Prices of all grids that sweep along one axis.
class GridPrices {
 public:
  GridPrices(const Stats& stats, const SweepCost& sweep_cost, std::uint32_t sweep_axis) noexcept;

  struct Price {
    double ns;        // on one thread
    double replicas;  // columns per box
    double parts;     // columns along the sweep axis
    double window;    // boxes that begin within one
  };
  // Of a grid with `columns` columns along each of the two axes after the sweep axis.
  Price operator()(std::uint32_t columns_y, std::uint32_t columns_z) const noexcept;
  // A lower bound for all grids with at least so many columns.
  double least_ns(std::uint32_t columns_y, std::uint32_t columns_z) const noexcept;

  // Limits of every grid.
  bool allows(std::uint32_t columns_y, std::uint32_t columns_z) const noexcept {
    return static_cast<double>(columns_y) * columns_z <= max_columns_ &&
           (columns_y == 1 || may_divide_[0]) && (columns_z == 1 || may_divide_[1]);
  }
  // Whether the axis `k` + 1 after the sweep axis may have more than one column.
  bool may_divide(int k) const noexcept { return may_divide_[k]; }

 private:
  static double length_of(const Stats& s, std::uint32_t axis) noexcept {
    return std::max(double{s.upper[axis]} - double{s.lower[axis]}, least_length);
  }
  // Along an axis of zero range all boxes overlap: it is neither swept nor divided.
  static double share_of(const Stats& s, std::uint32_t axis) noexcept {
    const double range = double{s.upper[axis]} - double{s.lower[axis]};
    return range > 0 ? s.extent[axis] / length_of(s, axis) : 1.0;
  }
  double replicas(std::uint32_t columns_y, std::uint32_t columns_z) const noexcept;
  double occupied_columns(std::uint32_t columns_y, std::uint32_t columns_z) const noexcept;

  const Stats& stats_;
  const SweepCost sweep_cost_;
  const std::uint32_t axes_[3];  // the sweep axis first
  double boxes_, queries_, max_columns_;
  // Mean extents as fractions of the range: along the sweep axis, the two others, and their mean
  // product.
  double share_x_, share_y_, share_z_, share_yz_;
  double window_;  // the fraction of a column's boxes that begin within one of them
  double layers_[2];
  double wanted_parts_, max_parts_;
  bool may_divide_[2];
};

inline GridPrices::GridPrices(const Stats& s, const SweepCost& sweep_cost,
                              std::uint32_t sweep_axis) noexcept
    : stats_(s),
      sweep_cost_(sweep_cost),
      axes_{sweep_axis, (sweep_axis + 1) % 3, (sweep_axis + 2) % 3},
      boxes_(static_cast<double>(s.target_count)),
      queries_(static_cast<double>(s.query_count)),
      max_columns_(std::clamp(boxes_ / 48, 1.0, double{1u << 17})) {
  const auto [x, y, z] = axes_;
  share_x_ = std::min(1.0, share_of(s, x));
  share_y_ = share_of(s, y);
  share_z_ = share_of(s, z);
  share_yz_ = s.product[x] / (length_of(s, y) * length_of(s, z));
  window_ = std::min(1.0, share_x_ + s.layer_overlap[x]);
  if (s.clustered) {
    const double slabs = std::clamp(1 / std::max(share_x_, 1e-9), 1.0, 1e9);
    const double effective_slabs = s.effective_slabs_at(x, static_cast<std::uint32_t>(slabs));
    window_ = std::min(1.0, s.joint_correlation / (s.axis_correlation[x] * effective_slabs));
  }
  for (int k = 0; k < 2; ++k) {
    layers_[k] = 1 / std::max(s.layer_overlap[axes_[k + 1]], 1e-9);
    may_divide_[k] = share_of(s, axes_[k + 1]) < 1;
  }
  // Each tie reads the floats: an extent should be some quantization steps long.
  const double extent = base::steps_per_column * std::max(share_x_, 1e-9);
  wanted_parts_ = std::ceil(base::cost.extent_steps / extent);
  max_parts_ = std::min(4096.0, std::floor(0.125 / std::max(share_x_, 1e-9)) + 1);
}

// A box crosses a fraction of the boundaries between columns: its extent's fraction of the range.
inline double GridPrices::replicas(std::uint32_t columns_y,
                                   std::uint32_t columns_z) const noexcept {
  const double y = columns_y - 1, z = columns_z - 1;
  return 1 + share_y_ * y + share_z_ * z + share_yz_ * y * z;
}

inline double GridPrices::least_ns(std::uint32_t columns_y,
                                   std::uint32_t columns_z) const noexcept {
  const double record_ns = base::cost.record_ns + sweep_cost_(0);
  return queries_ * (base::cost.box_ns - base::cost.replica_ns +
                     replicas(columns_y, columns_z) * (base::cost.replica_ns + record_ns)) +
         base::cost.empty_ns * columns_y * columns_z;
}

// Of the columns across the sweep axis, the number that hold boxes, derived from the probability
// that two boxes share one. Without clustering, at most the number of layers per axis; boxes
// slightly clustered, but in all columns, have correspondingly more neighbours.
inline double GridPrices::occupied_columns(std::uint32_t columns_y,
                                           std::uint32_t columns_z) const noexcept {
  if (!stats_.clustered) {
    const double y = std::min(layers_[0], static_cast<double>(columns_y));
    const double z = std::min(layers_[1], static_cast<double>(columns_z));
    return y * z / stats_.density_ratio;
  }
  const double y = stats_.effective_slabs_at(axes_[1], columns_y);
  const double z = stats_.effective_slabs_at(axes_[2], columns_z);
  return std::max({y, z, y * z / stats_.axis_correlation[axes_[0]]});
}

inline GridPrices::Price GridPrices::operator()(std::uint32_t columns_y,
                                                std::uint32_t columns_z) const noexcept {
  const double sections = static_cast<double>(columns_y) * columns_z;
  const double most_parts = std::min(max_parts_, std::floor(max_columns_ / sections));
  const double parts = std::max(1.0, std::min(wanted_parts_, most_parts));
  const double across = replicas(columns_y, columns_z);
  const double total = across * (1 + share_x_ * (parts - 1));
  const double occupied = occupied_columns(columns_y, columns_z);
  const double window = boxes_ * across / occupied * window_;
  const double record_ns = base::cost.record_ns + sweep_cost_(window);
  const double ns =
      queries_ * (base::cost.box_ns + base::cost.replica_ns * (total - 1) + total * record_ns) +
      (base::cost.empty_ns * sections + (base::cost.column_ns - base::cost.empty_ns) * occupied) *
          parts;
  return {ns, total, parts, window};
}

}  // namespace throng::grid
