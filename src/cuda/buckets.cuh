// What the threads of a block do together to put boxes into buckets (pipeline/bucket_order.hpp).
#pragma once

#include <cstdint>

#include "cuda/launch.cuh"
#include "pipeline/bucket_order.hpp"

// Where they pay. A build for tests may set it to 0.
#ifndef THRONG_GPU_BUCKETS_ABOVE
#define THRONG_GPU_BUCKETS_ABOVE 4000000
#endif

namespace throng::cuda {

// A thread holds its boxes of a tile in registers, from reading to storing them: two such blocks
// are what a processor has registers for.
constexpr unsigned tile_threads = 512, boxes_a_thread = 4;
constexpr unsigned tile_boxes = tile_threads * boxes_a_thread;

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

// Each step is one of all the thread's boxes, so that their loads do not wait for one another.
template <class F>
__global__ void __launch_bounds__(tile_threads, 2) run_fill_buckets(F f) {
  __shared__ std::uint32_t counts[pipeline::bucket_count];
  for (unsigned k = threadIdx.x; k < pipeline::bucket_count; k += tile_threads) counts[k] = 0;
  const std::uint64_t first = std::uint64_t{blockIdx.x} * tile_boxes + threadIdx.x;
  typename F::Held held[boxes_a_thread];
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) f.read(first + k * tile_threads, held[k]);
  __syncthreads();
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) f.count(first + k * tile_threads, held[k], counts);
  __syncthreads();
  for (unsigned k = threadIdx.x; k < pipeline::bucket_count; k += tile_threads) f.claim(k, counts);
  __syncthreads();
#pragma unroll
  for (unsigned k = 0; k < boxes_a_thread; ++k) f.store(first + k * tile_threads, held[k], counts);
}

}  // namespace throng::cuda
