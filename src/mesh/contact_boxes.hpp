// Float boxes of moving vertices, and of the elements that they span.
#pragma once

#include <algorithm>
#include <limits>

#include <throng/types.hpp>

#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"

namespace throng::mesh {

// A box that overlaps nothing: that of a vertex that is not finite.
constexpr Box inactive_box = {{1, 1, 1}, {-1, -1, -1}};

// The bounds along one axis of a path from p to q, enlarged by radius: the largest float not above
// min(p, q) - radius, and the smallest not below max(p, q) + radius, both exactly. p, q and radius
// are finite. lower <= upper: if the float type cannot represent them, they are the largest float
// and infinity.
THRONG_HD inline void swept_bounds(double p, double q, double radius, float& lower,
                                   float& upper) noexcept {
  lower = base::subtract_rounded_down_to_float(p < q ? p : q, radius);
  upper = -base::subtract_rounded_down_to_float(p < q ? -q : -p, radius);
}

// The box of a vertex that moves from p to q; inactive_box if a coordinate is not finite. flat: z
// is 0.
THRONG_HD inline Box swept_vertex_box(const DoubleVec3& p, const DoubleVec3& q, double radius,
                                      bool flat) noexcept {
  // x - x is 0 for a finite x and NaN for others.
  double zero = (p.x - p.x) + (p.y - p.y) + (q.x - q.x) + (q.y - q.y);
  if (!flat) zero += (p.z - p.z) + (q.z - q.z);
  if (zero != 0) return inactive_box;
  Box box{};
  swept_bounds(p.x, q.x, radius, box.lower.x, box.upper.x);
  swept_bounds(p.y, q.y, radius, box.lower.y, box.upper.y);
  if (!flat) swept_bounds(p.z, q.z, radius, box.lower.z, box.upper.z);
  return box;
}

// The smallest box that contains two active ones. Rounding is monotonic: the union of the boxes of
// an element's vertices is the box of the least and largest coordinates of all of them, rounded.
THRONG_HD inline Box united(const Box& a, const Box& b) noexcept {
  const auto least = [](float s, float t) { return s < t ? s : t; };
  const auto most = [](float s, float t) { return s < t ? t : s; };
  return {{least(a.lower.x, b.lower.x), least(a.lower.y, b.lower.y), least(a.lower.z, b.lower.z)},
          {most(a.upper.x, b.upper.x), most(a.upper.y, b.upper.y), most(a.upper.z, b.upper.z)}};
}

}  // namespace throng::mesh
