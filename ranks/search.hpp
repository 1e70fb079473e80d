// The search that a command runs: where boxes live, and by what they are searched.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include "ranks/memory.hpp"

namespace CLI {
class App;
}

namespace throng::ranks {

struct Where {
  std::string backend = "auto", buffers = "auto";
  bool on_device = false;

  void add_to(CLI::App& app);
  void apply(mpi::Settings& settings) const;
};

class Search {
 public:
  Search(MPI_Comm comm, const Where& where, const mpi::Settings& settings);

  // Not collective. The arrays must stay as they are until the next load.
  void load(const mpi::RankBoxes& boxes);
  // Collective, of what was loaded; waits for the GPU.
  Result find() noexcept;
  // Not collective: of the last search, in host memory.
  mpi::Pairs64 pairs();
  const mpi::Traffic& traffic() const noexcept;
  int home(const Box& box) const noexcept;
  // Collective: "direct", "staged", or "direct on 3 of 4 ranks"; empty where boxes live on the
  // host.
  std::string buffers() const;

 private:
  MPI_Comm comm_;
  bool copies_;  // to a GPU; emulated, or where a GPU is refused, the host's arrays do
  std::optional<mpi::Finder> host_;
  std::optional<mpi::DeviceFinder> device_;
  mpi::RankBoxes loaded_;
  DeviceCopy copy_;
  std::vector<Pair64> fetched_;
};

}  // namespace throng::ranks
