// What lets the host and a device compile the same function.
#pragma once

#if defined(__CUDACC__)
#define THRONG_HD __host__ __device__
#else
#define THRONG_HD
#endif

// Before a function: a device has one copy of it, which is called.
#if defined(__CUDACC__)
#define THRONG_OUTLINE __noinline__
#else
#define THRONG_OUTLINE
#endif

// Before a loop: so many turns at once on a device, so that their loads are under way together.
#if defined(__CUDA_ARCH__)
#define THRONG_PRAGMA(text) _Pragma(#text)
#define THRONG_UNROLL(turns) THRONG_PRAGMA(unroll turns)
#else
#define THRONG_UNROLL(turns)
#endif
