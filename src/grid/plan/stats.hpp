// The statistics of all boxes that the planner needs, estimated from a sample.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

namespace throng::grid {

constexpr std::uint32_t max_sample = 512;
// Shorter ranges count as this long. Below the least float, as boxes may be that small.
constexpr double least_length = 1e-44;

// Statistics of all boxes, estimated from a sample.
struct Stats {
  std::uint64_t query_count = 0;   // searching boxes: all, or those that are not static
  std::uint64_t target_count = 0;  // boxes that are searched
  double comparisons = 0;          // of brute force
  // Axes for which the values below are positions by bits (base/quantize.hpp) around a centre,
  // instead of coordinates.
  bool by_bits[3] = {false, false, false};
  float centre[3] = {0, 0, 0};
  float lower[3] = {0, 0, 0};  // range of nearly all boxes; outliers are excluded
  float upper[3] = {0, 0, 0};
  double extent[3] = {0, 0, 0};   // mean extent along each axis, clipped to that range
  double product[3] = {0, 0, 0};  // mean product of the extents along the two other axes
  // Density: neighbours per box, relative to boxes spread evenly over the range.
  double density_ratio = 1;

  // If boxes are clustered, the density depends on the axes. `effective_slabs`: of 2^r slabs along
  // an axis, the number of equally full slabs that gives the same probability that two boxes share
  // one.
  // `*_correlation`: how many times greater the probability is that two boxes share a cell across
  // an axis, or of all three axes, than the product of the axes' own probabilities.
  bool clustered = false;
  static constexpr int levels = 8;
  double effective_slabs[3][levels] = {};
  double axis_correlation[3] = {1, 1, 1}, joint_correlation = 1;
  // If boxes are not clustered: the fraction of boxes that begin within another box along an axis,
  // minus the fraction that their extents explain, if that at least doubles it, as in layers; else
  // 0.
  double layer_overlap[3] = {0, 0, 0};

  // The same for any number of slabs.
  double effective_slabs_at(std::uint32_t axis, std::uint32_t slabs) const noexcept;
};

// Computes the statistics of `count` <= max_sample active boxes.
Stats measure(const Box* sample, std::uint32_t count, std::uint64_t query_count,
              std::uint64_t target_count) noexcept;

}  // namespace throng::grid
