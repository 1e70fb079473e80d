// A user's program across ranks, in C++17 without exceptions and RTTI; here one rank, without
// mpirun.
#include <throng/mpi.hpp>
#include <throng/mpi_cuda.hpp>

#include <cstdio>
#include <vector>

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  bool good;
  {
    const std::vector<throng::Box> boxes = {{{0, 0, 0}, {2, 2, 2}}, {{2, 1, 1}, {3, 3, 3}}};
    throng::mpi::Finder finder(MPI_COMM_WORLD);
    const throng::Result result = finder.find({boxes});
    std::puts(result.ok() ? "MPI consumer: ok" : result.message);
    good = result.ok() && result.found == 1 && finder.pairs()[0] == throng::Pair64{0, 1};
    throng::mpi::Settings settings;
    settings.search.backend = throng::Backend::emulated;
    throng::mpi::DeviceFinder device(MPI_COMM_WORLD, settings);
    good = good && device.find({boxes}, nullptr).found == 1 && device.pairs().size() == 1;
    // The status of a GPU, or no_device: checks that it links.
    throng::mpi::DeviceFinder none(MPI_COMM_WORLD);
    const throng::Status wanted = throng::cuda::available().status;
    good = good && none.find(throng::mpi::RankBoxes(), nullptr).status == wanted;
  }
  MPI_Finalize();
  return good ? 0 : 1;
}
