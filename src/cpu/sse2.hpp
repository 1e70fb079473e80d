// The vectors of four that every x86-64 processor has, where it is one: THRONG_SSE2.
#pragma once

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#define THRONG_SSE2 1
#endif

namespace throng::cpu {

// What was written past the caches is seen before what is written from now on.
inline void streams_done() noexcept {
#if defined(THRONG_SSE2)
  _mm_sfence();
#endif
}

}  // namespace throng::cpu
