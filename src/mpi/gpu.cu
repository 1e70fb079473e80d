// The RankDevice for a GPU.
#include <cuda_runtime_api.h>

#include <cub/device/device_merge_sort.cuh>

#include "cuda/argument_checks.hpp"
#include "cuda/device.cuh"
#include "mpi/cuda_aware.hpp"
#include "mpi/device_distributed_search.hpp"
#include "mpi/device_search_base.hpp"

namespace throng::mpi {
namespace {

using cuda::check;

// Pinned, for full bus bandwidth.
struct PinnedMemory {
  static void* allocate(std::size_t bytes) {
    void* p = nullptr;
    const cudaError_t error = cudaMallocHost(&p, bytes);
    if (error == cudaErrorMemoryAllocation) {
      (void)cudaGetLastError();
      throw device::Failure{Status::out_of_memory, bytes, "pinned memory"};
    }
    check(error);
    return p;
  }
  static void release(void* p, std::size_t) noexcept { (void)cudaFreeHost(p); }
};

struct PairLess {
  __host__ __device__ bool operator()(const Pair64& a, const Pair64& b) const noexcept {
    return a < b;
  }
};

// A base class, so that it is constructed before the Device that refers to it.
struct MemoryOwner {
  cuda::Memory memory;
};

class GpuRankDevice : private MemoryOwner, public cuda::Device {
 public:
  GpuRankDevice(const Settings& settings, const cuda::MemoryResource& resource)
      : MemoryOwner{cuda::Memory(resource)},
        Device(memory),
        finder_(local_options(settings), resource) {
    cudaFuncAttributes attributes{};  // fails if this build has no code for the device
    check(cudaFuncGetAttributes(&attributes, cuda::run_each<InspectBoxes>));
  }

  struct Current : cuda::CurrentDevice {
    explicit Current(const GpuRankDevice& device) : cuda::CurrentDevice(device.ordinal()) {}
  };
  void begin(cuda::Stream stream) {
    if (stream && cuda::device_of(stream) != ordinal())
      throw device::Failure{Status::bad_option, 0, "is of another device than this DeviceFinder",
                            "the stream"};
    Device::begin(stream, false);
  }
  void require(const device::Set& set, std::size_t count, const std::uint64_t* ids) const {
    cuda::require_set(set, count, ordinal());
    if (ids)
      cuda::AccessCheck(ordinal(), Status::bad_boxes).require(ids, alignof(std::uint64_t), "ids");
  }
  static bool mpi_accepts_pointers() noexcept { return is_cuda_aware(); }

  void download(void* to, const void* from, std::size_t bytes) const {
    move(to, from, bytes, cudaMemcpyDeviceToHost);
  }
  void upload(void* to, const void* from, std::size_t bytes) const {
    move(to, from, bytes, cudaMemcpyHostToDevice);
  }
  void wait() const { check(cudaStreamSynchronize(stream())); }
  using Staging = PinnedMemory;

  Result find(const Boxes& a, const Boxes* b, Pairs& pairs) noexcept {
    const Result r = b ? finder_.find(a, *b, stream()) : finder_.find(a, stream());
    pairs = finder_.pairs();
    return r;
  }
  static std::size_t sort64_bytes(std::size_t count) {
    std::size_t bytes = 0;
    check(cub::DeviceMergeSort::SortKeys(nullptr, bytes, static_cast<Pair64*>(nullptr), count,
                                         PairLess{}));
    return bytes;
  }
  void sort64(Pair64* pairs, std::size_t count, void* scratch, std::size_t bytes) const {
    check(cub::DeviceMergeSort::SortKeys(scratch, bytes, pairs, count, PairLess{}, stream()));
  }

 private:
  void move(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) const {
    if (bytes == 0) return;
    check(cudaMemcpyAsync(to, from, bytes, kind, stream()));
    wait();
  }

  cuda::Finder finder_;
};

}  // namespace

std::unique_ptr<DeviceSearchBase> make_gpu_search(const Settings& settings,
                                                  const cuda::MemoryResource& memory) {
  int count = 0;
  check(cudaGetDeviceCount(&count));
  if (count == 0) check(cudaErrorNoDevice);
  return std::make_unique<DeviceDistributedSearch<GpuRankDevice>>(settings, memory);
}

}  // namespace throng::mpi
