// Stateless random numbers from (seed, i, k).
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <throng/checksum.hpp>

namespace throng::scenes {

// [0, 1), 32 bits of it.
constexpr double unit(std::uint64_t bits) noexcept {
  return static_cast<double>(bits >> 32) * 0x1p-32;
}
constexpr double unit_low(std::uint64_t bits) noexcept { return unit(bits << 32); }

// Counter-based: word k of box i is output number 8 i + k of a splitmix64 stream.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t scene) noexcept : key_(mix64(mix64(seed) ^ scene)) {}

  std::uint64_t word(std::uint64_t i, unsigned k) const noexcept {
    return mix64(key_ + (8 * i + k) * 0x9e3779b97f4a7c15ull);
  }

  // Evenly spaced over [0, 1) for any run of i, so shares and sizes are as specified at every n.
  // The step is the golden ratio's, so neighbours in i are far apart in value.
  double even(std::uint64_t i) const noexcept { return unit(key_ + i * 0x9e3779b97f4a7c15ull); }

 private:
  std::uint64_t key_;
};

// The position of a point that moved to x on a track of length `span` with reflecting walls.
inline double reflect(double x, double span) noexcept {
  if (!(span > 0)) return 0;
  const double lap = 2 * span;
  x -= static_cast<double>(static_cast<std::int64_t>(x / lap)) * lap;  // into (-lap, lap)
  if (x < 0) x = -x;  // the reflected path, mirrored
  if (x > span) x = lap - x;
  return x < 0 ? 0 : x > span ? span : x;
}

// 2^x for x in [0, 63), by its series: independent of the math library's rounding. Good to 1e-10.
inline double portable_exp2(double x) noexcept {
  const int octave = static_cast<int>(x);
  const double t = (x - octave) * 0.69314718055994531;
  constexpr double inverse[12] = {1.0,     1.0 / 2, 1.0 / 3, 1.0 / 4,  1.0 / 5,  1.0 / 6,
                                  1.0 / 7, 1.0 / 8, 1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12};
  double sum = 1;
  for (int k = 11; k >= 0; --k) sum = 1 + t * inverse[k] * sum;
  return sum * static_cast<double>(std::uint64_t{1} << octave);
}

struct SineCosine {
  double sine, cosine;
};

// Of an angle in turns, by their series: independent of the math library's rounding. Good to 1e-14.
inline SineCosine portable_sine_cosine(double turns) noexcept {
  turns -= std::floor(turns);
  const double quarters = std::floor(4 * turns + 0.5);
  const double x = (turns - quarters / 4) * 6.283185307179586, y = x * x;
  double sine = 0, cosine = 0;
  for (int k = 8; k >= 0; --k) {
    sine = 1 - y / ((2 * k + 2) * (2 * k + 3)) * (k == 8 ? 1.0 : sine);
    cosine = 1 - y / ((2 * k + 1) * (2 * k + 2)) * (k == 8 ? 1.0 : cosine);
  }
  sine *= x;
  switch (static_cast<int>(quarters) % 4) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

inline double cube_root(double x) noexcept {
  if (!(x > 0)) return 0;
  double r = x > 1 ? x : 1;  // from above, Newton's steps decrease until convergence
  for (;;) {
    const double next = (2 * r + x / (r * r)) / 3;
    if (!(next < r)) return r;
    r = next;
  }
}

}  // namespace throng::scenes
