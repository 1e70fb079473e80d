// Halo exchange between devices: writes outgoing records where MPI, or a copy to host memory, reads
// them, and appends incoming records to this rank's own. Place: see device_flow.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mpi/device_stages.hpp"
#include "mpi/flow.hpp"
#include "pipeline/block.hpp"

namespace throng::mpi {

// All calls are local, to be made in the order of declaration; they throw pipeline::Failure or
// std::bad_alloc. Destinations are the ranks, plus one for boxes that are forwarded along the tree.
template <class Place>
class DeviceRoutes {
 public:
  explicit DeviceRoutes(Place& place) noexcept : place_(place) {}

  void count(const Settings& settings, const Tree& tree, const std::vector<Sent>& sets);
  // One message per rank that receives records: their number per set.
  std::vector<Parcel> sizes(int here) const;
  // Takes the sizes received from other ranks. Fills `wide` of the sets.
  void write(const Settings& settings, std::vector<Sent>& sets, const std::vector<Parcel>& sizes,
             int here, bool direct);
  // Arguments of Link::exchange. The stream is synchronised before.
  const std::vector<Slice>& out() const noexcept { return out_; }
  const std::vector<Slice>& in() const noexcept { return in_; }
  // Copies staged records to the device.
  void take_staged();
  void take_wide(std::size_t set, const Bytes& records);

  std::size_t set_count() const noexcept { return going_.size(); }
  // All records that this rank searches.
  const Records& records(std::size_t set) const noexcept { return going_[set].records; }

 private:
  using Block = pipeline::Block<Place>;

  struct Going {
    pipeline::Set set;
    std::vector<std::uint64_t> counts;     // outgoing records per destination
    std::vector<std::uint64_t> coming;     // incoming records per rank
    Records records;                       // this rank's own first
    std::size_t bytes = 0;                 // per record
    std::uint64_t own = 0, came = 0;       // records
    std::size_t away_at = 0, came_at = 0;  // byte offsets of this set in `away_` and `staged_in_`
  };

  Routes routes_of(const Settings& settings, const Going& going) const noexcept {
    return {going.set, {tree_.template as<Cut>(), ranks_}, settings.search.margin, settings.wide};
  }
  void plan_slices(int here);

  Place& place_;
  int ranks_ = 0;
  Block tree_{place_}, counters_{place_}, away_{place_}, first_{place_}, second_{place_};
  typename Place::Staging staging_;
  pipeline::Block<typename Place::Staging> staged_out_{staging_}, staged_in_{staging_};
  std::vector<Going> going_;
  std::size_t away_bytes_ = 0, came_bytes_ = 0;
  bool direct_ = false;
  std::vector<Slice> out_, in_;
};

template <class Place>
void DeviceRoutes<Place>::count(const Settings& settings, const Tree& tree,
                                const std::vector<Sent>& sets) {
  ranks_ = tree.count;
  const std::size_t ranks = static_cast<std::size_t>(ranks_), places = ranks + 1;
  going_.assign(sets.size(), {});
  tree_.room(ranks * sizeof(Cut));
  place_.bring(tree_.template as<Cut>(), tree.cuts, ranks * sizeof(Cut));
  const std::size_t bytes = places * sizeof(std::uint64_t);
  counters_.room(sets.size() * bytes);
  auto* const counts = counters_.template as<std::uint64_t>();
  place_.clear(counts, sets.size() * bytes);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    Going& going = going_[s];
    going.set = pipeline::make_set(sets[s].given->boxes);
    going.bytes = record_bytes(sets[s].filters);
    going.counts.resize(places);
    going.coming.resize(ranks);
    place_.launch(sets[s].given->boxes.size(),
                  CountRoutes{routes_of(settings, going), counts + s * places});
  }
  for (std::size_t s = 0; s < sets.size(); ++s) {
    place_.fetch(going_[s].counts.data(), counts + s * places, bytes);
  }
}

template <class Place>
std::vector<Parcel> DeviceRoutes<Place>::sizes(int here) const {
  std::vector<Parcel> parcels;
  for (int rank = 0; rank < ranks_; ++rank) {
    std::uint64_t counts[2] = {}, any = 0;
    for (std::size_t s = 0; s < going_.size(); ++s) {
      any |= counts[s] = going_[s].counts[static_cast<std::size_t>(rank)];
    }
    if (rank == here || any == 0) continue;
    const auto* const bytes = reinterpret_cast<const std::byte*>(counts);
    parcels.push_back({rank, Bytes(bytes, bytes + going_.size() * sizeof counts[0])});
  }
  return parcels;
}

// Allocates memory for all records, then writes each to its place.
template <class Place>
void DeviceRoutes<Place>::write(const Settings& settings, std::vector<Sent>& sets,
                                const std::vector<Parcel>& sizes, int here, bool direct) {
  const auto own = static_cast<std::size_t>(here);
  const std::size_t places = static_cast<std::size_t>(ranks_) + 1;
  std::vector<std::uint64_t> next(sets.size() * places);
  direct_ = direct;
  away_bytes_ = came_bytes_ = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    Going& going = going_[s];
    for (const Parcel& parcel : sizes) {
      std::uint64_t coming;
      std::memcpy(&coming, parcel.data.data() + s * sizeof coming, sizeof coming);
      going.coming[static_cast<std::size_t>(parcel.rank)] = coming;
      going.came += coming;
    }
    std::uint64_t away = 0;
    for (std::size_t place = 0; place < places; ++place) {
      if (place == own) continue;
      next[s * places + place] = away;
      away += going.counts[place];
    }
    going.own = going.counts[own];
    going.away_at = away_bytes_;
    going.came_at = came_bytes_;
    away_bytes_ += static_cast<std::size_t>(away) * going.bytes;
    came_bytes_ += static_cast<std::size_t>(going.came) * going.bytes;
    Block& home = s == 0 ? first_ : second_;
    going.records.count = going.own + going.came;
    home.room(static_cast<std::size_t>(going.records.count + 1) * going.bytes);
    going.records.data = home.template as<std::uint32_t>();
    going.records.words = static_cast<std::uint32_t>(going.bytes / sizeof(std::uint32_t));
    going.records.filters = sets[s].filters;
  }
  away_.room(away_bytes_ + 1);
  auto* const cursors = counters_.template as<std::uint64_t>();
  place_.bring(cursors, next.data(), next.size() * sizeof(std::uint64_t));
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const RankBoxes& given = *sets[s].given;
    const Going& going = going_[s];
    char* const away_data = away_.template as<char>() + going.away_at;
    Records away = going.records;
    away.data = reinterpret_cast<std::uint32_t*>(away_data);
    place_.launch(given.boxes.size(),
                  WriteRoutes{routes_of(settings, going), given.ids, sets[s].first_id,
                              cursors + s * places, here, going.records, away});
    // Forwarded records are last.
    const auto begin = static_cast<std::size_t>(next[(s + 1) * places - 1]) * going.bytes;
    sets[s].wide.resize(static_cast<std::size_t>(going.counts.back()) * going.bytes);
    place_.fetch(sets[s].wide.data(), away_data + begin, sets[s].wide.size());
  }
  if (!direct_) {
    staged_out_.room(away_bytes_);
    staged_in_.room(came_bytes_);
    place_.fetch(staged_out_.template as<char>(), away_.template as<char>(), away_bytes_);
  }
  plan_slices(here);
  place_.wait();
}

// The buffers that MPI reads and writes.
template <class Place>
void DeviceRoutes<Place>::plan_slices(int here) {
  out_.clear();
  in_.clear();
  const auto start = [](auto& block, std::size_t at) {
    return block.template as<std::byte>() + at;
  };
  for (std::size_t s = 0; s < going_.size(); ++s) {
    const Going& going = going_[s];
    std::byte* out = direct_ ? start(away_, going.away_at) : start(staged_out_, going.away_at);
    std::byte* in = direct_ ? start(s == 0 ? first_ : second_, going.own * going.bytes)
                            : start(staged_in_, going.came_at);
    for (int rank = 0; rank < ranks_; ++rank) {
      if (rank == here) continue;
      const auto place = static_cast<std::size_t>(rank);
      const std::size_t to = static_cast<std::size_t>(going.counts[place]) * going.bytes;
      const std::size_t from = static_cast<std::size_t>(going.coming[place]) * going.bytes;
      if (to) out_.push_back({rank, out, to});
      if (from) in_.push_back({rank, in, from});
      out += to;
      in += from;
    }
  }
}

template <class Place>
void DeviceRoutes<Place>::take_staged() {
  if (direct_) return;
  for (const Going& going : going_) {
    place_.bring(going.records.data + going.own * going.records.words,
                 staged_in_.template as<char>() + going.came_at,
                 static_cast<std::size_t>(going.came) * going.bytes);
  }
}

template <class Place>
void DeviceRoutes<Place>::take_wide(std::size_t set, const Bytes& wide) {
  Records& records = going_[set].records;
  Block& home = set == 0 ? first_ : second_;
  const std::size_t kept = static_cast<std::size_t>(records.count) * going_[set].bytes;
  home.grow(kept + wide.size(), kept);
  records.data = home.template as<std::uint32_t>();
  place_.bring(home.template as<char>() + kept, wide.data(), wide.size());
  records.count += wide.size() / going_[set].bytes;
}

}  // namespace throng::mpi
