// Gathers a list's changes in order: see device/pair_event_stages.hpp.
#pragma once

#include <cstdint>

#include "cuda/launch.cuh"
#include "device/atomic.hpp"
#include "device/pair_event_stages.hpp"

namespace throng::cuda {

// One warp per tile. It collects the changes in shared memory: begin events from the front, end
// events from the back.
template <class Test>
__global__ void __launch_bounds__(block_threads)
    run_gather(Test test, device::Tiles to, std::uint64_t tiles) {
  using device::Change;
  constexpr std::uint32_t size = device::Tiles::size;
  constexpr unsigned warps = block_threads / 32;
  __shared__ Pair stages[warps][size];
  const unsigned lane = threadIdx.x % 32, below = (1u << lane) - 1;
  Pair* stage = stages[threadIdx.x / 32];
  const std::uint64_t count = test.count();
  std::uint64_t all_begun = 0, comparisons = 0;
  for (std::uint64_t tile = std::uint64_t{blockIdx.x} * warps + threadIdx.x / 32; tile < tiles;
       tile += std::uint64_t{gridDim.x} * warps) {
    std::uint32_t begun = 0, ended = 0, compared = 0;
    for (std::uint32_t k = 0; k < size && tile * size + k < count; k += 32) {
      const std::uint64_t i = tile * size + k + lane;
      Pair pair;
      const Change change = i < count ? test(i, pair, compared) : Change::none;
      const unsigned begins = __ballot_sync(~0u, change == Change::begins);
      const unsigned ends = __ballot_sync(~0u, change == Change::ends);
      if (change == Change::begins) stage[begun + __popc(begins & below)] = pair;
      if (change == Change::ends) stage[size - 1 - (ended + __popc(ends & below))] = pair;
      begun += __popc(begins);
      ended += __popc(ends);
    }
    std::uint64_t base = 0;
    if (const std::uint32_t held = begun + ended; held != 0) {
      __syncwarp();
      if (lane == 0) base = device::fetch_add(&to.event_counts->count, std::uint64_t{held});
      base = __shfl_sync(~0u, base, 0);
      for (std::uint32_t k = lane; k < held; k += 32)
        if (base + k < to.capacity)
          to.out[base + k] = stage[k < begun ? k : size - 1 - (k - begun)];
      __syncwarp();
    }
    if (lane == 0) to.note(tile, base, begun, ended);
    all_begun += begun;
    comparisons += compared;
  }
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  if (lane != 0) return;
  if (comparisons != 0) device::fetch_add(&to.event_counts->comparisons, comparisons);
  if (all_begun != 0) device::fetch_add(&to.event_counts->begun, all_begun);
}

}  // namespace throng::cuda
