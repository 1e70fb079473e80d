// Boxes in the memory of this rank's GPU, and pairs from there.
#pragma once

#include <vector>

#include <throng/mpi.hpp>

namespace throng::ranks {

// On the GPU that is current. A build without CUDA has none, and says so.
class DeviceCopy {
 public:
  DeviceCopy() = default;
  ~DeviceCopy() { clear(); }
  DeviceCopy(const DeviceCopy&) = delete;
  DeviceCopy& operator=(const DeviceCopy&) = delete;

  // The same boxes, filters and ids there, good until the next call. Throws program::Failure.
  mpi::RankBoxes load(const mpi::RankBoxes& host);

 private:
  void clear() noexcept;
  void* copy(const void* from, std::size_t bytes);

  std::vector<void*> held_;
};

// Pairs of device memory in host memory. Throws program::Failure.
std::vector<Pair64> fetch(const mpi::Pairs64& pairs);

}  // namespace throng::ranks
