// The smallest box that contains the given boxes, which contain no NaN.
#pragma once

#include <algorithm>
#include <limits>

#include <throng/types.hpp>

#include "cpu/sse2.hpp"

namespace throng::live {

class Bounds {
 public:
  void hold(const Box& box) noexcept {
    const auto* const corner = reinterpret_cast<const float*>(&box);
    hold(corner, corner + 2);
  }
  void hold(const Bounds& other) noexcept { hold(other.least_, other.most_); }
  // If no box was added, a box that overlaps nothing.
  Box box() const noexcept {
    return {{least_[0], least_[1], least_[2]}, {most_[1], most_[2], most_[3]}};
  }

 private:
  // Four floats each, in the order of Box: the first four and the last four coordinates.
  void hold(const float* least, const float* most) noexcept {
#if defined(THRONG_SSE2)
    _mm_store_ps(least_, _mm_min_ps(_mm_load_ps(least_), _mm_loadu_ps(least)));
    _mm_store_ps(most_, _mm_max_ps(_mm_load_ps(most_), _mm_loadu_ps(most)));
#else
    for (int k = 0; k < 4; ++k) {
      least_[k] = std::min(least_[k], least[k]);
      most_[k] = std::max(most_[k], most[k]);
    }
#endif
  }

  static constexpr float far = std::numeric_limits<float>::infinity();
  alignas(16) float least_[4] = {far, far, far, far};
  alignas(16) float most_[4] = {-far, -far, -far, -far};
};

}  // namespace throng::live
