// The search for pairs by warps: how the lanes go through their candidates together, and how what
// they find gets out.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/launch.cuh"
#include "pipeline/pipeline.hpp"

namespace throng::cuda {

// Places of shared memory by their own addresses, which take a register where a pointer takes two
// and is made anew at each use.
__device__ inline std::uint32_t shared_address(const void* p) {
  return static_cast<std::uint32_t>(__cvta_generic_to_shared(p));
}
__device__ inline void put(std::uint32_t at, std::uint32_t a, std::uint32_t b) {
  asm volatile("st.shared.v2.u32 [%0], {%1, %2};" ::"r"(at), "r"(a), "r"(b) : "memory");
}
__device__ inline uint2 get(std::uint32_t at) {
  uint2 v;
  asm volatile("ld.shared.v2.u32 {%0, %1}, [%2];" : "=r"(v.x), "=r"(v.y) : "r"(at) : "memory");
  return v;
}

// One warp's hits on their way out: gathered in shared memory, one atomic addition for some
// hundred.
class WarpStage {
 public:
  static constexpr unsigned room = 128;

  __device__ WarpStage(Pair* stage, const pipeline::PairSink& sink, unsigned lane)
      : stage_(shared_address(stage)), below_((1u << lane) - 1), sink_(sink) {}

  // All lanes together; `hit` tells which have a pair.
  __device__ void add(bool hit, const Pair& pair) {
    const unsigned hits = __ballot_sync(~0u, hit);
    if (hit) put(stage_ + 8 * (held_ + __popc(hits & below_)), pair.first, pair.second);
    held_ += __popc(hits);
    if (held_ > room - 32) flush();
  }
  __device__ void flush() {
    __syncwarp();
    unsigned long long at = 0;
    if (lane() == 0) {
      at = atomicAdd(reinterpret_cast<unsigned long long*>(&sink_.report->found),
                     static_cast<unsigned long long>(held_));
    }
    write(__shfl_sync(~0u, at, 0));
  }
  // Where a place for them has been claimed already.
  __device__ void write(unsigned long long at) {
    __syncwarp();
    for (unsigned k = lane(); k < held_; k += 32) {
      const uint2 pair = get(stage_ + 8 * k);
      if (at + k < sink_.capacity) sink_.out[at + k] = {pair.x, pair.y};
    }
    __syncwarp();
    held_ = 0;
  }
  __device__ unsigned held() const { return held_; }

 private:
  __device__ unsigned lane() const { return __popc(below_); }

  std::uint32_t stage_;
  unsigned below_, held_ = 0;  // below: a bit for each lane before this one
  const pipeline::PairSink& sink_;
};

// What the warps of a block still hold, and their comparisons, with one addition for all of them:
// so many warps end at once that they would wait for one another at that one place of memory. All
// threads of a block.
__device__ inline void finish(WarpStage& stage, std::uint64_t comparisons,
                              const pipeline::PairSink& sink) {
  constexpr unsigned warps = block_threads / 32;
  __shared__ unsigned long long held[warps], compared[warps];
  const unsigned warp = threadIdx.x / 32;
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  if (threadIdx.x % 32 == 0) {
    held[warp] = stage.held();
    compared[warp] = comparisons;
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    std::uint64_t pairs = 0, all = 0;
    for (unsigned k = 0; k < warps; ++k) {
      pairs += held[k];
      all += compared[k];
    }
    std::uint64_t at = pairs != 0 ? pipeline::fetch_add(&sink.report->found, pairs) : 0;
    if (all != 0) pipeline::fetch_add(&sink.report->comparisons, all);
    for (unsigned k = 0; k < warps; ++k) {
      const std::uint64_t own = held[k];
      held[k] = at;  // from here on where they go
      at += own;
    }
  }
  __syncthreads();
  stage.write(held[warp]);
}

// A lane walks by itself, where all have nearly the same to do: those from `begin` to `end`. The
// whole grid of blocks stays until all is done.
template <class Search>
__global__ void __launch_bounds__(block_threads)
    run_walks(Search search, pipeline::PairSink sink, std::uint64_t begin, std::uint64_t end) {
  __shared__ Pair stages[block_threads / 32][WarpStage::room];
  const unsigned lane = threadIdx.x % 32;
  WarpStage stage(stages[threadIdx.x / 32], sink, lane);
  const std::uint64_t all = search.count(), count = all < end ? all : end;
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  std::uint64_t comparisons = 0;
  // The bound is the same for all lanes of a warp.
  for (std::uint64_t first =
           begin + std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
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
  finish(stage, comparisons, sink);
}

// What the lanes of a warp keep of the rows that they have looked up: ranges that are not empty,
// and where records are mixed (Look) which rows they are. Small, for what is left of a processor's
// fast memory is the cache of the records.
struct WarpRanges {
  static constexpr unsigned words = 16;
  std::uint32_t kept[words][32];

  template <bool with_rows>
  static constexpr unsigned slots = words / (with_rows ? 3 : 2);
};

// A warp's boxes in a grid. A lane has one box, a warp 32 that stand together and look into nearly
// the same cells. First all lanes look up the rows of their cells, together, and keep the ranges;
// then each goes through the candidates in its own. `mixed`: as in Look. HostDevice has a
// twin of this.
template <bool mixed, class Search>
__device__ void look_around(const Search& search, const core::ClassGrid& cells,
                            const std::uint8_t* targets, unsigned target_count, WarpRanges& kept,
                            WarpStage& stage, std::uint64_t& comparisons) {
  const unsigned lane = threadIdx.x % 32;
  constexpr unsigned slots = WarpRanges::slots<mixed>;
  constexpr std::uint32_t next_slot = 32 * sizeof(uint2);
  const std::uint32_t ranges = shared_address(kept.kept) + lane * sizeof(uint2);
  std::uint32_t(*const row_of)[32] = kept.kept + 2 * slots;
  const std::uint64_t count = search.count();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
       first < count; first += step) {
    const bool looks = first + lane < count;
    typename Search::template Look<mixed> look(search, cells, looks ? first + lane : count - 1);
    unsigned target = 0, rows = 0, held = 0;
    std::uint32_t candidates = 0;
    for (bool more = true; more;) {
      for (;;) {
        if (__any_sync(~0u, rows > 0)) {
          if (rows > 0) {
            --rows;
            const auto range = look.row();
            if (range.begin != range.end) {
              put(ranges + held * next_slot, range.begin, range.end);
              if constexpr (mixed) row_of[held][lane] = range.row;
              candidates += range.end - range.begin;
              ++held;
            }
          }
          if (__any_sync(~0u, held == slots)) break;
        } else {
          if (mixed && __any_sync(~0u, held > 0)) break;  // they are the present target's
          more = target < target_count;
          if (!more) break;
          if (looks) rows = look.aim(targets[target]);
          ++target;
        }
      }
      std::uint32_t at = 0, end = 0, row = 0;
      std::uint32_t slot = ranges;
      const std::uint32_t last_slot = ranges + held * next_slot;
      for (;;) {
        if (at == end && slot != last_slot) {
          const uint2 range = get(slot);
          at = range.x;
          end = range.y;
          if constexpr (mixed) row = row_of[(slot - ranges) / next_slot][lane];
          slot += next_slot;
        }
        const bool live = at != end;
        if (!__any_sync(~0u, live)) break;
        // Lanes that are done read some record, too: that costs less than a branch.
        const pipeline::Record c = pipeline::load(search.records + (live ? at : 0));
        bool hit = live & look.meets(c);
        if constexpr (mixed || !Search::Plain) hit = hit && look.allows(c, row);
        stage.add(hit, look.pair(c));
        at += live;
      }
      held = 0;
    }
    comparisons += candidates;
  }
}

template <class Search>
__global__ void __launch_bounds__(block_threads, 4)
    run_looks(Search search, pipeline::PairSink sink) {
  constexpr unsigned warps = block_threads / 32;
  __shared__ Pair stages[warps][WarpStage::room];
  __shared__ WarpRanges ranges[warps];
  __shared__ core::ClassGrid cells;
  __shared__ std::uint8_t targets[Search::most_targets];
  __shared__ unsigned target_count;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  static_assert(sizeof cells % 4 == 0 && std::is_trivially_copyable_v<core::ClassGrid>);
  for (unsigned k = threadIdx.x; k < sizeof cells / 4; k += block_threads)
    reinterpret_cast<std::uint32_t*>(&cells)[k] =
        reinterpret_cast<const std::uint32_t*>(search.grid)[k];
  if (warp == 0) {  // what is looked into at all
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
  std::uint64_t comparisons = 0;
  if (cells.hashed || !Search::Plain)
    look_around<true>(search, cells, targets, target_count, ranges[warp], stage, comparisons);
  else
    look_around<false>(search, cells, targets, target_count, ranges[warp], stage, comparisons);
  finish(stage, comparisons, sink);
}

}  // namespace throng::cuda
