// The search of small worlds (device/worlds.hpp) by warps.
#pragma once

#include <cstdint>

#include "cuda/search.cuh"
#include "cuda/warp.cuh"
#include "device/quantized_boxes.hpp"
#include "device/worlds.hpp"

namespace throng::cuda {

// The bounds of a warp's boxes, two per lane; called by all lanes.
__device__ inline device::QuantizationRange range_of(const Box& a, const Box& b) {
  // As integers with the same order.
  const auto ordered = [](float x) {
    const int bits = __float_as_int(x);
    return bits ^ (bits >> 31 & 0x7fffffff);
  };
  const auto number = [](int bits) { return __int_as_float(bits ^ (bits >> 31 & 0x7fffffff)); };
  // The NaN bounds of a box that takes no part are ignored.
  const auto least = [&](float x, float y) { return warp_min(ordered(fminf(fminf(x, y), 3e38f))); };
  const auto most = [&](float x, float y) { return warp_max(ordered(fmaxf(fmaxf(x, y), -3e38f))); };
  device::QuantizationRange range;
  range.set_axis(0, number(least(a.lower.x, b.lower.x)), number(most(a.upper.x, b.upper.x)));
  range.set_axis(1, number(least(a.lower.y, b.lower.y)), number(most(a.upper.y, b.upper.y)));
  range.set_axis(2, number(least(a.lower.z, b.lower.z)), number(most(a.upper.z, b.upper.z)));
  return range;
}

// Bits for the boxes k lanes further on, k = 1 .. 16, cyclically, that may overlap this lane's.
// Each two of 32 meet once, except for those at a distance of 16 lanes, which meet twice.
__device__ inline unsigned may_overlap_cyclic(const device::QuantizedBox& own) {
  const unsigned lane = threadIdx.x % 32;
  unsigned bits = 0;
#pragma unroll
  for (unsigned k = 1; k <= 16; ++k) {
    const device::QuantizedBox other = {__shfl_sync(~0u, own.lower, lane + k),
                                        __shfl_sync(~0u, own.upper, lane + k)};
    if (!are_disjoint(own, other)) bits |= 1u << k;
  }
  return bits;
}
// Bits for those of the same world, with those at a distance of 16 lanes counted once.
__device__ inline unsigned same_world_cyclic(std::int32_t world) {
  const unsigned lane = threadIdx.x % 32, same = __match_any_sync(~0u, world);
  return __funnelshift_r(same, same, lane) & (lane < 16 ? 0x1fffe : 0xfffe);
}
// Bits for 32 boxes in shared memory, which all lanes read in the same order, two at a time.
__device__ inline unsigned may_overlap(const device::QuantizedBox& own, const uint4* others) {
  unsigned bits = 0;
#pragma unroll
  for (unsigned k = 0; k < 16; ++k) {
    const uint4 two = others[k];
    if (!are_disjoint(own, {two.x, two.y})) bits |= 1u << 2 * k;
    if (!are_disjoint(own, {two.z, two.w})) bits |= 2u << 2 * k;
  }
  return bits;
}

template <class Search>
struct WorldsCheck {
  const Search& search;
  __device__ bool operator()(std::uint32_t i, std::uint32_t j) const {
    return base::overlaps(search.box(i), search.box(j)) &&
           (!search.selects() || search.allows(i, j));
  }
};

// A lane has two boxes, a warp 64 consecutive ones: 32, and the 32 that follow. The warp goes
// through these, and then through later boxes as long as they are of the last one's world, 32 at a
// time; then through those of all worlds. It compares quantized boxes; all lanes check the hits
// exactly later.
template <class Search>
__global__ void __launch_bounds__(block_threads, 4)
    run_worlds(Search search, device::PairSink sink) {
  constexpr unsigned warps = block_threads / 32;
  using OutputBuffer = WarpOutputBuffer<WorldsCheck<Search>>;
  __shared__ Pair outputs[warps][OutputBuffer::max_held];
  __shared__ uint4 others[warps][16];
  const auto count = static_cast<std::uint32_t>(search.count());
  if (count == 0) return;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  OutputBuffer output(outputs[warp], sink, lane, {search});
  std::uint64_t comparisons = 0;
  const std::uint32_t everywhere_count = search.worlds_report->everywhere;
  constexpr std::int32_t none = -2;  // no world has this number
  const auto world_of = [&](std::uint32_t i) { return i < count ? search.in.world(i) : none; };
  const auto own_box_of = [&](std::uint32_t i) {
    return i < count ? search.own_box(i) : search.box(count - 1);
  };
  const auto box_of = [&](std::uint32_t i) { return search.box(i < count ? i : count - 1); };
  // Reports box i with the boxes of the set bits: bit k is base + (from + k) % 32.
  const auto emit = [&](std::uint32_t i, std::uint32_t base, unsigned from, unsigned bits) {
    while (__any_sync(~0u, bits != 0)) {
      const auto k = static_cast<unsigned>(__ffs(static_cast<int>(bits)) - 1);
      const std::uint32_t j = base + ((from + k) & 31);
      output.add(bits != 0, {i < j ? i : j, i < j ? j : i});
      bits &= bits - 1;
    }
  };
  // Neighbours swap places each round: of two that share a world the first has more work.
  const std::uint64_t own_place = std::uint64_t{blockIdx.x} * warps + warp;
  for (std::uint64_t round = 0, places = std::uint64_t{gridDim.x} * warps;
       round * places * 64 < count; ++round) {
    const std::uint64_t place = round * places + (own_place ^ (round & 1));
    if (place * 64 >= count) continue;
    std::uint32_t base = static_cast<std::uint32_t>(place) * 64;
    const std::uint32_t i = base + lane;
    const std::int32_t worlds[2] = {world_of(i), world_of(i + 32)};
    const Box own[2] = {own_box_of(i), own_box_of(i + 32)};
    const device::QuantizationRange range = range_of(own[0], own[1]);
    const device::QuantizedBox quantized[2] = {range.quantize(own[0]), range.quantize(own[1])};
#pragma unroll
    for (int k = 0; k < 2; ++k) {
      const unsigned same = same_world_cyclic(worlds[k]);  // by all lanes
      const unsigned wanted = worlds[k] != none ? same : 0;
      comparisons += static_cast<unsigned>(__popc(wanted));
      emit(i + 32 * k, base + 32 * k, lane, may_overlap_cyclic(quantized[k]) & wanted);
    }
    // The first half goes through the second next, and both go through what follows.
    std::int32_t last = __shfl_sync(~0u, worlds[0], 31);
    unsigned there = __ballot_sync(~0u, worlds[1] == last && last != none);
    device::QuantizedBox other = quantized[1];
    base += 32;
    for (bool both = false, of_worlds = true;; both = true) {
      unsigned wanted[2] = {worlds[0] == last ? there : 0, both && worlds[1] == last ? there : 0};
      if (!of_worlds) {
#pragma unroll
        for (int k = 0; k < 2; ++k) wanted[k] = worlds[k] >= 0 ? there : 0;
      }
      if (__any_sync(~0u, (wanted[0] | wanted[1]) != 0)) {
        __syncwarp();
        reinterpret_cast<uint2*>(others[warp])[lane] = {other.lower, other.upper};
        __syncwarp();
#pragma unroll
        for (int k = 0; k < 2; ++k) {
          if (!__any_sync(~0u, wanted[k] != 0)) continue;
          comparisons += static_cast<unsigned>(__popc(wanted[k]));
          emit(i + 32 * k, base, 0, may_overlap(quantized[k], others[warp]) & wanted[k]);
        }
      }
      if (!of_worlds) break;
      base += 32;
      const std::uint32_t j = base + lane;
      last = __shfl_sync(~0u, worlds[1], 31);
      there = __ballot_sync(~0u, last != none && world_of(j) == last);
      if (there == 0) {
        if (everywhere_count == 0) break;
        of_worlds = false;
        base = 0;
        there = everywhere_count < 32 ? (1u << everywhere_count) - 1 : ~0u;
      }
      other = range.quantize(box_of(of_worlds ? j : lane < everywhere_count ? lane : 0));
    }
  }
  finish(output, comparisons, sink);
}

}  // namespace throng::cuda
