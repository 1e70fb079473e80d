// Finder: sends boxes in host memory to the ranks whose regions they overlap, and searches on each.
#include <algorithm>
#include <utility>
#include <vector>

#include <throng/checksum.hpp>

#include "mpi/balance.hpp"
#include "mpi/distributed_search.hpp"
#include "mpi/local_set.hpp"
#include "mpi/region_search.hpp"

namespace throng::mpi {
namespace {

class HostDistributedSearch final : public DistributedSearch {
  BoxSummary inspect(const Settings& settings, const RankBoxes& set, Result& r) override;
  const std::uint64_t* host_ids(const RankBoxes& set) override { return set.ids; }
  Sample sample(const Settings& settings, const RankBoxes& set, std::size_t most) override;
  void take_tree_records(int set, const Bytes& records) override;
  Result search(const Settings& settings, const Bounds& region, Found& found,
                std::vector<Sample>& samples) override;
  const Pair64* kept_pairs() const noexcept override { return pairs_.data(); }
  void route(Communicator& communicator, const Settings& settings, std::vector<OutgoingSet>& sets,
             Result& r) override;
  void deliver(Communicator& communicator) override;

  void route(const Settings& settings, OutgoingSet& set, std::size_t s);

  // Outgoing records of one set.
  struct OutgoingRecords {
    std::vector<Bytes> to;     // by rank
    std::vector<int> touched;  // the ranks with a non-empty `to`
  };
  std::vector<OutgoingRecords> outgoing_;
  std::vector<LocalSet> locals_;
  RegionSearch region_search_;
  std::vector<Pair64> pairs_;
};

DistributedSearch::BoxSummary HostDistributedSearch::inspect(const Settings& settings,
                                                             const RankBoxes& set, Result& r) {
  BoxSummary seen;
  if (!valid(set.boxes, settings.search, r)) return seen;
  for (std::size_t i = 0; i < set.boxes.size(); ++i) {
    seen.inactive += !base::is_active(set.boxes[i]);
    if (set.ids) seen.id_sum += mix64(set.ids[i]);
  }
  return seen;
}

// Returns all boxes; subsample() samples them later.
DistributedSearch::Sample HostDistributedSearch::sample(const Settings& settings,
                                                        const RankBoxes& set, std::size_t) {
  Sample sample;
  for (std::size_t i = 0; i < set.boxes.size(); ++i) {
    add_point(sample.points, key_box_of(set.boxes[i], settings.search.margin), 0);
  }
  return sample;
}

void HostDistributedSearch::route(Communicator& communicator, const Settings& settings,
                                  std::vector<OutgoingSet>& sets, Result& r) {
  attempt(r, [&] {
    outgoing_.assign(sets.size(), {});
    locals_.clear();
    for (std::size_t s = 0; s < sets.size(); ++s) {
      locals_.emplace_back(sets[s].filters);
      outgoing_[s].to.resize(static_cast<std::size_t>(communicator.size()));
      route(settings, sets[s], s);
    }
  });
}

void HostDistributedSearch::route(const Settings& settings, OutgoingSet& set, std::size_t s) {
  const Boxes& boxes = set.given->boxes;
  const LocalSet& local = locals_[s];
  OutgoingRecords& outgoing = outgoing_[s];
  std::vector<int> reached;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const std::uint64_t id = set.given->ids ? set.given->ids[i] : set.first_id + i;
    reached.clear();
    const bool few = regions().visit(key_box_of(boxes[i], settings.search.margin), [&](int rank) {
      reached.push_back(rank);
      return reached.size() <= settings.tree_send_threshold;
    });
    if (!few) {
      local.write(boxes, i, id, set.tree_records);
      continue;
    }
    for (const int rank : reached) {
      Bytes& to = outgoing.to[static_cast<std::size_t>(rank)];
      if (to.empty()) outgoing.touched.push_back(rank);
      local.write(boxes, i, id, to);
    }
  }
}

void HostDistributedSearch::deliver(Communicator& communicator) {
  for (std::size_t s = 0; s < outgoing_.size(); ++s) {
    std::vector<Parcel> parcels;
    parcels.reserve(outgoing_[s].touched.size());
    for (const int rank : outgoing_[s].touched) {
      parcels.push_back({rank, std::move(outgoing_[s].to[static_cast<std::size_t>(rank)])});
    }
    const std::vector<Parcel> got = communicator.exchange(std::move(parcels));
    for (const Parcel& parcel : got) locals_[s].read_all(parcel.data);
  }
  outgoing_.clear();
}

void HostDistributedSearch::take_tree_records(int set, const Bytes& records) {
  locals_[static_cast<std::size_t>(set)].read_all(records);
}

Result HostDistributedSearch::search(const Settings& settings, const Bounds& region, Found& found,
                                     std::vector<Sample>& samples) {
  const LocalSet* const locals[] = {&locals_.front(), &locals_.back()};
  const Result r = region_search_.search(local_options(settings), settings.parts, region, locals,
                                         static_cast<int>(locals_.size()));
  found.owned_and_ghost = region_search_.owned_and_ghost();
  found.owned = region_search_.owned();
  found.parts = region_search_.parts();
  found.handled = region_search_.handled();
  if (!r.ok()) return r;
  samples.resize(1);
  samples[0].step = 1;
  region_search_.swap(pairs_, samples[0].points);
  found.kept = pairs_.size();
  if (settings.search.order == Order::canonical) std::sort(pairs_.begin(), pairs_.end());
  return r;
}

}  // namespace

struct Finder::State {
  std::unique_ptr<Communicator> communicator;
  HostDistributedSearch driver;

  static Result find(std::unique_ptr<State>& state, MPI_Comm comm, const Settings& settings,
                     const RankBoxes* const* sets, int count) noexcept {
    Result r;
    attempt(r, [&] {
      if (!state) state = std::make_unique<State>();
    });
    if (!r.ok()) return r;
    return call(state->communicator, comm, settings, [&](Communicator& up, Result& result) {
      state->driver.find(up, settings, sets, count, result);
    });
  }
};

Finder::Finder(MPI_Comm comm, const Settings& settings) noexcept
    : settings_(settings), comm_(comm) {}
Finder::~Finder() = default;
Finder::Finder(Finder&& other) noexcept = default;
Finder& Finder::operator=(Finder&& other) noexcept = default;

Result Finder::find(const RankBoxes& boxes) noexcept {
  const RankBoxes* sets[] = {&boxes};
  return State::find(state_, comm_, settings_, sets, 1);
}
Result Finder::find(const RankBoxes& a, const RankBoxes& b) noexcept {
  const RankBoxes* sets[] = {&a, &b};
  return State::find(state_, comm_, settings_, sets, 2);
}

Pairs64 Finder::pairs() const noexcept { return state_ ? state_->driver.pairs() : Pairs64{}; }
const Traffic& Finder::traffic() const noexcept {
  static const Traffic none;
  return state_ ? state_->driver.traffic() : none;
}
int Finder::home(const Box& box) const noexcept {
  const DefaultFloats floats;
  return state_ ? state_->driver.home(box, settings_.search.margin) : 0;
}

}  // namespace throng::mpi
