// Incremental update: searches around changed objects and reports which of their pairs began and
// ended. One instance per task; the scene is shared and read-only.
#pragma once

#include <cstdint>

#include "base/cancellation.hpp"
#include "tracking/bvh_forest.hpp"
#include "tracking/cells.hpp"
#include "tracking/objects.hpp"
#include "tracking/pair_set.hpp"
#include "tracking/pod_vector.hpp"

namespace throng::tracking {

class LocalUpdate {
 public:
  explicit LocalUpdate(base::Memory& memory) noexcept
      : begun_(memory), ended_(memory), hits_(memory), seen_(memory) {}

  // The objects are in the forest if it is not null, otherwise in the cells; their pairs are
  // linked.
  struct Scene {
    const Objects& objects;
    const PairSet& pairs;
    const Cells& cells;
    const BvhForest* forest;
  };
  // Clears the results.
  void start() noexcept;
  // Searches around the listed objects, all of which changed, and appends to the results. If both
  // objects of a pair changed, the one with the lower id reports it. Ends early when `stop` is set
  // or the work exceeds `max_work`. Throws base::AllocationFailed.
  void search(const Scene& scene, const ObjectId* ids, std::size_t count, std::uint64_t max_work,
              base::Cancellation& stop);

  // Events; begun pairs have no slot yet.
  const PodVector<LivePair>& begun() const noexcept { return begun_; }
  const PodVector<LivePair>& ended() const noexcept { return ended_; }
  const Work& work() const noexcept { return work_; }
  std::size_t searched() const noexcept { return searched_; }  // number of objects

  // Reserves as much memory as another task has, since chunks move between tasks. Discards the
  // results.
  void match(const LocalUpdate& other);

 private:
  std::uint32_t search_forest(const Scene& scene, ObjectId id, ObjectId* hits);
  void report_begun(const Scene& scene, ObjectId id, ObjectId other);
  void report_ended(const Scene& scene, ObjectId id, ObjectId other, std::uint32_t slot);
  void report_few(const Scene& scene, const PairSet::EdgeCursor& previous, ObjectId* hits,
                  std::uint32_t count);
  void report_many(const Scene& scene, const PairSet::EdgeCursor& previous, const ObjectId* hits,
                   std::uint32_t count);
  bool is_seen(ObjectId id) const noexcept { return (seen_[id / 64] >> id % 64 & 1) != 0; }
  void flip(ObjectId id) noexcept { seen_[id / 64] ^= std::uint64_t{1} << id % 64; }

  PodVector<LivePair> begun_, ended_;
  PodVector<ObjectId> hits_;
  PodVector<std::uint64_t> seen_;  // one bit per object; all 0 between searches
  bool seen_not_clear_ = false;    // `seen_` has bits set, because memory ran out
  Work work_;
  std::size_t searched_ = 0;
};

}  // namespace throng::tracking
