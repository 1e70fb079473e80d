#include "apps/mpi/memory.hpp"

#include <cuda_runtime_api.h>

#include <string>
#include <type_traits>

#include "apps/common/failure.hpp"

namespace throng::mpi_app {
namespace {

void check(cudaError_t error) {
  if (error == cudaSuccess) return;
  (void)cudaGetLastError();
  throw common::Failure(std::string("boxes for the GPU: ") + cudaGetErrorString(error));
}

}  // namespace

void DeviceCopy::clear() noexcept {
  for (void* p : held_) (void)cudaFree(p);
  held_.clear();
}

void* DeviceCopy::copy(const void* from, std::size_t bytes) {
  held_.push_back(nullptr);
  check(cudaMalloc(&held_.back(), bytes));
  check(cudaMemcpy(held_.back(), from, bytes, cudaMemcpyHostToDevice));
  return held_.back();
}

mpi::RankBoxes DeviceCopy::load(const mpi::RankBoxes& host) {
  clear();
  const std::size_t n = host.boxes.size();
  const auto packed = [&](const auto& from) {
    using T = std::decay_t<decltype(from[0])>;
    std::vector<T> values(n);
    for (std::size_t i = 0; i < n; ++i) values[i] = from[i];
    return n ? static_cast<const T*>(copy(values.data(), n * sizeof(T))) : nullptr;
  };
  const auto filter = [&](auto& to, const auto& from) {
    if (from && n) to = {packed(from), from.count};
  };
  mpi::RankBoxes device{Boxes(packed(host.boxes), n), host.ids ? packed(host.ids) : nullptr};
  const Filters& from = host.boxes.filters;
  Filters& to = device.boxes.filters;
  filter(to.group, from.group);
  filter(to.mask, from.mask);
  filter(to.owner, from.owner);
  filter(to.world, from.world);
  filter(to.is_static, from.is_static);
  return device;
}

std::vector<Pair64> fetch(const mpi::Pairs64& pairs) {
  std::vector<Pair64> host(pairs.size());
  if (!host.empty()) {
    check(cudaMemcpy(host.data(), pairs.data(), host.size() * sizeof(Pair64),
                     cudaMemcpyDeviceToHost));
  }
  return host;
}

}  // namespace throng::mpi_app
