// Searching around objects that changed: which of their pairs began and ended. One task's part;
// tasks share what they only read.
#pragma once

#include <cstdint>

#include "cpu/stop.hpp"
#include "live/bvh_forest.hpp"
#include "live/cells.hpp"
#include "live/list.hpp"
#include "live/objects.hpp"
#include "live/pair_set.hpp"

namespace throng::live {

class Around {
 public:
  explicit Around(cpu::Memory& memory) noexcept
      : begun_(memory), ended_(memory), hits_(memory), seen_(memory) {}

  // What is searched: the objects are in cells, or in a forest if there is one, and linked with
  // their pairs.
  struct Scene {
    const Objects& objects;
    const PairSet& pairs;
    const Cells& cells;
    const BvhForest* forest;
  };
  // Forgets what was found.
  void start() noexcept;
  // Searches around the objects of a list, all of which changed, until `stop`; adds to what was
  // found. Of two objects that both changed, the one with the lower id tells of their pair. Throws
  // cpu::NoMemory.
  // Ends early once it has looked at more than `most_work`.
  void search(const Scene& scene, const ObjectId* ids, std::size_t count, std::uint64_t most_work,
              cpu::Stop& stop);

  // Begun: without slots.
  const List<LivePair>& begun() const noexcept { return begun_; }
  const List<LivePair>& ended() const noexcept { return ended_; }
  const Work& work() const noexcept { return work_; }
  std::size_t searched() const noexcept { return searched_; }  // around so many objects

  // As much room as another task's part has, for which objects come to which task differs. What was
  // found is lost.
  void match(const Around& other);

 private:
  std::uint32_t search_forest(const Scene& scene, ObjectId id, ObjectId* hits);
  void tell_begun(const Scene& scene, ObjectId id, ObjectId other);
  void tell_ended(const Scene& scene, ObjectId id, ObjectId other, std::uint32_t slot);
  void tell_few(const Scene& scene, const PairSet::Walk& had, ObjectId* hits, std::uint32_t count);
  void tell_many(const Scene& scene, const PairSet::Walk& had, const ObjectId* hits,
                 std::uint32_t count);
  bool is_seen(ObjectId id) const noexcept { return (seen_[id / 64] >> id % 64 & 1) != 0; }
  void flip(ObjectId id) noexcept { seen_[id / 64] ^= std::uint64_t{1} << id % 64; }

  List<LivePair> begun_, ended_;
  List<ObjectId> hits_;
  List<std::uint64_t> seen_;  // a bit an object, all of them 0 between two objects
  bool unclean_ = false;      // unless memory ran out
  Work work_;
  std::size_t searched_ = 0;
};

}  // namespace throng::live
