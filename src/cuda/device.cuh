// The Device that is a GPU: launches on one stream, scratch memory of its own, nothing waited for
// except where it says so. The pipeline's function objects run in the kernels below; what is
// written here is only what a block or a warp does together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/buckets.cuh"
#include "cuda/check.hpp"
#include "cuda/launch.cuh"
#include "cuda/upload.hpp"
#include "pipeline/order.hpp"
#include "pipeline/pipeline.hpp"

namespace throng::cuda {

// The phases of a function object for one block, with a barrier after each.
template <class F>
__global__ void __launch_bounds__(F::threads) run_phases(F f) {
  __shared__ typename F::Shared shared;
  for (int phase = 0; phase < F::phases; ++phase) {
    f(phase, threadIdx.x, shared);
    __syncthreads();
  }
}

// One warp's hits on their way out: gathered in shared memory, one atomic addition for some
// hundred.
class WarpStage {
 public:
  static constexpr unsigned room = 256;

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

// A lane walks through the candidates of one box; a warp takes 32 boxes that stand together, which
// look into nearly the same cells. The whole grid of blocks stays until all is done.
template <class Search>
__global__ void __launch_bounds__(block_threads)
    run_search(Search search, pipeline::PairSink sink) {
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
  for (int half = 16; half > 0; half /= 2) comparisons += __shfl_down_sync(~0u, comparisons, half);
  if (lane == 0 && comparisons != 0) pipeline::fetch_add(&sink.report->comparisons, comparisons);
}

class Device {
 public:
  // What launches need to know of the GPU. Failure: no_device.
  explicit Device(const Memory& memory) : memory_(memory) {
    check(cudaGetDevice(&device_));
    check(cudaDeviceGetAttribute(&processors_, cudaDevAttrMultiProcessorCount, device_));
  }

  ~Device() {
    for (const cudaEvent_t event : events_)
      if (event) (void)cudaEventDestroy(event);
    give_back();
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // What follows is for this stream; `measure`: with an event after each stage.
  void begin(cudaStream_t stream, bool measure) {
    stream_ = stream;
    measuring_ = measure;
    seen_ = 0;
    if (!measure) return;
    for (cudaEvent_t& event : events_)
      if (!event) check(cudaEventCreate(&event));
    check(cudaEventRecord(events_[0], stream_));
  }
  cudaStream_t stream() const noexcept { return stream_; }
  int ordinal() const noexcept { return device_; }

  void* allocate(std::size_t bytes) const { return memory_.allocate(bytes, stream_); }
  void release(void* p, std::size_t bytes) const noexcept { memory_.release(p, bytes, stream_); }

  static constexpr bool reaches_host_memory = false;
  // Boxes of host memory on their way here; see cuda/upload.hpp.
  static std::size_t boxes_bytes(const Boxes& boxes) noexcept { return bytes_on_device(boxes); }
  Boxes bring(const Boxes& boxes, char*& to) { return upload(boxes, to, staging_, stream_); }
  static constexpr std::size_t staging_bytes = Staging::total_bytes;
  std::size_t held() const noexcept { return staging_.held() + copy_bytes_; }
  // What can be had again.
  void give_back() noexcept {
    if (copy_) (void)cudaFreeHost(copy_);
    copy_ = nullptr;
    copy_bytes_ = 0;
  }

  template <class F>
  void launch(std::uint64_t count, const F& f) const {
    if (count == 0) return;
    run_each<<<blocks(count, 8), block_threads, 0, stream_>>>(count, f);
    check(cudaGetLastError());
  }
  void plan(const pipeline::PlanGrid& f) const {
    run_phases<<<1, pipeline::PlanGrid::threads, 0, stream_>>>(f);
    check(cudaGetLastError());
  }
  void clear(void* p, std::size_t bytes) const { check(cudaMemsetAsync(p, 0, bytes, stream_)); }
  void copy(void* to, const void* from, std::size_t bytes) const {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_));
  }

  // Scratch that the scan and the sort of so many values need.
  static std::size_t scan_bytes(std::size_t count) {
    std::size_t bytes = 0;
    std::uint32_t* none = nullptr;
    check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, none, none, count));
    return bytes;
  }
  // For as many keys again, and the sort's own scratch.
  static std::size_t sort_bytes(std::size_t count) {
    std::size_t bytes = 0;
    cub::DoubleBuffer<std::uint64_t> none;
    check(cub::DeviceRadixSort::SortKeys(nullptr, bytes, none, count));
    return keys_bytes(count) + bytes;
  }

  static constexpr std::uint32_t buckets_above = THRONG_GPU_BUCKETS_ABOVE;
  void count_buckets(std::uint64_t count, const pipeline::CountBuckets& f) const {
    run_count_buckets<<<blocks(count, 8), block_threads, 0, stream_>>>(count, f);
    check(cudaGetLastError());
  }
  void fill_buckets(std::uint64_t count, const pipeline::FillBuckets& f) const {
    const auto tiles = static_cast<unsigned>((count + tile_boxes - 1) / tile_boxes);
    run_fill_buckets<<<tiles, tile_threads, 0, stream_>>>(f);
    check(cudaGetLastError());
  }

  void use_scratch(void* p, std::size_t bytes) noexcept {
    scratch_ = p;
    scratch_bytes_ = bytes;
  }
  void scan(std::uint32_t* values, std::size_t count) const {
    std::size_t bytes = scratch_bytes_;
    check(cub::DeviceScan::ExclusiveSum(scratch_, bytes, values, values, count, stream_));
  }
  template <class Search>
  void search(std::uint64_t bound, const Search& search, const pipeline::PairSink& sink) const {
    if (bound == 0) return;
    int resident = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, run_search<Search>,
                                                        block_threads, 0));
    run_search<<<blocks(bound, static_cast<unsigned>(resident)), block_threads, 0, stream_>>>(
        search, sink);
    check(cudaGetLastError());
  }
  // The report's pairs, of which `count` may be, from `pairs`, whose contents are lost, to `out`,
  // with sort_bytes(count) at `room`. Nothing is written where they are more than `capacity`.
  void sort(Pair* pairs, void* room, std::size_t room_bytes, Pair* out, std::uint64_t capacity,
            std::uint64_t count, const Report* report, const pipeline::Input& in) const {
    if (count == 0) return;
    const auto shape = pipeline::PairKeys::of(in);
    auto* keys = reinterpret_cast<std::uint64_t*>(pairs);
    launch(count, pipeline::PackPairs{pairs, keys, report, capacity, shape});
    cub::DoubleBuffer<std::uint64_t> buffers(keys, static_cast<std::uint64_t*>(room));
    std::size_t bytes = room_bytes - keys_bytes(count);
    check(cub::DeviceRadixSort::SortKeys(static_cast<char*>(room) + keys_bytes(count), bytes,
                                         buffers, count, 0, shape.bits(), stream_));
    launch(count, pipeline::UnpackPairs{buffers.Current(), out, report, capacity, shape});
  }

  // These wait.
  template <class T>
  T read(const T& value) const {
    T copy;
    check(cudaMemcpyAsync(&copy, &value, sizeof copy, cudaMemcpyDeviceToHost, stream_));
    check(cudaStreamSynchronize(stream_));
    return copy;
  }
  template <class T>
  void read(const T* from, T* to, std::size_t count) {
    (void)in_pieces(from, count, [&](const T* values, std::size_t n) {
      to = std::copy_n(values, n, to);
      return true;
    });
  }
  // take(values, n) of all in turn, each in host memory until it returns; false stops, and is told.
  template <class T, class F>
  bool in_pieces(const T* values, std::size_t count, const F& take) {
    return staging_.receive(values, count, stream_, take);
  }
  // A copy in host memory of its own, good until the next.
  template <class T>
  const T* host_copy(const T* values, std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes > copy_bytes_) {
      give_back();
      check(cudaMallocHost(&copy_, bytes));
      copy_bytes_ = bytes;
    }
    check(cudaMemcpyAsync(copy_, values, bytes, cudaMemcpyDeviceToHost, stream_));
    check(cudaStreamSynchronize(stream_));
    return static_cast<const T*>(copy_);
  }

  void mark(pipeline::Stage stage) {
    if (!measuring_) return;
    const auto k = static_cast<unsigned>(stage);
    check(cudaEventRecord(events_[k + 1], stream_));
    seen_ |= 1u << k;
  }
  // Of the stages marked since begin(); waits for them.
  StageTimes times() const {
    StageTimes times;
    double* const of[] = {&times.plan_ms, &times.bin_ms, &times.find_ms, &times.order_ms};
    unsigned last = 0;
    for (unsigned k = 0; k < 4; ++k) {
      if (!(seen_ >> k & 1)) continue;
      float ms = 0;
      check(cudaEventSynchronize(events_[k + 1]));
      check(cudaEventElapsedTime(&ms, events_[last], events_[k + 1]));
      *of[k] = static_cast<double>(ms);
      times.total_ms += static_cast<double>(ms);
      last = k + 1;
    }
    return times;
  }

 private:
  static std::size_t keys_bytes(std::size_t count) noexcept {
    return rounded(count * sizeof(std::uint64_t));
  }
  unsigned blocks(std::uint64_t count, unsigned each) const noexcept {
    return blocks_for(count, each, processors_);
  }
  const Memory& memory_;
  int device_ = 0, processors_ = 1;
  cudaStream_t stream_ = nullptr;
  void* scratch_ = nullptr;
  std::size_t scratch_bytes_ = 0;
  bool measuring_ = false;
  unsigned seen_ = 0;
  cudaEvent_t events_[5] = {};
  Staging staging_;
  void* copy_ = nullptr;
  std::size_t copy_bytes_ = 0;
};

}  // namespace throng::cuda
