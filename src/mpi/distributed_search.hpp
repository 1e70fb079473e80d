// The search across ranks, independent of where boxes are stored: consensus, partitioning, halo
// exchange. HostDistributedSearch and DeviceDistributedSearch implement access to the boxes.
#pragma once

#include <cstdint>
#include <vector>

#include <throng/mpi.hpp>

#include "mpi/balance.hpp"
#include "mpi/bisect.hpp"
#include "mpi/communicator.hpp"
#include "mpi/consensus.hpp"

namespace throng::mpi {

// One set of a call, to be sent.
struct OutgoingSet {
  const RankBoxes* given = nullptr;
  std::uint64_t first_id = 0;  // if no ids are given
  unsigned filters = 0;        // the union over all ranks
  Bytes tree_records;          // records to forward along the tree
};

// The options of a search among the boxes that this rank holds.
inline Options local_options(const Settings& settings) noexcept {
  Options options = settings.search;
  options.order = Order::any;         // the caller's order is that of ids
  options.nan = NanPolicy::inactive;  // NaNs were refused before sending
  return options;
}

class DistributedSearch {
 public:
  virtual ~DistributedSearch() = default;

  // Collective; one or two sets. An error in r is propagated to all ranks.
  void find(Communicator& communicator, const Settings& settings, const RankBoxes* const* given,
            int count, Result& r);
  // Takes part in the call for a rank that could not create its DistributedSearch; r has the error.
  static void join_failed_call(Communicator& communicator, const Settings& settings, int count,
                               Result& r);

  Pairs64 pairs() const noexcept { return kept_ ? Pairs64{kept_pairs(), kept_} : Pairs64{}; }
  const Traffic& traffic() const noexcept { return traffic_; }
  int home(const Box& box, float margin) const noexcept {
    return regions_.owner_of(key_box_of(box, margin).lower);
  }

 protected:
  // Points that stand for `step` boxes each; the weight is the cost of the pairs.
  struct Sample {
    std::vector<Point> points;
    std::uint64_t step = 1;
  };
  struct BoxSummary {
    std::uint64_t inactive = 0, id_sum = 0;  // sum of hashed ids
  };
  struct Found {
    std::uint64_t kept = 0;  // pairs that this rank reports
    std::uint64_t owned = 0, owned_and_ghost = 0, parts = 1;
    std::uint64_t handled =
        0;  // owned_and_ghost, counted twice if the boxes were distributed to parts
  };

  DistributedSearch() = default;
  DistributedSearch(const DistributedSearch&) = delete;
  DistributedSearch& operator=(const DistributedSearch&) = delete;
  const Regions& regions() const noexcept { return regions_; }

  // Local steps. They throw std::bad_alloc or device::Failure, or set an error in r.
  virtual BoxSummary inspect(const Settings& settings, const RankBoxes& set, Result& r) = 0;
  // In host memory; valid until the next call.
  virtual const std::uint64_t* host_ids(const RankBoxes& set) = 0;
  virtual Sample sample(const Settings& settings, const RankBoxes& set, std::size_t most) = 0;
  virtual void take_tree_records(int set, const Bytes& records) = 0;
  // Finds the pairs whose reference corner lies in the region; returns the boxes there with their
  // costs.
  virtual Result search(const Settings& settings, const Bounds& region, Found& found,
                        std::vector<Sample>& samples) = 0;
  virtual const Pair64* kept_pairs() const noexcept = 0;
  // Collective. route() finds the destinations of the boxes, up to the next consensus; deliver()
  // sends them.
  virtual void route(Communicator& communicator, const Settings& settings,
                     std::vector<OutgoingSet>& sets, Result& r) = 0;
  virtual void deliver(Communicator& communicator) = 0;

  Traffic traffic_;

 private:
  bool begin(Communicator& communicator, const Settings& settings, const RankBoxes* const* given,
             int count, Result& r);
  void check_ids(Communicator& communicator, Result& r);
  void repartition(Communicator& communicator, const Settings& settings, Result& r);
  void forward_tree_records(Communicator& communicator, const Settings& settings, Result& r);
  bool finish(Communicator& communicator, Result& r);
  void evaluate_partition(double before);

  std::vector<OutgoingSet> sets_;
  Regions regions_;
  bool partitioned_ = false;       // space has been partitioned at least once
  std::uint64_t hash_ = 0;         // of this rank's ids in the last call
  std::uint64_t checked_[4] = {};  // checksums of the ids checked last, over all ranks
  std::vector<Sample> samples_;    // of the last search
  double imbalance_ = 1;
  Regions regions_before_;  // kept until the new partition has been evaluated
  // Work without pairs: of this rank; per owned box here, and per box over all ranks.
  std::uint64_t work_ = 0, work_per_owned_ = 0, mean_work_per_box_ = 0;
  unsigned worse_cuts_ = 0;  // consecutive partitions that were worse than their predecessor
  RepartitionBackoff backoff_;
  std::uint64_t inactive_ = 0, kept_ = 0;
};

}  // namespace throng::mpi
