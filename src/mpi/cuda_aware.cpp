#include "mpi/cuda_aware.hpp"

#include <mpi.h>

// Open MPI and MVAPICH declare it there, MPICH in its mpi.h.
#if __has_include(<mpi-ext.h>)
#include <mpi-ext.h>
#endif

namespace throng::mpi {

bool is_cuda_aware() noexcept {
#if defined(MPIX_CUDA_AWARE_SUPPORT) || defined(MPIX_GPU_SUPPORT_CUDA)
  return MPIX_Query_cuda_support() == 1;
#else
  return false;
#endif
}

}  // namespace throng::mpi
