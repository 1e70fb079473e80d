// A lower bound on copies, for partitions of a cube into regions of equal volume.
#pragma once

#include <algorithm>
#include <cmath>

namespace throng::mpi {

// Copies per box for unit cubes placed at random in a cube of side `side`; a copy is a box that
// overlaps a region other than that of its lower corner. The area between parts is least if they
// are cubes; two and three parts need 1 and 5/3 planes.
inline double minimum_copies(int ranks, double side) noexcept {
  const double planes = ranks == 1 ? 0 : ranks == 3 ? 5.0 / 3 : 1;
  return std::max(planes / side, std::pow(1 + (std::cbrt(ranks) - 1) / side, 3) - 1);
}

}  // namespace throng::mpi
