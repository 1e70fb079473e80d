// BroadPhase::update: sends changes to the ranks concerned, and finds begin and end events.
#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "mpi/balance.hpp"
#include "mpi/broad_phase_state.hpp"
#include "mpi/consensus.hpp"
#include "mpi/ids.hpp"

namespace throng::mpi {
namespace {

template <class T>
void append(Bytes& out, const T& record) {
  const std::size_t at = out.size();
  out.resize(at + sizeof record);
  std::memcpy(out.data() + at, &record, sizeof record);
}

template <class T, class F>
void for_each(const Bytes& data, F&& f) {
  for (std::size_t at = 0; at < data.size(); at += sizeof(T)) {
    T record;
    std::memcpy(&record, data.data() + at, sizeof record);
    f(record);
  }
}

}  // namespace

void BroadPhase::State::update(Result& r) {
  begun.clear();
  ended.clear();
  arrived.clear();
  departed.clear();
  pairs_are_new = false;
  traffic = {};
  communicator->reset_counts();
  std::uint64_t bits = 0;  // 1: ids were added or removed, 2: something changed
  if (broken) set_error(r, Status::rank_failed, "an update failed before; make a new BroadPhase");
  for (const std::size_t place : touched) {
    const Change& c = held[place].change;
    bits |= 2 | (c.was_alive != c.is_alive ? 1 : 0);
  }
  if (!consensus(*communicator, r, consensus_settings(settings, 0), &bits, 1)) return;
  if ((bits & 1) && !check_ids(r)) return;
  traffic.control = communicator->counts();
  communicator->reset_counts();
  broken = true;  // until the update completes
  if (!partitioned)
    regions = Regions(communicator->size());  // arbitrary cuts, as there are no objects yet
  regions_before = regions;
  if (!partitioned || backoff.is_due(imbalance, settings.imbalance)) repartition();
  traffic.balance = communicator->counts();
  communicator->reset_counts();
  if (bits || traffic.cut_anew) {
    Outgoing out;
    attempt(r, [&] { route(out); });
    if (!deliver(out, r)) return;
  }
  traffic.halo = communicator->counts();
  communicator->reset_counts();
  const int rank = communicator->rank();
  const Result local_result = remote_objects.update(regions_before.bounds(rank, rank + 1),
                                                    regions.bounds(rank, rank + 1), begun, ended);
  if (!local_result.ok()) r = local_result;
  if (!consensus(*communicator, r, nullptr, 0)) return;
  r.comparisons = local_result.comparisons;
  r.visited = local_result.visited;
  commit_changes();
  if (settings.migrate && (bits || traffic.cut_anew)) migrate();
  finish(r);
  broken = false;
}

// The directory ranks check added ids before anything changes; removed ids stay in use until the
// end of the check.
bool BroadPhase::State::check_ids(Result& r) {
  std::vector<std::uint64_t> come, gone;
  attempt(r, [&] {
    for (const std::size_t place : touched) {
      const Change& c = held[place].change;
      if (!c.was_alive && c.is_alive) come.push_back(c.id);
      if (c.was_alive && !c.is_alive) gone.push_back(c.id);
    }
  });
  const std::vector<Parcel> parcels = send_to_directory(*communicator, come.data(), come.size());
  attempt(r, [&] { check_unique(parcels, taken, r); });
  if (!consensus(*communicator, r, nullptr, 0)) return false;
  const auto each = [](const std::vector<Parcel>& all, auto&& f) {
    for (const Parcel& parcel : all) for_each<std::uint64_t>(parcel.data, f);
  };
  each(parcels, [&](std::uint64_t id) { taken.insert(id); });
  each(send_to_directory(*communicator, gone.data(), gone.size()),
       [&](std::uint64_t id) { taken.erase(id); });
  return true;
}

void BroadPhase::State::repartition() {
  std::vector<Point> points;
  const int rank = communicator->rank();
  remote_objects.points(regions.bounds(rank, rank + 1), points);
  for (const std::size_t place : touched) {
    const Change& c = held[place].change;
    if (!c.was_alive) add_point(points, key_box_of(c.now, settings.search.margin), box_work);
  }
  subsample(points);
  regions = bisect(*communicator, std::move(points));
  if (!partitioned) regions_before = regions;
  partitioned = traffic.cut_anew = true;
}

void BroadPhase::State::route(Outgoing& out) {
  std::vector<int> before, now;
  const auto reached = [&](const Regions& in, bool alive, const Box& box, std::vector<int>& ranks) {
    ranks.clear();
    return !alive || in.visit(key_box_of(box, settings.search.margin), [&](int rank) {
      ranks.push_back(rank);
      return ranks.size() <= settings.tree_send_threshold;
    });
  };
  const auto route_object = [&](const Held& h) {
    const Change& c = h.change;
    const bool few = reached(regions_before, c.was_alive, c.before, before);
    if (!reached(regions, c.is_alive, c.now, now) || !few) {
      append(out.tree_records, c);
      return;
    }
    const bool plain = same(c.filter_before, c.filter);
    auto old = before.begin(), next = now.begin();
    while (old != before.end() || next != now.end()) {
      const bool both = old != before.end() && next != now.end() && *old == *next;
      // cppcheck-suppress derefInvalidIteratorRedundantCheck
      const int rank = next == now.end() || (old != before.end() && *old < *next) ? *old : *next;
      if (both && plain) {
        if (h.touched) append(out.to[rank].first, Move{c.id, c.now});
      } else {
        append(out.to[rank].second, c);
      }
      if (old != before.end() && *old == rank) ++old;
      if (next != now.end() && *next == rank) ++next;
    }
  };
  if (traffic.cut_anew) {
    for (const Held& h : held) route_object(h);
  } else {
    for (const std::size_t place : touched) route_object(held[place]);
  }
  traffic.wide = out.tree_records.size() / sizeof(Change);
}

bool BroadPhase::State::deliver(Outgoing& out, Result& r) {
  std::vector<Parcel> moves, changes;
  attempt(r, [&] {
    for (auto& [rank, data] : out.to) {
      if (!data.first.empty()) moves.push_back({rank, std::move(data.first)});
      if (!data.second.empty()) changes.push_back({rank, std::move(data.second)});
    }
  });
  std::uint64_t bits = (moves.empty() ? 0u : 1u) | (changes.empty() ? 0u : 2u) |
                       (out.tree_records.empty() ? 0u : 4u);
  if (!consensus(*communicator, r, &bits, 1)) return false;
  const int rank = communicator->rank();
  const Bounds before = regions_before.bounds(rank, rank + 1),
               here = regions.bounds(rank, rank + 1);
  const auto take = [&](const Change& c) { remote_objects.take(c, before, here); };
  if (bits & 1) {
    const std::vector<Parcel> got = communicator->exchange(std::move(moves));
    for (const Parcel& parcel : got) {
      for_each<Move>(parcel.data, [&](const Move& move) { remote_objects.take(move); });
    }
  }
  if (bits & 2) {
    const std::vector<Parcel> got = communicator->exchange(std::move(changes));
    for (const Parcel& parcel : got) {
      for_each<Change>(parcel.data, take);
    }
  }
  if (bits & 4) {
    const float margin = settings.search.margin;
    for_each<Change>(
        forward_along_tree(
            *communicator, std::move(out.tree_records), sizeof(Change),
            [&](int begin, int end, const std::byte* record) {
              Change c;
              std::memcpy(&c, record, sizeof c);
              return (c.was_alive &&
                      regions_before.bounds(begin, end).meets(key_box_of(c.before, margin))) ||
                     (c.is_alive && regions.bounds(begin, end).meets(key_box_of(c.now, margin)));
            }),
        take);
  }
  return true;
}

// The current state becomes the previous state.
void BroadPhase::State::commit_changes() {
  std::vector<std::uint64_t> gone;
  for (const std::size_t place : touched) {
    Held& h = held[place];
    h.touched = false;
    h.change.before = h.change.now;
    h.change.filter_before = h.change.filter;
    h.change.was_alive = 1;
    if (!h.change.is_alive) gone.push_back(h.change.id);
  }
  touched.clear();
  for (const std::uint64_t id : gone) forget(places.at(id));
}

void BroadPhase::State::migrate() {
  std::unordered_map<int, Bytes> to;
  for (const Held& h : held) {
    const KeyBox key_box = key_box_of(h.change.now, settings.search.margin);
    const int owner = key_box.empty() ? communicator->rank() : regions.owner_of(key_box.lower);
    if (owner == communicator->rank()) continue;
    append(to[owner], h.change);
    departed.push_back({h.change.id, owner});
  }
  std::vector<Parcel> parcels;
  parcels.reserve(to.size());
  for (auto& [rank, data] : to) parcels.push_back({rank, std::move(data)});
  for (const Departure& d : departed) forget(places.at(d.id));
  const std::vector<Parcel> got = communicator->exchange(std::move(parcels));
  for (const Parcel& parcel : got) {
    for_each<Change>(parcel.data, [&](const Change& c) {
      hold(c, false);
      arrived.push_back(c.id);
    });
  }
}

void BroadPhase::State::finish(Result& r) {
  const int rank = communicator->rank();
  traffic.owned_and_ghost = remote_objects.size();
  traffic.home = remote_objects.owned_count(regions.bounds(rank, rank + 1));
  traffic.work = work_of(traffic.owned_and_ghost, 0, remote_objects.pair_count());
  std::uint64_t sums[5] = {begun.size(), ended.size(), r.comparisons, traffic.work, r.visited};
  std::uint64_t most = traffic.work;
  communicator->all_reduce_sum_and_max(sums, 5, most);
  total += sums[0] - sums[1];
  r.found = total;
  r.written = begun.size() + ended.size();
  r.comparisons = sums[2];
  r.visited = sums[4];
  const double before = imbalance;
  imbalance = traffic.imbalance = imbalance_of(most, sums[3], communicator->size());
  if (traffic.cut_anew) backoff.evaluate(imbalance, before);
  traffic.control.messages += communicator->counts().messages;
  traffic.control.bytes += communicator->counts().bytes;
  traffic.control.collectives += communicator->counts().collectives;
  traffic.control.collective_bytes += communicator->counts().collective_bytes;
}

}  // namespace throng::mpi
