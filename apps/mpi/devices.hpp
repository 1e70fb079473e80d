// Assigns one GPU to each rank. The library uses the process's first visible GPU, so each rank of a
// machine must see a different one first. Set before MPI_Init, since a CUDA-aware MPI initializes
// the GPU.
#pragma once

#include <cstddef>
#include <string>

namespace throng::mpi_app {

// The value of CUDA_VISIBLE_DEVICES for one rank of a machine: round-robin over the devices in
// `visible`, or over `gpus` GPUs if it is null. Empty: leave it unchanged, e.g. if the launcher
// already set one device per rank.
std::string device_for(const char* rank_on_machine, const char* visible, std::size_t gpus);

// Sets CUDA_VISIBLE_DEVICES for this process from the launcher's environment. Call before MPI_Init.
void choose_device();

}  // namespace throng::mpi_app
