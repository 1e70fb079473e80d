// THRONG_SSE2: vectors of four, which every x86-64 processor has.
#pragma once

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#define THRONG_SSE2 1
#endif

namespace throng::base {

// Makes streaming stores visible before any later store.
inline void fence_streaming_stores() noexcept {
#if defined(THRONG_SSE2)
  _mm_sfence();
#endif
}

}  // namespace throng::base
