// Across MPI ranks: mpirun -n 3 example_ranks
#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

void narrow_phase(std::uint64_t, std::uint64_t) {}

// This rank's part of a row of cubes, each of which touches the next.
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
  // Collective: every rank with its own boxes, numbered through from rank 0 on.
  throng::Result result = finder.find({mine});
  if (!result.ok() && rank == 0) std::fprintf(stderr, "%s\n", result.message);
  for (const throng::Pair64& pair : finder.pairs()) narrow_phase(pair.first, pair.second);
  // snippet-end: find
  CHECK(result.ok() && result.found == 100u * static_cast<unsigned>(ranks) - 1);
  CHECK(result.written == finder.pairs().size());

  // Here a processor plays the GPU: device memory is the host's.
  throng::mpi::Settings settings;
  settings.search.backend = throng::Backend::emulated;
  const throng::Boxes device_boxes(mine);
  const std::uint64_t* device_ids = nullptr;
  const throng::cuda::Stream stream = nullptr;
  // snippet-begin: device
  throng::mpi::DeviceFinder on_gpu(MPI_COMM_WORLD, settings);  // the GPU that is current
  result = on_gpu.find({device_boxes, device_ids}, stream);
  const throng::mpi::Pairs64 pairs = on_gpu.pairs();  // in device memory, until the next call
  const bool no_copies = on_gpu.traffic().direct;     // MPI was given device memory as it lies
  // snippet-end: device
  CHECK(result.ok() && result.written == pairs.size() && no_copies);
  CHECK(result.found == 100u * static_cast<unsigned>(ranks) - 1);

  // snippet-begin: live
  throng::mpi::BroadPhase live(MPI_COMM_WORLD);
  std::vector<std::uint64_t> ids;  // an id belongs to one object, over all ranks
  for (std::uint64_t i = 0; i < mine.size(); ++i)
    ids.push_back(1000000u * static_cast<std::uint64_t>(rank) + i);
  const auto check = [](const throng::Result& r) {
    if (!r.ok()) std::fprintf(stderr, "%s\n", r.message);
  };
  check(live.add(ids.data(), mine));
  result = live.update();  // collective; objects go to the ranks in whose regions they lie
  for (std::size_t i = 0; i < live.arrived_count(); ++i) {
    const std::uint64_t id = live.arrived()[i];  // from now on this rank moves it
    throng::Box box = live.box(id);
    box.upper.y = 5;
    check(live.move(&id, throng::Boxes(&box, 1)));
  }
  check(live.update());
  for (const throng::Pair64& pair : live.ended()) narrow_phase(pair.first, pair.second);
  // snippet-end: live
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
