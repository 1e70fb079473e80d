// Replaces gpu.cu in a build without a CUDA compiler.
#include "mpi/on_device.hpp"

namespace throng::mpi {

std::unique_ptr<OnDevice> make_gpu_flow(const Settings&, const cuda::MemoryResource&) {
  throw pipeline::Failure{Status::no_device};
}

}  // namespace throng::mpi
