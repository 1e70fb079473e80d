// Across MPI ranks: mpirun -n 3 example_ranks
#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

void narrow_phase(std::uint64_t, std::uint64_t) {}

// This rank's part of a row of cubes. Each cube touches the next.
std::vector<throng::Box> part_of_row(int rank) {
  std::vector<throng::Box> boxes;
  for (int i = 0; i < 100; ++i) {
    const float x = static_cast<float>(100 * rank + i);
    boxes.push_back({{x, 0, 0}, {x + 1, 1, 1}});
  }
  return boxes;
}

int run(int rank, int ranks) {
  // snippet-begin: find
  const std::vector<throng::Box> mine = part_of_row(rank);
  throng::mpi::Finder finder(MPI_COMM_WORLD);
  // Collective: each rank passes its own boxes. Ids count on from rank 0.
  throng::Result result = finder.find({mine});
  if (!result.ok() && rank == 0) std::fprintf(stderr, "%s\n", result.message);
  for (const throng::Pair64& pair : finder.pairs()) narrow_phase(pair.first, pair.second);
  // snippet-end: find
  CHECK(result.ok() && result.found == 100u * static_cast<unsigned>(ranks) - 1);
  CHECK(result.written == finder.pairs().size());

  // The emulated backend: device memory is host memory.
  throng::mpi::Settings settings;
  settings.search.backend = throng::Backend::emulated;
  const throng::Boxes device_boxes(mine);
  const std::uint64_t* device_ids = nullptr;
  const throng::cuda::Stream stream = nullptr;
  // snippet-begin: device
  throng::mpi::DeviceFinder on_gpu(MPI_COMM_WORLD, settings);  // the current GPU
  result = on_gpu.find({device_boxes, device_ids}, stream);
  const throng::mpi::Pairs64 pairs = on_gpu.pairs();  // in device memory, until the next call
  const bool no_copies = on_gpu.traffic().direct;     // MPI read device memory directly
  // snippet-end: device
  CHECK(result.ok() && result.written == pairs.size() && no_copies);
  CHECK(result.found == 100u * static_cast<unsigned>(ranks) - 1);

  // snippet-begin: persistent
  throng::mpi::BroadPhase broad_phase(MPI_COMM_WORLD);
  std::vector<std::uint64_t> ids;  // unique over all ranks
  for (std::uint64_t i = 0; i < mine.size(); ++i)
    ids.push_back(1000000u * static_cast<std::uint64_t>(rank) + i);
  const auto check = [](const throng::Result& r) {
    if (!r.ok()) std::fprintf(stderr, "%s\n", r.message);
  };
  check(broad_phase.add(ids.data(), mine));
  result = broad_phase.update();  // collective; objects migrate to the rank of their region
  for (std::size_t i = 0; i < broad_phase.arrived_count(); ++i) {
    const std::uint64_t id = broad_phase.arrived()[i];  // this rank moves it from now on
    throng::Box box = broad_phase.box(id);
    box.upper.y = 5;
    check(broad_phase.move(&id, throng::Boxes(&box, 1)));
  }
  check(broad_phase.update());
  for (const throng::Pair64& pair : broad_phase.ended()) narrow_phase(pair.first, pair.second);
  // snippet-end: persistent
  CHECK(result.ok() && result.found == 100u * static_cast<unsigned>(ranks) - 1);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0, ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const int status = run(rank, ranks);
  MPI_Finalize();
  return status;
}
