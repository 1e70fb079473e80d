// Whether MPI is CUDA-aware, i.e. accepts device pointers.
#pragma once

namespace throng::mpi {

// What MPI reports at run time; false if it cannot report it. Call after MPI_Init.
bool is_cuda_aware() noexcept;

}  // namespace throng::mpi
