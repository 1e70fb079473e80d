// Tests on packed boxes (six contiguous floats) in memory, with vectors of four.
#pragma once

#include <cstddef>
#include <cstring>

#include <throng/types.hpp>

#include "base/bounds.hpp"
#include "base/sse2.hpp"

namespace throng::base {

namespace packed {
#if defined(THRONG_SSE2)
inline __m128 floats(const char* at) noexcept {
  return _mm_loadu_ps(reinterpret_cast<const float*>(at));
}
inline __m128i words(const char* at) noexcept {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
}
// The fourth lane is unspecified.
inline __m128 upper(const char* box) noexcept {
  const __m128 v = floats(box + 2 * sizeof(float));
  return _mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 3, 2, 1));
}
inline bool all_three(__m128 lanes) noexcept { return (_mm_movemask_ps(lanes) & 7) == 7; }
#else
inline Box box(const char* at) noexcept {
  Box b;
  std::memcpy(&b, at, sizeof b);
  return b;
}
#endif
}  // namespace packed

// As overlaps().
inline bool overlap_in_memory(const char* a, const char* b) noexcept {
#if defined(THRONG_SSE2)
  return packed::all_three(_mm_and_ps(_mm_cmple_ps(packed::floats(a), packed::upper(b)),
                                      _mm_cmple_ps(packed::floats(b), packed::upper(a))));
#else
  return overlaps(packed::box(a), packed::box(b));
#endif
}

// As is_active().
inline bool active_in_memory(const char* box) noexcept {
#if defined(THRONG_SSE2)
  return packed::all_three(_mm_cmple_ps(packed::floats(box), packed::upper(box)));
#else
  return is_active(packed::box(box));
#endif
}

// Compares bits.
inline bool same_in_memory(const char* a, const char* b) noexcept {
#if defined(THRONG_SSE2)
  const __m128i low = _mm_cmpeq_epi32(packed::words(a), packed::words(b));
  const __m128i high = _mm_cmpeq_epi32(packed::words(a + 8), packed::words(b + 8));
  return _mm_movemask_epi8(_mm_and_si128(low, high)) == 0xffff;
#else
  return std::memcmp(a, b, sizeof(Box)) == 0;
#endif
}

// Whether any of `count` boxes, `stride` bytes apart, has a NaN.
inline bool nan_in_memory(const char* boxes, std::size_t count, std::size_t stride) noexcept {
#if defined(THRONG_SSE2)
  __m128 any = _mm_setzero_ps();
  for (const char* box = boxes; count != 0; --count, box += stride)
    any = _mm_or_ps(any, _mm_cmpunord_ps(packed::floats(box), packed::floats(box + 8)));
  return _mm_movemask_ps(any) != 0;
#else
  bool any = false;
  for (const char* box = boxes; count != 0; --count, box += stride)
    any |= has_nan(packed::box(box));
  return any;
#endif
}

}  // namespace throng::base
