// Exclusive sums over the table of cells, in place, in one pass of one kernel (decoupled
// look-back). Each block takes a piece, publishes its own sum, and adds the sums of the pieces
// before it. Blocks start in the order of their indices, so a block waits only for blocks that run
// or have ended.
#pragma once

#include <cstdint>
#include <cub/block/block_scan.cuh>

#include "cuda/check.hpp"
#include "cuda/warp.cuh"
#include "device/input.hpp"

namespace throng::cuda {

struct CellSums {
  static constexpr unsigned threads = 512, quads = 2;  // a thread has `quads` times four cells
  static constexpr std::uint32_t piece = threads * quads * 4;
  // A piece's word: 0 before it has any result; then its own sum, or the sum up to its end, in 32
  // bits.
  static constexpr std::uint64_t own_sum = std::uint64_t{1} << 32,
                                 prefix_sum = std::uint64_t{2} << 32;

  static std::size_t pieces(std::size_t cells) noexcept { return (cells + piece - 1) / piece; }
};

// Returns the sum of all pieces before `piece`, whose own sum is `own`; called by all lanes of a
// warp.
__device__ inline std::uint32_t sum_before(std::uint64_t* words, std::uint32_t piece,
                                           std::uint32_t own) {
  const unsigned lane = threadIdx.x % 32;
  const auto publish = [&](std::uint64_t what, std::uint32_t sum) {
    if (lane == 0) *static_cast<volatile std::uint64_t*>(words + piece) = what | sum;
  };
  if (piece > 0) publish(CellSums::own_sum, own);
  std::uint32_t before = 0;
  for (std::uint32_t end = piece; end > 0;) {
    // The nearest piece first.
    std::uint64_t word = CellSums::prefix_sum;
    if (lane < end) {
      const auto* const at = static_cast<volatile std::uint64_t*>(words + (end - 1 - lane));
      do word = *at;
      while (word == 0);
    }
    const unsigned last = __ballot_sync(~0u, word >= CellSums::prefix_sum);
    const unsigned taken = last ^ (last - 1);  // up to the first of these; all if there is none
    std::uint32_t sum = taken >> lane & 1 ? static_cast<std::uint32_t>(word) : 0;
    before += warp_sum(sum);
    end = last != 0 ? 0 : end - 32;
  }
  publish(CellSums::prefix_sum, before + own);
  return before;
}

// The table's capacity is a multiple of eight cells.
static __global__ void __launch_bounds__(CellSums::threads)
    run_cell_sums(const std::uint32_t* wanted, uint4* table, std::uint32_t quads,
                  std::uint64_t* words) {
  using Scan = cub::BlockScan<std::uint32_t, CellSums::threads>;
  __shared__ typename Scan::TempStorage scan;
  __shared__ std::uint32_t before;
  if (wanted && *wanted == 0) return;
  const std::uint32_t first = (blockIdx.x * CellSums::threads + threadIdx.x) * CellSums::quads;
  uint4 c[CellSums::quads];
  std::uint32_t own = 0;
  for (unsigned k = 0; k < CellSums::quads; ++k) {
    c[k] = first + k < quads ? table[first + k] : uint4{0, 0, 0, 0};
    own += c[k].x + c[k].y + c[k].z + c[k].w;
  }
  std::uint32_t sum, all;
  Scan(scan).ExclusiveSum(own, sum, all);
  if (threadIdx.x < 32) {
    const std::uint32_t so_far = sum_before(words, blockIdx.x, all);
    if (threadIdx.x == 0) before = so_far;
  }
  __syncthreads();
  sum += before;
  for (unsigned k = 0; k < CellSums::quads; ++k) {
    const uint4 at = {sum, sum + c[k].x, sum + c[k].x + c[k].y, sum + c[k].x + c[k].y + c[k].z};
    if (first + k < quads) table[first + k] = at;
    sum = at.w + c[k].w;
  }
}

}  // namespace throng::cuda
