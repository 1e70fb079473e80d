// Recursive coordinate bisection. Where a cut goes depends on sums of integers alone, so it is the
// same however the points are spread over ranks, and the same here as among ranks (balance.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "mpi/regions.hpp"

namespace throng::mpi {

// Where an object is, and what it costs.
struct Point {
  Key at[3];
  std::uint32_t weight;
};

// What is infinite lies everywhere, and tells nothing of where objects are.
THRONG_HD inline bool is_somewhere(const Reach& reach) noexcept {
  constexpr Key far = key_of(std::numeric_limits<float>::infinity());
  bool inside = true;
  for (int k = 0; k < 3; ++k) inside = inside && reach.lower[k] > -far && reach.upper[k] < far;
  return inside;
}
THRONG_HD constexpr std::uint32_t point_weight(std::uint64_t weight) noexcept {
  return weight < 1u << 20 ? static_cast<std::uint32_t>(weight) : 1u << 20;
}

// The extent of points along each axis, as one sum can merge it: the maxima of key and ~key.
struct Extent {
  std::int64_t highest[3], not_lowest[3];

  Extent() noexcept;
  void add(const Point& point) noexcept;
  bool empty() const noexcept { return highest[0] < ~not_lowest[0]; }
  // The axis along which the points reach farthest; of equal ones the first.
  int longest() const noexcept;
};

// Finds the cut that leaves `left` of `parts` of the weight below it, as nearly as the points
// allow. A round narrows the range of keys by 256, so there are at most five.
class CutSearch {
 public:
  static constexpr std::size_t bins = 256;
  using Histogram = std::array<std::uint64_t, bins>;

  CutSearch(const Extent& extent, int axis, int left, int parts) noexcept;

  // Adds the weights of these points to the bins of this round.
  void count(const Point* points, std::size_t count, Histogram& histogram) const noexcept;
  // Takes the sum over all points; false: the cut is found.
  bool narrow(const Histogram& histogram) noexcept;
  Cut cut() const noexcept { return cut_; }

 private:
  Cut cut_;
  int left_, parts_;
  bool first_ = true;
  std::int64_t low_, width_;
  std::uint64_t below_ = 0, target_ = 0, enough_ = 0;
};

// Puts the points left of the cut first; tells how many.
std::size_t split(Point* points, std::size_t count, const Cut& cut) noexcept;

// Cuts space for `ranks` ranks by all these points, whose order changes.
Regions bisect(Point* points, std::size_t count, int ranks);

}  // namespace throng::mpi
