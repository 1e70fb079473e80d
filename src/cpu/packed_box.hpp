// Boxes whose overlap two vectors of four decide, as they lie in memory.
#pragma once

#include <cstring>

#include <throng/types.hpp>

#include "core/bounds.hpp"
#include "cpu/sse2.hpp"

namespace throng::cpu {

// core::overlaps() of two boxes as they lie in memory, their six floats together.
inline bool overlap_in_memory(const char* a, const char* b) noexcept {
#if defined(THRONG_SSE2)
  const auto floats = [](const char* at) {
    return _mm_loadu_ps(reinterpret_cast<const float*>(at));
  };
  const auto upper = [&](const char* box) {
    const __m128 v = floats(box + 2 * sizeof(float));
    return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 3, 2, 1));
  };
  // The fourth lanes are of no meaning.
  const __m128 both =
      _mm_and_ps(_mm_cmple_ps(floats(a), upper(b)), _mm_cmple_ps(floats(b), upper(a)));
  return (_mm_movemask_ps(both) & 7) == 7;
#else
  Box boxes[2];
  std::memcpy(boxes, a, sizeof *boxes);
  std::memcpy(boxes + 1, b, sizeof *boxes);
  return core::overlaps(boxes[0], boxes[1]);
#endif
}

}  // namespace throng::cpu
