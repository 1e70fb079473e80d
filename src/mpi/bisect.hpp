// Recursive coordinate bisection. A cut depends only on integer sums, so it is independent of the
// distribution of points over ranks, and equal to that computed across ranks (balance.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "mpi/regions.hpp"

namespace throng::mpi {

// The position and cost of an object.
struct Point {
  Key at[3];
  std::uint32_t weight;
};

// Infinite boxes overlap everything and carry no position, so they are excluded.
THRONG_HD inline bool is_finite(const KeyBox& key_box) noexcept {
  constexpr Key far = key_of(std::numeric_limits<float>::infinity());
  bool inside = true;
  for (int k = 0; k < 3; ++k) inside = inside && key_box.lower[k] > -far && key_box.upper[k] < far;
  return inside;
}
THRONG_HD constexpr std::uint32_t point_weight(std::uint64_t weight) noexcept {
  return weight < 1u << 20 ? static_cast<std::uint32_t>(weight) : 1u << 20;
}

// The extent of points per axis as maxima of key and ~key, which one max-reduction can merge.
struct Extent {
  std::int64_t highest[3], not_lowest[3];

  Extent() noexcept;
  void add(const Point& point) noexcept;
  bool empty() const noexcept { return highest[0] < ~not_lowest[0]; }
  // The axis of the largest extent; of equal ones the first.
  int longest() const noexcept;
};

// Finds the cut with `left` of `parts` of the weight below it, as closely as the points allow. Each
// round narrows the key range by a factor of 256, so there are at most five.
class CutSearch {
 public:
  static constexpr std::size_t bins = 256;
  using Histogram = std::array<std::uint64_t, bins>;

  CutSearch(const Extent& extent, int axis, int left, int parts) noexcept;

  // Adds the points' weights to the histogram of this round.
  void count(const Point* points, std::size_t count, Histogram& histogram) const noexcept;
  // Takes the histogram over all points; returns false when the cut is found.
  bool narrow(const Histogram& histogram) noexcept;
  Cut cut() const noexcept { return cut_; }

 private:
  Cut cut_;
  int left_, parts_;
  bool first_ = true;
  std::int64_t low_, width_;
  std::uint64_t below_ = 0, target_ = 0, enough_ = 0;
};

// Moves the points left of the cut to the front; returns their number.
std::size_t split(Point* points, std::size_t count, const Cut& cut) noexcept;

// Partitions space for `ranks` ranks by these points; reorders them.
Regions bisect(Point* points, std::size_t count, int ranks);

}  // namespace throng::mpi
