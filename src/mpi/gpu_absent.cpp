// Replaces gpu.cu in a build without a CUDA compiler.
#include "mpi/device_search_base.hpp"

namespace throng::mpi {

std::unique_ptr<DeviceSearchBase> make_gpu_search(const Settings&, const cuda::MemoryResource&) {
  throw device::Failure{Status::no_device};
}

}  // namespace throng::mpi
