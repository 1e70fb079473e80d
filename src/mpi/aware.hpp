// Whether MPI reads and writes a CUDA device's memory as it lies.
#pragma once

namespace throng::mpi {

// What MPI itself says, now that it is up; false where it has no word for it.
bool takes_device_memory() noexcept;

}  // namespace throng::mpi
