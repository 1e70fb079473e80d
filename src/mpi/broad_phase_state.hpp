// State of a BroadPhase: the objects held here, their changes, and the objects in this rank's
// region.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <throng/mpi.hpp>

#include "mpi/balance.hpp"
#include "mpi/communicator.hpp"
#include "mpi/regions.hpp"
#include "mpi/remote_objects.hpp"

namespace throng::mpi {

struct BroadPhase::State {
  struct Held {
    Change change;  // since the last update
    bool touched = false;
  };

  explicit State(const Settings& s) : settings(s), remote_objects(s.search, s.search.margin) {}

  Settings settings;
  std::unique_ptr<Communicator> communicator;
  RemoteObjects remote_objects;
  Regions regions, regions_before;
  bool partitioned = false, broken = false;
  double imbalance = 1;
  RepartitionBackoff backoff;
  std::uint64_t total = 0;  // current pairs over all ranks
  std::vector<Held> held;
  std::unordered_map<std::uint64_t, std::size_t> places;  // index into `held`
  std::vector<std::size_t> touched;
  std::unordered_set<std::uint64_t> taken;  // ids in use that this rank is responsible for checking
  std::vector<Pair64> begun, ended, pairs;
  bool pairs_are_new = false;
  std::vector<std::uint64_t> arrived;
  std::vector<Departure> departed;
  Traffic traffic;

  void touch(std::size_t place) {
    if (std::exchange(held[place].touched, true)) return;
    touched.push_back(place);
  }
  Change& change(std::uint64_t id) { return held[places.at(id)].change; }
  void forget(std::size_t place);
  bool valid_ids(const std::uint64_t* ids, std::size_t count, Result& r) const;
  void hold(const Change& change, bool is_touched);

  void update(Result& r);
  bool check_ids(Result& r);
  void repartition();
  struct Outgoing {
    std::unordered_map<int, std::pair<Bytes, Bytes>> to;  // moves, changes
    Bytes tree_records;
  };
  void route(Outgoing& out);
  bool deliver(Outgoing& out, Result& r);
  void commit_changes();
  void migrate();
  void finish(Result& r);
};

}  // namespace throng::mpi
