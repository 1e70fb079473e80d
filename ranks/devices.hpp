// Several GPUs, a rank each. What is current is the process's first GPU: of the ranks of a machine
// each must see another one first, and before MPI starts, as an MPI that knows of CUDA wakes it.
#pragma once

#include <cstddef>
#include <string>

namespace throng::ranks {

// The value that CUDA_VISIBLE_DEVICES is to have for one of the ranks of a machine: one of what it
// has, or of so many GPUs where it is null, in turn. Empty: it stays as it is; so where a launcher
// gave each rank its own.
std::string device_for(const char* rank_on_machine, const char* visible, std::size_t gpus);

// Sets it for this process, by what the launcher's environment tells. Before MPI_Init.
void choose_device();

}  // namespace throng::ranks
