// Launches, and the kernel that has one thread for each index.
#pragma once

#include <cstdint>

#include "cuda/check.hpp"

namespace throng::cuda {

constexpr unsigned block_threads = 256;

// What each kernel that is started by a Launcher does first. Its blocks may have begun while those
// of the kernel before it were still running, so that no time passes between the two; here they
// wait for these, and then see what they wrote. The kernel after it may do the same.
__device__ inline void wait_for_the_one_before() {
#if __CUDA_ARCH__ >= 900
  cudaTriggerProgrammaticLaunchCompletion();
  cudaGridDependencySynchronize();
#endif
}

template <class F>
__global__ void __launch_bounds__(block_threads) run_each(std::uint64_t count, F f) {
  wait_for_the_one_before();
  const std::uint64_t step = std::uint64_t{gridDim.x} * block_threads;
  for (std::uint64_t i = std::uint64_t{blockIdx.x} * block_threads + threadIdx.x; i < count;
       i += step)
    f(i);
}

// Enough blocks to keep every processor busy with `each`, and no more than there is work for.
inline unsigned blocks_for(std::uint64_t count, unsigned each, int processors) noexcept {
  const std::uint64_t wanted = (count + block_threads - 1) / block_threads;
  const std::uint64_t most = std::uint64_t{each} * static_cast<unsigned>(processors);
  return static_cast<unsigned>(wanted < most ? wanted : most);
}

// Starts kernels on a stream, one as soon as the one before it has begun where the GPU can do that.
class Launcher {
 public:
  explicit Launcher(int device) {
    int major = 0;
    check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    overlaps_ = major >= 9;
  }

  template <class... Parameters, class... Arguments>
  void operator()(cudaStream_t stream, unsigned blocks, unsigned threads, std::size_t shared_bytes,
                  void (*kernel)(Parameters...), const Arguments&... arguments) const {
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = threads;
    config.dynamicSmemBytes = shared_bytes;
    config.stream = stream;
    cudaLaunchAttribute early{};
    early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    early.val.programmaticStreamSerializationAllowed = 1;
    config.attrs = &early;
    config.numAttrs = overlaps_ ? 1 : 0;
    check(cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...));
  }

 private:
  bool overlaps_ = false;
};

}  // namespace throng::cuda
