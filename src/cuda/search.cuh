// The search for pairs by warps: how the lanes go through their candidates together, and how what
// they find gets out.
#pragma once

#include <cstdint>

#include "cuda/launch.cuh"
#include "pipeline/pipeline.hpp"

namespace throng::cuda {

// One warp's hits on their way out: gathered in shared memory, one atomic addition for some
// hundred.
class WarpStage {
 public:
  static constexpr unsigned room = 128;

  __device__ WarpStage(Pair* stage, const pipeline::PairSink& sink, unsigned lane)
      : stage_(stage), sink_(sink), lane_(lane) {}

  // All lanes together; `hit` tells which have a pair.
  __device__ void add(bool hit, const Pair& pair) {
    const unsigned hits = __ballot_sync(~0u, hit);
    if (hits == 0) return;
    if (hit) stage_[held_ + __popc(hits & ((1u << lane_) - 1))] = pair;
    held_ += __popc(hits);
    if (held_ > room - 32) flush();
  }
  __device__ void flush() {
    if (held_ == 0) return;
    __syncwarp();
    unsigned long long at = 0;
    if (lane_ == 0) {
      at = atomicAdd(reinterpret_cast<unsigned long long*>(&sink_.report->found),
                     static_cast<unsigned long long>(held_));
    }
    at = __shfl_sync(~0u, at, 0);
    for (unsigned k = lane_; k < held_; k += 32)
      if (at + k < sink_.capacity) sink_.out[at + k] = stage_[k];
    __syncwarp();
    held_ = 0;
  }

 private:
  Pair* stage_;
  const pipeline::PairSink& sink_;
  unsigned lane_, held_ = 0;
};

// A warp's comparisons, told together.
__device__ inline void tell_comparisons(const pipeline::PairSink& sink, std::uint64_t comparisons) {
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  if (threadIdx.x % 32 == 0 && comparisons != 0)
    pipeline::fetch_add(&sink.report->comparisons, comparisons);
}

// A lane walks by itself, where all have nearly the same to do. The whole grid of blocks stays until
// all is done.
template <class Search>
__global__ void __launch_bounds__(block_threads)
    run_walks(Search search, pipeline::PairSink sink) {
  __shared__ Pair stages[block_threads / 32][WarpStage::room];
  const unsigned lane = threadIdx.x % 32;
  WarpStage stage(stages[threadIdx.x / 32], sink, lane);
  const std::uint64_t count = search.count();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  std::uint64_t comparisons = 0;
  // The bound is the same for all lanes of a warp.
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
       first < count; first += step) {
    const std::uint64_t i = first + lane;
    auto walk = search.begin(i < count ? i : count - 1);
    bool live = i < count && !walk.over();
    while (__any_sync(~0u, live)) {
      bool hit = false;
      Pair pair;
      if (live) {
        hit = walk.step(pair);
        live = !walk.over();
      }
      stage.add(hit, pair);
    }
    if (i < count) comparisons += walk.comparisons();
  }
  stage.flush();
  tell_comparisons(sink, comparisons);
}

// Boxes in a grid. A lane has one box, a warp 32 that stand together and look into nearly the same
// cells. First all lanes look up the rows of their cells, together, and keep the ranges that are not
// empty; then each goes through the candidates in its own.
template <class Search>
__global__ void __launch_bounds__(block_threads, 4)
    run_looks(Search search, pipeline::PairSink sink) {
  constexpr unsigned warps = block_threads / 32, slots = 8;
  __shared__ Pair stages[warps][WarpStage::room];
  __shared__ uint2 ranges[warps][slots][32];
  __shared__ std::uint32_t rows_of[warps][slots][32];
  __shared__ core::ClassGrid cells;
  __shared__ std::uint8_t targets[Search::most_targets];
  __shared__ unsigned target_count;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  static_assert(sizeof(core::ClassGrid) % 4 == 0 && std::is_trivially_copyable_v<core::ClassGrid>);
  for (unsigned k = threadIdx.x; k < sizeof(core::ClassGrid) / 4; k += block_threads)
    reinterpret_cast<std::uint32_t*>(&cells)[k] =
        reinterpret_cast<const std::uint32_t*>(search.grid)[k];
  if (warp == 0) {
    unsigned held = 0;
    for (unsigned k = lane; k < Search::most_targets; k += 32) {
      const bool one = search.occupied[k] != 0;
      const unsigned some = __ballot_sync(~0u, one);
      if (one) targets[held + __popc(some & ((1u << lane) - 1))] = static_cast<std::uint8_t>(k);
      held += __popc(some);
    }
    if (lane == 0) target_count = held;
  }
  __syncthreads();
  WarpStage stage(stages[warp], sink, lane);
  const std::uint64_t count = search.count();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  std::uint64_t comparisons = 0;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads + warp * 32; first < count;
       first += step) {
    const std::uint64_t i = first + lane;
    const bool looks = i < count;
    typename Search::Look look(search, cells, looks ? i : count - 1);
    unsigned target = 0, rows = 0, held = 0;
    for (bool more = true; more;) {
      for (;;) {
        if (__any_sync(~0u, rows > 0)) {
          if (rows > 0) {
            --rows;
            const auto range = look.row();
            if (range.begin != range.end) {
              ranges[warp][held][lane] = {range.begin, range.end};
              if (look.shares()) rows_of[warp][held][lane] = range.row;
              ++held;
              comparisons += range.end - range.begin;
            }
          }
          if (__any_sync(~0u, held == slots)) break;
        } else {
          if (__any_sync(~0u, held > 0 && look.shares())) break;
          more = target < target_count;
          if (!more) break;
          if (looks) rows = look.aim(targets[target]);
          ++target;
        }
      }
      std::uint32_t at = 0, end = 0, row = 0;
      unsigned slot = 0;
      for (;;) {
        if (at == end && slot < held) {
          at = ranges[warp][slot][lane].x;
          end = ranges[warp][slot][lane].y;
          if (look.shares()) row = rows_of[warp][slot][lane];
          ++slot;
        }
        const bool live = at != end;
        if (!__any_sync(~0u, live)) break;
        bool hit = false;
        Pair pair;
        if (live) hit = look.test(pipeline::load(search.records + at++), row, pair);
        stage.add(hit, pair);
      }
      held = 0;
    }
  }
  stage.flush();
  tell_comparisons(sink, comparisons);
}

template <class Search>
constexpr auto search_kernel() noexcept {
  if constexpr (requires { typename Search::Look; })
    return run_looks<Search>;
  else
    return run_walks<Search>;
}

}  // namespace throng::cuda
