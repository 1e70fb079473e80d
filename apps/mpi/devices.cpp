#include "apps/mpi/devices.hpp"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <system_error>
#include <vector>

namespace throng::mpi_app {
namespace {

// Open MPI, MPICH and Intel's, MVAPICH, Slurm.
constexpr const char* names[] = {"OMPI_COMM_WORLD_LOCAL_RANK", "MPI_LOCALRANKID",
                                 "MV2_COMM_WORLD_LOCAL_RANK", "SLURM_LOCALID"};

// With NVIDIA's driver, Linux has one folder per GPU.
std::size_t count_gpus() {
  std::error_code none;
  const std::filesystem::directory_iterator gpus("/proc/driver/nvidia/gpus", none);
  return none ? 0 : static_cast<std::size_t>(std::distance(begin(gpus), end(gpus)));
}

}  // namespace

std::string device_for(const char* rank_on_machine, const char* visible, std::size_t gpus) {
  if (!rank_on_machine) return "";
  char* end = nullptr;
  errno = 0;
  const unsigned long rank = std::strtoul(rank_on_machine, &end, 10);
  if (end == rank_on_machine || *end != '\0' || errno != 0) return "";
  if (!visible) return gpus < 2 ? "" : std::to_string(rank % gpus);
  std::vector<std::string> devices(1);
  for (const char* p = visible; *p != '\0'; ++p) {
    if (*p == ',') {
      devices.emplace_back();
    } else {
      devices.back() += *p;
    }
  }
  return devices.size() < 2 ? "" : devices[rank % devices.size()];
}

void choose_device() {
  const char* rank = nullptr;
  for (const char* name : names) {
    if (!rank) rank = std::getenv(name);
  }
  const std::string device =
      device_for(rank, std::getenv("CUDA_VISIBLE_DEVICES"), rank ? count_gpus() : 0);
  if (device.empty()) return;
#ifdef _WIN32
  (void)_putenv_s("CUDA_VISIBLE_DEVICES", device.c_str());
#else
  (void)setenv("CUDA_VISIBLE_DEVICES", device.c_str(), 1);
#endif
}

}  // namespace throng::mpi_app
