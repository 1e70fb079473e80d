// The search across ranks for boxes in device memory: per-box work runs as kernels
// (device_stages.hpp), records are sent from device to device by MPI or through host memory
// (device_halo_exchange.hpp).
//
// A RankDevice is a Device (device/pipeline.hpp: launch, clear; device/engine.hpp: allocate,
// release, copy, read) that adds
//   begin(stream)                selects the stream of the calls that follow
//   Current                      RAII: the RankDevice's device is current during its lifetime
//   require(set, count, ids)     refuses arrays that the device cannot read
//   mpi_accepts_pointers()               whether MPI accepts pointers to its memory
//   download, upload(to, from, n)    copy bytes to and from host memory; synchronous
//   Staging                      allocates the host memory of staged copies
//   wait()                       synchronizes the stream
//   find(a, b or null, pairs)    the local search
//   sort64(pairs, n, scratch, bytes), sort64_bytes(n)
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "device/device_buffer.hpp"
#include "mpi/balance.hpp"
#include "mpi/device_halo_exchange.hpp"
#include "mpi/device_search_base.hpp"
#include "mpi/device_stages.hpp"

namespace throng::mpi {

template <class RankDevice>
class DeviceDistributedSearch final : public DeviceSearchBase {
 public:
  template <class... Args>
  explicit DeviceDistributedSearch(Args&&... args) : device_(std::forward<Args>(args)...) {}

  void find(Communicator& communicator, const Settings& settings, const RankBoxes* const* given,
            int count, cuda::Stream stream, Result& r) override {
    std::optional<typename RankDevice::Current> current;
    attempt(r, [&] {
      device_.begin(stream);
      current.emplace(device_);
    });
    DistributedSearch::find(communicator, settings, given, count, r);
  }

 private:
  using Block = device::DeviceBuffer<RankDevice>;
  struct Sums {
    std::uint64_t owned, kept;
  };

  BoxSummary inspect(const Settings& settings, const RankBoxes& given, Result& r) override;
  const std::uint64_t* host_ids(const RankBoxes& given) override;
  Sample sample(const Settings& settings, const RankBoxes& given, std::size_t most) override;
  void route(Communicator& communicator, const Settings& settings, std::vector<OutgoingSet>& sets,
             Result& r) override;
  void deliver(Communicator& communicator) override {
    communicator.exchange(halo_.out(), halo_.in());
  }
  void take_tree_records(int set, const Bytes& records) override {
    halo_.take_tree_records(static_cast<std::size_t>(set), records);
  }
  Result search(const Settings& settings, const Bounds& region, Found& found,
                std::vector<Sample>& samples) override;
  const Pair64* kept_pairs() const noexcept override { return kept_.template as<Pair64>(); }

  Sample points_of(SamplePoints stage, std::size_t most);
  void keep(const Pairs& pairs, Found& found, Sums* sums);
  void sort_kept(std::size_t count);

  RankDevice device_;
  DeviceHaloExchange<RankDevice> halo_{device_};
  Block inspection_{device_}, points_{device_}, kept_{device_}, sorting_{device_};
  Block marks_[2]{Block(device_), Block(device_)},
      halves_[2]{Block(device_), Block(device_)};  // per box
  std::vector<std::uint64_t> ids_;
};

template <class RankDevice>
DistributedSearch::BoxSummary DeviceDistributedSearch<RankDevice>::inspect(const Settings& settings,
                                                                           const RankBoxes& given,
                                                                           Result& r) {
  const std::size_t n = given.boxes.size();
  if (!valid_arrays(given.boxes, r) || n == 0) return {};
  const device::Set set = device::make_set(given.boxes);
  device_.require(set, n, given.ids);
  inspection_.ensure(sizeof(BoxInspection));
  auto* const inspection = inspection_.template as<BoxInspection>();
  device_.clear(inspection, sizeof(BoxInspection));
  const std::uint64_t threads = std::min<std::uint64_t>(n, summing_threads);
  device_.launch(threads, InspectBoxes{set, given.ids, n, threads, inspection});
  const BoxInspection seen = device_.read(*inspection);
  r.invalid_count = seen.bad_worlds;
  r.first_invalid = ~seen.bad_world_mark;
  if (!no_bad_worlds(r)) return {};
  r.invalid_count = settings.search.nan == NanPolicy::refuse ? seen.nans : 0;
  r.first_invalid = ~seen.nan_mark;
  if (!no_nans(r)) return {};
  r.first_invalid = 0;
  return {seen.inactive, seen.id_sum};
}

template <class RankDevice>
const std::uint64_t* DeviceDistributedSearch<RankDevice>::host_ids(const RankBoxes& given) {
  ids_.resize(given.boxes.size());
  device_.download(ids_.data(), given.ids, ids_.size() * sizeof(std::uint64_t));
  return ids_.data();
}

// At most `most` points, of boxes that carry a position.
template <class RankDevice>
DistributedSearch::Sample DeviceDistributedSearch<RankDevice>::points_of(SamplePoints stage,
                                                                         std::size_t most) {
  Sample sample;
  if (stage.count == 0) return sample;
  sample.step = stage.step = (stage.count + most - 1) / most;
  const auto count = static_cast<std::size_t>((stage.count + stage.step - 1) / stage.step);
  points_.ensure(count * sizeof(Point));
  stage.points = points_.template as<Point>();
  device_.launch(count, stage);
  sample.points.resize(count);
  device_.download(sample.points.data(), stage.points, count * sizeof(Point));
  const auto none = [](const Point& point) { return point.weight == SamplePoints::none; };
  sample.points.erase(std::remove_if(sample.points.begin(), sample.points.end(), none),
                      sample.points.end());
  return sample;
}

template <class RankDevice>
DistributedSearch::Sample DeviceDistributedSearch<RankDevice>::sample(const Settings& settings,
                                                                      const RankBoxes& given,
                                                                      std::size_t most) {
  SamplePoints stage{};
  stage.set = device::make_set(given.boxes);
  stage.margin = settings.search.margin;
  stage.count = given.boxes.size();
  return points_of(stage, most);
}

template <class RankDevice>
void DeviceDistributedSearch<RankDevice>::route(Communicator& communicator,
                                                const Settings& settings,
                                                std::vector<OutgoingSet>& sets, Result& r) {
  traffic_.direct = settings.buffers == Buffers::direct ||
                    (settings.buffers == Buffers::automatic && device_.mpi_accepts_pointers());
  std::vector<Parcel> sizes;
  attempt(r, [&] {
    halo_.count(settings, regions().tree(), sets);
    sizes = halo_.sizes(communicator.rank());
  });
  const std::vector<Parcel> received_sizes = communicator.exchange(std::move(sizes));
  attempt(r, [&] {
    halo_.write(settings, sets, received_sizes, communicator.rank(), traffic_.direct);
  });
}

template <class RankDevice>
Result DeviceDistributedSearch<RankDevice>::search(const Settings& settings, const Bounds& region,
                                                   Found& found, std::vector<Sample>& samples) {
  halo_.upload_staged();
  inspection_.ensure(sizeof(Sums));
  auto* const sums = inspection_.template as<Sums>();
  device_.clear(sums, sizeof(Sums));
  const std::size_t sets = halo_.set_count();
  const float margin = settings.search.margin;
  Boxes views[2];
  SamplePoints stages[2] = {};
  for (std::size_t s = 0; s < sets; ++s) {
    const std::uint64_t n = halo_.records(s).count;
    views[s] = halo_.records(s).view();
    const device::Set set = device::make_set(views[s]);
    const auto capacity = static_cast<std::size_t>(n) + 1;
    marks_[s].ensure(capacity);
    halves_[s].ensure(capacity * sizeof(std::uint32_t));
    auto* const marks = marks_[s].template as<std::uint8_t>();
    auto* const halves = halves_[s].template as<std::uint32_t>();
    device_.clear(halves, capacity * sizeof(std::uint32_t));
    const std::uint64_t threads = std::min(n, summing_threads);
    device_.launch(threads, MarkOwned{set, margin, region, n, threads, marks, &sums->owned});
    stages[s] = {set, margin, n, 1, marks, halves, pair_work / 2, nullptr};
    found.owned_and_ghost += n;
  }
  found.handled = found.owned_and_ghost;
  Pairs pairs;
  Result r = device_.find(views[0], sets == 2 ? &views[1] : nullptr, pairs);
  if (!r.ok()) return r;
  keep(pairs, found, sums);
  std::vector<Sample> fresh;
  for (std::size_t s = 0; s < sets; ++s) fresh.push_back(points_of(stages[s], max_points / sets));
  if (settings.search.order == Order::canonical) sort_kept(static_cast<std::size_t>(found.kept));
  device_.wait();
  samples.swap(fresh);
  return r;
}

template <class RankDevice>
void DeviceDistributedSearch<RankDevice>::keep(const Pairs& pairs, Found& found, Sums* sums) {
  const std::size_t last = halo_.set_count() - 1;
  kept_.ensure((pairs.size() + 1) * sizeof(Pair64));
  device_.launch(
      pairs.size(),
      KeepPairs{pairs.data(), halo_.records(0), halo_.records(last),
                marks_[0].template as<std::uint8_t>(), marks_[last].template as<std::uint8_t>(),
                halves_[0].template as<std::uint32_t>(), halves_[last].template as<std::uint32_t>(),
                last != 0, kept_.template as<Pair64>(), &sums->kept});
  const Sums totals = device_.read(*sums);
  found.owned = totals.owned;
  found.kept = totals.kept;
}

template <class RankDevice>
void DeviceDistributedSearch<RankDevice>::sort_kept(std::size_t count) {
  if (count < 2) return;
  const std::size_t bytes = device_.sort64_bytes(count);
  device_.sort64(kept_.template as<Pair64>(), count, bytes ? sorting_.ensure(bytes) : nullptr,
                 bytes);
}

}  // namespace throng::mpi
