// Gradient noise in space (Perlin 1985, with the smoother blend of 2002).
#pragma once

#include <cmath>
#include <cstdint>

#include <throng/checksum.hpp>

namespace throng::scenes {

class Noise {
 public:
  Noise(std::uint64_t seed, std::uint64_t channel) noexcept : key_(mix64(mix64(seed) ^ channel)) {}

  // From -1 to 1, 0 at lattice points, which are 1 apart; twice continuously differentiable.
  double operator()(double x, double y, double z) const noexcept {
    const double low[3] = {std::floor(x), std::floor(y), std::floor(z)};
    const double at[3] = {x - low[0], y - low[1], z - low[2]};
    double blend[3];
    for (int k = 0; k < 3; ++k) {
      const double t = at[k];
      blend[k] = t * t * t * (t * (t * 6 - 15) + 10);
    }
    double sum = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      std::uint64_t hash = key_;
      double offset[3], weight = 1;
      for (unsigned k = 0; k < 3; ++k) {
        const unsigned up = corner >> k & 1;
        offset[k] = at[k] - up;
        weight *= up != 0 ? blend[k] : 1 - blend[k];
        hash = mix64(hash ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(low[k]) + up));
      }
      sum += weight * along_gradient(hash, offset);
    }
    return sum;
  }

 private:
  // One of twelve gradients, towards the edges of a cube.
  static double along_gradient(std::uint64_t hash, const double (&p)[3]) noexcept {
    const auto edge = static_cast<unsigned>((hash >> 32) * 12 >> 32);
    const unsigned axis = edge / 4;  // the one along which the edge lies
    const double a = p[axis == 0 ? 1 : 0], b = p[axis == 2 ? 1 : 2];
    return (edge & 1 ? -a : a) + (edge & 2 ? -b : b);
  }

  std::uint64_t key_;
};

}  // namespace throng::scenes
