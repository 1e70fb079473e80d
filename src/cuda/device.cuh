// The GPU as a Device: launches on one stream, with its own scratch memory. Asynchronous, except
// where noted. The kernels below run the pipeline's function objects; this code adds only what a
// block or warp does collectively.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/cell_sort.cuh"
#include "cuda/cell_sums.cuh"
#include "cuda/check.hpp"
#include "cuda/gather.cuh"
#include "cuda/launch.cuh"
#include "cuda/mailbox.cuh"
#include "cuda/pair_sorter.cuh"
#include "cuda/search.cuh"
#include "cuda/side_stream.cuh"
#include "cuda/upload.hpp"
#include "cuda/worlds.cuh"
#include "device/pair_keys.hpp"
#include "device/pipeline.hpp"

namespace throng::cuda {

// Block 0 runs the phases of a function object, with a barrier after each. The other blocks write
// `count` * 16 zero bytes meanwhile, if wanted.
template <class F>
__global__ void __launch_bounds__(F::threads) run_phases(F f, uint4* zeros, std::uint64_t count) {
  __shared__ typename F::Shared shared;
  if (blockIdx.x > 0) {
    if (!f.wanted()) return;
    const std::uint64_t step = std::uint64_t{gridDim.x - 1} * F::threads;
    for (std::uint64_t k = std::uint64_t{blockIdx.x - 1} * F::threads + threadIdx.x; k < count;
         k += step)
      zeros[k] = {0, 0, 0, 0};
    return;
  }
  f(shared, [](const auto& phase) {
    phase(threadIdx.x);
    __syncthreads();
  });
}

class Device {
  using Sorter = device::PairSorter<device::DeviceSortSizes>;
  // Some milliseconds of brute force.
  static constexpr std::uint64_t walks_per_stop_check = std::uint64_t{1} << 24;
  static constexpr std::size_t sort_shared_bytes = sizeof(SortMemory<Sorter>::Dynamic);

 public:
  // Reads the device properties that launches need. Failure: no_device.
  explicit Device(const Memory& memory) : memory_(memory) {
    check(cudaGetDevice(&device_));
    check(cudaDeviceGetAttribute(&sm_count_, cudaDevAttrMultiProcessorCount, device_));
    int scratch = 0, cooperative = 0;
    check(cudaDeviceGetAttribute(&scratch, cudaDevAttrMaxSharedMemoryPerBlockOptin, device_));
    check(cudaDeviceGetAttribute(&cooperative, cudaDevAttrCooperativeLaunch, device_));
    if (!cooperative || static_cast<std::size_t>(scratch) < sort_shared_bytes) return;
    allow_shared_memory(run_pair_sorter<Sorter>, sort_shared_bytes);
    int blocks = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, run_pair_sorter<Sorter>,
                                                        sort_threads, sort_shared_bytes));
    sort_blocks_ = static_cast<unsigned>(blocks * sm_count_);
  }

  ~Device() {
    for (const cudaEvent_t event : events_)
      if (event) (void)cudaEventDestroy(event);
    release_host_copy();
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // Sets the stream of the following calls. `measure`: records an event after each stage. Once
  // *stop is true, throws Failure: stopped, soon; then the stream is synchronized between launches.
  void begin(cudaStream_t stream, bool measure, const std::atomic<bool>* stop = nullptr) {
    (void)cudaGetLastError();  // an earlier error of the caller is not an error of this call
    stream_ = stream;
    measuring_ = measure;
    stop_ = stop;
    marked_stages_ = 0;
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
  // Copies boxes from host memory; see cuda/upload.hpp.
  static std::size_t boxes_bytes(const Boxes& boxes) noexcept { return bytes_on_device(boxes); }
  Boxes copy_boxes(const Boxes& boxes, char*& to) { return upload(boxes, to, staging_, stream_); }
  // The same of a mesh.
  static std::size_t mesh_bytes(const TriangleMesh& mesh) noexcept { return bytes_on_device(mesh); }
  TriangleMesh copy_mesh(const TriangleMesh& mesh, char*& to) {
    return upload(mesh, to, staging_, stream_);
  }
  static constexpr std::size_t staging_bytes = Staging::total_bytes;
  std::size_t held() const noexcept { return staging_.held() + copy_bytes_; }
  // Frees what can be allocated again.
  void release_host_copy() noexcept {
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
  // Zeroes whole multiples of 256 bytes, which is how arrays are carved.
  void plan(const device::PlanGrid& f, void* cleared, std::size_t bytes) const {
    const std::uint64_t count = (bytes + 255) / 256 * 16;
    constexpr std::uint64_t a_block = std::uint64_t{8} * device::PlanGrid::threads;
    const std::uint64_t more =
        std::min<std::uint64_t>((count + a_block - 1) / a_block, static_cast<unsigned>(sm_count_));
    run_phases<<<1 + static_cast<unsigned>(more), device::PlanGrid::threads, 0, stream_>>>(
        f, static_cast<uint4*>(cleared), count);
    check(cudaGetLastError());
  }
  void clear(void* p, std::size_t bytes) const { check(cudaMemsetAsync(p, 0, bytes, stream_)); }
  void copy(void* to, const void* from, std::size_t bytes) const {
    check(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream_));
  }

  // Scratch bytes of a scan and a sort of `count` values.
  static std::size_t scan_bytes(std::size_t count) {
    std::size_t bytes = 0;
    std::uint32_t* none = nullptr;
    check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, none, none, count));
    return bytes;
  }
  // For a second array of keys and the sort's own scratch; non-decreasing in `count`.
  static std::size_t sort_bytes(std::size_t count) {
    std::size_t bytes = 0;
    cub::DoubleBuffer<std::uint64_t> none;
    check(cub::DeviceRadixSort::SortKeys(nullptr, bytes, none, count));
    const std::size_t few = count < Sorter::max_pairs ? count : Sorter::max_pairs;
    return std::max(keys_bytes(count) + bytes, Sorter::bytes(few));
  }

  static constexpr std::uint32_t sorted_above = THRONG_GPU_SORTED_ABOVE;
  static std::size_t sort_cells_bytes(std::size_t count) {
    std::size_t bytes = 0;
    cub::DoubleBuffer<std::uint32_t> none;
    check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, none, none, count));
    return bytes;
  }
  // Each array has two halves of `capacity` entries; both may be overwritten.
  device::SortedCells sort_cells(std::uint32_t* keys, std::uint32_t* values, std::size_t capacity,
                                 std::size_t count, int begin, int end) const {
    cub::DoubleBuffer<std::uint32_t> of_keys(keys, keys + capacity),
        of_values(values, values + capacity);
    std::size_t bytes = scratch_bytes_;
    check(cub::DeviceRadixSort::SortPairs(scratch_, bytes, of_keys, of_values, count, begin, end,
                                          stream_));
    return {of_keys.Current(), of_values.Current()};
  }
  void place(std::uint32_t count, const device::PlaceBuckets& f) const {
    const auto kernel = run_place_buckets<device::PlaceBuckets>;
    const std::size_t bytes = f.buckets.cells() * sizeof(std::uint32_t);
    // The maximum of any call, because the attribute is shared by all threads of the process.
    allow_shared_memory(kernel, device::Buckets::max_cells * sizeof(std::uint32_t));
    kernel<<<f.buckets.count(), bucket_threads, bytes, stream_>>>(f, count);
    check(cudaGetLastError());
  }

  void use_scratch(void* p, std::size_t bytes) noexcept {
    scratch_ = p;
    scratch_bytes_ = bytes;
  }
  static std::size_t scan_cells_bytes(std::size_t cells) noexcept {
    return CellSums::pieces(cells) * sizeof(std::uint64_t);
  }
  // Table and words are carved in multiples of 256 bytes.
  void scan_cells(const std::uint32_t* wanted, std::uint32_t* table, std::size_t cells,
                  std::uint64_t* words) const {
    run_cell_sums<<<static_cast<unsigned>(CellSums::pieces(cells)), CellSums::threads, 0,
                    stream_>>>(wanted, reinterpret_cast<uint4*>(table),
                               static_cast<std::uint32_t>((cells + 3) / 4), words);
    check(cudaGetLastError());
  }
  void scan(std::uint32_t* values, std::size_t count) const {
    std::size_t bytes = scratch_bytes_;
    check(cub::DeviceScan::ExclusiveSum(scratch_, bytes, values, values, count, stream_));
  }
  template <class Search, class Check = AcceptAll>
  void search(std::uint64_t bound, const Search& search, const device::PairSink& sink,
              const Check& test = {}) const {
    if (bound == 0) return;
    if constexpr (requires { Search::max_in_world; }) {
      static_assert(std::is_same_v<Check, AcceptAll>);
      const auto kernel = run_worlds<Search>;
      kernel<<<blocks(bound, resident(kernel)), block_threads, 0, stream_>>>(search, sink);
      check(cudaGetLastError());
    } else if constexpr (requires { Search::max_targets; }) {
      const auto kernel = run_grid_search<Search, Check>;
      kernel<<<blocks(bound, resident(kernel)), block_threads, 0, stream_>>>(search, sink, test);
      check(cudaGetLastError());
    } else {
      const auto kernel = run_walks<Search, Check>;
      const unsigned most = resident(kernel);
      for (std::uint64_t begin = 0, end; begin < bound; begin = end) {
        end = stop_ ? std::min(begin + walks_per_stop_check, bound) : bound;
        kernel<<<blocks(end - begin, most), block_threads, 0, stream_>>>(search, sink, test, begin,
                                                                         end);
        check(cudaGetLastError());
        check_stop();
      }
    }
  }
  template <class Test>
  void gather(std::uint64_t bound, const Test& test, const device::Tiles& to) const {
    if (bound == 0) return;
    const std::uint64_t tiles = device::Tiles::of(bound);
    run_gather<<<blocks(tiles * 32, 8), block_threads, 0, stream_>>>(test, to, tiles);
    check(cudaGetLastError());
  }
  // Sorts the report's pairs, at most `count`, from `pairs`, which is overwritten, to `out`.
  // `scratch` has sort_bytes(count) bytes. Writes nothing if there are more than `capacity`.
  void sort(Pair* pairs, void* scratch, std::size_t scratch_size, Pair* out, std::uint64_t capacity,
            std::uint64_t count, const Report* report, const device::Input& in) const {
    if (count == 0) return;
    const auto shape = device::PairKeys::of(in);
    if (sort_blocks_ != 0 && count <= Sorter::max_pairs) {
      Sorter order{pairs, out, report, std::min(capacity, count), shape};
      order.carve(count, scratch);
      void* arguments[] = {&order};
      allow_shared_memory(run_pair_sorter<Sorter>, sort_shared_bytes);
      const cudaError_t launched = cudaLaunchCooperativeKernel(
          run_pair_sorter<Sorter>, count <= Sorter::single_block_pairs ? 1 : sort_blocks_,
          sort_threads, arguments, sort_shared_bytes, stream_);
      if (launched != cudaErrorCooperativeLaunchTooLarge) return check(launched);
      (void)cudaGetLastError();  // there are fewer processors than the device reports
    }
    auto* keys = reinterpret_cast<std::uint64_t*>(pairs);
    launch(count, device::EncodePairs{pairs, keys, report, capacity, shape});
    cub::DoubleBuffer<std::uint64_t> buffers(keys, static_cast<std::uint64_t*>(scratch));
    std::size_t bytes = scratch_size - keys_bytes(count);
    check(cub::DeviceRadixSort::SortKeys(static_cast<char*>(scratch) + keys_bytes(count), bytes,
                                         buffers, count, 0, shape.bits(), stream_));
    launch(count, device::DecodePairs{buffers.Current(), out, report, capacity, shape});
  }

  // The following functions synchronize with the stream.
  template <class T>
  T read(const T& value) {
    if constexpr (Mailbox::fits<T>) return send_and_wait(value, 0);
    T copy;
    check(cudaMemcpyAsync(&copy, &value, sizeof copy, cudaMemcpyDeviceToHost, stream_));
    check(cudaStreamSynchronize(stream_));
    return copy;
  }
  // Zeroes its first `bytes`.
  template <class T>
  T take(T& value, std::size_t bytes = sizeof(T)) {
    return send_and_wait(value, bytes);
  }
  // Sends the value at the end of the launch itself. *tickets is zero before and after.
  template <class F, class T>
  T launch_and_read(std::uint64_t count, const F& f, T& value, std::uint32_t* tickets) {
    if (count == 0) return take(value);
    const Post post = mailbox_.post(value, sizeof value);
    run_each_and_send<<<blocks(count, 8), block_threads, 0, stream_>>>(count, f, post, tickets);
    check(cudaGetLastError());
    return mailbox_.wait<T>(stream_);
  }
  template <class T>
  void read(const T* from, T* to, std::size_t count) {
    (void)in_pieces(from, count, [&](const T* values, std::size_t n) {
      to = std::copy_n(values, n, to);
      return true;
    });
  }
  // Calls take(values, n) for all pieces in turn, each in host memory until it returns. A false
  // stops and is returned.
  template <class T, class F>
  bool in_pieces(const T* values, std::size_t count, const F& take) {
    return staging_.receive(values, count, stream_, take);
  }
  // A copy in the device's own pinned memory, valid until the next.
  template <class T>
  const T* host_copy(const T* values, std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes > copy_bytes_) {
      release_host_copy();
      check(cudaMallocHost(&copy_, bytes));
      copy_bytes_ = bytes;
    }
    check(cudaMemcpyAsync(copy_, values, bytes, cudaMemcpyDeviceToHost, stream_));
    check(cudaStreamSynchronize(stream_));
    return static_cast<const T*>(copy_);
  }

  template <class F>
  void fork(const F& f) {
    side_.fork(stream_, f);
  }
  void join() const { side_.join(stream_); }

  void mark(device::Stage stage) {
    check_stop();
    if (!measuring_) return;
    const auto k = static_cast<unsigned>(stage);
    check(cudaEventRecord(events_[k + 1], stream_));
    marked_stages_ |= 1u << k;
  }
  // Times of the stages marked since begin(); synchronizes with their events.
  StageTimes times() const {
    StageTimes times;
    double* const of[] = {&times.plan_ms, &times.bin_ms, &times.find_ms, &times.order_ms};
    unsigned last = 0;
    for (unsigned k = 0; k < 4; ++k) {
      if (!(marked_stages_ >> k & 1)) continue;
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
    return aligned_size(count * sizeof(std::uint64_t));
  }
  unsigned blocks(std::uint64_t count, unsigned each) const noexcept {
    return blocks_for(count, each, sm_count_);
  }
  // Allows a kernel more dynamic shared memory than the default. Called next to the launch, because
  // each translation unit has its own instances of the kernels.
  template <class Kernel>
  static void allow_shared_memory(Kernel* kernel, std::size_t bytes) {
    check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                               static_cast<int>(bytes)));
  }
  // Blocks of block_threads that an SM holds at a time.
  template <class Kernel>
  static unsigned resident(Kernel* kernel) {
    int blocks = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, block_threads, 0));
    return static_cast<unsigned>(blocks);
  }
  void check_stop() const {
    if (!stop_) return;
    check(cudaStreamSynchronize(stream_));
    if (stop_->load(std::memory_order_relaxed)) throw device::Failure{Status::stopped};
  }
  template <class T>
  T send_and_wait(const T& value, std::size_t cleared) {
    const Post post = mailbox_.post(value, cleared);
    send<<<1, 64, 0, stream_>>>(post);
    check(cudaGetLastError());
    return mailbox_.wait<T>(stream_);
  }
  const Memory& memory_;
  int device_ = 0, sm_count_ = 1;
  unsigned sort_blocks_ = 0;  // the number of co-resident blocks; 0: this sort is unavailable
  cudaStream_t stream_ = nullptr;
  void* scratch_ = nullptr;
  std::size_t scratch_bytes_ = 0;
  bool measuring_ = false;
  const std::atomic<bool>* stop_ = nullptr;
  unsigned marked_stages_ = 0;
  cudaEvent_t events_[5] = {};
  SideStream side_;
  Staging staging_;
  Mailbox mailbox_;
  void* copy_ = nullptr;
  std::size_t copy_bytes_ = 0;
};

}  // namespace throng::cuda
