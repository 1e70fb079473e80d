// Deterministic random numbers: integers, and floats made from them by exact operations only, so
// that a seed gives the same boxes with every compiler.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <throng/types.hpp>

namespace throng::tests {

class Random {
 public:
  explicit Random(std::uint64_t seed)
      : state_(seed * 0x2545f4914f6cdd1dull + 0x9e3779b97f4a7c15ull) {}

  // xorshift64*; the state must not be 0.
  std::uint64_t next() {
    if (state_ == 0) state_ = 1;
    state_ ^= state_ >> 12;
    state_ ^= state_ << 25;
    state_ ^= state_ >> 27;
    return state_ * 0x2545f4914f6cdd1dull;
  }
  // 0 .. n-1, n > 0; slightly biased.
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((next() >> 33) % n); }
  int between(int low, int high) {
    return low + static_cast<int>(below(static_cast<std::uint32_t>(high - low + 1)));
  }
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  // A multiple of 2^-24 in [0, 1).
  float unit() { return static_cast<float>(next() >> 40) * 0x1p-24f; }
  float in(float low, float high) { return low + unit() * (high - low); }
  Vec3 point(float low, float high) { return {in(low, high), in(low, high), in(low, high)}; }
  // Log-uniform over powers of two, with a random mantissa: [2^low, 2^(high+1)).
  float magnitude(int low, int high) { return std::ldexp(1.0f + unit(), between(low, high)); }

 private:
  std::uint64_t state_;
};

// `steps` floats up (or down).
inline float nudge(float x, int steps) {
  const float target =
      steps < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  for (int s = steps < 0 ? -steps : steps; s > 0; --s) x = std::nextafter(x, target);
  return x;
}

// The smallest integer whose cube is at least `volume`.
inline float side_of(float volume) {
  float side = 1;
  while (side * side * side < volume) side += 1;
  return side;
}

template <class T>
void shuffle(std::vector<T>& v, Random& random) {
  for (std::size_t i = v.size(); i > 1; --i)
    std::swap(v[i - 1], v[random.below(static_cast<std::uint32_t>(i))]);
}

}  // namespace throng::tests
