// BroadPhase: local calls on objects, and accessors. update() is in update.cpp.
#include <utility>

#include "mpi/broad_phase_state.hpp"
#include "mpi/consensus.hpp"

namespace throng::mpi {
namespace {

using ull = unsigned long long;

void set(Filter& filter, const Filters& f, std::size_t i) noexcept {
  if (f.group) filter.group = f.group[i];
  if (f.mask) filter.mask = f.mask[i];
  if (f.owner) filter.owner = f.owner[i];
  if (f.world) filter.world = f.world[i];
  if (f.is_static) filter.is_static = f.is_static[i];
}

}  // namespace

void BroadPhase::State::hold(const Change& change, bool is_touched) {
  held.push_back({change, false});
  try {
    places.emplace(change.id, held.size() - 1);
    if (is_touched) touch(held.size() - 1);
  } catch (...) {
    places.erase(change.id);
    held.pop_back();
    throw;
  }
}

// Fills the gap with the last object.
void BroadPhase::State::forget(std::size_t place) {
  places.erase(held[place].change.id);
  if (place + 1 != held.size()) {
    held[place] = held.back();
    places[held[place].change.id] = place;
  }
  held.pop_back();
}

bool BroadPhase::State::valid_ids(const std::uint64_t* ids, std::size_t count, Result& r) const {
  std::unordered_set<std::uint64_t> seen;
  for (std::size_t i = 0; i < count && r.ok(); ++i) {
    const auto found = places.find(ids[i]);
    if (found == places.end() || !held[found->second].change.is_alive) {
      set_error(r, Status::bad_id, "id %llu, at index %llu of the list, is not held by this rank",
                ull{ids[i]}, ull{i});
    } else if (!seen.insert(ids[i]).second) {
      set_error(r, Status::bad_id, "id %llu, at index %llu of the list, occurs twice; give it once",
                ull{ids[i]}, ull{i});
    }
    if (!r.ok()) r.first_invalid = i;
  }
  return r.ok();
}

BroadPhase::BroadPhase(MPI_Comm comm, const Settings& settings) noexcept
    : settings_(settings), comm_(comm) {}
BroadPhase::~BroadPhase() = default;
BroadPhase::BroadPhase(BroadPhase&& other) noexcept = default;
BroadPhase& BroadPhase::operator=(BroadPhase&& other) noexcept = default;

// Runs a local (not collective) call on objects.
template <class F>
Result BroadPhase::local(F&& f) noexcept {
  const DefaultFloats floats;
  Result r;
  if (!valid(settings_, r)) return r;
  attempt(r, [&] {
    if (!state_) state_ = std::make_unique<State>(settings_);
    f(*state_, r);
  });
  if (r.ok()) r.found = state_->held.size();
  return r;
}

Result BroadPhase::add(const std::uint64_t* ids, const Boxes& boxes) noexcept {
  // cppcheck-suppress throwInNoexceptFunction
  return local([&](State& s, Result& r) {
    if (!valid(boxes, settings_.search, r)) return;
    std::unordered_set<std::uint64_t> seen;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (s.places.count(ids[i]) == 0 && seen.insert(ids[i]).second) continue;
      set_error(r, Status::bad_id,
                "id %llu, at index %llu of the list, is in use; give each object its own",
                ull{ids[i]}, ull{i});
      r.first_invalid = i;
      return;
    }
    const std::size_t held_before = s.held.size(), touched_before = s.touched.size();
    try {
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        Change change = {};
        change.id = ids[i];
        change.now = boxes[i];
        change.before = change.now;
        set(change.filter, boxes.filters, i);
        change.filter_before = change.filter;
        change.is_alive = 1;
        s.hold(change, true);
      }
    } catch (...) {
      s.touched.resize(touched_before);
      while (s.held.size() > held_before) s.forget(s.held.size() - 1);
      throw;
    }
  });
}

Result BroadPhase::remove(const std::uint64_t* ids, std::size_t count) noexcept {
  return local([&](State& s, Result& r) {
    if (!s.valid_ids(ids, count, r)) return;
    s.touched.reserve(s.touched.size() + count);
    for (std::size_t i = 0; i < count; ++i) {
      s.touch(s.places.at(ids[i]));
      s.change(ids[i]).is_alive = 0;
    }
    // An object added and removed between two updates needs no message.
    std::vector<std::uint64_t> never_reported;
    for (const std::size_t place : s.touched) {
      const Change& c = s.held[place].change;
      if (!c.was_alive && !c.is_alive) never_reported.push_back(c.id);
    }
    for (const std::uint64_t id : never_reported) s.forget(s.places.at(id));
    if (never_reported.empty()) return;
    s.touched.clear();
    for (std::size_t place = 0; place < s.held.size(); ++place) {
      if (s.held[place].touched) s.touched.push_back(place);
    }
  });
}

Result BroadPhase::move(const std::uint64_t* ids, const Boxes& boxes) noexcept {
  return local([&](State& s, Result& r) {
    Boxes bare = boxes;
    bare.filters = {};
    if (!valid(bare, settings_.search, r) || !s.valid_ids(ids, boxes.size(), r)) return;
    s.touched.reserve(s.touched.size() + boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      s.touch(s.places.at(ids[i]));
      s.change(ids[i]).now = boxes[i];
    }
  });
}

Result BroadPhase::set_filters(const std::uint64_t* ids, std::size_t count,
                               const Filters& filters) noexcept {
  return local([&](State& s, Result& r) {
    if (!valid_filters(filters, count, r) || !s.valid_ids(ids, count, r)) return;
    s.touched.reserve(s.touched.size() + count);
    for (std::size_t i = 0; i < count; ++i) {
      s.touch(s.places.at(ids[i]));
      set(s.change(ids[i]).filter, filters, i);
    }
  });
}

Result BroadPhase::update() noexcept {
  Result r = local([](State&, Result&) {});
  if (!state_) return r;
  return call(state_->communicator, comm_, settings_,
              // cppcheck-suppress throwInNoexceptFunction
              [&](Communicator&, Result& result) { state_->update(result); });
}

namespace {
Pairs64 view(const std::vector<Pair64>& pairs) noexcept { return {pairs.data(), pairs.size()}; }
}  // namespace

Pairs64 BroadPhase::begun() const noexcept { return state_ ? view(state_->begun) : Pairs64{}; }
Pairs64 BroadPhase::ended() const noexcept { return state_ ? view(state_->ended) : Pairs64{}; }
Pairs64 BroadPhase::pairs() {
  if (!state_ || !state_->communicator) return {};
  if (!std::exchange(state_->pairs_are_new, true)) {
    const int rank = state_->communicator->rank();
    state_->remote_objects.pairs(state_->regions.bounds(rank, rank + 1), state_->pairs);
  }
  return view(state_->pairs);
}
const std::uint64_t* BroadPhase::arrived() const noexcept {
  return state_ ? state_->arrived.data() : nullptr;
}
std::size_t BroadPhase::arrived_count() const noexcept {
  return state_ ? state_->arrived.size() : 0;
}
const Departure* BroadPhase::departed() const noexcept {
  return state_ ? state_->departed.data() : nullptr;
}
std::size_t BroadPhase::departed_count() const noexcept {
  return state_ ? state_->departed.size() : 0;
}
bool BroadPhase::holds(std::uint64_t id) const noexcept {
  return state_ && state_->places.count(id) && state_->change(id).is_alive;
}
Box BroadPhase::box(std::uint64_t id) const noexcept { return state_->change(id).now; }
std::size_t BroadPhase::object_count() const noexcept { return state_ ? state_->held.size() : 0; }
const Traffic& BroadPhase::traffic() const noexcept {
  static const Traffic none;
  return state_ ? state_->traffic : none;
}

}  // namespace throng::mpi
