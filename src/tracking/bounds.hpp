// The smallest box that contains the given boxes, which contain no NaN.
#pragma once

#include <algorithm>
#include <limits>

#include <throng/types.hpp>

#include "base/sse2.hpp"

namespace throng::tracking {

class Bounds {
 public:
  void extend(const Box& box) noexcept {
    const auto* const corner = reinterpret_cast<const float*>(&box);
    extend(corner, corner + 2);
  }
  void extend(const Bounds& other) noexcept { extend(other.min_, other.max_); }
  // If no box was added, a box that overlaps nothing.
  Box box() const noexcept { return {{min_[0], min_[1], min_[2]}, {max_[1], max_[2], max_[3]}}; }

 private:
  // Four floats each, in the order of Box: the first four and the last four coordinates.
  void extend(const float* least, const float* most) noexcept {
#if defined(THRONG_SSE2)
    _mm_store_ps(min_, _mm_min_ps(_mm_load_ps(min_), _mm_loadu_ps(least)));
    _mm_store_ps(max_, _mm_max_ps(_mm_load_ps(max_), _mm_loadu_ps(most)));
#else
    for (int k = 0; k < 4; ++k) {
      min_[k] = std::min(min_[k], least[k]);
      max_[k] = std::max(max_[k], most[k]);
    }
#endif
  }

  static constexpr float far = std::numeric_limits<float>::infinity();
  alignas(16) float min_[4] = {far, far, far, far};
  alignas(16) float max_[4] = {-far, -far, -far, -far};
};

}  // namespace throng::tracking
