// The search of small worlds (pipeline/worlds.hpp) by warps.
#pragma once

#include <cstdint>

#include "cuda/search.cuh"
#include "pipeline/worlds.hpp"

namespace throng::cuda {

// 32 boxes in shared memory, as halves of records. All lanes of a warp read the same one at once.
struct WarpBoxes {
  float4 lower[32], upper[32];

  __device__ void put(unsigned at, const Box& b) {
    lower[at] = {b.lower.x, b.lower.y, b.lower.z, 0};
    upper[at] = {b.upper.x, b.upper.y, b.upper.z, 0};
  }
  // A bit for each that overlaps a box.
  __device__ unsigned meet(const Box& own) const {
    unsigned bits = 0;
#pragma unroll 8
    for (unsigned k = 0; k < 32; ++k) {
      const float4 low = lower[k], high = upper[k];
      const Box other = {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
      bits |= (core::overlaps(own, other) ? 1u : 0u) << k;
    }
    return bits;
  }
};

// A lane has one box, a warp 32 side by side. It goes through these, and through those that follow
// as long as they are of the last one's world, 32 at a time; then through those of all worlds.
template <class Search>
__global__ void __launch_bounds__(block_threads, 3)
    run_worlds(Search search, pipeline::PairSink sink) {
  __shared__ Pair stages[block_threads / 32][WarpStage::room];
  __shared__ WarpBoxes others[block_threads / 32];
  const auto count = static_cast<std::uint32_t>(search.count());
  if (count == 0) return;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const unsigned later = lane < 31 ? ~0u << (lane + 1) : 0;
  WarpStage stage(stages[warp], sink, lane);
  std::uint64_t comparisons = 0;
  const bool selects = search.selects();
  const std::uint32_t of_all = search.told->everywhere;
  for (std::uint64_t first = (std::uint64_t{blockIdx.x} * block_threads + threadIdx.x) / 32 * 32;
       first < count; first += std::uint64_t{gridDim.x} * block_threads) {
    std::uint32_t base = static_cast<std::uint32_t>(first);
    const std::uint32_t i = base + lane;
    const bool mine = i < count;
    // No world has this number.
    constexpr std::int32_t none = -2;
    const std::int32_t world = mine ? search.in.world(i) : none;
    const std::int32_t last = __shfl_sync(~0u, world, 31);
    const Box own = search.box(mine ? i : count - 1);
    Box other = own;
    unsigned wanted = __match_any_sync(~0u, world) & later;
    for (bool of_worlds = true;;) {
      wanted = mine ? wanted : 0;
      comparisons += static_cast<unsigned>(__popc(wanted));
      if (__any_sync(~0u, wanted != 0)) {
        others[warp].put(lane, other);
        __syncwarp();
        unsigned bits = others[warp].meet(own) & wanted;
        while (__any_sync(~0u, bits != 0)) {
          const std::uint32_t j = base + static_cast<unsigned>(__ffs(static_cast<int>(bits)) - 1);
          const bool hit = bits != 0 && (!selects || search.allows(i, j));
          stage.add(hit, hit ? search.in.pair(i, j) : Pair{});
          bits &= bits - 1;
        }
        __syncwarp();
      }
      if (!of_worlds) break;
      base += 32;
      const std::uint32_t j = base + lane;
      const unsigned same =
          last == none ? 0 : __ballot_sync(~0u, j < count && search.in.world(j) == last);
      if (same != 0) {
        wanted = world == last ? same : 0;
        other = search.box(j < count ? j : count - 1);
        continue;
      }
      if (of_all == 0) break;
      of_worlds = false;
      base = 0;
      wanted = world >= 0 ? (of_all < 32 ? (1u << of_all) - 1 : ~0u) : 0;
      other = search.box(lane < of_all ? lane : 0);
    }
  }
  finish(stage, comparisons, sink);
}

}  // namespace throng::cuda
