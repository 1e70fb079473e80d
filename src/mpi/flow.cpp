#include "mpi/flow.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mpi/balance.hpp"
#include "mpi/ids.hpp"
#include "mpi/local.hpp"

namespace throng::mpi {
namespace {

// Words of the first consensus: the filters of each set; whether ids changed, and how ids are
// given.
constexpr int word_count = 3;

}  // namespace

void Flow::give_up(Link& link, const Settings& settings, int count, Result& r) {
  std::uint64_t words[word_count] = {};
  agree(link, r, agreed(settings, static_cast<std::uint64_t>(count)), words, word_count);
}

void Flow::find(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
                Result& r) {
  kept_ = 0;
  traffic_ = {};
  link.reset_counts();
  if (!begin(link, settings, given, count, r)) return;
  traffic_.control = link.counts();
  link.reset_counts();
  if (!cut_ || (imbalance_ > settings.imbalance && ++waited_ > patience_)) {
    cut_space(link, settings, r);
  }
  traffic_.balance = link.counts();
  link.reset_counts();
  route(link, settings, sets_, r);
  for (const Sent& set : sets_) traffic_.wide += set.wide.size() / record_bytes(set.filters);
  std::uint64_t some_wide = traffic_.wide;
  if (!agree(link, r, &some_wide, 1)) return;
  deliver(link);
  if (some_wide != 0) hand_on_wide(link, settings, r);
  traffic_.halo = link.counts();
  link.reset_counts();
  Found found;
  attempt(r, [&] {
    r = search(settings, regions_.bounds(link.rank(), link.rank() + 1), found, samples_);
    traffic_.known = found.known;
    traffic_.home = found.home;
    traffic_.parts = found.parts;
    if (!r.ok()) return;
    work_ = work_of(found.handled, r.comparisons, 0);
    traffic_.work = work_of(found.handled, r.comparisons, found.kept);
    own_ = found.home ? work_ / found.home : 0;
  });
  r.written = found.kept;
  if (finish(link, r)) kept_ = found.kept;
}

bool Flow::begin(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
                 Result& r) {
  std::uint64_t words[word_count] = {};
  std::uint64_t hash_now = 0;
  std::uint64_t ids[4] =
      {};  // per set, summed over all ranks: the sum of hashed ids, and their count
  inactive_ = 0;
  if (r.ok() && valid(settings, r)) {
    for (int s = 0; s < count && r.ok(); ++s) {
      attempt(r, [&] {
        const Seen seen = look_at(settings, *given[s], r);
        inactive_ += seen.inactive;
        hash_now = mixed(hash_now ^ mixed(seen.id_sum ^ mixed(given[s]->boxes.size())));
        ids[2 * s] = seen.id_sum;
        ids[2 * s + 1] = given[s]->boxes.size();
      });
      words[s] = present(given[s]->boxes.filters);
    }
  }
  // A rank without boxes matches both forms.
  std::uint64_t forms = 0;
  for (int s = 0; s < count; ++s) {
    if (!given[s]->boxes.empty()) forms |= (given[s]->ids ? 1u : 2u) << (2 * s);
  }
  words[2] = (forms << 1) | (hash_now != hash_ || !cut_ ? 1 : 0);
  if (!agree(link, r, agreed(settings, static_cast<std::uint64_t>(count)), words, word_count)) {
    return false;
  }
  for (int s = 0; s < count; ++s) {
    if ((words[2] >> (1 + 2 * s) & 3) == 3) {
      say(r, Status::ranks_disagree,
          "some ranks give ids and others do not; give them on all ranks or on none");
      return false;
    }
  }
  sets_.assign(static_cast<std::size_t>(count), {});
  for (int s = 0; s < count; ++s) {
    Sent& set = sets_[static_cast<std::size_t>(s)];
    set.given = given[s];
    set.filters = static_cast<unsigned>(words[s]);
  }
  if (words[2] & 1) {
    // Equal sums: objects only migrated between ranks, so the ids were checked before.
    link.sum(ids, 4);
    if (!cut_ || !std::equal(ids, ids + 4, checked_)) check_ids(link, r);
    if (!r.ok()) return false;
    std::copy_n(ids, 4, checked_);
  }
  hash_ = hash_now;
  for (int s = 0; s < count; ++s) {
    Sent& set = sets_[static_cast<std::size_t>(s)];
    if (!(words[2] >> (1 + 2 * s) & 1)) set.first_id = link.before(given[s]->boxes.size());
  }
  return true;
}

void Flow::check_ids(Link& link, Result& r) {
  for (const Sent& set : sets_) {
    std::size_t n = set.given->ids ? set.given->boxes.size() : 0;
    const std::uint64_t* ids = nullptr;
    if (n) attempt(r, [&] { ids = host_ids(*set.given); });
    if (!ids) n = 0;
    const std::vector<Parcel> parcels = to_judges(link, ids, n);
    attempt(r, [&] { judge(parcels, {}, r); });
    if (!agree(link, r, nullptr, 0)) return;
  }
}

void Flow::cut_space(Link& link, const Settings& settings, Result& r) {
  // The cost of the last search weights the boxes; before the first search all weigh the same.
  if (!cut_) {
    own_ = mean_ = 1;
    samples_.clear();
    for (const Sent& set : sets_) {
      attempt(
          r, [&] { samples_.push_back(sample(settings, *set.given, most_points / sets_.size())); });
    }
  }
  // A rank's comparisons depend on the grid chosen for its region, and so on the cuts. After a cut
  // that made things worse, the next one trusts the difference between ranks less.
  const double part = static_cast<double>(own_) - static_cast<double>(mean_);
  const double cost = static_cast<double>(mean_) + std::ldexp(part, -static_cast<int>(refused_));
  const auto each = static_cast<std::uint32_t>(std::max(0.0, std::min(cost, 0x1p20)));
  std::vector<Point> points;
  for (Sample& some : samples_) {
    for (Point& point : some.points) {
      const std::uint64_t weight = (std::uint64_t{point.weight} + each) * some.step;
      point.weight = static_cast<std::uint32_t>(std::min<std::uint64_t>(weight, 0xffffffffu));
    }
    if (points.empty()) {
      points.swap(some.points);
    } else {
      points.insert(points.end(), some.points.begin(), some.points.end());
    }
  }
  samples_.clear();
  thin_out(points);
  regions_before_ = regions_;
  regions_ = bisect(link, std::move(points));
  cut_ = traffic_.cut_anew = true;
  waited_ = 0;
}

void Flow::hand_on_wide(Link& link, const Settings& settings, Result& r) {
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    Sent& set = sets_[s];
    const Bytes got =
        hand_on(link, std::move(set.wide), record_bytes(set.filters),
                [&](int begin, int end, const std::byte* record) {
                  return regions_.bounds(begin, end)
                      .meets(reach_of(LocalSet::box_of(record), settings.search.margin));
                });
    attempt(r, [&] { take_wide(static_cast<int>(s), got); });
  }
}

bool Flow::finish(Link& link, Result& r) {
  if (!agree(link, r, nullptr, 0)) return false;
  std::uint64_t sums[7] = {r.written,     inactive_, r.comparisons, traffic_.work,
                           traffic_.home, work_,     r.visited};
  std::uint64_t most = traffic_.work;
  link.sum_and_most(sums, 7, most);
  r.found = sums[0];
  r.inactive = sums[1];
  r.comparisons = sums[2];
  r.visited = sums[6];
  mean_ = sums[4] ? sums[5] / sums[4] : 0;
  const double each = static_cast<double>(sums[3]) / link.size(), before = imbalance_;
  imbalance_ = traffic_.imbalance = each > 0 ? static_cast<double>(most) / each : 1;
  if (traffic_.cut_anew) judge_cut(before);
  const Counts& c = link.counts();
  traffic_.control.collectives += c.collectives;
  traffic_.control.collective_bytes += c.collective_bytes;
  return true;
}

// A worse partition is reverted. If the gain is below 5 %, the rest of the imbalance is inherent in
// the scene, and the next repartitioning is delayed.
void Flow::judge_cut(double before) {
  const bool first = regions_before_.count() != regions_.count();
  patience_ = first || imbalance_ < 0.95 * before ? 0 : std::min(2 * patience_ + 1, 1000u);
  if (first || imbalance_ <= before) {
    refused_ = 0;
    return;
  }
  refused_ = std::min(refused_ + 1, 20u);
  regions_ = regions_before_;
  imbalance_ = before;
}

}  // namespace throng::mpi
