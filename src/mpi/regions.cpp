#include "mpi/regions.hpp"

namespace throng::mpi {

Bounds Regions::bounds(int begin, int end) const noexcept {
  constexpr Key first = std::numeric_limits<Key>::min(), last = std::numeric_limits<Key>::max();
  Bounds bounds = {{first, first, first}, {last, last, last}};
  int b = 0, e = count();
  while (b != begin || e != end) {
    const int m = middle(b, e);
    const Cut& c = cut(m);
    // A cut of an empty node may lie outside the remaining bounds: take the tighter bound.
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
