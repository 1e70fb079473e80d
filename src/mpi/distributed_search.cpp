#include "mpi/distributed_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <throng/checksum.hpp>

#include "mpi/balance.hpp"
#include "mpi/ids.hpp"
#include "mpi/local_set.hpp"

namespace throng::mpi {
namespace {

// Words of the first consensus: the filters of each set; whether ids changed, and how ids are
// given.
constexpr int word_count = 3;

}  // namespace

void DistributedSearch::join_failed_call(Communicator& communicator, const Settings& settings,
                                         int count, Result& r) {
  std::uint64_t words[word_count] = {};
  consensus(communicator, r, consensus_settings(settings, static_cast<std::uint64_t>(count)), words,
            word_count);
}

void DistributedSearch::find(Communicator& communicator, const Settings& settings,
                             const RankBoxes* const* given, int count, Result& r) {
  kept_ = 0;
  traffic_ = {};
  communicator.reset_counts();
  if (!begin(communicator, settings, given, count, r)) return;
  traffic_.control = communicator.counts();
  communicator.reset_counts();
  if (!partitioned_ || backoff_.is_due(imbalance_, settings.imbalance)) {
    repartition(communicator, settings, r);
  }
  traffic_.balance = communicator.counts();
  communicator.reset_counts();
  route(communicator, settings, sets_, r);
  for (const OutgoingSet& set : sets_)
    traffic_.wide += set.tree_records.size() / record_bytes(set.filters);
  std::uint64_t any_tree_records = traffic_.wide;
  if (!consensus(communicator, r, &any_tree_records, 1)) return;
  deliver(communicator);
  if (any_tree_records != 0) forward_tree_records(communicator, settings, r);
  traffic_.halo = communicator.counts();
  communicator.reset_counts();
  Found found;
  attempt(r, [&] {
    r = search(settings, regions_.bounds(communicator.rank(), communicator.rank() + 1), found,
               samples_);
    traffic_.owned_and_ghost = found.owned_and_ghost;
    traffic_.home = found.owned;
    traffic_.parts = found.parts;
    if (!r.ok()) return;
    work_ = work_of(found.handled, r.comparisons, 0);
    traffic_.work = work_of(found.handled, r.comparisons, found.kept);
    work_per_owned_ = found.owned ? work_ / found.owned : 0;
  });
  r.written = found.kept;
  if (finish(communicator, r)) kept_ = found.kept;
}

bool DistributedSearch::begin(Communicator& communicator, const Settings& settings,
                              const RankBoxes* const* given, int count, Result& r) {
  std::uint64_t words[word_count] = {};
  std::uint64_t hash_now = 0;
  std::uint64_t ids[4] =
      {};  // per set, summed over all ranks: the sum of hashed ids, and their count
  inactive_ = 0;
  if (r.ok() && valid(settings, r)) {
    for (int s = 0; s < count && r.ok(); ++s) {
      attempt(r, [&] {
        const BoxSummary seen = inspect(settings, *given[s], r);
        inactive_ += seen.inactive;
        hash_now = mix64(hash_now ^ mix64(seen.id_sum ^ mix64(given[s]->boxes.size())));
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
  words[2] = (forms << 1) | (hash_now != hash_ || !partitioned_ ? 1 : 0);
  if (!consensus(communicator, r, consensus_settings(settings, static_cast<std::uint64_t>(count)),
                 words, word_count)) {
    return false;
  }
  for (int s = 0; s < count; ++s) {
    if ((words[2] >> (1 + 2 * s) & 3) == 3) {
      set_error(r, Status::ranks_disagree,
                "some ranks give ids and others do not; give them on all ranks or on none");
      return false;
    }
  }
  sets_.assign(static_cast<std::size_t>(count), {});
  for (int s = 0; s < count; ++s) {
    OutgoingSet& set = sets_[static_cast<std::size_t>(s)];
    set.given = given[s];
    set.filters = static_cast<unsigned>(words[s]);
  }
  if (words[2] & 1) {
    // Equal sums: objects only migrated between ranks, so the ids were checked before.
    communicator.all_reduce_sum(ids, 4);
    if (!partitioned_ || !std::equal(ids, ids + 4, checked_)) check_ids(communicator, r);
    if (!r.ok()) return false;
    std::copy_n(ids, 4, checked_);
  }
  hash_ = hash_now;
  for (int s = 0; s < count; ++s) {
    OutgoingSet& set = sets_[static_cast<std::size_t>(s)];
    if (!(words[2] >> (1 + 2 * s) & 1))
      set.first_id = communicator.exclusive_sum(given[s]->boxes.size());
  }
  return true;
}

void DistributedSearch::check_ids(Communicator& communicator, Result& r) {
  for (const OutgoingSet& set : sets_) {
    std::size_t n = set.given->ids ? set.given->boxes.size() : 0;
    const std::uint64_t* ids = nullptr;
    if (n) attempt(r, [&] { ids = host_ids(*set.given); });
    if (!ids) n = 0;
    const std::vector<Parcel> parcels = send_to_directory(communicator, ids, n);
    attempt(r, [&] { check_unique(parcels, {}, r); });
    if (!consensus(communicator, r, nullptr, 0)) return;
  }
}

void DistributedSearch::repartition(Communicator& communicator, const Settings& settings,
                                    Result& r) {
  // The cost of the last search weights the boxes; before the first search all weigh the same.
  if (!partitioned_) {
    work_per_owned_ = mean_work_per_box_ = 1;
    samples_.clear();
    for (const OutgoingSet& set : sets_) {
      attempt(r,
              [&] { samples_.push_back(sample(settings, *set.given, max_points / sets_.size())); });
    }
  }
  // A rank's comparisons depend on the grid chosen for its region, and so on the cuts. After a cut
  // that made things worse, the next one trusts the difference between ranks less.
  const double part =
      static_cast<double>(work_per_owned_) - static_cast<double>(mean_work_per_box_);
  const double cost =
      static_cast<double>(mean_work_per_box_) + std::ldexp(part, -static_cast<int>(worse_cuts_));
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
  subsample(points);
  regions_before_ = regions_;
  regions_ = bisect(communicator, std::move(points));
  partitioned_ = traffic_.cut_anew = true;
}

void DistributedSearch::forward_tree_records(Communicator& communicator, const Settings& settings,
                                             Result& r) {
  for (std::size_t s = 0; s < sets_.size(); ++s) {
    OutgoingSet& set = sets_[s];
    const Bytes got = forward_along_tree(
        communicator, std::move(set.tree_records), record_bytes(set.filters),
        [&](int begin, int end, const std::byte* record) {
          return regions_.bounds(begin, end)
              .meets(key_box_of(LocalSet::box_of(record), settings.search.margin));
        });
    attempt(r, [&] { take_tree_records(static_cast<int>(s), got); });
  }
}

bool DistributedSearch::finish(Communicator& communicator, Result& r) {
  if (!consensus(communicator, r, nullptr, 0)) return false;
  std::uint64_t sums[7] = {r.written,     inactive_, r.comparisons, traffic_.work,
                           traffic_.home, work_,     r.visited};
  std::uint64_t most = traffic_.work;
  communicator.all_reduce_sum_and_max(sums, 7, most);
  r.found = sums[0];
  r.inactive = sums[1];
  r.comparisons = sums[2];
  r.visited = sums[6];
  mean_work_per_box_ = sums[4] ? sums[5] / sums[4] : 0;
  const double before = imbalance_;
  imbalance_ = traffic_.imbalance = imbalance_of(most, sums[3], communicator.size());
  if (traffic_.cut_anew) evaluate_partition(before);
  const Counts& c = communicator.counts();
  traffic_.control.collectives += c.collectives;
  traffic_.control.collective_bytes += c.collective_bytes;
  return true;
}

// A worse partition is reverted.
void DistributedSearch::evaluate_partition(double before) {
  const bool first = regions_before_.count() != regions_.count();
  if (!first) backoff_.evaluate(imbalance_, before);
  if (first || imbalance_ <= before) {
    worse_cuts_ = 0;
    return;
  }
  worse_cuts_ = std::min(worse_cuts_ + 1, 20u);
  regions_ = regions_before_;
  imbalance_ = before;
}

}  // namespace throng::mpi
