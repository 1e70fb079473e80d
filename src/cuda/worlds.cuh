// The search of small worlds (pipeline/worlds.hpp) by blocks.
#pragma once

#include <cstdint>

#include "cuda/search.cuh"
#include "pipeline/worlds.hpp"

namespace throng::cuda {

// Some boxes in shared memory, as halves of records.
struct WorldTile {
  using Search = pipeline::WorldSearch;
  static constexpr unsigned everywhere = Search::most_everywhere;
  static constexpr unsigned most = block_threads + Search::most_in_world;
  // A warp looks at 32 at once, past the last one's end, too.
  static constexpr unsigned room = everywhere + most + 32;

  float4 lower[room], upper[room];
  std::int32_t world[most];

  __device__ void put(unsigned at, const Box& b) {
    lower[at] = {b.lower.x, b.lower.y, b.lower.z, 0};
    upper[at] = {b.upper.x, b.upper.y, b.upper.z, 0};
  }
  __device__ Box get(unsigned at) const {
    const float4 low = lower[at], high = upper[at];
    return {{low.x, low.y, low.z}, {high.x, high.y, high.z}};
  }
  // Which of the 32 from `at` on overlap a box. All lanes of a warp read the same one at once.
  __device__ unsigned meet(unsigned at, const Box& own) const {
    unsigned bits = 0;
#pragma unroll 8
    for (unsigned k = 0; k < 32; ++k) bits |= (core::overlaps(own, get(at + k)) ? 1u : 0u) << k;
    return bits;
  }
};

// Bits below n.
__device__ inline unsigned first_bits(unsigned n) { return n < 32 ? (1u << n) - 1 : ~0u; }

// A block takes as many boxes as it has threads, and what follows of the last one's world. A thread
// has one box; a warp goes through those behind its first, for all of its lanes at once.
template <class Search>
__global__ void __launch_bounds__(block_threads, 4)
    run_worlds(Search search, pipeline::PairSink sink) {
  constexpr unsigned everywhere = WorldTile::everywhere;
  __shared__ Pair stages[block_threads / 32][WarpStage::room];
  __shared__ WorldTile tile;
  __shared__ unsigned tile_end;
  const unsigned t = threadIdx.x, lane = t % 32;
  const auto count = static_cast<std::uint32_t>(search.count());
  if (count == 0) return;
  WarpStage stage(stages[t / 32], sink, lane);
  std::uint64_t comparisons = 0;
  const bool selects = search.selects();
  const std::uint32_t of_all = search.told->everywhere;
  if (t < of_all) tile.put(t, search.box(t));
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads; first < count;
       first += std::uint64_t{gridDim.x} * block_threads) {
    const auto begin = static_cast<std::uint32_t>(first);
    const unsigned behind = min(count - begin, block_threads + Search::most_in_world - 1);
    const bool mine = t < behind;
    const std::uint32_t i = begin + t;
    // Its own box is on its way while worlds are looked at.
    if (mine) tile.put(everywhere + t, search.box(i));
#pragma unroll
    for (unsigned k = t; k < block_threads + Search::most_in_world; k += block_threads)
      if (k < behind) tile.world[k] = search.in.world(begin + k);
    __syncthreads();
    // Where its world ends: they are in order.
    unsigned end = t, above = behind;
    const std::int32_t world = tile.world[mine ? t : 0];
    while (mine && end + 1 < above) {
      const unsigned middle = (end + above) / 2;
      if (tile.world[middle] > world)
        above = middle;
      else
        end = middle;
    }
    end = mine ? end + 1 : 0;
    if (t == min(block_threads, behind) - 1) tile_end = end;
    __syncthreads();
    for (unsigned k = block_threads + t; k < tile_end; k += block_threads)
      tile.put(everywhere + k, search.box(begin + k));
    __syncthreads();
    const Box own = tile.get(everywhere + (mine ? t : 0));
    unsigned warp_end = end;
    for (int half = 16; half > 0; half /= 2)
      warp_end = max(warp_end, __shfl_xor_sync(~0u, warp_end, half));
    // First those of all worlds, then those behind its own box and before the end.
    unsigned at = t / 32 * 32 + 1;
    for (bool all_first = of_all != 0; all_first || at < warp_end; all_first = false) {
      unsigned slot = 0, wanted = mine && world >= 0 ? first_bits(of_all) : 0;
      std::uint32_t base = 0;
      if (!all_first) {
        const unsigned before = t + 1 > at ? t + 1 - at : 0;
        wanted = end > at ? first_bits(end - at) & ~first_bits(before) : 0;
        slot = everywhere + at;
        base = begin + at;
        at += 32;
      }
      unsigned bits = tile.meet(slot, own) & wanted;
      while (__any_sync(~0u, bits != 0)) {
        const std::uint32_t j = base + static_cast<unsigned>(__ffs(static_cast<int>(bits)) - 1);
        const bool hit = bits != 0 && (!selects || search.allows(i, j));
        stage.add(hit, hit ? search.in.pair(i, j) : Pair{});
        bits &= bits - 1;
      }
    }
    if (mine) comparisons += end - t - 1 + (world >= 0 ? of_all : 0);
    __syncthreads();
  }
  stage.flush();
  tell_comparisons(sink, comparisons);
}

}  // namespace throng::cuda
