// The interface of a search across ranks with boxes in device memory, as used by DeviceFinder; free
// of CUDA.
#pragma once

#include <memory>

#include <throng/mpi_cuda.hpp>

#include "mpi/flow.hpp"

namespace throng::mpi {

class OnDevice : public Flow {
 public:
  // As Flow::find, on this stream.
  virtual void find(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
                    cuda::Stream stream, Result& r) = 0;

 protected:
  using Flow::find;
};

// Uses the current GPU. Throws pipeline::Failure: no_device, out_of_memory.
std::unique_ptr<OnDevice> make_gpu_flow(const Settings& settings,
                                        const cuda::MemoryResource& memory);

}  // namespace throng::mpi
