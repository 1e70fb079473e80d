// The search of a command, on the host or on a device.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include "apps/mpi/memory.hpp"

namespace CLI {
class App;
}

namespace throng::mpi_app {

struct BackendOptions {
  std::string backend = "auto", buffers = "auto";
  bool on_device = false;

  void add_to(CLI::App& app);
  void apply(mpi::Settings& settings) const;
};

class Search {
 public:
  Search(MPI_Comm comm, const BackendOptions& backend_options, const mpi::Settings& settings);

  // Not collective. The arrays must stay unchanged until the next load.
  void load(const mpi::RankBoxes& boxes);
  // Collective. Searches the loaded boxes; synchronizes with the GPU.
  Result find() noexcept;
  // Not collective. The pairs of the last search, in host memory.
  mpi::Pairs64 pairs();
  const mpi::Traffic& traffic() const noexcept;
  int home(const Box& box) const noexcept;
  // Collective. "direct", "staged", or "direct on 3 of 4 ranks"; empty for boxes in host memory.
  std::string buffers() const;

 private:
  MPI_Comm comm_;
  bool copies_;  // copy to a GPU; emulated or refused backends use the host arrays
  std::optional<mpi::Finder> host_;
  std::optional<mpi::DeviceFinder> device_;
  mpi::RankBoxes loaded_;
  DeviceCopy copy_;
  std::vector<Pair64> fetched_;
};

}  // namespace throng::mpi_app
