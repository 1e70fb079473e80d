// The least there is to send, for cuts of a cube into boxes of equal volume.
#pragma once

#include <algorithm>
#include <cmath>

namespace throng::mpi {

// Copies a box of unit cubes anywhere in a cube of this side: those whose lower corner is in
// another region. No parts have less area between them than cubes of their volume, as if they
// filled the cube; two and three parts need one plane, and one and two thirds.
inline double least_copies(int ranks, double side) noexcept {
  const double planes = ranks == 1 ? 0 : ranks == 3 ? 5.0 / 3 : 1;
  return std::max(planes / side, std::pow(1 + (std::cbrt(ranks) - 1) / side, 3) - 1);
}

}  // namespace throng::mpi
