// The checksum of pairs by a kernel: a sum, so any order gives the same.
#include "bench/gpu/gpu.hpp"

#include <throng/checksum.hpp>

namespace throng::bench::gpu {
namespace {

__global__ void sum_pairs(const Pair* pairs, std::size_t count, unsigned long long* sum) {
  unsigned long long own = 0;
  const std::size_t step = std::size_t{gridDim.x} * blockDim.x;
  for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += step)
    own += mix64(std::uint64_t{pairs[i].first} << 32 | pairs[i].second);
  for (int half = 16; half > 0; half /= 2) own += __shfl_down_sync(~0u, own, half);
  if (threadIdx.x % 32 == 0) atomicAdd(sum, own);
}

}  // namespace

std::uint64_t device_checksum(const Pair* pairs, std::size_t count, cudaStream_t stream) {
  const DeviceArray<unsigned long long> sum(1);
  need(cudaMemsetAsync(sum.data(), 0, sizeof(unsigned long long), stream));
  if (count != 0) {
    sum_pairs<<<1024, 256, 0, stream>>>(pairs, count, sum.data());
    need(cudaGetLastError());
  }
  need(cudaStreamSynchronize(stream));
  unsigned long long value = 0;
  sum.get(&value, 1);
  return value;
}

}  // namespace throng::bench::gpu
