// The search across ranks, independent of where boxes are stored: consensus, partitioning, halo
// exchange. HostFlow and DeviceFlow implement access to the boxes.
#pragma once

#include <cstdint>
#include <vector>

#include <throng/mpi.hpp>

#include "mpi/agree.hpp"
#include "mpi/bisect.hpp"
#include "mpi/link.hpp"

namespace throng::mpi {

// One set of a call, to be sent.
struct Sent {
  const RankBoxes* given = nullptr;
  std::uint64_t first_id = 0;  // if no ids are given
  unsigned filters = 0;        // the union over all ranks
  Bytes wide;                  // records to forward along the tree
};

class Flow {
 public:
  virtual ~Flow() = default;

  // Collective; one or two sets. An error in r is propagated to all ranks.
  void find(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
            Result& r);
  // Takes part in the call for a rank that could not create its Flow; r has the error.
  static void give_up(Link& link, const Settings& settings, int count, Result& r);

  Pairs64 pairs() const noexcept { return kept_ ? Pairs64{kept_pairs(), kept_} : Pairs64{}; }
  const Traffic& traffic() const noexcept { return traffic_; }
  int home(const Box& box, float margin) const noexcept {
    return regions_.home(reach_of(box, margin).lower);
  }

 protected:
  // Points that stand for `step` boxes each; the weight is the cost of the pairs.
  struct Sample {
    std::vector<Point> points;
    std::uint64_t step = 1;
  };
  struct Seen {
    std::uint64_t inactive = 0, id_sum = 0;  // sum of hashed ids
  };
  struct Found {
    std::uint64_t kept = 0;  // pairs that this rank reports
    std::uint64_t home = 0, known = 0, parts = 1;
    std::uint64_t handled = 0;  // known, counted twice if the boxes were distributed to parts
  };

  Flow() = default;
  Flow(const Flow&) = delete;
  Flow& operator=(const Flow&) = delete;
  const Regions& regions() const noexcept { return regions_; }

  // Local steps. They throw std::bad_alloc or pipeline::Failure, or set an error in r.
  virtual Seen look_at(const Settings& settings, const RankBoxes& set, Result& r) = 0;
  // In host memory; valid until the next call.
  virtual const std::uint64_t* host_ids(const RankBoxes& set) = 0;
  virtual Sample sample(const Settings& settings, const RankBoxes& set, std::size_t most) = 0;
  virtual void take_wide(int set, const Bytes& records) = 0;
  // Finds the pairs whose reference corner lies in the region; returns the boxes there with their
  // costs.
  virtual Result search(const Settings& settings, const Bounds& region, Found& found,
                        std::vector<Sample>& samples) = 0;
  virtual const Pair64* kept_pairs() const noexcept = 0;
  // Collective. route() finds the destinations of the boxes, up to the next consensus; deliver()
  // sends them.
  virtual void route(Link& link, const Settings& settings, std::vector<Sent>& sets, Result& r) = 0;
  virtual void deliver(Link& link) = 0;

  Traffic traffic_;

 private:
  bool begin(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
             Result& r);
  void check_ids(Link& link, Result& r);
  void cut_space(Link& link, const Settings& settings, Result& r);
  void hand_on_wide(Link& link, const Settings& settings, Result& r);
  bool finish(Link& link, Result& r);
  void judge_cut(double before);

  std::vector<Sent> sets_;
  Regions regions_;
  bool cut_ = false;               // space has been partitioned at least once
  std::uint64_t hash_ = 0;         // of this rank's ids in the last call
  std::uint64_t checked_[4] = {};  // checksums of the ids checked last, over all ranks
  std::vector<Sample> samples_;    // of the last search
  double imbalance_ = 1;
  Regions regions_before_;  // kept until the new partition has been evaluated
  // Work without pairs: of this rank; per owned box here, and per box over all ranks.
  std::uint64_t work_ = 0, own_ = 0, mean_ = 0;
  unsigned refused_ = 0;  // consecutive partitions that were worse than their predecessor
  unsigned patience_ = 0, waited_ = 0;  // back-off: partitions that did not help delay the next one
  std::uint64_t inactive_ = 0, kept_ = 0;
};

}  // namespace throng::mpi
