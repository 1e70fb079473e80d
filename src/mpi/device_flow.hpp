// The search across ranks for boxes in device memory: per-box work runs as kernels
// (device_stages.hpp), records are sent from device to device by MPI or through host memory
// (device_routes.hpp).
//
// A Place is a Device (pipeline/pipeline.hpp: launch, clear; pipeline/engine.hpp: allocate,
// release, copy, read) that adds
//   begin(stream)                selects the stream of the calls that follow
//   Current                      RAII: the Place's device is current during its lifetime
//   require(set, count, ids)     refuses arrays that the device cannot read
//   mpi_takes_it()               whether MPI accepts pointers to its memory
//   fetch, bring(to, from, n)    copy bytes to and from host memory; synchronous
//   Staging                      allocates the host memory of staged copies
//   wait()                       synchronises the stream
//   find(a, b or null, pairs)    the local search
//   sort64(pairs, n, scratch, bytes), sort64_bytes(n)
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "mpi/balance.hpp"
#include "mpi/device_routes.hpp"
#include "mpi/device_stages.hpp"
#include "mpi/on_device.hpp"
#include "pipeline/block.hpp"

namespace throng::mpi {

template <class Place>
class DeviceFlow final : public OnDevice {
 public:
  template <class... Args>
  explicit DeviceFlow(Args&&... args) : place_(std::forward<Args>(args)...) {}

  void find(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
            cuda::Stream stream, Result& r) override {
    std::optional<typename Place::Current> current;
    attempt(r, [&] {
      place_.begin(stream);
      current.emplace(place_);
    });
    Flow::find(link, settings, given, count, r);
  }

 private:
  using Block = pipeline::Block<Place>;
  struct Sums {
    std::uint64_t home, kept;
  };

  Seen look_at(const Settings& settings, const RankBoxes& given, Result& r) override;
  const std::uint64_t* host_ids(const RankBoxes& given) override;
  Sample sample(const Settings& settings, const RankBoxes& given, std::size_t most) override;
  void route(Link& link, const Settings& settings, std::vector<Sent>& sets, Result& r) override;
  void deliver(Link& link) override { link.exchange(routes_.out(), routes_.in()); }
  void take_wide(int set, const Bytes& records) override {
    routes_.take_wide(static_cast<std::size_t>(set), records);
  }
  Result search(const Settings& settings, const Bounds& region, Found& found,
                std::vector<Sample>& samples) override;
  const Pair64* kept_pairs() const noexcept override { return kept_.template as<Pair64>(); }

  Sample points_of(SamplePoints stage, std::size_t most);
  void keep(const Pairs& pairs, Found& found, Sums* sums);
  void sort_kept(std::size_t count);

  Place place_;
  DeviceRoutes<Place> routes_{place_};
  Block looked_{place_}, points_{place_}, kept_{place_}, sorting_{place_};
  Block marks_[2]{Block(place_), Block(place_)},
      halves_[2]{Block(place_), Block(place_)};  // per box
  std::vector<std::uint64_t> ids_;
};

template <class Place>
Flow::Seen DeviceFlow<Place>::look_at(const Settings& settings, const RankBoxes& given, Result& r) {
  const std::size_t n = given.boxes.size();
  if (!valid_arrays(given.boxes, r) || n == 0) return {};
  const pipeline::Set set = pipeline::make_set(given.boxes);
  place_.require(set, n, given.ids);
  looked_.room(sizeof(Looked));
  auto* const looked = looked_.template as<Looked>();
  place_.clear(looked, sizeof(Looked));
  const std::uint64_t threads = std::min<std::uint64_t>(n, summing_threads);
  place_.launch(threads, LookAtBoxes{set, given.ids, n, threads, looked});
  const Looked seen = place_.read(*looked);
  r.invalid_count = seen.bad_worlds;
  r.first_invalid = ~seen.bad_world_mark;
  if (!no_bad_worlds(r)) return {};
  r.invalid_count = settings.search.nan == NanPolicy::refuse ? seen.nans : 0;
  r.first_invalid = ~seen.nan_mark;
  if (!no_nans(r)) return {};
  r.first_invalid = 0;
  return {seen.inactive, seen.id_sum};
}

template <class Place>
const std::uint64_t* DeviceFlow<Place>::host_ids(const RankBoxes& given) {
  ids_.resize(given.boxes.size());
  place_.fetch(ids_.data(), given.ids, ids_.size() * sizeof(std::uint64_t));
  return ids_.data();
}

// At most `most` points, of boxes that carry a position.
template <class Place>
Flow::Sample DeviceFlow<Place>::points_of(SamplePoints stage, std::size_t most) {
  Sample sample;
  if (stage.count == 0) return sample;
  sample.step = stage.step = (stage.count + most - 1) / most;
  const auto count = static_cast<std::size_t>((stage.count + stage.step - 1) / stage.step);
  points_.room(count * sizeof(Point));
  stage.points = points_.template as<Point>();
  place_.launch(count, stage);
  sample.points.resize(count);
  place_.fetch(sample.points.data(), stage.points, count * sizeof(Point));
  const auto none = [](const Point& point) { return point.weight == SamplePoints::none; };
  sample.points.erase(std::remove_if(sample.points.begin(), sample.points.end(), none),
                      sample.points.end());
  return sample;
}

template <class Place>
Flow::Sample DeviceFlow<Place>::sample(const Settings& settings, const RankBoxes& given,
                                       std::size_t most) {
  SamplePoints stage{};
  stage.set = pipeline::make_set(given.boxes);
  stage.margin = settings.search.margin;
  stage.count = given.boxes.size();
  return points_of(stage, most);
}

template <class Place>
void DeviceFlow<Place>::route(Link& link, const Settings& settings, std::vector<Sent>& sets,
                              Result& r) {
  traffic_.direct = settings.buffers == Buffers::direct ||
                    (settings.buffers == Buffers::automatic && place_.mpi_takes_it());
  std::vector<Parcel> sizes;
  attempt(r, [&] {
    routes_.count(settings, regions().tree(), sets);
    sizes = routes_.sizes(link.rank());
  });
  const std::vector<Parcel> heard = link.exchange(std::move(sizes));
  attempt(r, [&] { routes_.write(settings, sets, heard, link.rank(), traffic_.direct); });
}

template <class Place>
Result DeviceFlow<Place>::search(const Settings& settings, const Bounds& region, Found& found,
                                 std::vector<Sample>& samples) {
  routes_.take_staged();
  looked_.room(sizeof(Sums));
  auto* const sums = looked_.template as<Sums>();
  place_.clear(sums, sizeof(Sums));
  const std::size_t sets = routes_.set_count();
  const float margin = settings.search.margin;
  Boxes views[2];
  SamplePoints stages[2] = {};
  for (std::size_t s = 0; s < sets; ++s) {
    const std::uint64_t n = routes_.records(s).count;
    views[s] = routes_.records(s).view();
    const pipeline::Set set = pipeline::make_set(views[s]);
    const auto room = static_cast<std::size_t>(n) + 1;
    marks_[s].room(room);
    halves_[s].room(room * sizeof(std::uint32_t));
    auto* const marks = marks_[s].template as<std::uint8_t>();
    auto* const halves = halves_[s].template as<std::uint32_t>();
    place_.clear(halves, room * sizeof(std::uint32_t));
    const std::uint64_t threads = std::min(n, summing_threads);
    place_.launch(threads, MarkHome{set, margin, region, n, threads, marks, &sums->home});
    stages[s] = {set, margin, n, 1, marks, halves, pair_work / 2, nullptr};
    found.known += n;
  }
  found.handled = found.known;
  Pairs pairs;
  Result r = place_.find(views[0], sets == 2 ? &views[1] : nullptr, pairs);
  if (!r.ok()) return r;
  keep(pairs, found, sums);
  std::vector<Sample> fresh;
  for (std::size_t s = 0; s < sets; ++s) fresh.push_back(points_of(stages[s], most_points / sets));
  if (settings.search.order == Order::canonical) sort_kept(static_cast<std::size_t>(found.kept));
  place_.wait();
  samples.swap(fresh);
  return r;
}

template <class Place>
void DeviceFlow<Place>::keep(const Pairs& pairs, Found& found, Sums* sums) {
  const std::size_t last = routes_.set_count() - 1;
  kept_.room((pairs.size() + 1) * sizeof(Pair64));
  place_.launch(
      pairs.size(),
      KeepPairs{pairs.data(), routes_.records(0), routes_.records(last),
                marks_[0].template as<std::uint8_t>(), marks_[last].template as<std::uint8_t>(),
                halves_[0].template as<std::uint32_t>(), halves_[last].template as<std::uint32_t>(),
                last != 0, kept_.template as<Pair64>(), &sums->kept});
  const Sums told = place_.read(*sums);
  found.home = told.home;
  found.kept = told.kept;
}

template <class Place>
void DeviceFlow<Place>::sort_kept(std::size_t count) {
  if (count < 2) return;
  const std::size_t bytes = place_.sort64_bytes(count);
  place_.sort64(kept_.template as<Pair64>(), count, bytes ? sorting_.room(bytes) : nullptr, bytes);
}

}  // namespace throng::mpi
