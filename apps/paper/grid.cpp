#include "apps/paper/grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace throng::paper {
namespace {

void widen(float x, float& lower, float& upper) {
  if (!std::isfinite(x)) return;
  lower = std::min(lower, x);
  upper = std::max(upper, x);
}

// Any positive finite scale keeps the proof; values out of float's range are clamped to it.
float to_scale(double x) {
  constexpr double low = std::numeric_limits<float>::min(),
                   high = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(x, low, high));
}

}  // namespace

Box environment_of(const Box* boxes, std::uint64_t n) noexcept {
  constexpr float none = std::numeric_limits<float>::infinity();
  Box around{{none, none, none}, {-none, -none, -none}};
  for (std::uint64_t i = 0; i < n; ++i) {
    const Box& box = boxes[i];
    if (!base::is_active(box)) continue;
    for (const Vec3& corner : {box.lower, box.upper}) {
      widen(corner.x, around.lower.x, around.upper.x);
      widen(corner.y, around.lower.y, around.upper.y);
      widen(corner.z, around.lower.z, around.upper.z);
    }
  }
  if (!(around.lower.x <= around.upper.x)) around.lower.x = around.upper.x = 0;
  if (!(around.lower.y <= around.upper.y)) around.lower.y = around.upper.y = 0;
  if (!(around.lower.z <= around.upper.z)) around.lower.z = around.upper.z = 0;
  return around;
}

// The paper: density d = n / volume, cell volume X / d, side the cube root of that, then an integer
// number of cells on each axis. Where the environment is thinner than such a cell on an axis (or
// flat: then it has no volume), it gets one cell there, and the other axes are treated as an area
// or a length in the same way. This increases the side to s': with thickness t < s, s^3 = t * area
// * X/n and s'^2 = area * X/n = s^3 / t > s^2. Cell counts are rounded down, so there are at most
// volume / s^3 = n / X of them, or one where that is less than one.
GridShape make_grid(const Box& environment, std::uint64_t n, double per_cell) noexcept {
  const float lower[3] = {environment.lower.x, environment.lower.y, environment.lower.z};
  const float upper[3] = {environment.upper.x, environment.upper.y, environment.upper.z};
  GridShape shape;
  double length[3] = {};
  bool divided[3] = {};
  for (int axis = 0; axis < 3; ++axis) {
    shape.origin[axis] = lower[axis];
    length[axis] = static_cast<double>(upper[axis]) - static_cast<double>(lower[axis]);
    divided[axis] = n > 0 && length[axis] > 0;
  }
  double side = 0;
  for (bool thin = true; thin;) {
    thin = false;
    double volume = 1;
    int axes = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!divided[axis]) continue;
      volume *= length[axis];
      ++axes;
    }
    if (axes == 0) break;
    const double density = static_cast<double>(n) / volume;
    const double cell_volume = per_cell / density;
    side = axes == 3 ? std::cbrt(cell_volume) : axes == 2 ? std::sqrt(cell_volume) : cell_volume;
    for (int axis = 0; axis < 3; ++axis) {
      if (!divided[axis] || length[axis] >= side) continue;
      divided[axis] = false;
      thin = true;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (length[axis] <= 0) continue;
    if (divided[axis]) {
      const double cells = std::floor(length[axis] / side);
      shape.cells[axis] = static_cast<std::uint32_t>(
          std::clamp(cells, 1.0, static_cast<double>(max_cells_per_axis)));
    }
    shape.scale[axis] = to_scale(shape.cells[axis] / length[axis]);
  }
  return shape;
}

}  // namespace throng::paper
