// DeviceFinder: selects the device and runs the collective call.
#include <throng/mpi_cuda.hpp>

#include <utility>

#include "mpi/consensus.hpp"
#include "mpi/device_distributed_search.hpp"
#include "mpi/device_search_base.hpp"
#include "mpi/host_rank_device.hpp"

namespace throng::mpi {

struct DeviceFinder::State {
  std::unique_ptr<Communicator> communicator;
  std::unique_ptr<DeviceSearchBase> driver;

  State() = default;
  // After a failed call MPI may still access the buffers, so they are leaked.
  ~State() {
    if (communicator && communicator->broken()) static_cast<void>(driver.release());
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void make_search(const Settings& settings, const cuda::MemoryResource& memory, Result& r) {
    if (settings.search.backend == Backend::cpu) {
      set_error(r, Status::bad_option,
                "the backend is cpu, which cannot search boxes in device memory; use mpi::Finder");
      return;
    }
    driver = settings.search.backend == Backend::emulated
                 ? std::make_unique<DeviceDistributedSearch<HostRankDevice>>(settings)
                 : make_gpu_search(settings, memory);
  }
};

DeviceFinder::DeviceFinder(MPI_Comm comm, const Settings& settings,
                           const cuda::MemoryResource& memory) noexcept
    : settings_(settings), memory_(memory), comm_(comm) {}
DeviceFinder::~DeviceFinder() = default;
DeviceFinder::DeviceFinder(DeviceFinder&& other) noexcept = default;
DeviceFinder& DeviceFinder::operator=(DeviceFinder&& other) noexcept = default;

Result DeviceFinder::find(const RankBoxes* const* sets, int count, cuda::Stream stream) noexcept {
  Result r;
  attempt(r, [&] {
    if (!state_) state_ = std::make_unique<State>();
  });
  if (!r.ok()) return r;
  State& state = *state_;
  return call(state.communicator, comm_, settings_,
              [&](Communicator& communicator, Result& result) {
                attempt(result, [&] {
                  if (!state.driver) state.make_search(settings_, memory_, result);
                });
                if (state.driver)
                  state.driver->find(communicator, settings_, sets, count, stream, result);
                else
                  DistributedSearch::join_failed_call(communicator, settings_, count, result);
              });
}

Result DeviceFinder::find(const RankBoxes& boxes, cuda::Stream stream) noexcept {
  const RankBoxes* sets[] = {&boxes};
  return find(sets, 1, stream);
}
Result DeviceFinder::find(const RankBoxes& a, const RankBoxes& b, cuda::Stream stream) noexcept {
  const RankBoxes* sets[] = {&a, &b};
  return find(sets, 2, stream);
}

Pairs64 DeviceFinder::pairs() const noexcept {
  return state_ && state_->driver ? state_->driver->pairs() : Pairs64{};
}
const Traffic& DeviceFinder::traffic() const noexcept {
  static const Traffic none;
  return state_ && state_->driver ? state_->driver->traffic() : none;
}
int DeviceFinder::home(const Box& box) const noexcept {
  const DefaultFloats floats;
  return state_ && state_->driver ? state_->driver->home(box, settings_.search.margin) : 0;
}

}  // namespace throng::mpi
