// Finder: boxes to the regions that they reach, and a search on each rank.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mpi/agree.hpp"
#include "mpi/balance.hpp"
#include "mpi/ids.hpp"
#include "mpi/local.hpp"
#include "mpi/share.hpp"

namespace throng::mpi {
namespace {

// One set of a call, on its way.
struct Sent {
  const RankBoxes* given = nullptr;
  std::uint64_t first_id = 0;
  std::vector<Bytes> to;     // by rank
  std::vector<int> touched;  // the ranks of `to` that are not empty
  Bytes wide;
  LocalSet local;

  std::uint64_t id(std::size_t i) const noexcept {
    return given->ids ? given->ids[i] : first_id + i;
  }
};

std::uint64_t hash_of(const RankBoxes& set) noexcept {
  std::uint64_t hash = mixed(set.boxes.size());
  for (std::size_t i = 0; set.ids && i < set.boxes.size(); ++i) hash = mixed(hash ^ set.ids[i]);
  return hash;
}

}  // namespace

struct Finder::State {
  std::unique_ptr<Link> link;
  Share share;
  Regions regions;
  bool cut = false;           // into regions, once at least
  std::uint64_t hash = 0;     // of the ids that were checked last
  std::vector<Point> points;  // of the last search, with what they cost
  double imbalance = 1;
  Regions regions_before;  // while it is not known whether those that followed are better
  // Work, pairs apart: of this rank; of a box at home here, and over all ranks.
  std::uint64_t work = 0, own = 0, mean = 0;
  unsigned refused = 0;               // cuts in a row that were worse than what they followed
  unsigned patience = 0, waited = 0;  // cuts that did not help make the next ones rarer
  std::vector<Pair64> pairs;
  Traffic traffic;

  void find(const Settings& settings, const RankBoxes* const* sets, int count, Result& r);
  void check_ids(const RankBoxes* const* sets, int count, bool changed, Result& r);
  void cut_space(const Settings& settings, const Sent* sets, int count);
  void route(const Settings& settings, Sent& set);
  void deliver(Sent& set);
  void search_here(const Settings& settings, const Sent* sets, int count, Result& r);
  bool finish(const Sent* sets, int count, Result& r);
  void judge_cut(double before);
};

void Finder::State::find(const Settings& settings, const RankBoxes* const* given, int count,
                         Result& r) {
  pairs.clear();
  traffic = {};
  link->reset_counts();
  std::uint64_t bits[3] = {};  // filters; whether ids changed
  std::uint64_t hash_now = 0;
  if (valid(settings, r)) {
    for (int s = 0; s < count && r.ok(); ++s) {
      if (!valid(given[s]->boxes, settings.search, r)) break;
      bits[s] = present(given[s]->boxes.filters);
      hash_now = mixed(hash_now ^ hash_of(*given[s]));
    }
  }
  // A rank without boxes has no ids to give: it takes either form.
  std::uint64_t given_ids = 0;
  for (int s = 0; s < count; ++s) {
    if (!given[s]->boxes.empty()) given_ids |= (given[s]->ids ? 1u : 2u) << (2 * s);
  }
  bits[2] = (given_ids << 1) | (hash_now != hash || !cut ? 1 : 0);
  if (!agree(*link, r, agreed(settings, static_cast<std::uint64_t>(count)), bits, 3)) return;
  for (int s = 0; s < count; ++s) {
    if ((bits[2] >> (1 + 2 * s) & 3) == 3) {
      say(r, Status::ranks_disagree,
          "some ranks give ids and others leave them out; give them on all ranks or on none");
      return;
    }
  }
  check_ids(given, count, bits[2] & 1, r);
  if (!r.ok()) return;
  hash = hash_now;
  std::vector<Sent> sets(static_cast<std::size_t>(count));
  for (int s = 0; s < count; ++s) {
    Sent& set = sets[static_cast<std::size_t>(s)];
    set.given = given[s];
    set.local = LocalSet(static_cast<unsigned>(bits[s]));
    if (!(bits[2] >> (1 + 2 * s) & 1)) set.first_id = link->before(given[s]->boxes.size());
  }
  traffic.control = link->counts();
  link->reset_counts();
  if (!cut || (imbalance > settings.imbalance && ++waited > patience)) {
    cut_space(settings, sets.data(), count);
  }
  traffic.balance = link->counts();
  link->reset_counts();
  for (Sent& set : sets) attempt(r, [&] { route(settings, set); });
  for (const Sent& set : sets) traffic.wide += set.wide.size() / set.local.record_bytes();
  std::uint64_t some_wide = traffic.wide;
  if (!agree(*link, r, &some_wide, 1)) return;
  for (Sent& set : sets) {
    deliver(set);
    if (some_wide != 0) {
      const std::size_t bytes = set.local.record_bytes();
      const Bytes got = hand_on(
          *link, std::move(set.wide), bytes, [&](int begin, int end, const std::byte* record) {
            return regions.bounds(begin, end)
                .meets(reach_of(LocalSet::box_of(record), settings.search.margin));
          });
      for (std::size_t at = 0; at < got.size(); at += bytes) set.local.read(got.data() + at);
    }
  }
  traffic.halo = link->counts();
  link->reset_counts();
  attempt(r, [&] { search_here(settings, sets.data(), count, r); });
  if (!finish(sets.data(), count, r)) pairs.clear();
}

void Finder::State::check_ids(const RankBoxes* const* given, int count, bool changed, Result& r) {
  for (int s = 0; changed && s < count && r.ok(); ++s) {
    const std::size_t n = given[s]->ids ? given[s]->boxes.size() : 0;
    const std::vector<Parcel> parcels = to_judges(*link, given[s]->ids, n);
    attempt(r, [&] { judge(parcels, {}, r); });
    if (!agree(*link, r, nullptr, 0)) return;
  }
}

void Finder::State::cut_space(const Settings& settings, const Sent* sets, int count) {
  // What the last search cost tells where work is; before the first one all boxes weigh the same.
  if (!cut) {
    own = mean = 1;
    points.clear();
    for (int s = 0; s < count; ++s) {
      const Boxes& boxes = sets[s].given->boxes;
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        add_point(points, reach_of(boxes[i], settings.search.margin), 0);
      }
    }
  }
  // A rank's comparisons depend on the grid that it chose for its region, and so on the cuts. Where
  // a cut was worse, the next one believes less of the difference between ranks.
  for (Point& point : points) {
    const double part = static_cast<double>(own) - static_cast<double>(mean);
    const double cost = static_cast<double>(mean) + std::ldexp(part, -static_cast<int>(refused));
    point.weight += static_cast<std::uint32_t>(std::max(0.0, std::min(cost, 0x1p20)));
  }
  thin_out(points);
  regions_before = regions;
  regions = bisect(*link, std::move(points));
  points.clear();
  cut = traffic.cut_anew = true;
  waited = 0;
}

void Finder::State::route(const Settings& settings, Sent& set) {
  const Boxes& boxes = set.given->boxes;
  set.to.resize(static_cast<std::size_t>(link->size()));
  std::vector<int> reached;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Reach reach = reach_of(boxes[i], settings.search.margin);
    reached.clear();
    const bool few = regions.visit(reach, [&](int rank) {
      reached.push_back(rank);
      return reached.size() <= settings.wide;
    });
    if (!few) {
      set.local.write(boxes, i, set.id(i), set.wide);
      continue;
    }
    for (const int rank : reached) {
      Bytes& to = set.to[static_cast<std::size_t>(rank)];
      if (to.empty()) set.touched.push_back(rank);
      set.local.write(boxes, i, set.id(i), to);
    }
  }
}

void Finder::State::deliver(Sent& set) {
  std::vector<Parcel> parcels;
  parcels.reserve(set.touched.size());
  for (const int rank : set.touched) {
    parcels.push_back({rank, std::move(set.to[static_cast<std::size_t>(rank)])});
  }
  const std::size_t bytes = set.local.record_bytes();
  const std::vector<Parcel> got = link->exchange(std::move(parcels));
  for (const Parcel& parcel : got) {
    for (std::size_t at = 0; at < parcel.data.size(); at += bytes) {
      set.local.read(parcel.data.data() + at);
    }
  }
}

void Finder::State::search_here(const Settings& settings, const Sent* sets, int count, Result& r) {
  Options options = settings.search;
  options.order = Order::any;
  options.nan = NanPolicy::inactive;  // none came
  const LocalSet* const locals[] = {&sets[0].local, &sets[count - 1].local};
  r = share.search(options, settings.parts, regions.bounds(link->rank(), link->rank() + 1), locals,
                   count);
  traffic.known = share.known();
  traffic.home = share.home();
  traffic.parts = share.parts();
  if (!r.ok()) return;
  share.swap(pairs, points);
  if (settings.search.order == Order::canonical) std::sort(pairs.begin(), pairs.end());
  work = work_of(share.handled(), r.comparisons, 0);
  traffic.work = work_of(share.handled(), r.comparisons, pairs.size());
  own = traffic.home ? work / traffic.home : 0;
}

bool Finder::State::finish(const Sent* sets, int count, Result& r) {
  r.written = pairs.size();
  if (!agree(*link, r, nullptr, 0)) return false;
  std::uint64_t given_inactive = 0;
  for (int s = 0; s < count; ++s) {
    const Boxes& boxes = sets[s].given->boxes;
    for (std::size_t i = 0; i < boxes.size(); ++i) given_inactive += reach_of(boxes[i], 0).empty();
  }
  std::uint64_t sums[6] = {pairs.size(), given_inactive, r.comparisons,
                           traffic.work, traffic.home,   work};
  std::uint64_t most = traffic.work;
  link->sum_and_most(sums, 6, most);
  r.found = sums[0];
  r.inactive = sums[1];
  r.comparisons = sums[2];
  mean = sums[4] ? sums[5] / sums[4] : 0;
  const double each = static_cast<double>(sums[3]) / link->size(), before = imbalance;
  imbalance = traffic.imbalance = each > 0 ? static_cast<double>(most) / each : 1;
  if (traffic.cut_anew) judge_cut(before);
  const Counts& c = link->counts();
  traffic.control.collectives += c.collectives;
  traffic.control.collective_bytes += c.collective_bytes;
  return true;
}

// Worse than what it followed: back to that. It gained less than a twentieth: what is left is in
// the scene, not in the cuts, and the next one can wait.
void Finder::State::judge_cut(double before) {
  const bool first = regions_before.count() != regions.count();
  patience = first || imbalance < 0.95 * before ? 0 : std::min(2 * patience + 1, 1000u);
  if (first || imbalance <= before) {
    refused = 0;
    return;
  }
  refused = std::min(refused + 1, 20u);
  regions = regions_before;
  imbalance = before;
}

Finder::Finder(MPI_Comm comm, const Settings& settings) noexcept
    : settings_(settings), comm_(comm) {}
Finder::~Finder() = default;
Finder::Finder(Finder&& other) noexcept = default;
Finder& Finder::operator=(Finder&& other) noexcept = default;

Result Finder::find(const RankBoxes& boxes) noexcept {
  Result r;
  const RankBoxes* sets[] = {&boxes};
  attempt(r, [&] {
    if (!state_) state_ = std::make_unique<State>();
  });
  if (!r.ok()) return r;
  return call(state_->link, comm_, settings_,
              [&](Link&, Result& result) { state_->find(settings_, sets, 1, result); });
}

Result Finder::find(const RankBoxes& a, const RankBoxes& b) noexcept {
  Result r;
  const RankBoxes* sets[] = {&a, &b};
  attempt(r, [&] {
    if (!state_) state_ = std::make_unique<State>();
  });
  if (!r.ok()) return r;
  return call(state_->link, comm_, settings_,
              [&](Link&, Result& result) { state_->find(settings_, sets, 2, result); });
}

Pairs64 Finder::pairs() const noexcept {
  return state_ ? Pairs64{state_->pairs.data(), state_->pairs.size()} : Pairs64{};
}
const Traffic& Finder::traffic() const noexcept {
  static const Traffic none;
  return state_ ? state_->traffic : none;
}
int Finder::home(const Box& box) const noexcept {
  const DefaultFloats floats;
  const Reach reach = reach_of(box, settings_.search.margin);
  return state_ ? state_->regions.home(reach.lower) : 0;
}

}  // namespace throng::mpi
