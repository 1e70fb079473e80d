// The instruction sets for which Highway compiles kernels. Included before any header of Highway.
#pragma once

// Highway's own assertions would need its library at link time; without them its headers are
// enough.
#define HWY_IS_DEBUG_BUILD 0

// Built: SSE4, AVX2, AVX-512 (as of Ice Lake and Zen 4, which compress bytes; earlier AVX-512
// processors use AVX2), NEON, WebAssembly. Disabled by bit, as old releases do not name them all:
// SSSE3, other AVX-512 sets, SVE.
#define HWY_WANT_AVX3_DL
#define HWY_DISABLED_TARGETS                                                                     \
  ((1LL << 12) | (1LL << 8) | (1LL << 6) | (1LL << 5) | (1LL << 4) | (1LL << 24) | (1LL << 25) | \
   (1LL << 26) | (1LL << 27))
