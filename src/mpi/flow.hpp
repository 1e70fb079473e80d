// A search across ranks from call to answer, wherever boxes live: what is agreed upon, how space is
// cut, who is told of a box. A class of its own knows the boxes: HostFlow, DeviceFlow.
#pragma once

#include <cstdint>
#include <vector>

#include <throng/mpi.hpp>

#include "mpi/agree.hpp"
#include "mpi/bisect.hpp"
#include "mpi/link.hpp"

namespace throng::mpi {

// One set of a call, on its way.
struct Sent {
  const RankBoxes* given = nullptr;
  std::uint64_t first_id = 0;  // where none are given
  unsigned filters = 0;        // those that some rank has
  Bytes wide;                  // records to hand on along the tree
};

class Flow {
 public:
  virtual ~Flow() = default;

  // Collective; one set or two. r may be bad already: then all ranks are told.
  void find(Link& link, const Settings& settings, const RankBoxes* const* given, int count,
            Result& r);
  // Takes part in the call for a rank that has no Flow; r says why.
  static void give_up(Link& link, const Settings& settings, int count, Result& r);

  Pairs64 pairs() const noexcept { return kept_ ? Pairs64{kept_pairs(), kept_} : Pairs64{}; }
  const Traffic& traffic() const noexcept { return traffic_; }
  int home(const Box& box, float margin) const noexcept {
    return regions_.home(reach_of(box, margin).lower);
  }

 protected:
  // Points that stand for `step` boxes each; a weight is what pairs cost.
  struct Sample {
    std::vector<Point> points;
    std::uint64_t step = 1;
  };
  struct Seen {
    std::uint64_t inactive = 0, id_sum = 0;  // of the mixed ids
  };
  struct Found {
    std::uint64_t kept = 0;  // pairs that this rank tells
    std::uint64_t home = 0, known = 0, parts = 1;
    std::uint64_t handled = 0;  // known, and once more what was dealt out to parts
  };

  Flow() = default;
  Flow(const Flow&) = delete;
  Flow& operator=(const Flow&) = delete;
  const Regions& regions() const noexcept { return regions_; }

  // This rank's own parts; they throw std::bad_alloc or pipeline::Failure, or make r bad.
  virtual Seen look_at(const Settings& settings, const RankBoxes& set, Result& r) = 0;
  // In host memory, good until the next call of it.
  virtual const std::uint64_t* host_ids(const RankBoxes& set) = 0;
  virtual Sample sample(const Settings& settings, const RankBoxes& set, std::size_t most) = 0;
  virtual void take_wide(int set, const Bytes& records) = 0;
  // The pairs whose home corner lies in the region; and the boxes there, with what they cost.
  virtual Result search(const Settings& settings, const Bounds& region, Found& found,
                        std::vector<Sample>& samples) = 0;
  virtual const Pair64* kept_pairs() const noexcept = 0;
  // Collective: finds out whom the boxes reach, up to the agreement that follows; and sends them.
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
  bool cut_ = false;               // into regions, once at least
  std::uint64_t hash_ = 0;         // of this rank's ids in the last call
  std::uint64_t checked_[4] = {};  // of those that were checked last, over all ranks
  std::vector<Sample> samples_;    // of the last search
  double imbalance_ = 1;
  Regions regions_before_;  // while it is not known whether those that followed are better
  // Work, pairs apart: of this rank; of a box at home here, and over all ranks.
  std::uint64_t work_ = 0, own_ = 0, mean_ = 0;
  unsigned refused_ = 0;                // cuts in a row that were worse than what they followed
  unsigned patience_ = 0, waited_ = 0;  // cuts that did not help make the next ones rarer
  std::uint64_t inactive_ = 0, kept_ = 0;
};

}  // namespace throng::mpi
