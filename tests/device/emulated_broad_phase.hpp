// The persistent objects of a device, emulated by host threads, with the interface of
// throng::BroadPhase. The templates behind it are instantiated once, in emulated_broad_phase.cpp,
// not per test.
#pragma once

#include <memory>
#include <memory_resource>
#include <vector>

#include <throng/broad_phase.hpp>

namespace throng::tests {

class EmulatedBroadPhase {
 public:
  explicit EmulatedBroadPhase(const Options& options, float fat_margin = 0,
                              std::pmr::memory_resource* memory = std::pmr::new_delete_resource());
  ~EmulatedBroadPhase();

  Result add(const Boxes& boxes, ObjectId* ids);
  Result remove(const ObjectId* ids, std::size_t count);
  Result move(const ObjectId* ids, const Boxes& boxes);
  // Calls move_all() at once, or passes the boxes to the next update.
  Result move_all(const Boxes& boxes);
  Result set_filters(const ObjectId* ids, std::size_t count, const Filters& filters);
  Result shift_origin(const Vec3& by);
  Result update();
  Result copy_from(const EmulatedBroadPhase& other);
  // A SweepTest callback cannot run on a device.
  Result find_overlaps(const Boxes& boxes);
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which, const Filters& filters,
                   const SweepTest& = {});
  Result find_first_hits(const Sweep* sweeps, std::size_t count, const Filters& filters,
                         SweepHit* out);
  Pairs overlaps() const;
  SweepHitList hits() const;
  const char* last_reason() const { return reason_; }
  void combine_with_update(bool at_once) { combined_ = at_once; }

  LivePairs begun() const;
  LivePairs ended() const;
  LivePairs pairs();
  std::uint64_t object_count() const;
  std::uint64_t id_limit() const;
  std::uint64_t pair_count() const;
  std::uint64_t slot_limit() const;

  // Costs: number of candidates, bytes in all and for queries, launches and synchronizations.
  std::uint64_t candidate_count() const;
  std::size_t held() const;
  std::size_t query_bytes() const;
  std::size_t launches() const;
  std::size_t syncs() const;

 private:
  struct Scene;
  template <class F>
  static Result call(const F& f);

  std::unique_ptr<Scene> scene_;
  std::vector<Box> all_;
  bool combined_ = false, given_ = false;
  const char* reason_ = "";
};

}  // namespace throng::tests
