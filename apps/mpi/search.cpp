#include "apps/mpi/search.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/mpi/collective.hpp"

namespace throng::mpi_app {

void BackendOptions::add_to(CLI::App& app) {
  app.add_option("--backend", backend, "backend of each rank: auto, cpu, cuda or emulated (auto)")
      ->check(CLI::IsMember({"auto", "cpu", "cuda", "emulated"}))
      ->type_name("BACKEND");
  app.add_flag("--on-device", on_device,
               "boxes and pairs are in the memory of each rank's GPU, or emulated on the CPU");
  app.add_option("--buffers", buffers,
                 "with --on-device: pass device memory to MPI direct or staged (auto: MPI decides)")
      ->check(CLI::IsMember({"auto", "direct", "staged"}))
      ->type_name("HOW");
}

void BackendOptions::apply(mpi::Settings& settings) const {
  settings.search.backend = backend == "cuda"       ? Backend::cuda
                            : backend == "cpu"      ? Backend::cpu
                            : backend == "emulated" ? Backend::emulated
                                                    : Backend::automatic;
  settings.buffers = buffers == "direct"   ? mpi::Buffers::direct
                     : buffers == "staged" ? mpi::Buffers::staged
                                           : mpi::Buffers::automatic;
}

Search::Search(MPI_Comm comm, const BackendOptions& backend_options, const mpi::Settings& settings)
    : comm_(comm),
      copies_(backend_options.on_device && backend_options.backend != "emulated" &&
              backend_options.backend != "cpu") {
  mpi::Settings all = settings;
  backend_options.apply(all);
  if (backend_options.on_device)
    device_.emplace(comm, all);
  else
    host_.emplace(comm, all);
}

void Search::load(const mpi::RankBoxes& boxes) { loaded_ = copies_ ? copy_.load(boxes) : boxes; }

Result Search::find() noexcept {
  return device_ ? device_->find(loaded_, nullptr) : host_->find(loaded_);
}

mpi::Pairs64 Search::pairs() {
  if (!device_) return host_->pairs();
  if (!copies_) return device_->pairs();
  fetched_ = fetch(device_->pairs());
  return {fetched_.data(), fetched_.size()};
}

const mpi::Traffic& Search::traffic() const noexcept {
  return device_ ? device_->traffic() : host_->traffic();
}
int Search::home(const Box& box) const noexcept {
  return device_ ? device_->home(box) : host_->home(box);
}

std::string Search::buffers() const {
  if (!device_) return "";
  const auto ranks = static_cast<std::uint64_t>(size_of(comm_));
  const std::uint64_t direct = sum_over_ranks(traffic().direct ? 1 : 0, comm_);
  return direct == 0       ? "staged"
         : direct == ranks ? "direct"
                           : fmt::format("direct on {} of {} ranks", direct, ranks);
}

}  // namespace throng::mpi_app
