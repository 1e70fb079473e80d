// The Flow of boxes in a device's memory: what a box asks a thread of the device answers
// (device_stages.hpp), and records go from device to device by MPI, or through host memory.
//
// A Place is a Device (pipeline/pipeline.hpp: launch, clear, copy; pipeline/engine.hpp: allocate,
// release, read) that has beside this
//   begin(stream)                what follows is for this stream
//   Current                      made of a Place: its device is current as long as this lives
//   require(set, count, ids)     refuses arrays that it could not read
//   mpi_takes_it()               whether MPI reads and writes its memory where it lies
//   fetch, bring(to, from, n)    bytes to and from host memory; they wait
//   Staging                      the host memory that staged copies lie in
//   wait()                       until all is done
//   find(a, b or null, pairs)    the search of this rank
//   sort64(pairs, n, room, bytes), sort64_bytes(n)
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "mpi/balance.hpp"
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
  using Staged = pipeline::Block<typename Place::Staging>;

  // One set on its way. Places are the ranks, and one more for what is wide.
  struct Going {
    pipeline::Set set;
    std::vector<std::uint64_t> counts;  // of a place: records that go there
    std::uint64_t away = 0;             // where in `away_` its records begin, in bytes
    std::vector<std::uint64_t> coming;  // of a rank
    std::uint64_t came = 0;             // where in `staged_in_` they begin, in bytes
  };
  // What is held here of one set.
  struct Held {
    explicit Held(Place& place) noexcept : data(place), marks(place), halves(place) {}
    Block data, marks, halves;
    Records records;
    std::uint64_t given = 0;  // the first of them: this rank's own
  };
  struct Sums {
    std::uint64_t home, kept;
  };

  typename Flow::Seen look_at(const Settings& settings, const RankBoxes& set, Result& r) override;
  const std::uint64_t* host_ids(const RankBoxes& set) override;
  Flow::Sample sample(const Settings& settings, const RankBoxes& set, std::size_t most) override;
  void take_wide(int set, const Bytes& records) override;
  Result search(const Settings& settings, const Bounds& region, Found& found,
                std::vector<Flow::Sample>& samples) override;
  const Pair64* kept_pairs() const noexcept override { return kept_.template as<Pair64>(); }
  void route(Link& link, const Settings& settings, std::vector<Sent>& sets, Result& r) override;
  void deliver(Link& link) override;

  Routes routes_of(const Settings& settings, const Going& going, int ranks) const noexcept {
    return {going.set, {tree_.template as<Cut>(), ranks}, settings.search.margin, settings.wide};
  }
  void count_routes(const Settings& settings, const std::vector<Sent>& sets, int ranks);
  std::vector<Parcel> sizes_to_tell(int here) const;
  void hear_sizes(const std::vector<Parcel>& parcels);
  void write_routes(const Settings& settings, std::vector<Sent>& sets, int here, int ranks);
  void plan_slices(const std::vector<Sent>& sets, int here, int ranks);
  Flow::Sample points_of(SamplePoints stage, std::size_t most);
  Held& held(std::size_t s) noexcept { return s == 0 ? first_ : second_; }

  Place place_;
  Block looked_{place_}, tree_{place_}, counters_{place_}, away_{place_}, points_{place_},
      kept_{place_}, sorting_{place_};
  Held first_{place_}, second_{place_};
  typename Place::Staging staging_;
  Staged staged_out_{staging_}, staged_in_{staging_};
  std::vector<Going> going_;
  std::vector<Slice> out_, in_;
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
  if (settings.search.nan == NanPolicy::refuse) {
    r.invalid_count = seen.nans;
    r.first_invalid = ~seen.nan_mark;
    if (!no_nans(r)) return {};
  }
  r.first_invalid = 0;
  return {seen.inactive, seen.id_sum};
}

template <class Place>
const std::uint64_t* DeviceFlow<Place>::host_ids(const RankBoxes& set) {
  ids_.resize(set.boxes.size());
  place_.fetch(ids_.data(), set.ids, ids_.size() * sizeof(std::uint64_t));
  return ids_.data();
}

// Those that tell something, of at most so many.
template <class Place>
Flow::Sample DeviceFlow<Place>::points_of(SamplePoints stage, std::size_t most) {
  Flow::Sample sample;
  if (stage.count == 0) return sample;
  sample.step = stage.step = (stage.count + most - 1) / most;
  const std::uint64_t count = (stage.count + stage.step - 1) / stage.step;
  const auto bytes = static_cast<std::size_t>(count) * sizeof(Point);
  points_.room(bytes);
  stage.points = points_.template as<Point>();
  place_.launch(count, stage);
  sample.points.resize(static_cast<std::size_t>(count));
  place_.fetch(sample.points.data(), stage.points, bytes);
  const auto tells_nothing = [](const Point& p) { return p.weight == SamplePoints::none; };
  sample.points.erase(std::remove_if(sample.points.begin(), sample.points.end(), tells_nothing),
                      sample.points.end());
  return sample;
}

template <class Place>
Flow::Sample DeviceFlow<Place>::sample(const Settings& settings, const RankBoxes& set,
                                       std::size_t most) {
  SamplePoints stage{};
  stage.set = pipeline::make_set(set.boxes);
  stage.margin = settings.search.margin;
  stage.count = set.boxes.size();
  return points_of(stage, most);
}

template <class Place>
void DeviceFlow<Place>::count_routes(const Settings& settings, const std::vector<Sent>& sets,
                                     int ranks) {
  const auto places = static_cast<std::size_t>(ranks) + 1;
  going_.assign(sets.size(), {});
  tree_.room(static_cast<std::size_t>(ranks) * sizeof(Cut));
  place_.bring(tree_.template as<Cut>(), this->regions().tree().cuts,
               static_cast<std::size_t>(ranks) * sizeof(Cut));
  counters_.room(sets.size() * places * sizeof(std::uint64_t));
  auto* const counts = counters_.template as<std::uint64_t>();
  place_.clear(counts, sets.size() * places * sizeof(std::uint64_t));
  for (std::size_t s = 0; s < sets.size(); ++s) {
    Going& going = going_[s];
    going.set = pipeline::make_set(sets[s].given->boxes);
    going.counts.resize(places);
    going.coming.resize(static_cast<std::size_t>(ranks));
    place_.launch(sets[s].given->boxes.size(),
                  CountRoutes{routes_of(settings, going, ranks), counts + s * places});
  }
  for (std::size_t s = 0; s < sets.size(); ++s) {
    place_.fetch(going_[s].counts.data(), counts + s * places, places * sizeof(std::uint64_t));
  }
}

// To each rank that gets something: how many records, a number a set.
template <class Place>
std::vector<Parcel> DeviceFlow<Place>::sizes_to_tell(int here) const {
  std::vector<Parcel> parcels;
  for (std::size_t rank = 0; rank < going_[0].coming.size(); ++rank) {
    std::uint64_t counts[2] = {}, any = 0;
    for (std::size_t s = 0; s < going_.size(); ++s) any |= counts[s] = going_[s].counts[rank];
    if (static_cast<int>(rank) == here || any == 0) continue;
    const auto* const bytes = reinterpret_cast<const std::byte*>(counts);
    parcels.push_back(
        {static_cast<int>(rank), Bytes(bytes, bytes + going_.size() * sizeof counts[0])});
  }
  return parcels;
}

template <class Place>
void DeviceFlow<Place>::hear_sizes(const std::vector<Parcel>& parcels) {
  for (const Parcel& parcel : parcels) {
    for (std::size_t s = 0; s < going_.size(); ++s) {
      std::memcpy(&going_[s].coming[static_cast<std::size_t>(parcel.rank)],
                  parcel.data.data() + s * sizeof(std::uint64_t), sizeof(std::uint64_t));
    }
  }
}

// Room for all that is held and sent; then each record to its place.
template <class Place>
void DeviceFlow<Place>::write_routes(const Settings& settings, std::vector<Sent>& sets, int here,
                                     int ranks) {
  const auto places = static_cast<std::size_t>(ranks) + 1;
  std::vector<std::uint64_t> next(sets.size() * places);
  std::uint64_t away = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    Going& going = going_[s];
    Held& home = held(s);
    const std::size_t bytes = record_bytes(sets[s].filters);
    std::uint64_t at = 0;
    for (std::size_t place = 0; place < places; ++place) {
      if (static_cast<int>(place) == here) continue;
      next[s * places + place] = at;
      at += going.counts[place];
    }
    going.away = away;
    away += at * bytes;
    home.given = going.counts[static_cast<std::size_t>(here)];
    std::uint64_t count = home.given;
    for (const std::uint64_t coming : going.coming) count += coming;
    home.data.room(static_cast<std::size_t>(count) * bytes + sizeof(Box));
    home.records = {home.data.template as<std::uint32_t>(), count,
                    static_cast<std::uint32_t>(bytes / sizeof(std::uint32_t)), sets[s].filters};
  }
  away_.room(static_cast<std::size_t>(away) + sizeof(Box));
  auto* const cursors = counters_.template as<std::uint64_t>();
  place_.bring(cursors, next.data(), next.size() * sizeof(std::uint64_t));
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const RankBoxes& given = *sets[s].given;
    Records to = held(s).records;
    to.data = reinterpret_cast<std::uint32_t*>(away_.template as<std::byte>() + going_[s].away);
    place_.launch(given.boxes.size(),
                  WriteRoutes{routes_of(settings, going_[s], ranks), given.ids, sets[s].first_id,
                              cursors + s * places, here, held(s).records, to});
    // Those that are wide stand last.
    const std::size_t bytes = record_bytes(sets[s].filters);
    const std::uint64_t wide = going_[s].counts.back();
    sets[s].wide.resize(static_cast<std::size_t>(wide) * bytes);
    place_.fetch(
        sets[s].wide.data(),
        away_.template as<std::byte>() + going_[s].away + next[(s + 1) * places - 1] * bytes,
        sets[s].wide.size());
  }
}

// Where MPI reads and writes.
template <class Place>
void DeviceFlow<Place>::plan_slices(const std::vector<Sent>& sets, int here, int ranks) {
  out_.clear();
  in_.clear();
  const bool direct = this->traffic_.direct;
  std::uint64_t away = 0, coming = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const std::size_t bytes = record_bytes(sets[s].filters);
    going_[s].came = coming;
    coming += (held(s).records.count - held(s).given) * bytes;
    away = going_[s].away;
    for (const std::uint64_t count : going_[s].counts) away += count * bytes;
    away -= held(s).given * bytes;
  }
  if (!direct) {
    staged_out_.room(static_cast<std::size_t>(away));
    staged_in_.room(static_cast<std::size_t>(coming));
    place_.fetch(staged_out_.template as<std::byte>(), away_.template as<std::byte>(),
                 static_cast<std::size_t>(away));
  }
  std::byte* const from =
      direct ? away_.template as<std::byte>() : staged_out_.template as<std::byte>();
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const std::size_t bytes = record_bytes(sets[s].filters);
    std::byte* out = from + going_[s].away;
    std::byte* in = direct ? held(s).data.template as<std::byte>() + held(s).given * bytes
                           : staged_in_.template as<std::byte>() + going_[s].came;
    for (int rank = 0; rank < ranks; ++rank) {
      if (rank == here) continue;
      const auto place = static_cast<std::size_t>(rank);
      const auto to = static_cast<std::size_t>(going_[s].counts[place]) * bytes;
      const auto coming_bytes = static_cast<std::size_t>(going_[s].coming[place]) * bytes;
      if (to) out_.push_back({rank, out, to});
      if (coming_bytes) in_.push_back({rank, in, coming_bytes});
      out += to;
      in += coming_bytes;
    }
  }
  place_.wait();
}

template <class Place>
void DeviceFlow<Place>::route(Link& link, const Settings& settings, std::vector<Sent>& sets,
                              Result& r) {
  const int here = link.rank(), ranks = link.size();
  this->traffic_.direct = settings.buffers == Buffers::direct ||
                          (settings.buffers == Buffers::automatic && place_.mpi_takes_it());
  std::vector<Parcel> sizes;
  attempt(r, [&] {
    count_routes(settings, sets, ranks);
    sizes = sizes_to_tell(here);
  });
  const std::vector<Parcel> heard = link.exchange(std::move(sizes));
  attempt(r, [&] {
    hear_sizes(heard);
    write_routes(settings, sets, here, ranks);
    plan_slices(sets, here, ranks);
  });
}

template <class Place>
void DeviceFlow<Place>::deliver(Link& link) {
  link.exchange(out_, in_);
}

template <class Place>
void DeviceFlow<Place>::take_wide(int set, const Bytes& bytes) {
  Held& to = held(static_cast<std::size_t>(set));
  const std::size_t each = to.records.words * sizeof(std::uint32_t);
  const std::size_t kept = static_cast<std::size_t>(to.records.count) * each;
  to.data.grow(kept + bytes.size(), kept);
  place_.bring(to.data.template as<std::byte>() + kept, bytes.data(), bytes.size());
  to.records.data = to.data.template as<std::uint32_t>();
  to.records.count += bytes.size() / each;
}

template <class Place>
Result DeviceFlow<Place>::search(const Settings& settings, const Bounds& region, Found& found,
                                 std::vector<Flow::Sample>& samples) {
  const std::size_t sets = going_.size();
  const float margin = settings.search.margin;
  if (!this->traffic_.direct) {
    std::uint64_t end = 0;
    for (const Slice& slice : in_) end += slice.bytes;
    for (std::size_t s = sets; s-- > 0; end = going_[s].came) {
      const std::size_t each = held(s).records.words * sizeof(std::uint32_t);
      place_.bring(held(s).data.template as<std::byte>() + held(s).given * each,
                   staged_in_.template as<std::byte>() + going_[s].came,
                   static_cast<std::size_t>(end - going_[s].came));
    }
  }
  looked_.room(sizeof(Sums));
  auto* const sums = looked_.template as<Sums>();
  place_.clear(sums, sizeof(Sums));
  Boxes views[2];
  for (std::size_t s = 0; s < sets; ++s) {
    Held& h = held(s);
    const std::uint64_t n = h.records.count;
    const std::uint64_t threads = std::min(n, summing_threads);
    views[s] = h.records.view();
    h.marks.room(static_cast<std::size_t>(n) + 1);
    h.halves.room(static_cast<std::size_t>(n + 1) * sizeof(std::uint32_t));
    place_.clear(h.halves.template as<char>(), static_cast<std::size_t>(n) * sizeof(std::uint32_t));
    place_.launch(threads, MarkHome{pipeline::make_set(views[s]), margin, region, n, threads,
                                    h.marks.template as<std::uint8_t>(), &sums->home});
    found.known += n;
  }
  found.handled = found.known;
  Pairs pairs;
  Result r = place_.find(views[0], sets == 2 ? &views[1] : nullptr, pairs);
  if (!r.ok()) return r;
  kept_.room((pairs.size() + 1) * sizeof(Pair64));
  Held &a = held(0), &b = held(sets - 1);
  place_.launch(
      pairs.size(),
      KeepPairs{pairs.data(), a.records, b.records, a.marks.template as<std::uint8_t>(),
                b.marks.template as<std::uint8_t>(), a.halves.template as<std::uint32_t>(),
                b.halves.template as<std::uint32_t>(), sets == 2, kept_.template as<Pair64>(),
                &sums->kept});
  const Sums told = place_.read(*sums);
  found.home = told.home;
  found.kept = told.kept;
  std::vector<Flow::Sample> fresh;
  for (std::size_t s = 0; s < sets; ++s) {
    const Held& h = held(s);
    fresh.push_back(points_of({pipeline::make_set(views[s]), margin, h.records.count, 1,
                               h.marks.template as<std::uint8_t>(),
                               h.halves.template as<std::uint32_t>(), pair_work / 2, nullptr},
                              most_points / sets));
  }
  if (settings.search.order == Order::canonical && found.kept > 1) {
    const auto count = static_cast<std::size_t>(found.kept);
    const std::size_t bytes = place_.sort64_bytes(count);
    place_.sort64(kept_.template as<Pair64>(), count, bytes ? sorting_.room(bytes) : nullptr,
                  bytes);
  }
  place_.wait();
  samples.swap(fresh);
  return r;
}

}  // namespace throng::mpi
