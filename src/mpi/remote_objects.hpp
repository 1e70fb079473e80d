// The objects whose boxes overlap this rank's region, whichever rank holds them, and the begin and
// end events among them.
//
// Why the events are exact although each rank sees only a part. Between two updates both an
// object's box and the regions may change, so an object can enter or leave a rank's region. An
// entering object is first added with its box of the last update; a leaving object is moved to its
// current box before it is dropped:
//   1. add entering objects in their old state;  2. move, set filters, add new objects, remove
//   deleted ones;  3. drop leaving objects.
// Only step 2 reports events. Before it, this rank has all objects that overlap its old or new
// region, in their old state; after it, in their new state. A current pair is owned here only if
// both objects overlap the new region, so step 2 sees it begin exactly if it did not exist before.
// An old pair was owned here only if both overlapped the old region, so step 2 sees it end exactly
// if it no longer exists. So each event is reported once: by the current owner of the pair or by
// its old owner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <throng/broad_phase.hpp>
#include <throng/mpi.hpp>

#include "mpi/bisect.hpp"
#include "mpi/regions.hpp"

namespace throng::mpi {

// The full change of an object since the last update; sent to ranks whose region it enters or
// leaves.
struct Change {
  std::uint64_t id;
  Box before, now;
  Filter filter_before, filter;
  std::uint32_t was_alive, is_alive;
};
// Sent to ranks whose region the object overlaps before and after.
struct Move {
  std::uint64_t id;
  Box now;
};

bool same(const Filter& a, const Filter& b) noexcept;

class RemoteObjects {
 public:
  RemoteObjects(const Options& options, float margin);

  // Takes one change; ignores objects that do not concern this rank.
  void take(const Change& change, const Bounds& here_before, const Bounds& here);
  void take(const Move& move);
  // Applies the changes taken.
  Result update(const Bounds& here_before, const Bounds& here, std::vector<Pair64>& begun,
                std::vector<Pair64>& ended);
  void pairs(const Bounds& here, std::vector<Pair64>& out);

  std::size_t size() const noexcept { return objects_.size(); }
  std::uint64_t pair_count() const noexcept { return search_.pair_count(); }
  // The objects whose lower corner lies here: their number; their points with costs.
  std::size_t owned_count(const Bounds& here) const noexcept;
  void points(const Bounds& here, std::vector<Point>& out);

 private:
  struct Corner {
    Key at[3];
  };

  Result apply_entering();
  Result apply_changes();
  Result drop_leaving();
  void name(ObjectId object, std::uint64_t id, const Box& box);
  bool owns_pair(ObjectId a, ObjectId b, const std::vector<Corner>& corners,
                 const Bounds& here) const noexcept;
  Pair64 ids_of(const LivePair& pair) const noexcept;

  throng::BroadPhase search_;
  float margin_;
  std::unordered_map<std::uint64_t, ObjectId> objects_;
  // Indexed by ObjectId.
  std::vector<std::uint64_t> ids_;
  std::vector<Corner> corners_, corners_before_;
  // Changes taken and not yet applied.
  std::vector<Change> entering_, created_;
  std::vector<ObjectId> moved_, filtered_, removed_, leaving_;
  std::vector<Box> boxes_;
  std::vector<Filter> filters_;
};

}  // namespace throng::mpi
