// Replaces memory.cpp in a build without CUDA.
#include "apps/common/failure.hpp"
#include "apps/mpi/memory.hpp"

namespace throng::mpi_app {
namespace {

[[noreturn]] void refuse() {
  throw common::Failure("boxes for the GPU: this build has no GPU backend; leave --on-device out");
}

}  // namespace

void DeviceCopy::clear() noexcept {}
mpi::RankBoxes DeviceCopy::load(const mpi::RankBoxes&) { refuse(); }
std::vector<Pair64> fetch(const mpi::Pairs64&) { refuse(); }

}  // namespace throng::mpi_app
