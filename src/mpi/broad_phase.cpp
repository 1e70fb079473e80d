// BroadPhase: who holds what, what changed, and who is told.
#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "mpi/agree.hpp"
#include "mpi/balance.hpp"
#include "mpi/ids.hpp"
#include "mpi/known.hpp"

namespace throng::mpi {
namespace {

using ull = unsigned long long;

struct Held {
  Change change;  // since the last update
  bool touched = false;
};

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

void set(Filter& filter, const Filters& f, std::size_t i) noexcept {
  if (f.group) filter.group = f.group[i];
  if (f.mask) filter.mask = f.mask[i];
  if (f.owner) filter.owner = f.owner[i];
  if (f.world) filter.world = f.world[i];
  if (f.is_static) filter.is_static = f.is_static[i];
}

}  // namespace

struct BroadPhase::State {
  explicit State(const Settings& s) : settings(s), known(s.search, s.search.margin) {}

  Settings settings;
  std::unique_ptr<Link> link;
  Known known;
  Regions regions, regions_before;
  bool cut = false, broken = false;
  double imbalance = 1;
  unsigned patience = 0, waited = 0;
  std::uint64_t total = 0;  // pairs that live, over all ranks
  std::vector<Held> held;
  std::unordered_map<std::uint64_t, std::size_t> places;  // in `held`
  std::vector<std::size_t> touched;
  std::unordered_set<std::uint64_t> taken;  // ids that this rank judges
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
  void cut_space();
  struct Outgoing {
    std::unordered_map<int, std::pair<Bytes, Bytes>> to;  // moves, changes
    Bytes wide;
  };
  void route(Outgoing& out);
  bool deliver(Outgoing& out, Result& r);
  void settle();
  void migrate();
  void finish(Result& r);
};

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

// The last one takes its place.
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
      say(r, Status::bad_id, "id %llu, at %llu of the list, is not held by this rank", ull{ids[i]},
          ull{i});
    } else if (!seen.insert(ids[i]).second) {
      say(r, Status::bad_id, "id %llu, at %llu of the list, stands there twice; give it once",
          ull{ids[i]}, ull{i});
    }
    if (!r.ok()) r.first_invalid = i;
  }
  return r.ok();
}

void BroadPhase::State::update(Result& r) {
  begun.clear();
  ended.clear();
  arrived.clear();
  departed.clear();
  pairs_are_new = false;
  traffic = {};
  link->reset_counts();
  std::uint64_t bits = 0;  // 1: ids came or went, 2: something changed
  if (broken) say(r, Status::rank_failed, "an update failed before; make a new BroadPhase");
  for (const std::size_t place : touched) {
    const Change& c = held[place].change;
    bits |= 2 | (c.was_alive != c.is_alive ? 1 : 0);
  }
  if (!agree(*link, r, agreed(settings, 0), &bits, 1)) return;
  if ((bits & 1) && !check_ids(r)) return;
  traffic.control = link->counts();
  link->reset_counts();
  broken = true;                              // until it is done
  if (!cut) regions = Regions(link->size());  // some cuts, as there are no objects yet
  regions_before = regions;
  if (!cut || (imbalance > settings.imbalance && ++waited > patience)) cut_space();
  traffic.balance = link->counts();
  link->reset_counts();
  if (bits || traffic.cut_anew) {
    Outgoing out;
    attempt(r, [&] { route(out); });
    if (!deliver(out, r)) return;
  }
  traffic.halo = link->counts();
  link->reset_counts();
  const int rank = link->rank();
  const Result told = known.update(regions_before.bounds(rank, rank + 1),
                                   regions.bounds(rank, rank + 1), begun, ended);
  if (!told.ok()) r = told;
  if (!agree(*link, r, nullptr, 0)) return;
  r.comparisons = told.comparisons;
  settle();
  if (settings.migrate && (bits || traffic.cut_anew)) migrate();
  finish(r);
  broken = false;
}

// Ids that come are checked by those who judge them before anything changes; those that go stay
// taken until this is over.
bool BroadPhase::State::check_ids(Result& r) {
  std::vector<std::uint64_t> come, gone;
  attempt(r, [&] {
    for (const std::size_t place : touched) {
      const Change& c = held[place].change;
      if (!c.was_alive && c.is_alive) come.push_back(c.id);
      if (c.was_alive && !c.is_alive) gone.push_back(c.id);
    }
  });
  const std::vector<Parcel> parcels = to_judges(*link, come.data(), come.size());
  attempt(r, [&] { judge(parcels, taken, r); });
  if (!agree(*link, r, nullptr, 0)) return false;
  const auto each = [](const std::vector<Parcel>& all, auto&& f) {
    for (const Parcel& parcel : all) for_each<std::uint64_t>(parcel.data, f);
  };
  each(parcels, [&](std::uint64_t id) { taken.insert(id); });
  each(to_judges(*link, gone.data(), gone.size()), [&](std::uint64_t id) { taken.erase(id); });
  return true;
}

void BroadPhase::State::cut_space() {
  std::vector<Point> points;
  const int rank = link->rank();
  known.points(regions.bounds(rank, rank + 1), points);
  for (const std::size_t place : touched) {
    const Change& c = held[place].change;
    if (!c.was_alive) add_point(points, reach_of(c.now, settings.search.margin), box_work);
  }
  thin_out(points);
  regions = bisect(*link, std::move(points));
  if (!cut) regions_before = regions;
  cut = traffic.cut_anew = true;
  waited = 0;
}

void BroadPhase::State::route(Outgoing& out) {
  std::vector<int> before, now;
  const auto reached = [&](const Regions& in, bool alive, const Box& box, std::vector<int>& ranks) {
    ranks.clear();
    return !alive || in.visit(reach_of(box, settings.search.margin), [&](int rank) {
      ranks.push_back(rank);
      return ranks.size() <= settings.wide;
    });
  };
  const auto tell = [&](const Held& h) {
    const Change& c = h.change;
    const bool few = reached(regions_before, c.was_alive, c.before, before);
    if (!reached(regions, c.is_alive, c.now, now) || !few) {
      append(out.wide, c);
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
    for (const Held& h : held) tell(h);
  } else {
    for (const std::size_t place : touched) tell(held[place]);
  }
  traffic.wide = out.wide.size() / sizeof(Change);
}

bool BroadPhase::State::deliver(Outgoing& out, Result& r) {
  std::vector<Parcel> moves, changes;
  attempt(r, [&] {
    for (auto& [rank, data] : out.to) {
      if (!data.first.empty()) moves.push_back({rank, std::move(data.first)});
      if (!data.second.empty()) changes.push_back({rank, std::move(data.second)});
    }
  });
  std::uint64_t bits =
      (moves.empty() ? 0u : 1u) | (changes.empty() ? 0u : 2u) | (out.wide.empty() ? 0u : 4u);
  if (!agree(*link, r, &bits, 1)) return false;
  const int rank = link->rank();
  const Bounds before = regions_before.bounds(rank, rank + 1),
               here = regions.bounds(rank, rank + 1);
  const auto take = [&](const Change& c) { known.take(c, before, here); };
  if (bits & 1) {
    const std::vector<Parcel> got = link->exchange(std::move(moves));
    for (const Parcel& parcel : got) {
      for_each<Move>(parcel.data, [&](const Move& move) { known.take(move); });
    }
  }
  if (bits & 2) {
    const std::vector<Parcel> got = link->exchange(std::move(changes));
    for (const Parcel& parcel : got) {
      for_each<Change>(parcel.data, take);
    }
  }
  if (bits & 4) {
    const float margin = settings.search.margin;
    for_each<Change>(
        hand_on(*link, std::move(out.wide), sizeof(Change),
                [&](int begin, int end, const std::byte* record) {
                  Change c;
                  std::memcpy(&c, record, sizeof c);
                  return (c.was_alive &&
                          regions_before.bounds(begin, end).meets(reach_of(c.before, margin))) ||
                         (c.is_alive && regions.bounds(begin, end).meets(reach_of(c.now, margin)));
                }),
        take);
  }
  return true;
}

// What is now becomes what was.
void BroadPhase::State::settle() {
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
    const Reach reach = reach_of(h.change.now, settings.search.margin);
    const int home = reach.empty() ? link->rank() : regions.home(reach.lower);
    if (home == link->rank()) continue;
    append(to[home], h.change);
    departed.push_back({h.change.id, home});
  }
  std::vector<Parcel> parcels;
  parcels.reserve(to.size());
  for (auto& [rank, data] : to) parcels.push_back({rank, std::move(data)});
  for (const Departure& d : departed) forget(places.at(d.id));
  const std::vector<Parcel> got = link->exchange(std::move(parcels));
  for (const Parcel& parcel : got) {
    for_each<Change>(parcel.data, [&](const Change& c) {
      hold(c, false);
      arrived.push_back(c.id);
    });
  }
}

void BroadPhase::State::finish(Result& r) {
  const int rank = link->rank();
  traffic.known = known.size();
  traffic.home = known.home_count(regions.bounds(rank, rank + 1));
  traffic.work = work_of(traffic.known, 0, known.pair_count());
  std::uint64_t sums[4] = {begun.size(), ended.size(), r.comparisons, traffic.work};
  std::uint64_t most = traffic.work;
  link->sum_and_most(sums, 4, most);
  total += sums[0] - sums[1];
  r.found = total;
  r.written = begun.size() + ended.size();
  r.comparisons = sums[2];
  const double mean = static_cast<double>(sums[3]) / link->size(), last = imbalance;
  imbalance = traffic.imbalance = mean > 0 ? static_cast<double>(most) / mean : 1;
  if (traffic.cut_anew) patience = imbalance < 0.95 * last ? 0 : 2 * patience + 1;
  traffic.control.messages += link->counts().messages;
  traffic.control.bytes += link->counts().bytes;
  traffic.control.collectives += link->counts().collectives;
  traffic.control.collective_bytes += link->counts().collective_bytes;
}

BroadPhase::BroadPhase(MPI_Comm comm, const Settings& settings) noexcept
    : settings_(settings), comm_(comm) {}
BroadPhase::~BroadPhase() = default;
BroadPhase::BroadPhase(BroadPhase&& other) noexcept = default;
BroadPhase& BroadPhase::operator=(BroadPhase&& other) noexcept = default;

// A call on objects: this rank's alone.
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
      say(r, Status::bad_id, "id %llu, at %llu of the list, is taken; give each object its own",
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
    // What was never told of need not be told to be gone.
    std::vector<std::uint64_t> unborn;
    for (const std::size_t place : s.touched) {
      const Change& c = s.held[place].change;
      if (!c.was_alive && !c.is_alive) unborn.push_back(c.id);
    }
    for (const std::uint64_t id : unborn) s.forget(s.places.at(id));
    if (unborn.empty()) return;
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
  return call(state_->link, comm_, settings_,
              // cppcheck-suppress throwInNoexceptFunction
              [&](Link&, Result& result) { state_->update(result); });
}

namespace {
Pairs64 view(const std::vector<Pair64>& pairs) noexcept { return {pairs.data(), pairs.size()}; }
}  // namespace

Pairs64 BroadPhase::begun() const noexcept { return state_ ? view(state_->begun) : Pairs64{}; }
Pairs64 BroadPhase::ended() const noexcept { return state_ ? view(state_->ended) : Pairs64{}; }
Pairs64 BroadPhase::pairs() {
  if (!state_ || !state_->link) return {};
  if (!std::exchange(state_->pairs_are_new, true)) {
    const int rank = state_->link->rank();
    state_->known.pairs(state_->regions.bounds(rank, rank + 1), state_->pairs);
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
