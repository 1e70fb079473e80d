// What the threads of a block do together to put boxes into buckets (pipeline/bucket_order.hpp).
#pragma once

#include <cstdint>
#include <cub/block/block_scan.cuh>

#include "cuda/launch.cuh"
#include "pipeline/bucket_order.hpp"

// Where they pay. A build for tests may set it to 0.
#ifndef THRONG_GPU_BUCKETS_ABOVE
#define THRONG_GPU_BUCKETS_ABOVE 4000000
#endif

namespace throng::cuda {

// A thread holds its boxes of a tile in registers until it knows where in the tile they stand: two
// such blocks are what a processor has registers for. A tile and its counts fit into the 64 KiB of
// shared memory that the oldest GPUs have for a block.
constexpr unsigned tile_threads = 512, boxes_a_thread = 3;
constexpr unsigned tile_boxes = tile_threads * boxes_a_thread;
constexpr std::size_t tile_bytes = tile_boxes * sizeof(pipeline::Record);
static_assert(pipeline::bucket_count <= tile_threads);

template <class F>
__global__ void __launch_bounds__(block_threads) run_count_buckets(std::uint64_t count, F f) {
  __shared__ std::uint32_t shared[F::shared_count];
  for (unsigned k = threadIdx.x; k < F::shared_count; k += block_threads) shared[k] = 0;
  __syncthreads();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t i = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x; i < count;
       i += step)
    f(i, shared);
  __syncthreads();
  for (unsigned k = threadIdx.x; k < F::shared_count; k += block_threads) f.add(k, shared);
}

// A tile is put into the order of buckets in shared memory, and written from there, neighbours by
// neighbours. Each step is one of all the thread's boxes, so that their loads do not wait for one
// another.
template <class F>
__global__ void __launch_bounds__(tile_threads, 2) run_fill_buckets(F f) {
  using Scan = cub::BlockScan<std::uint32_t, tile_threads>;
  extern __shared__ float4 tile[];  // halves of records
  __shared__ typename Scan::TempStorage scan;
  __shared__ std::uint32_t counts[pipeline::bucket_count], starts[pipeline::bucket_count];
  const unsigned t = threadIdx.x;
  if (t < pipeline::bucket_count) counts[t] = 0;
  const std::uint64_t first = std::uint64_t{blockIdx.x} * tile_boxes + t;
  typename F::Held held[boxes_a_thread];
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) f.read(first + k * tile_threads, held[k]);
  __syncthreads();
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) f.count(first + k * tile_threads, held[k], counts);
  __syncthreads();
  const std::uint32_t count = t < pipeline::bucket_count ? counts[t] : 0;
  std::uint32_t start, all;
  Scan(scan).ExclusiveSum(count, start, all);
  if (t < pipeline::bucket_count) {
    starts[t] = start;
    counts[t] = f.claim(t, count) - start;  // from a place in the tile to one in memory
  }
  __syncthreads();
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) {
    if (held[k].rank == F::none) continue;
    const std::uint32_t at = starts[f.bucket(held[k].cell)] + held[k].rank;
    const pipeline::Record r = F::record(first + k * tile_threads, held[k]);
    tile[2 * at] = make_float4(r.lower.x, r.lower.y, r.lower.z, __uint_as_float(r.id));
    tile[2 * at + 1] = make_float4(r.upper.x, r.upper.y, r.upper.z, __uint_as_float(r.cell));
  }
  __syncthreads();
  auto* const to = reinterpret_cast<float4*>(f.records);
  for (unsigned k = t; k < 2 * all; k += tile_threads) {
    const float4 half = tile[k];
    const std::uint32_t cell = __float_as_uint(tile[k | 1].w);
    const std::uint32_t at = counts[f.bucket(cell)] + k / 2;
    __stcs(to + 2 * std::uint64_t{at} + k % 2, half);
    if (k % 2 != 0) __stcs(f.cells + at, cell);
  }
}

}  // namespace throng::cuda
