// Warp-wide operations; called by all lanes.
#pragma once

#include <cstdint>

namespace throng::cuda {

__device__ inline std::uint32_t warp_sum(std::uint32_t value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_add_sync(~0u, value);
#else
  for (int half = 16; half > 0; half /= 2) value += __shfl_xor_sync(~0u, value, half);
  return value;
#endif
}
__device__ inline int warp_min(int value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_min_sync(~0u, value);
#else
  for (int half = 16; half > 0; half /= 2) value = min(value, __shfl_xor_sync(~0u, value, half));
  return value;
#endif
}
__device__ inline int warp_max(int value) { return ~warp_min(~value); }

// Inclusive sums over the lanes.
__device__ inline unsigned warp_inclusive_sum(unsigned value) {
#pragma unroll
  for (unsigned k = 1; k < 32; k *= 2) {
    asm volatile(
        "{.reg .u32 other; .reg .pred p; shfl.sync.up.b32 other|p, %0, %1, 0, -1;"
        " @p add.u32 %0, %0, other;}"
        : "+r"(value)
        : "r"(k));
  }
  return value;
}

}  // namespace throng::cuda
