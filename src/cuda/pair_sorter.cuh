// Block-wide and grid-wide steps that sort pairs (device/pair_sorter.hpp): one cooperative
// kernel, whose blocks are all resident and synchronize with each other.
#pragma once

#include <cooperative_groups.h>

#include <cstdint>
#include <cub/block/block_scan.cuh>
#include <utility>

#include "device/pair_sorter.hpp"

namespace throng::cuda {

constexpr unsigned sort_threads = 512;

// A block's shared memory.
template <class Order>
struct SortMemory {
  // Dynamic shared memory: 80 KiB, so that two blocks fit in the 228 KiB of an SM, or one in 99.
  struct Dynamic {
    alignas(16) device::PackedPair placed[Order::block_pairs];
    alignas(16) std::uint32_t counts[Order::bins];  // of buckets, then of bins
  };
  using Places = cub::BlockScan<typename Order::Place, sort_threads, cub::BLOCK_SCAN_WARP_SCANS>;
  using Counts = cub::BlockScan<std::uint32_t, sort_threads, cub::BLOCK_SCAN_WARP_SCANS>;
  union {
    typename Places::TempStorage places;
    typename Counts::TempStorage sums;
  };
  std::uint32_t most;  // pairs of a bucket, or of a bin
};

// Replaces the bins' counts by where each begins. memory.most: the largest count, if above a run.
template <class Order>
__device__ void scan_bins(std::uint32_t* counts, SortMemory<Order>& memory) {
  constexpr unsigned each = Order::bins / sort_threads;
  static_assert(each % 4 == 0);
  auto* const four = reinterpret_cast<uint4*>(counts) + threadIdx.x * (each / 4);
  std::uint32_t sum = 0, most = 0;
  for (unsigned k = 0; k < each / 4; ++k) {
    const uint4 c = four[k];
    sum += c.x + c.y + c.z + c.w;
    most = max(most, max(max(c.x, c.y), max(c.z, c.w)));
  }
  if (most > Order::run_pairs) atomicMax(&memory.most, most);
  typename SortMemory<Order>::Counts(memory.sums).ExclusiveSum(sum, sum);
  for (unsigned k = 0; k < each / 4; ++k) {
    const uint4 c = four[k];
    four[k] = {sum, sum + c.x, sum + c.x + c.y, sum + c.x + c.y + c.z};
    sum = four[k].w + c.w;
  }
}

// Called by all threads of a block, synchronized since the last use of its memory; synchronizes at
// the end.
template <class Order>
__device__ void sort_task(const Order& order, const typename Order::Shape& shape,
                          const typename Order::Task& task,
                          typename SortMemory<Order>::Dynamic& own, SortMemory<Order>& memory) {
  using device::PackedPair;
  const unsigned t = threadIdx.x;
  const std::uint32_t count = task.last() - task.first;
  auto* const zeros = reinterpret_cast<uint4*>(own.counts);
  for (unsigned k = t; k < Order::bins / 4; k += sort_threads) zeros[k] = {0, 0, 0, 0};
  if (t == 0) memory.most = 0;
  __syncthreads();
  order.count_bins(shape, task, t, sort_threads, own.counts);
  __syncthreads();
  scan_bins<Order>(own.counts, memory);
  __syncthreads();
  order.place(shape, task, t, sort_threads, own.counts, own.placed);
  __syncthreads();
  const std::uint32_t most = memory.most;
  PackedPair* from = own.placed;
  PackedPair* to = order.words + task.first;
  for (std::uint32_t i = t; i < count; i += sort_threads) {
    const std::uint32_t at = order.ranked(shape, from, own.counts, i);
    if (most > Order::run_pairs)
      to[at] = from[i];
    else
      order.deliver(task, at, from[i]);
  }
  for (std::uint32_t width = Order::run_pairs; width < most; width *= 4) {
    __syncthreads();
    std::swap(from, to);
    for (std::uint32_t i = t; i < count; i += sort_threads) {
      const std::uint32_t at = order.merged(shape, from, own.counts, i, width);
      if (4 * width < most)
        to[at] = from[i];
      else
        order.deliver(task, at, from[i]);
    }
  }
  __syncthreads();
}

// From each block's counts computes where its pairs go, and the tasks; returns the totals.
template <class Order>
__device__ typename Order::Place scan_buckets(const Order& order, std::uint32_t buckets,
                                              std::uint32_t* counts, SortMemory<Order>& memory) {
  using Place = typename Order::Place;
  Place sum{};
  for (unsigned first = 0; first < buckets; first += sort_threads) {
    const unsigned bucket = first + threadIdx.x;
    const std::uint32_t pairs = bucket < buckets ? order.totals[bucket] : 0;
    Place at, all;
    typename SortMemory<Order>::Places(memory.places).ExclusiveSum(Order::size(pairs), at, all);
    at = sum + at;
    sum = sum + all;
    if (bucket < buckets) {
      counts[bucket] += at.pairs;
      if (bucket % gridDim.x == blockIdx.x) order.add_tasks(pairs, at);
      if (pairs > Order::block_pairs) atomicMax(&memory.most, pairs);
    }
    __syncthreads();
  }
  return sum;
}

// Scatters pairs into buckets, with all blocks. Returns the number of pairs and tasks. memory.most:
// the size of the largest bucket, if a block cannot take it.
template <class Order>
__device__ typename Order::Place partition_pairs(const Order& order,
                                                 const typename Order::Shape& shape,
                                                 std::uint32_t found, std::uint32_t* counts,
                                                 SortMemory<Order>& memory) {
  const auto grid = cooperative_groups::this_grid();
  const unsigned t = threadIdx.x;
  const std::uint32_t thread = blockIdx.x * sort_threads + t, threads = gridDim.x * sort_threads;
  for (std::uint32_t k = thread; k < shape.buckets; k += threads) order.totals[k] = 0;
  auto cleared = grid.barrier_arrive();
  for (unsigned k = t; k < shape.buckets; k += sort_threads) counts[k] = 0;
  __syncthreads();
  order.count(shape, found, thread, threads, counts);
  grid.barrier_wait(std::move(cleared));
  for (unsigned k = t; k < shape.buckets; k += sort_threads) order.reserve(k, counts);
  grid.sync();
  const typename Order::Place all = scan_buckets(order, shape.buckets, counts, memory);
  order.scatter(shape, found, thread, threads, counts);
  grid.sync();
  return all;
}

template <class Order>
__global__ void __launch_bounds__(sort_threads, 2) run_pair_sorter(Order order) {
  extern __shared__ uint4 sort_memory[];
  __shared__ SortMemory<Order> memory;
  auto& own = reinterpret_cast<typename SortMemory<Order>::Dynamic&>(sort_memory);
  const unsigned t = threadIdx.x;
  const std::uint32_t found = order.found();
  if (found == 0) return;
  const typename Order::Shape shape = order.shape(found);
  const bool alone = shape.buckets == 1;
  typename Order::Place all{found, 1, 0};
  if (t == 0) memory.most = 0;
  if (alone) {
    if (blockIdx.x > 0) return;
    for (std::uint32_t i = t; i < found; i += sort_threads)
      order.words[i] = device::load(order.pairs + i);
    __syncthreads();
  } else {
    all = partition_pairs(order, shape, found, own.counts, memory);
  }
  // All blocks compute the same maximum, so they execute the same number of grid barriers.
  const std::uint32_t passes = Order::passes(memory.most);
  __syncthreads();
  for (std::uint32_t k = blockIdx.x; k < all.large + all.small; k += gridDim.x) {
    typename Order::Task task{0, found, 0};
    if (!alone) task = k < all.large ? order.large[k] : order.small[k - all.large];
    sort_task(order, shape, task, own, memory);
  }
  constexpr std::uint32_t pieces = Order::block_pairs / sort_threads;
  for (std::uint32_t pass = 0; pass < passes; ++pass) {
    cooperative_groups::this_grid().sync();
    for (std::uint32_t k = blockIdx.x; k < all.large * pieces; k += gridDim.x) {
      const typename Order::Task task = order.large[k / pieces];
      const std::uint32_t i = task.first + k % pieces * sort_threads + t;
      if (i < task.last()) order.merge(task, i, pass, passes);
    }
  }
}

}  // namespace throng::cuda
