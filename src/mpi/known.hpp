// The objects whose boxes reach this rank's region, wherever they are held, and what began and
// ended among them.
//
// Why begun and ended are exact although each rank sees only a part. Between two updates an
// object's box and the regions may both change, so an object can enter a rank's sight and leave it.
// What enters is first added with its box of the last update, and what leaves is moved to its box
// of now before it is dropped:
//   1. add what enters, as it was;  2. move, filter, add what is new, remove what is gone;
//   3. drop what left.
// Only step 2 tells. Before it this rank has all that it knew at the last update or knows now, as
// it was then; after it, as it is now. A pair that lives now has its home here only if both are
// known here now, so that step 2 sees it begin exactly if it did not live then; a pair that lived
// has had its home here only if both were known here then, so that step 2 sees it end exactly if it
// no longer lives. So each event is told once: by the rank of the home now, or of the home then.
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

// All of an object's change since the last update: what ranks are told that do not know it yet, or
// no longer.
struct Change {
  std::uint64_t id;
  Box before, now;
  Filter filter_before, filter;
  std::uint32_t was_alive, is_alive;
};
// Of an object that the receiver knows and goes on knowing.
struct Move {
  std::uint64_t id;
  Box now;
};

bool same(const Filter& a, const Filter& b) noexcept;

class Known {
 public:
  Known(const Options& options, float margin);

  // Takes one change of an object; of no concern to this rank: nothing.
  void take(const Change& change, const Bounds& here_before, const Bounds& here);
  void take(const Move& move);
  // Applies what was taken.
  Result update(const Bounds& here_before, const Bounds& here, std::vector<Pair64>& begun,
                std::vector<Pair64>& ended);
  void pairs(const Bounds& here, std::vector<Pair64>& out);

  std::size_t size() const noexcept { return objects_.size(); }
  std::uint64_t pair_count() const noexcept { return search_.pair_count(); }
  // Those at home here, with what they cost.
  std::size_t home_count(const Bounds& here) const noexcept;
  void points(const Bounds& here, std::vector<Point>& out);

 private:
  struct Corner {
    Key at[3];
  };

  Result apply_entering();
  Result apply_changes();
  Result drop_leaving();
  void name(ObjectId object, std::uint64_t id, const Box& box);
  bool at_home(ObjectId a, ObjectId b, const std::vector<Corner>& corners,
               const Bounds& here) const noexcept;
  Pair64 ids_of(const LivePair& pair) const noexcept;

  throng::BroadPhase search_;
  float margin_;
  std::unordered_map<std::uint64_t, ObjectId> objects_;
  // By ObjectId.
  std::vector<std::uint64_t> ids_;
  std::vector<Corner> corners_, corners_before_;
  // Taken, and not yet applied.
  std::vector<Change> entering_, created_;
  std::vector<ObjectId> moved_, filtered_, removed_, leaving_;
  std::vector<Box> boxes_;
  std::vector<Filter> filters_;
};

}  // namespace throng::mpi
