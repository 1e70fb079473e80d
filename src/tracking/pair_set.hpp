// The current pairs: their slots, the pairs of each object, and the begin and end events.
//
// They are stored in two forms, of which at least one is valid. Linked: each pair is an edge in two
// doubly linked lists, one per object; the number of the edge is the slot. So finding the pairs of
// an object, and removing one of them, costs nothing for other objects' pairs. Sorted: one array in
// sorted order; one merge with the result of a full search yields the events.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "base/prefetch.hpp"
#include "tracking/objects.hpp"
#include "tracking/pod_vector.hpp"

namespace throng::tracking {

class PairSet {
 public:
  explicit PairSet(base::Memory& memory) noexcept;

  std::size_t count() const noexcept { return count_; }
  std::size_t slot_limit() const noexcept { return slot_limit_; }
  const PodVector<LivePair>& begun() const noexcept { return begun_; }
  const PodVector<LivePair>& ended() const noexcept { return ended_; }
  // The sorted form; brings it up to date. Allocates nothing: commits reserve the memory.
  const PodVector<LivePair>& sorted(std::size_t id_limit) noexcept;

  // The sorted form; must be up to date.
  const PodVector<LivePair>& sorted_list() const noexcept { return sorted_; }
  // Return how many pairs an object has; write them in sorted order if `capacity` is enough.
  // pairs_by_links() follows the object's list; pairs_by_scan() scans the sorted form, which must
  // be up to date.
  std::size_t pairs_by_links(const Objects& objects, ObjectId id, LivePair* out,
                             std::size_t capacity) const noexcept;
  std::size_t pairs_by_scan(ObjectId id, LivePair* out, std::size_t capacity) const noexcept;

  // Events to commit; begun pairs without slots. reserve_events() clears both and reserves memory.
  void reserve_events(std::size_t begun, std::size_t ended) {
    next_begun_.clear();
    next_ended_.clear();
    next_begun_.reserve(begun);
    next_ended_.reserve(ended);
  }
  PodVector<LivePair>& next_begun() noexcept { return next_begun_; }
  PodVector<LivePair>& next_ended() noexcept { return next_ended_; }

  // Builds the linked form from the sorted one.
  void link_all(Objects& objects);
  // Iterates over the pairs of an object in steps, so that edges can be prefetched; buffers the
  // first few.
  struct EdgeCursor {
    static constexpr std::uint32_t capacity = 16;
    ObjectId id;
    std::uint32_t next, count;  // the next edge, or 0
    ObjectId others[capacity];
    std::uint32_t slots[capacity];
  };
  void start(EdgeCursor& cursor, const Objects& objects, ObjectId id) const noexcept {
    cursor.id = id;
    cursor.next = objects.body(id).first_edge;
    cursor.count = 0;
    base::prefetch(&edges_[cursor.next]);
  }
  // At the end of the list repeats edge 0: a branch on the end would be mispredicted.
  void step(EdgeCursor& cursor) const noexcept {
    if (cursor.count == EdgeCursor::capacity) return;
    const Edge& edge = edges_[cursor.next];
    const bool is_second = edge.id[1] == cursor.id;
    cursor.others[cursor.count] = edge.id[!is_second];
    cursor.slots[cursor.count] = cursor.next - 1;
    cursor.count += cursor.next != 0;
    cursor.next = edge.next[is_second];
    base::prefetch(&edges_[cursor.next]);
  }
  // Calls f(other, slot) for all pairs of the object, buffered or not.
  template <class F>
  void each_pair(const EdgeCursor& cursor, F&& f) const;
  // Applies the events, in any order, to the linked form; the sorted form follows on demand.
  void commit_linked(Objects& objects);
  // Takes all pairs in sorted order; computes the events; replaces the sorted form, with up to
  // `tasks` tasks. Invalidates the linked form.
  void commit_sorted(const Pair* pairs, std::size_t count, std::size_t id_limit,
                     const Executor& executor, unsigned tasks);
  // Commits no events.
  void commit_nothing() noexcept;

  void reserve_for(const PairSet& other);
  void copy(const PairSet& other) noexcept;

 private:
  // The edge of a slot has the next number. Edge 0 is the end of every list.
  struct Edge {
    ObjectId id[2];  // id[0] is `none` in a free slot
    std::uint32_t next[2], previous[2];
  };
  // State of the sorted form: up to date; as before the last commit; or invalid.
  enum class Sorted : std::uint8_t { current, previous, invalid };

  void reserve_slots(std::size_t begun);
  // Slot of begun pair number `taken` of a commit.
  std::uint32_t slot_for(std::size_t taken) const noexcept;
  void link(Objects& objects, const LivePair& pair) noexcept;
  void unlink(Objects& objects, std::uint32_t slot) noexcept;
  void prefetch_neighbours(std::uint32_t slot) const noexcept;
  // The back link of the next edge in one of the two lists. For edge 0 the value has no meaning.
  std::uint32_t& back_link_of_next(const Edge& edge, int side) noexcept {
    Edge& next = edges_[edge.next[side]];
    return next.previous[next.id[1] == edge.id[side]];
  }
  void finish(std::size_t begun, std::size_t ended, Sorted sorted) noexcept;

  PodVector<Edge> edges_;
  PodVector<std::uint32_t> free_slots_;
  PodVector<LivePair> sorted_, scratch_;
  PodVector<LivePair> begun_, ended_, next_begun_, next_ended_;
  std::size_t count_ = 0, slot_limit_ = 0;
  Sorted state_ = Sorted::current;
};

template <class F>
void PairSet::each_pair(const EdgeCursor& cursor, F&& f) const {
  for (std::uint32_t k = 0; k < cursor.count; ++k) f(cursor.others[k], cursor.slots[k]);
  for (std::uint32_t e = cursor.next; e != 0;) {
    const Edge& edge = edges_[e];
    const bool is_second = edge.id[1] == cursor.id;
    f(edge.id[!is_second], e - 1);
    e = edge.next[is_second];
  }
}

}  // namespace throng::tracking
