// The pair search by warps: how the lanes share their candidates, and how hits are written.
#pragma once

#include <cstdint>
#include <type_traits>

#include "cuda/launch.cuh"
#include "cuda/warp.cuh"
#include "device/pipeline.hpp"

namespace throng::cuda {

// Shared memory by its own 32-bit addresses. A generic pointer takes two registers and is converted
// again at each use.
__device__ inline std::uint32_t shared_address(const void* p) {
  return static_cast<std::uint32_t>(__cvta_generic_to_shared(p));
}
template <unsigned offset_bytes = 0>
__device__ void store_shared(std::uint32_t at, std::uint32_t a, std::uint32_t b) {
  asm volatile("st.shared.v2.u32 [%0 + %3], {%1, %2};" ::"r"(at), "r"(a), "r"(b), "n"(offset_bytes)
               : "memory");
}
__device__ inline uint2 load_shared(std::uint32_t at) {
  uint2 v;
  asm volatile("ld.shared.v2.u32 {%0, %1}, [%2];" : "=r"(v.x), "=r"(v.y) : "r"(at) : "memory");
  return v;
}
__device__ inline float4 load_shared4(std::uint32_t at) {
  float4 v;
  asm volatile("ld.shared.v4.f32 {%0, %1, %2, %3}, [%4];"
               : "=f"(v.x), "=f"(v.y), "=f"(v.z), "=f"(v.w)
               : "r"(at)
               : "memory");
  return v;
}

using device::AcceptAll;

// A check whose data stay where they are: a kernel's parameters take no registers.
template <class Check>
struct CheckReference {
  const Check& check;
  __device__ bool operator()(std::uint32_t i, std::uint32_t j) const { return check(i, j); }
  __device__ void add_candidates(std::uint64_t count) const { check.add_candidates(count); }
};
template <class Check>
using HeldCheck =
    std::conditional_t<std::is_same_v<Check, AcceptAll>, AcceptAll, CheckReference<Check>>;

// Output buffer of one warp: collects hits in shared memory and writes some hundred with one atomic
// addition. Applies `Check` to the hits before writing: each lane takes hits by their number.
template <class Check = AcceptAll>
class WarpOutputBuffer {
 public:
  static constexpr unsigned max_held = 128;

  __device__ WarpOutputBuffer(Pair* pairs, const device::PairSink& sink, unsigned lane,
                              const Check& check = {})
      : pairs_(shared_address(pairs)), below_((1u << lane) - 1), sink_(sink), check_(check) {}

  // Called by all lanes; `hit`: whether this lane has a pair.
  __device__ void add(bool hit, const Pair& pair) {
    const unsigned hits = __ballot_sync(~0u, hit);
    if (hit) store_shared(pairs_ + 8 * (held_ + __popc(hits & below_)), pair.first, pair.second);
    held_ += __popc(hits);
    if (held_ > max_held - 32) flush();
  }
  __device__ void flush() {
    apply_check();
    unsigned long long at = 0;
    if (lane() == 0) {
      at = atomicAdd(reinterpret_cast<unsigned long long*>(&sink_.report->found),
                     static_cast<unsigned long long>(held_));
    }
    write(__shfl_sync(~0u, at, 0));
  }
  // Writes the hits to a place that is already claimed.
  __device__ void write(unsigned long long at) {
    __syncwarp();
    for (unsigned k = lane(); k < held_; k += 32) {
      const uint2 pair = load_shared(pairs_ + 8 * k);
      if (at + k < sink_.capacity) sink_.out[at + k] = {pair.x, pair.y};
    }
    __syncwarp();
    held_ = 0;
  }
  // Applies the check: from here on all held pairs are hits.
  __device__ void apply_check() {
    __syncwarp();
    if constexpr (std::is_same_v<Check, AcceptAll>) return;
    if constexpr (counts_candidates) candidates_ += held_;
    unsigned kept = 0;
    for (unsigned k = 0; k < held_; k += 32) {
      const bool some = k + lane() < held_;
      const uint2 pair = load_shared(pairs_ + 8 * (some ? k + lane() : k));
      const bool hit = some && check_(pair.x, pair.y);
      const unsigned hits = __ballot_sync(~0u, hit);
      __syncwarp();  // all lanes have read
      if (hit) store_shared(pairs_ + 8 * (kept + __popc(hits & below_)), pair.x, pair.y);
      kept += __popc(hits);
    }
    held_ = kept;
    __syncwarp();
  }
  __device__ unsigned held() const { return held_; }

  static constexpr bool counts_candidates = requires(const Check& check) {
    check.add_candidates(std::uint64_t{});
  };
  __device__ std::uint64_t candidates() const { return candidates_; }
  __device__ const Check& check() const { return check_; }

 private:
  __device__ unsigned lane() const { return __popc(below_); }

  std::uint32_t pairs_;
  unsigned below_, held_ = 0;  // below: a bit for each lane before this one
  std::uint64_t candidates_ = 0;
  const device::PairSink& sink_;
  Check check_;
};

// Writes the remaining hits and the comparisons of all warps of a block with one atomic addition.
// Many warps end at once and would contend for that one address. Called by all threads of a block.
template <class OutputBuffer>
__device__ void finish(OutputBuffer& output, std::uint64_t comparisons,
                       const device::PairSink& sink) {
  constexpr unsigned warps = block_threads / 32;
  __shared__ unsigned long long held[warps], compared[warps], candidates[warps];
  const unsigned warp = threadIdx.x / 32;
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  output.apply_check();
  if (threadIdx.x % 32 == 0) {
    held[warp] = output.held();
    compared[warp] = comparisons;
    if constexpr (OutputBuffer::counts_candidates) candidates[warp] = output.candidates();
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    std::uint64_t pairs = 0, all = 0;
    for (unsigned k = 0; k < warps; ++k) {
      pairs += held[k];
      all += compared[k];
    }
    std::uint64_t at = pairs != 0 ? device::fetch_add(&sink.report->found, pairs) : 0;
    if (all != 0) device::fetch_add(&sink.report->comparisons, all);
    if constexpr (OutputBuffer::counts_candidates) {
      std::uint64_t sum = 0;
      for (unsigned k = 0; k < warps; ++k) sum += candidates[k];
      if (sum != 0) output.check().add_candidates(sum);
    }
    for (unsigned k = 0; k < warps; ++k) {
      const std::uint64_t own = held[k];
      held[k] = at;  // from here on: the place of the warp's hits
      at += own;
    }
  }
  __syncthreads();
  output.write(held[warp]);
}

// Blocks per SM that kernels must allow, so a bound on the registers of a thread. A check takes
// more of them.
template <class Check>
constexpr unsigned walk_blocks = std::is_same_v<Check, AcceptAll> ? 0 : 2;
template <class Check>
constexpr unsigned grid_blocks = std::is_same_v<Check, AcceptAll> ? 4 : 2;

// One walk per lane, for searches of nearly equal work: indices from `begin` to `end`. Grid-stride
// loop.
template <class Search, class Check>
__global__ void __launch_bounds__(block_threads, walk_blocks<Check>)
    run_walks(Search search, device::PairSink sink, Check check, std::uint64_t begin,
              std::uint64_t end) {
  using OutputBuffer = WarpOutputBuffer<HeldCheck<Check>>;
  __shared__ Pair outputs[block_threads / 32][OutputBuffer::max_held];
  const unsigned lane = threadIdx.x % 32;
  OutputBuffer output(outputs[threadIdx.x / 32], sink, lane, {check});
  const std::uint64_t all = search.count(), count = all < end ? all : end;
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  std::uint64_t comparisons = 0;
  // The bound is the same for all lanes of a warp.
  for (std::uint64_t first =
           begin + std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
       first < count; first += step) {
    const std::uint64_t i = first + lane;
    auto walk = search.begin(i < count ? i : count - 1);
    bool active = i < count && !walk.over();
    while (__any_sync(~0u, active)) {
      bool hit = false;
      Pair pair;
      if (active) {
        hit = walk.step(pair);
        active = !walk.over();
      }
      output.add(hit, pair);
    }
    if (i < count) comparisons += walk.comparisons();
  }
  finish(output, comparisons, sink);
}

// A warp's shared memory: its boxes, as halves of records, and candidates of all of them. A
// candidate is a record and its searcher: the address of that box, or its lane and the row. Small,
// because the rest of the SM's shared memory serves as L1 cache for the records.
struct WarpCandidates {
  static constexpr unsigned max_held = 256, per_lane = 8;
  static_assert(32 * per_lane <= max_held);
  // If the lanes together have this many of per_lane each, every lane tests its own candidates.
  static constexpr unsigned direct_threshold = 208;
  float4 lower[32], upper[32];
  uint2 items[max_held];
};

// Stores up to four of a lane's candidates, from the first-th on.
template <unsigned first>
__device__ void store_candidates(std::uint32_t to, unsigned some, std::uint32_t at,
                                 std::uint32_t who) {
  if (first + 0 < some) store_shared<8 * (first + 0)>(to, at + first + 0, who);
  if (first + 1 < some) store_shared<8 * (first + 1)>(to, at + first + 1, who);
  if (first + 2 < some) store_shared<8 * (first + 2)>(to, at + first + 2, who);
  if (first + 3 < some) store_shared<8 * (first + 3)>(to, at + first + 3, who);
}

// Searches a grid with one box per lane. The 32 boxes of a warp are adjacent and search nearly the
// same cells. Each lane finds the records of one row of cells and stores them as candidates. Then
// the lanes share all candidates, because some boxes have many more than others. Adjacent lanes
// read adjacent records. `mixed`: as in GridQuery. HostDevice::search_grid_rows is the host
// implementation.
template <bool mixed, class Search, class OutputBuffer>
__device__ void search_grid_rows(const Search& search, const base::SizeClassGrid& cells,
                                 const std::uint8_t* targets, unsigned target_count,
                                 WarpCandidates& kept, OutputBuffer& output,
                                 std::uint64_t& comparisons) {
  constexpr int row_bits = Search::row_bits + 1;  // a row, or all of them; the rest is a lane
  static_assert(row_bits + 5 <= 32);
  constexpr std::uint32_t row_mask = (1u << row_bits) - 1;
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t items = shared_address(kept.items), boxes = shared_address(kept.lower);
  const std::uint64_t count = search.count();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t first = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x / 32 * 32;
       first < count; first += step) {
    const bool has_box = first + lane < count;
    typename Search::template GridQuery<mixed> query(search, cells,
                                                     has_box ? first + lane : count - 1);
    const device::Record& box = query.box();
    kept.lower[lane] = {box.lower.x, box.lower.y, box.lower.z, __uint_as_float(box.id)};
    kept.upper[lane] = {box.upper.x, box.upper.y, box.upper.z, 0};
    unsigned next = 0, target = 0, rows = 0;
    std::uint32_t at = 0, end = 0, who = mixed ? 0 : boxes + lane * 16, candidates = 0;
    for (bool more = true; more;) {
      unsigned held = 0, some = 0;
      bool own_candidates = false;
      for (;;) {
        if (!__any_sync(~0u, at != end)) {
          if (!__any_sync(~0u, rows > 0)) {
            if (mixed && held > 0) break;  // these belong to the current target
            more = next < target_count;
            if (!more) break;
            target = targets[next++];
            if (has_box) rows = query.select_target(target);
          }
          if (rows > 0) {
            --rows;
            const auto range = query.row();
            at = range.begin;
            end = range.end;
            candidates += end - at;
            if constexpr (mixed) who = lane << row_bits | range.row;
          }
        }
        // Of each lane no more than is certain to fit.
        some = end - at < WarpCandidates::per_lane ? end - at : WarpCandidates::per_lane;
        const unsigned up_to = warp_inclusive_sum(some), all = __shfl_sync(~0u, up_to, 31);
        own_candidates = held == 0 && all >= WarpCandidates::direct_threshold;
        if (own_candidates || held + all > WarpCandidates::max_held) break;
        const std::uint32_t to = items + 8 * (held + up_to - some);
        store_candidates<0>(to, some, at, who);
        if (__any_sync(~0u, some > 4)) store_candidates<4>(to, some, at, who);
        at += some;
        held += all;
      }
      __syncwarp();
      if (own_candidates) held = 32 * WarpCandidates::per_lane;
      for (unsigned base = 0; base < held; base += 32) {
        bool active = base + lane < held;
        uint2 item;
        if (own_candidates) {
          active = base / 32 < some;
          item = {active ? at + base / 32 : 0, who};
        } else {
          item = load_shared(items + 8 * (active ? base + lane : base));
        }
        const std::uint32_t own = mixed ? boxes + (item.y >> row_bits) * 16 : item.y;
        const device::Record c = device::load(search.records + item.x);
        const float4 low = load_shared4(own), high = load_shared4(own + sizeof kept.lower);
        const std::uint32_t id = __float_as_uint(low.w);
        bool hit =
            active & base::overlaps({{low.x, low.y, low.z}, {high.x, high.y, high.z}}, c.box());
        if constexpr (mixed || !Search::is_plain)
          hit = hit && search.template allows<mixed>(cells, id, c, target, item.y & row_mask);
        output.add(hit, search.pair(id, c));
      }
      if (own_candidates) at += some;
      __syncwarp();
    }
    comparisons += candidates;
  }
}

template <class Search, class Check>
__global__ void __launch_bounds__(block_threads, grid_blocks<Check>)
    run_grid_search(Search search, device::PairSink sink, Check check) {
  constexpr unsigned warps = block_threads / 32;
  using OutputBuffer = WarpOutputBuffer<HeldCheck<Check>>;
  __shared__ Pair outputs[warps][OutputBuffer::max_held];
  __shared__ WarpCandidates kept[warps];
  __shared__ base::SizeClassGrid cells;
  __shared__ std::uint8_t targets[Search::max_targets];
  __shared__ unsigned target_count;
  const unsigned lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const bool none = search.count() == 0;
  static_assert(sizeof cells % 4 == 0 && std::is_trivially_copyable_v<base::SizeClassGrid>);
  for (unsigned k = threadIdx.x; k < sizeof cells / 4; k += block_threads)
    reinterpret_cast<std::uint32_t*>(&cells)[k] =
        reinterpret_cast<const std::uint32_t*>(search.grid)[k];
  if (warp == 0) {  // the targets that contain boxes
    unsigned held = 0;
    for (unsigned k = lane; k < Search::max_targets; k += 32) {
      const bool one = search.occupied[k] != 0;
      const unsigned some = __ballot_sync(~0u, one);
      if (one) targets[held + __popc(some & ((1u << lane) - 1))] = static_cast<std::uint8_t>(k);
      held += __popc(some);
    }
    if (lane == 0) target_count = held;
  }
  if (none) return;
  __syncthreads();
  OutputBuffer output(outputs[warp], sink, lane, {check});
  std::uint64_t comparisons = 0;
  if (cells.hashed || !Search::is_plain)
    search_grid_rows<true>(search, cells, targets, target_count, kept[warp], output, comparisons);
  else
    search_grid_rows<false>(search, cells, targets, target_count, kept[warp], output, comparisons);
  finish(output, comparisons, sink);
}

}  // namespace throng::cuda
