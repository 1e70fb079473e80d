// The search for pairs by warps: how the lanes go through their candidates together, and how what
// they find gets out.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/launch.cuh"
#include "cuda/warp.cuh"
#include "pipeline/pipeline.hpp"

namespace throng::cuda {

// Places of shared memory by their own addresses, which take a register where a pointer takes two
// and is made anew at each use.
__device__ inline std::uint32_t shared_address(const void* p) {
  return static_cast<std::uint32_t>(__cvta_generic_to_shared(p));
}
template <unsigned further = 0>
__device__ void put(std::uint32_t at, std::uint32_t a, std::uint32_t b) {
  asm volatile("st.shared.v2.u32 [%0 + %3], {%1, %2};" ::"r"(at), "r"(a), "r"(b), "n"(further)
               : "memory");
}
__device__ inline uint2 get(std::uint32_t at) {
  uint2 v;
  asm volatile("ld.shared.v2.u32 {%0, %1}, [%2];" : "=r"(v.x), "=r"(v.y) : "r"(at) : "memory");
  return v;
}
__device__ inline float4 get_four(std::uint32_t at) {
  float4 v;
  asm volatile("ld.shared.v4.f32 {%0, %1, %2, %3}, [%4];"
               : "=f"(v.x), "=f"(v.y), "=f"(v.z), "=f"(v.w)
               : "r"(at)
               : "memory");
  return v;
}

// Whether a pair that was found is one.
struct Sure {
  __device__ bool operator()(std::uint32_t, std::uint32_t) const { return true; }
};

// One warp's hits on their way out: gathered in shared memory, one atomic addition for some
// hundred. Before that they are checked, if there is anything to check.
template <class Check = Sure>
class WarpStage {
 public:
  static constexpr unsigned room = 128;

  __device__ WarpStage(Pair* stage, const pipeline::PairSink& sink, unsigned lane,
                       const Check& check = {})
      : stage_(shared_address(stage)), below_((1u << lane) - 1), sink_(sink), check_(check) {}

  // All lanes together; `hit` tells which have a pair.
  __device__ void add(bool hit, const Pair& pair) {
    const unsigned hits = __ballot_sync(~0u, hit);
    if (hit) put(stage_ + 8 * (held_ + __popc(hits & below_)), pair.first, pair.second);
    held_ += __popc(hits);
    if (held_ > room - 32) flush();
  }
  __device__ void flush() {
    settle();
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
  // From here on what is held is sure.
  __device__ void settle() {
    __syncwarp();
    if constexpr (std::is_same_v<Check, Sure>) return;
    unsigned kept = 0;
    for (unsigned k = 0; k < held_; k += 32) {
      const bool some = k + lane() < held_;
      const uint2 pair = get(stage_ + 8 * (some ? k + lane() : k));
      const bool hit = some && check_(pair.x, pair.y);
      const unsigned hits = __ballot_sync(~0u, hit);
      __syncwarp();  // all have read
      if (hit) put(stage_ + 8 * (kept + __popc(hits & below_)), pair.x, pair.y);
      kept += __popc(hits);
    }
    held_ = kept;
    __syncwarp();
  }
  __device__ unsigned held() const { return held_; }

 private:
  __device__ unsigned lane() const { return __popc(below_); }

  std::uint32_t stage_;
  unsigned below_, held_ = 0;  // below: a bit for each lane before this one
  const pipeline::PairSink& sink_;
  Check check_;
};

// What the warps of a block still hold, and their comparisons, with one addition for all of them:
// so many warps end at once that they would wait for one another at that one place of memory. All
// threads of a block.
template <class Stage>
__device__ void finish(Stage& stage, std::uint64_t comparisons, const pipeline::PairSink& sink) {
  constexpr unsigned warps = block_threads / 32;
  __shared__ unsigned long long held[warps], compared[warps];
  const unsigned warp = threadIdx.x / 32;
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  stage.settle();
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
  __shared__ Pair stages[block_threads / 32][WarpStage<>::room];
  const unsigned lane = threadIdx.x % 32;
  WarpStage<> stage(stages[threadIdx.x / 32], sink, lane);
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

// What a warp keeps in shared memory: its boxes, as halves of records, and candidates of all of
// them, each the record and who looks at it: where that box is, or its lane and the row. Small, for
// what is left of a processor's fast memory is the cache of the records.
struct WarpCandidates {
  static constexpr unsigned room = 256, at_once = 8;
  static_assert(32 * at_once <= room);
  // Where all lanes together have so many of at_once each, each goes through its own.
  static constexpr unsigned nearly_all = 208;
  float4 lower[32], upper[32];
  uint2 items[room];
};

// Four of the candidates that a lane puts down, from the first of them on, as far as there are any.
template <unsigned first>
__device__ void put_some(std::uint32_t to, unsigned some, std::uint32_t at, std::uint32_t who) {
  if (first + 0 < some) put<8 * (first + 0)>(to, at + first + 0, who);
  if (first + 1 < some) put<8 * (first + 1)>(to, at + first + 1, who);
  if (first + 2 < some) put<8 * (first + 2)>(to, at + first + 2, who);
  if (first + 3 < some) put<8 * (first + 3)>(to, at + first + 3, who);
}

// A warp's boxes in a grid. A lane has one box, a warp 32 that stand together and look into nearly
// the same cells. All lanes look up a row of cells each, together, and put down which records stand
// there; then the lanes share all that is put down, for some boxes have many more candidates than
// others. Lanes that are side by side read records that are side by side. `mixed`: as in Look.
// HostDevice has a twin of this.
template <bool mixed, class Search>
__device__ void look_around(const Search& search, const core::ClassGrid& cells,
                            const std::uint8_t* targets, unsigned target_count,
                            WarpCandidates& kept, WarpStage<>& stage, std::uint64_t& comparisons) {
  constexpr int row_bits = Search::row_bits + 1;  // a row, or all of them; the rest is a lane
  static_assert(row_bits + 5 <= 32);
  constexpr std::uint32_t row_mask = (1u << row_bits) - 1;
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t items = shared_address(kept.items), boxes = shared_address(kept.lower);
  const std::uint64_t count = search.count();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
       first < count; first += step) {
    const bool looks = first + lane < count;
    typename Search::template Look<mixed> look(search, cells, looks ? first + lane : count - 1);
    const pipeline::Record& box = look.box();
    kept.lower[lane] = {box.lower.x, box.lower.y, box.lower.z, __uint_as_float(box.id)};
    kept.upper[lane] = {box.upper.x, box.upper.y, box.upper.z, 0};
    unsigned next = 0, target = 0, rows = 0;
    std::uint32_t at = 0, end = 0, who = mixed ? 0 : boxes + lane * 16, candidates = 0;
    for (bool more = true; more;) {
      unsigned held = 0, some = 0;
      bool each_own = false;
      for (;;) {
        if (!__any_sync(~0u, at != end)) {
          if (!__any_sync(~0u, rows > 0)) {
            if (mixed && held > 0) break;  // they are the present target's
            more = next < target_count;
            if (!more) break;
            target = targets[next++];
            if (looks) rows = look.aim(target);
          }
          if (rows > 0) {
            --rows;
            const auto range = look.row();
            at = range.begin;
            end = range.end;
            candidates += end - at;
            if constexpr (mixed) who = lane << row_bits | range.row;
          }
        }
        // Of each lane's no more than there is room for in any case.
        some = end - at < WarpCandidates::at_once ? end - at : WarpCandidates::at_once;
        const unsigned up_to = warp_sums_up(some), all = __shfl_sync(~0u, up_to, 31);
        each_own = held == 0 && all >= WarpCandidates::nearly_all;
        if (each_own || held + all > WarpCandidates::room) break;
        const std::uint32_t to = items + 8 * (held + up_to - some);
        put_some<0>(to, some, at, who);
        if (__any_sync(~0u, some > 4)) put_some<4>(to, some, at, who);
        at += some;
        held += all;
      }
      __syncwarp();
      if (each_own) held = 32 * WarpCandidates::at_once;
      for (unsigned base = 0; base < held; base += 32) {
        bool live = base + lane < held;
        uint2 item;
        if (each_own) {
          live = base / 32 < some;
          item = {live ? at + base / 32 : 0, who};
        } else {
          item = get(items + 8 * (live ? base + lane : base));
        }
        const std::uint32_t own = mixed ? boxes + (item.y >> row_bits) * 16 : item.y;
        const pipeline::Record c = pipeline::load(search.records + item.x);
        const float4 low = get_four(own), high = get_four(own + sizeof kept.lower);
        const std::uint32_t id = __float_as_uint(low.w);
        bool hit =
            live & core::overlaps({{low.x, low.y, low.z}, {high.x, high.y, high.z}}, c.box());
        if constexpr (mixed || !Search::Plain)
          hit = hit && search.template allows<mixed>(cells, id, c, target, item.y & row_mask);
        stage.add(hit, search.pair(id, c));
      }
      if (each_own) at += some;
      __syncwarp();
    }
    comparisons += candidates;
  }
}

template <class Search>
__global__ void __launch_bounds__(block_threads, 4)
    run_looks(Search search, pipeline::PairSink sink) {
  constexpr unsigned warps = block_threads / 32;
  __shared__ Pair stages[warps][WarpStage<>::room];
  __shared__ WarpCandidates kept[warps];
  __shared__ core::ClassGrid cells;
  __shared__ std::uint8_t targets[Search::most_targets];
  __shared__ unsigned target_count;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const bool none = search.count() == 0;
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
  if (none) return;
  __syncthreads();
  WarpStage<> stage(stages[warp], sink, lane);
  std::uint64_t comparisons = 0;
  if (cells.hashed || !Search::Plain)
    look_around<true>(search, cells, targets, target_count, kept[warp], stage, comparisons);
  else
    look_around<false>(search, cells, targets, target_count, kept[warp], stage, comparisons);
  finish(stage, comparisons, sink);
}

}  // namespace throng::cuda
