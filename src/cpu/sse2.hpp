// The vectors of four that every x86-64 processor has, where it is one: THRONG_SSE2.
#pragma once

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#define THRONG_SSE2 1
#endif
