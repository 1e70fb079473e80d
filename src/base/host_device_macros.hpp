// Macros that let host and device compile the same function.
#pragma once

#if defined(__CUDACC__)
#define THRONG_HD __host__ __device__
#else
#define THRONG_HD
#endif

// Before a function: device code calls one copy of it instead of inlining it.
#if defined(__CUDACC__)
#define THRONG_OUTLINE __noinline__
#else
#define THRONG_OUTLINE
#endif

// Before a loop: unrolls `count` iterations on a device, so that their loads overlap.
#if defined(__CUDA_ARCH__)
#define THRONG_PRAGMA(text) _Pragma(#text)
#define THRONG_UNROLL(count) THRONG_PRAGMA(unroll count)
#else
#define THRONG_UNROLL(count)
#endif
