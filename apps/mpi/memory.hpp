// Copies boxes to the memory of this rank's GPU, and pairs back.
#pragma once

#include <vector>

#include <throng/mpi.hpp>

namespace throng::mpi_app {

// Uses the current GPU. Throws in a build without CUDA.
class DeviceCopy {
 public:
  DeviceCopy() = default;
  ~DeviceCopy() { clear(); }
  DeviceCopy(const DeviceCopy&) = delete;
  DeviceCopy& operator=(const DeviceCopy&) = delete;

  // Copies boxes, filters and ids; valid until the next call. Throws common::Failure.
  mpi::RankBoxes load(const mpi::RankBoxes& host);

 private:
  void clear() noexcept;
  void* copy(const void* from, std::size_t bytes);

  std::vector<void*> held_;
};

// Copies pairs from device to host memory. Throws common::Failure.
std::vector<Pair64> fetch(const mpi::Pairs64& pairs);

}  // namespace throng::mpi_app
