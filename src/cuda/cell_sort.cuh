// Block-wide steps that bring boxes into cell order (device/cell_sort.hpp).
#pragma once

#include <cstdint>
#include <cub/block/block_scan.cuh>

#include "cuda/launch.cuh"
#include "device/cell_sort.hpp"

// Above this the sort is faster. A test build may set it to 0.
#ifndef THRONG_GPU_SORTED_ABOVE
#define THRONG_GPU_SORTED_ABOVE 3500000
#endif

namespace throng::cuda {

constexpr unsigned bucket_threads = 512;

// Index of the first of `count` boxes that is not before `bucket`: a 32-ary search by all lanes of
// a warp.
template <class F>
__device__ std::uint32_t first_of(const F& f, std::uint32_t bucket, std::uint32_t count) {
  const unsigned lane = threadIdx.x % 32;
  std::uint32_t begin = 0, end = count;
  while (begin < end) {
    const std::uint32_t step = (end - begin) / 32 + 1;
    const std::uint64_t at = begin + std::uint64_t{lane} * step;
    const bool before = at < end && f.before(static_cast<std::uint32_t>(at), bucket);
    const auto n = static_cast<unsigned>(__popc(__ballot_sync(~0u, before)));
    if (n == 0) return begin;
    const std::uint64_t last = begin + std::uint64_t{n} * step;  // not before it, if it exists
    begin += (n - 1) * step + 1;
    if (last < end) end = static_cast<std::uint32_t>(last);
  }
  return begin;
}

// Each two adjacent lanes store both their records, one half of each record per lane, so that a
// sector is written whole in one transaction. Called by all lanes.
__device__ inline void store_pairwise(device::Record* records, bool some, std::uint32_t to,
                                      const device::Record& r) {
  const bool odd = threadIdx.x % 2 != 0;
  const float4 low = {r.lower.x, r.lower.y, r.lower.z, __uint_as_float(r.id)};
  const float4 high = {r.upper.x, r.upper.y, r.upper.z, 0.0f};
  const float4 own = odd ? high : low, give = odd ? low : high;
  float4 taken;
  taken.x = __shfl_xor_sync(~0u, give.x, 1);
  taken.y = __shfl_xor_sync(~0u, give.y, 1);
  taken.z = __shfl_xor_sync(~0u, give.z, 1);
  taken.w = __shfl_xor_sync(~0u, give.w, 1);
  const std::uint32_t mine = some ? to : ~0u;
  const std::uint32_t other = __shfl_xor_sync(~0u, mine, 1);
  auto* const halves = reinterpret_cast<float4*>(records);
  const std::uint32_t even_to = odd ? other : mine, odd_to = odd ? mine : other;
  if (even_to != ~0u) halves[2 * std::uint64_t{even_to} + odd] = odd ? taken : own;
  if (odd_to != ~0u) halves[2 * std::uint64_t{odd_to} + odd] = odd ? own : taken;
}

template <class F>
__global__ void __launch_bounds__(bucket_threads, 3) run_place_buckets(F f, std::uint32_t count) {
  using Scan = cub::BlockScan<std::uint32_t, bucket_threads>;
  extern __shared__ uint4 counts[];  // four cells each
  __shared__ typename Scan::TempStorage scan;
  __shared__ std::uint32_t range[2];
  const unsigned t = threadIdx.x;
  const std::uint32_t bucket = blockIdx.x, cells = f.buckets.cells();
  auto* const next = reinterpret_cast<std::uint32_t*>(counts);
  if (!f.in.wants_grid()) return;
  if (t < 64) {
    const std::uint32_t first = first_of(f, bucket + t / 32, count);
    if (t % 32 == 0) range[t / 32] = first;
  }
  for (unsigned k = t; k < cells / 4; k += bucket_threads) counts[k] = {0, 0, 0, 0};
  __syncthreads();
  const std::uint32_t begin = range[0], end = range[1];
  for (std::uint32_t i = begin + t; i < end; i += bucket_threads) f.count(i, next);
  __syncthreads();
  std::uint32_t sum = begin;
  for (unsigned first = 0; first < cells / 4; first += bucket_threads) {
    const unsigned k = first + t;
    const bool mine = k < cells / 4;
    uint4 c = mine ? counts[k] : uint4{0, 0, 0, 0};
    std::uint32_t at, all;
    Scan(scan).ExclusiveSum(c.x + c.y + c.z + c.w, at, all);
    at += sum;
    sum += all;
    c = {at, at + c.x, at + c.x + c.y, at + c.x + c.y + c.z};
    if (mine) {
      counts[k] = c;
      const std::uint32_t cell = (bucket << f.buckets.bits) + 4 * k;
      if (cell + 3 < f.buckets.last)
        reinterpret_cast<uint4*>(f.start)[cell / 4] = c;
      else
        f.set_start(cell, c.x), f.set_start(cell + 1, c.y), f.set_start(cell + 2, c.z),
            f.set_start(cell + 3, c.w);
    }
    __syncthreads();
  }
  for (std::uint32_t first = begin; first < end; first += bucket_threads) {
    device::Record record{};
    std::uint32_t to = 0;
    const bool some = first + t < end;
    if (some) record = f.take(first + t, next, to);
    store_pairwise(f.records, some, to, record);
  }
}

}  // namespace throng::cuda
