// CUDA errors and device memory.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include <throng/cuda.hpp>

#include "device/failure.hpp"

namespace throng::cuda {

// Throws Failure for an error. Clears it on the device, so that the next call starts clean; a
// sticky error returns with the next call.
inline void check(cudaError_t error) {
  if (error == cudaSuccess) return;
  (void)cudaGetLastError();
  const Status status = error == cudaErrorNoDevice || error == cudaErrorInsufficientDriver ||
                                error == cudaErrorNoKernelImageForDevice ||
                                error == cudaErrorInvalidDeviceFunction ||
                                error == cudaErrorStubLibrary
                            ? Status::no_device
                        : error == cudaErrorMemoryAllocation ? Status::out_of_memory
                                                             : Status::device_error;
  throw device::Failure{status, 0, cudaGetErrorString(error)};
}

// The caller's resource, or cudaMalloc.
class Memory {
 public:
  explicit Memory(const MemoryResource& resource) noexcept : resource_(resource) {}

  // Failure: out_of_memory.
  void* allocate(std::size_t bytes, cudaStream_t stream) const {
    void* p = nullptr;
    const char* text = "by the MemoryResource";
    if (resource_.allocate) {
      p = resource_.allocate(resource_.self, bytes, stream);
    } else if (const cudaError_t error = cudaMalloc(&p, bytes); error != cudaSuccess) {
      if (error != cudaErrorMemoryAllocation) check(error);
      (void)cudaGetLastError();
      text = cudaGetErrorString(error);
    }
    if (!p) throw device::Failure{Status::out_of_memory, bytes, text};
    return p;
  }
  void release(void* p, std::size_t bytes, cudaStream_t stream) const noexcept {
    if (resource_.deallocate)
      resource_.deallocate(resource_.self, p, bytes, stream);
    else
      (void)cudaFree(p);
  }

 private:
  MemoryResource resource_;
};

}  // namespace throng::cuda
