#include "mpi/regions.hpp"

#include <cmath>

#include <throng/find_pairs.hpp>

namespace throng::mpi {

// A margin: the difference in doubles is off by at most half a unit, so that of the next double
// down is below the exact one, and rounding that down to float stays there. It may be a float more
// than the search's own rounding gives: only where a box is sent depends on it, never what is a
// pair.
Reach reach_of(const Box& box, float margin) noexcept {
  constexpr Reach nothing = {{1, 1, 1}, {0, 0, 0}};
  if (!(box.lower.x <= box.upper.x && box.lower.y <= box.upper.y && box.lower.z <= box.upper.z)) {
    return nothing;
  }
  Box b = box;
  if (margin > 0) {
    const double m = static_cast<double>(margin), far = std::numeric_limits<double>::infinity();
    const auto down = [&](float x) { return std::nextafter(static_cast<double>(x) - m, -far); };
    const auto up = [&](float x) { return std::nextafter(static_cast<double>(x) + m, far); };
    const double lower[3] = {down(b.lower.x), down(b.lower.y), down(b.lower.z)};
    const double upper[3] = {up(b.upper.x), up(b.upper.y), up(b.upper.z)};
    b = round_outward(lower, upper);
  }
  return {{key_of(b.lower.x), key_of(b.lower.y), key_of(b.lower.z)},
          {key_of(b.upper.x), key_of(b.upper.y), key_of(b.upper.z)}};
}

Bounds Regions::bounds(int begin, int end) const noexcept {
  constexpr Key first = std::numeric_limits<Key>::min(), last = std::numeric_limits<Key>::max();
  Bounds bounds = {{first, first, first}, {last, last, last}};
  int b = 0, e = count();
  while (b != begin || e != end) {
    const int m = middle(b, e);
    const Cut& c = cut(m);
    // A cut of an empty node may lie outside of what is left: take the tighter bound.
    if (end <= m) {
      if (c.at < bounds.upper[c.axis]) bounds.upper[c.axis] = c.at;
      e = m;
    } else {
      if (c.at > bounds.lower[c.axis]) bounds.lower[c.axis] = c.at;
      b = m;
    }
  }
  return bounds;
}

}  // namespace throng::mpi
