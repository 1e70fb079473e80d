// Halo exchange between devices: writes outgoing records where MPI, or a copy to host memory, reads
// them, and appends incoming records to this rank's own. RankDevice: see
// device_distributed_search.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "device/device_buffer.hpp"
#include "mpi/device_stages.hpp"
#include "mpi/distributed_search.hpp"

namespace throng::mpi {

// All calls are local, to be made in the order of declaration; they throw device::Failure or
// std::bad_alloc. Destinations are the ranks, plus one for boxes that are forwarded along the tree.
template <class RankDevice>
class DeviceHaloExchange {
 public:
  explicit DeviceHaloExchange(RankDevice& device) noexcept : device_(device) {}

  void count(const Settings& settings, const Tree& tree, const std::vector<OutgoingSet>& sets);
  // One message per rank that receives records: their number per set.
  std::vector<Parcel> sizes(int here) const;
  // Takes the sizes received from other ranks. Fills `tree_records` of the sets.
  void write(const Settings& settings, std::vector<OutgoingSet>& sets,
             const std::vector<Parcel>& sizes, int here, bool direct);
  // Arguments of Communicator::exchange. The stream is synchronized before.
  const std::vector<Slice>& out() const noexcept { return out_; }
  const std::vector<Slice>& in() const noexcept { return in_; }
  // Copies staged records to the device.
  void upload_staged();
  void take_tree_records(std::size_t set, const Bytes& records);

  std::size_t set_count() const noexcept { return outgoing_.size(); }
  // All records that this rank searches.
  const Records& records(std::size_t set) const noexcept { return outgoing_[set].records; }

 private:
  using Block = device::DeviceBuffer<RankDevice>;

  struct OutgoingRecords {
    device::Set set;
    std::vector<std::uint64_t> counts;    // outgoing records per destination
    std::vector<std::uint64_t> incoming;  // incoming records per rank
    Records records;                      // this rank's own first
    std::size_t bytes = 0;                // per record
    std::uint64_t own = 0, received = 0;  // records
    std::size_t away_at = 0,
                received_at = 0;  // byte offsets of this set in `away_` and `staged_in_`
  };

  Routes routes_of(const Settings& settings, const OutgoingRecords& outgoing) const noexcept {
    return {outgoing.set,
            {tree_.template as<Cut>(), ranks_},
            settings.search.margin,
            settings.tree_send_threshold};
  }
  void plan_slices(int here);

  RankDevice& device_;
  int ranks_ = 0;
  Block tree_{device_}, counters_{device_}, away_{device_}, first_{device_}, second_{device_};
  typename RankDevice::Staging staging_;
  device::DeviceBuffer<typename RankDevice::Staging> staged_out_{staging_}, staged_in_{staging_};
  std::vector<OutgoingRecords> outgoing_;
  std::size_t away_bytes_ = 0, received_bytes_ = 0;
  bool direct_ = false;
  std::vector<Slice> out_, in_;
};

template <class RankDevice>
void DeviceHaloExchange<RankDevice>::count(const Settings& settings, const Tree& tree,
                                           const std::vector<OutgoingSet>& sets) {
  ranks_ = tree.count;
  const std::size_t ranks = static_cast<std::size_t>(ranks_), places = ranks + 1;
  outgoing_.assign(sets.size(), {});
  tree_.ensure(ranks * sizeof(Cut));
  device_.upload(tree_.template as<Cut>(), tree.cuts, ranks * sizeof(Cut));
  const std::size_t bytes = places * sizeof(std::uint64_t);
  counters_.ensure(sets.size() * bytes);
  auto* const counts = counters_.template as<std::uint64_t>();
  device_.clear(counts, sets.size() * bytes);
  for (std::size_t s = 0; s < sets.size(); ++s) {
    OutgoingRecords& outgoing = outgoing_[s];
    outgoing.set = device::make_set(sets[s].given->boxes);
    outgoing.bytes = record_bytes(sets[s].filters);
    outgoing.counts.resize(places);
    outgoing.incoming.resize(ranks);
    device_.launch(sets[s].given->boxes.size(),
                   CountRoutes{routes_of(settings, outgoing), counts + s * places});
  }
  for (std::size_t s = 0; s < sets.size(); ++s) {
    device_.download(outgoing_[s].counts.data(), counts + s * places, bytes);
  }
}

template <class RankDevice>
std::vector<Parcel> DeviceHaloExchange<RankDevice>::sizes(int here) const {
  std::vector<Parcel> parcels;
  for (int rank = 0; rank < ranks_; ++rank) {
    std::uint64_t counts[2] = {}, any = 0;
    for (std::size_t s = 0; s < outgoing_.size(); ++s) {
      any |= counts[s] = outgoing_[s].counts[static_cast<std::size_t>(rank)];
    }
    if (rank == here || any == 0) continue;
    const auto* const bytes = reinterpret_cast<const std::byte*>(counts);
    parcels.push_back({rank, Bytes(bytes, bytes + outgoing_.size() * sizeof counts[0])});
  }
  return parcels;
}

// Allocates memory for all records, then writes each to its place.
template <class RankDevice>
void DeviceHaloExchange<RankDevice>::write(const Settings& settings, std::vector<OutgoingSet>& sets,
                                           const std::vector<Parcel>& sizes, int here,
                                           bool direct) {
  const auto own = static_cast<std::size_t>(here);
  const std::size_t places = static_cast<std::size_t>(ranks_) + 1;
  std::vector<std::uint64_t> next(sets.size() * places);
  direct_ = direct;
  away_bytes_ = received_bytes_ = 0;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    OutgoingRecords& outgoing = outgoing_[s];
    for (const Parcel& parcel : sizes) {
      std::uint64_t incoming;
      std::memcpy(&incoming, parcel.data.data() + s * sizeof incoming, sizeof incoming);
      outgoing.incoming[static_cast<std::size_t>(parcel.rank)] = incoming;
      outgoing.received += incoming;
    }
    std::uint64_t away = 0;
    for (std::size_t place = 0; place < places; ++place) {
      if (place == own) continue;
      next[s * places + place] = away;
      away += outgoing.counts[place];
    }
    outgoing.own = outgoing.counts[own];
    outgoing.away_at = away_bytes_;
    outgoing.received_at = received_bytes_;
    away_bytes_ += static_cast<std::size_t>(away) * outgoing.bytes;
    received_bytes_ += static_cast<std::size_t>(outgoing.received) * outgoing.bytes;
    Block& records_block = s == 0 ? first_ : second_;
    outgoing.records.count = outgoing.own + outgoing.received;
    records_block.ensure(static_cast<std::size_t>(outgoing.records.count + 1) * outgoing.bytes);
    outgoing.records.data = records_block.template as<std::uint32_t>();
    outgoing.records.words = static_cast<std::uint32_t>(outgoing.bytes / sizeof(std::uint32_t));
    outgoing.records.filters = sets[s].filters;
  }
  away_.ensure(away_bytes_ + 1);
  auto* const cursors = counters_.template as<std::uint64_t>();
  device_.upload(cursors, next.data(), next.size() * sizeof(std::uint64_t));
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const RankBoxes& given = *sets[s].given;
    const OutgoingRecords& outgoing = outgoing_[s];
    char* const away_data = away_.template as<char>() + outgoing.away_at;
    Records away = outgoing.records;
    away.data = reinterpret_cast<std::uint32_t*>(away_data);
    device_.launch(given.boxes.size(),
                   WriteRoutes{routes_of(settings, outgoing), given.ids, sets[s].first_id,
                               cursors + s * places, here, outgoing.records, away});
    // Forwarded records are last.
    const auto begin = static_cast<std::size_t>(next[(s + 1) * places - 1]) * outgoing.bytes;
    sets[s].tree_records.resize(static_cast<std::size_t>(outgoing.counts.back()) * outgoing.bytes);
    device_.download(sets[s].tree_records.data(), away_data + begin, sets[s].tree_records.size());
  }
  if (!direct_) {
    staged_out_.ensure(away_bytes_);
    staged_in_.ensure(received_bytes_);
    device_.download(staged_out_.template as<char>(), away_.template as<char>(), away_bytes_);
  }
  plan_slices(here);
  device_.wait();
}

// The buffers that MPI reads and writes.
template <class RankDevice>
void DeviceHaloExchange<RankDevice>::plan_slices(int here) {
  out_.clear();
  in_.clear();
  const auto start = [](auto& block, std::size_t at) {
    return block.template as<std::byte>() + at;
  };
  for (std::size_t s = 0; s < outgoing_.size(); ++s) {
    const OutgoingRecords& outgoing = outgoing_[s];
    std::byte* out =
        direct_ ? start(away_, outgoing.away_at) : start(staged_out_, outgoing.away_at);
    std::byte* in = direct_ ? start(s == 0 ? first_ : second_, outgoing.own * outgoing.bytes)
                            : start(staged_in_, outgoing.received_at);
    for (int rank = 0; rank < ranks_; ++rank) {
      if (rank == here) continue;
      const auto place = static_cast<std::size_t>(rank);
      const std::size_t to = static_cast<std::size_t>(outgoing.counts[place]) * outgoing.bytes;
      const std::size_t from = static_cast<std::size_t>(outgoing.incoming[place]) * outgoing.bytes;
      if (to) out_.push_back({rank, out, to});
      if (from) in_.push_back({rank, in, from});
      out += to;
      in += from;
    }
  }
}

template <class RankDevice>
void DeviceHaloExchange<RankDevice>::upload_staged() {
  if (direct_) return;
  for (const OutgoingRecords& outgoing : outgoing_) {
    device_.upload(outgoing.records.data + outgoing.own * outgoing.records.words,
                   staged_in_.template as<char>() + outgoing.received_at,
                   static_cast<std::size_t>(outgoing.received) * outgoing.bytes);
  }
}

template <class RankDevice>
void DeviceHaloExchange<RankDevice>::take_tree_records(std::size_t set, const Bytes& wide) {
  Records& records = outgoing_[set].records;
  Block& records_block = set == 0 ? first_ : second_;
  const std::size_t kept = static_cast<std::size_t>(records.count) * outgoing_[set].bytes;
  records_block.grow(kept + wide.size(), kept);
  records.data = records_block.template as<std::uint32_t>();
  device_.upload(records_block.template as<char>() + kept, wide.data(), wide.size());
  records.count += wide.size() / outgoing_[set].bytes;
}

}  // namespace throng::mpi
