// One thread per index.
#pragma once

#include <cstdint>

#include "cuda/check.hpp"

namespace throng::cuda {

constexpr unsigned block_threads = 256;

template <class F>
__global__ void __launch_bounds__(block_threads) run_each(std::uint64_t count, F f) {
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t i = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x; i < count;
       i += step)
    f(i);
}

// At most `each` blocks per SM, and no more than there is work for.
inline unsigned blocks_for(std::uint64_t count, unsigned each, int sm_count) noexcept {
  const std::uint64_t wanted = (count + block_threads - 1) / block_threads;
  const std::uint64_t most = std::uint64_t{each} * static_cast<unsigned>(sm_count);
  return static_cast<unsigned>(wanted < most ? wanted : most);
}

}  // namespace throng::cuda
