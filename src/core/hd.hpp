// One macro: a function that the host and a device both compile.
#pragma once

#if defined(__CUDACC__)
#define THRONG_HD __host__ __device__
#else
#define THRONG_HD
#endif
