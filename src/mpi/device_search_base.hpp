// The interface of a search across ranks with boxes in device memory, as used by DeviceFinder; free
// of CUDA.
#pragma once

#include <memory>

#include <throng/mpi_cuda.hpp>

#include "mpi/distributed_search.hpp"

namespace throng::mpi {

class DeviceSearchBase : public DistributedSearch {
 public:
  // As DistributedSearch::find, on this stream.
  virtual void find(Communicator& communicator, const Settings& settings,
                    const RankBoxes* const* given, int count, cuda::Stream stream, Result& r) = 0;

 protected:
  using DistributedSearch::find;
};

// Uses the current GPU. Throws device::Failure: no_device, out_of_memory.
std::unique_ptr<DeviceSearchBase> make_gpu_search(const Settings& settings,
                                                  const cuda::MemoryResource& memory);

}  // namespace throng::mpi
