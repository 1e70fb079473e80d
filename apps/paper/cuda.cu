// The GPU as a device: thin launches of the functions that the host runs in loops, memory, events.
// All CUDA code of this module.
#include <cuda_runtime.h>
#include <cub/device/device_scan.cuh>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <throng/cuda.hpp>

#include "apps/common/median.hpp"
#include "apps/paper/cuda.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/mapping_timing.hpp"
#include "apps/paper/root_timing.hpp"
#include "apps/paper/steps.hpp"

namespace throng::paper {
namespace {

constexpr unsigned block_size = 256;
constexpr unsigned lanes_per_warp = 32;
// The maximum number of blocks of a launch; larger counts use a grid-stride loop.
constexpr std::uint64_t max_blocks = 0x7fffffff;

void check(cudaError_t error, const std::string& what) {
  if (error == cudaSuccess) return;
  std::string message = what + ": CUDA says: " + cudaGetErrorString(error);
  if (error == cudaErrorMemoryAllocation) {
    message += "; use --output pairs or --grid X, or --device cpu";
  }
  throw Failure(message);
}

__device__ std::uint64_t thread_number() {
  return std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x;
}
__device__ std::uint64_t thread_total() { return std::uint64_t{gridDim.x} * blockDim.x; }

template <class F>
__global__ void run_each(std::uint64_t count, F f) {
  for (std::uint64_t t = thread_number(); t < count; t += thread_total()) f(t);
}

// Whole warps enter and leave each iteration together: the stride is a multiple of a warp.
template <class F>
__global__ void run_ballots(std::uint64_t count, F test, std::uint32_t* words) {
  for (std::uint64_t t = thread_number(); t / lanes_per_warp * lanes_per_warp < count;
       t += thread_total()) {
    const std::uint32_t votes = __ballot_sync(0xffffffffu, t < count && test(t));
    if (t % lanes_per_warp == 0) words[t / bits_per_word] = votes;
  }
}

// One warp per team.
template <class F>
__global__ void run_teams(std::uint64_t count, F f) {
  const std::uint32_t lane = threadIdx.x % lanes_per_warp;
  const std::uint64_t teams = thread_total() / lanes_per_warp;
  for (std::uint64_t team = thread_number() / lanes_per_warp; team < count; team += teams) {
    f(team, lane, lanes_per_warp);
  }
}

// Device memory, or the host memory that the device accesses fastest.
template <class T, bool on_device>
class DeviceArray {
 public:
  DeviceArray() = default;
  ~DeviceArray() { release(); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;

  T* data() const noexcept { return data_; }
  std::uint64_t size() const noexcept { return size_; }
  void reserve(std::uint64_t size) {
    if (size <= size_) return;
    release();
    const std::uint64_t bytes = size * sizeof(T);
    void* memory = nullptr;
    check(on_device ? cudaMalloc(&memory, bytes) : cudaMallocHost(&memory, bytes),
          std::to_string(bytes) + " bytes of " + (on_device ? "GPU" : "pinned host") + " memory");
    data_ = static_cast<T*>(memory);
    size_ = size;
  }

 private:
  void release() noexcept {
    if (data_) on_device ? cudaFree(data_) : cudaFreeHost(data_);
    data_ = nullptr;
    size_ = 0;
  }
  T* data_ = nullptr;
  std::uint64_t size_ = 0;
};

class CudaDevice {
 public:
  template <class T>
  using Array = DeviceArray<T, true>;

  explicit CudaDevice(unsigned = 1) { check(cudaStreamCreate(&stream_), "a stream"); }
  ~CudaDevice() {
    for (cudaEvent_t event : events_) cudaEventDestroy(event);
    cudaStreamDestroy(stream_);
  }
  CudaDevice(const CudaDevice&) = delete;
  CudaDevice& operator=(const CudaDevice&) = delete;

  template <class T>
  void zero(Array<T>& array, std::uint64_t count) {
    if (count == 0) return;
    check(cudaMemsetAsync(array.data(), 0, count * sizeof(T), stream_), "clearing memory");
  }

  template <class F>
  void each(std::uint64_t count, const F& f) {
    if (count == 0) return;
    run_each<<<blocks(count), block_size, 0, stream_>>>(count, f);
    check(cudaGetLastError(), "a launch");
  }
  template <class F>
  void ballots(std::uint64_t count, const F& test, std::uint32_t* words) {
    if (count == 0) return;
    run_ballots<<<blocks(count), block_size, 0, stream_>>>(count, test, words);
    check(cudaGetLastError(), "a launch");
  }
  // Warps execute in lockstep anyway.
  template <class F>
  void in_lockstep(std::uint64_t count, const F& f) {
    each(count, f);
  }
  template <class F>
  void teams(std::uint64_t count, const F& f) {
    if (count == 0) return;
    run_teams<<<blocks(count * lanes_per_warp), block_size, 0, stream_>>>(count, f);
    check(cudaGetLastError(), "a launch");
  }

  // The initial value's type sets the type of the sums: 64 bits.
  void scan(const std::uint32_t* values, std::uint64_t* sums, std::uint64_t count) {
    std::size_t bytes = 0;
    const auto run = [&](void* storage) {
      check(cub::DeviceScan::ExclusiveScan(storage, bytes, values, sums, ::cuda::std::plus<>{},
                                           std::uint64_t{0}, count, stream_),
            "a scan");
    };
    run(nullptr);
    scan_storage_.reserve(bytes);
    run(scan_storage_.data());
  }

  // Transfers are fastest from pinned memory; copying into it is not part of a step.
  void hold(const Box* boxes, std::uint64_t n) {
    pinned_boxes_.reserve(n);
    boxes_copy_.reserve(n);
    if (n > 0) std::memcpy(pinned_boxes_.data(), boxes, n * sizeof(Box));
  }
  const Box* upload(const Box*, std::uint64_t n) {
    if (n == 0) return boxes_copy_.data();
    check(cudaMemcpyAsync(boxes_copy_.data(), pinned_boxes_.data(), n * sizeof(Box),
                          cudaMemcpyHostToDevice, stream_),
          "the transfer of the boxes");
    return boxes_copy_.data();
  }
  std::uint64_t read(const std::uint64_t* value) {
    value_.reserve(1);
    check(cudaMemcpyAsync(value_.data(), value, sizeof *value, cudaMemcpyDeviceToHost, stream_),
          "the transfer of a count");
    finish();
    return *value_.data();
  }
  // Valid after finish(), until the next fetch.
  template <class T>
  const T* fetch(const Array<T>& array, std::uint64_t count) {
    const std::uint64_t bytes = count * sizeof(T);
    fetched_.reserve(bytes);
    if (bytes == 0) return nullptr;
    check(cudaMemcpyAsync(fetched_.data(), array.data(), bytes, cudaMemcpyDeviceToHost, stream_),
          "the transfer of the output");
    return reinterpret_cast<const T*>(fetched_.data());
  }

  void restart() {
    finish();
    used_ = 0;
    mark();
  }
  void mark() {
    if (used_ == events_.size()) {
      cudaEvent_t event = nullptr;
      check(cudaEventCreate(&event), "an event");
      events_.push_back(event);
    }
    check(cudaEventRecord(events_[used_++], stream_), "an event");
  }
  void finish() { check(cudaStreamSynchronize(stream_), "a step"); }
  cudaStream_t stream() const noexcept { return stream_; }
  double ms(std::size_t stage) const {
    float elapsed = 0;
    check(cudaEventElapsedTime(&elapsed, events_[stage], events_[stage + 1]), "an event");
    return static_cast<double>(elapsed);
  }

 private:
  static unsigned blocks(std::uint64_t threads) {
    return static_cast<unsigned>(std::min((threads + block_size - 1) / block_size, max_blocks));
  }

  cudaStream_t stream_ = nullptr;
  std::vector<cudaEvent_t> events_;
  std::size_t used_ = 0;
  DeviceArray<Box, false> pinned_boxes_;
  DeviceArray<Box, true> boxes_copy_;
  DeviceArray<std::uint64_t, false> value_;
  DeviceArray<unsigned char, false> fetched_;
  DeviceArray<unsigned char, true> scan_storage_;
};

void require_cuda() {
  const std::string reason = why_no_cuda();
  if (!reason.empty()) throw Failure(reason);
}

}  // namespace

std::string why_no_cuda() {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess && count > 0) return {};
  return std::string("found no GPU that can be used (") +
         (error == cudaSuccess ? "none is installed" : cudaGetErrorString(error)) +
         "); use --device cpu";
}

std::string cuda_device_name() {
  require_cuda();
  int device = 0;
  cudaDeviceProp properties{};
  check(cudaGetDevice(&device), "the GPU");
  check(cudaGetDeviceProperties(&properties, device), "the GPU");
  return properties.name;
}

std::unique_ptr<Stepper> make_cuda_stepper(const Job& job) {
  require_cuda();
  return make_stepper<CudaDevice>(job);
}

RootTime time_roots_on_cuda(RootKind kind, int steps, std::uint64_t count, int repeat) {
  require_cuda();
  CudaDevice device;
  return time_roots(device, kind, steps, count, repeat);
}

MappingTime time_mapping_on_cuda(const Variant& variant, std::uint64_t n, int repeat) {
  require_cuda();
  CudaDevice device;
  return time_mapping(device, variant, n, repeat);
}

double time_bodies_on_cuda(const Transform* transforms, std::uint64_t count, const Shape& shape,
                           int repeat) {
  require_cuda();
  CudaDevice device;
  CudaDevice::Array<Transform> held;
  CudaDevice::Array<Shape> shapes;
  CudaDevice::Array<Box> boxes;
  held.reserve(count);
  shapes.reserve(1);
  boxes.reserve(count);
  check(cudaMemcpy(held.data(), transforms, count * sizeof(Transform), cudaMemcpyHostToDevice),
        "the transfer of the bodies");
  check(cudaMemcpy(shapes.data(), &shape, sizeof(Shape), cudaMemcpyHostToDevice),
        "the transfer of a shape");
  const Bodies bodies(held.data(), count, shapes.data(), 1);
  std::vector<double> times;
  for (int i = 0; i <= repeat; ++i) {  // the first is cold
    device.restart();
    const Result result = cuda::update_boxes_async(bodies, boxes.data(), nullptr, device.stream());
    if (!result.ok()) throw Failure(result.message);
    device.mark();
    device.finish();
    if (i > 0) times.push_back(device.ms(0));
  }
  return common::median(times);
}

}  // namespace throng::paper
