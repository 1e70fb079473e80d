// The pairs that live: their slots, which of them an object has, what began and ended.
//
// They are kept in one of two forms, or both. Linked: each pair is an edge in two doubly linked
// lists, those of its objects; the edge's number is the slot. So an object's pairs are found, and
// one of them taken out, at a cost that nobody else's pairs add to. Sorted: one array in canonical
// order, from which, with all pairs found anew, one merge tells what began and ended.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "cpu/prefetch.hpp"
#include "live/list.hpp"
#include "live/objects.hpp"

namespace throng::live {

class PairSet {
 public:
  explicit PairSet(cpu::Memory& memory) noexcept;

  std::size_t count() const noexcept { return count_; }
  std::size_t slot_limit() const noexcept { return slot_limit_; }
  const List<LivePair>& begun() const noexcept { return begun_; }
  const List<LivePair>& ended() const noexcept { return ended_; }
  // Puts the sorted form in order where it is not. Takes no memory: a commit has made room.
  const List<LivePair>& sorted(std::size_t id_limit) noexcept;

  // The sorted form, where it is in order.
  const List<LivePair>& in_order() const noexcept { return sorted_; }
  // Those of one object in canonical order, if `out` has room for them all; returns how many there
  // are. By its list, where pairs are linked; or by looking at all in the sorted form, which must
  // be in order.
  std::size_t linked_of(const Objects& objects, ObjectId id, LivePair* out,
                        std::size_t room) const noexcept;
  std::size_t sorted_of(ObjectId id, LivePair* out, std::size_t room) const noexcept;

  // What is found goes here, and becomes the pairs by a commit. begun: without slots.
  // make_room() empties both, for so many.
  void make_room(std::size_t begun, std::size_t ended) {
    next_begun_.clear();
    next_ended_.clear();
    next_begun_.reserve(begun);
    next_ended_.reserve(ended);
  }
  List<LivePair>& next_begun() noexcept { return next_begun_; }
  List<LivePair>& next_ended() noexcept { return next_ended_; }

  // Linked: makes the lists of all objects, from the sorted form.
  void link_all(Objects& objects);
  // An object's pairs are walked through in steps, so that each edge can be asked for ahead: the
  // first few are listed.
  struct Walk {
    static constexpr std::uint32_t room = 16;
    ObjectId id;
    std::uint32_t next, count;  // the edge that comes next, or 0
    ObjectId others[room];
    std::uint32_t slots[room];
  };
  void start(Walk& walk, const Objects& objects, ObjectId id) const noexcept {
    walk.id = id;
    walk.next = objects.body(id).first_edge;
    walk.count = 0;
    cpu::prefetch(&edges_[walk.next]);
  }
  // At the end of the list edge 0, again and again: nobody can guess where that is.
  void step(Walk& walk) const noexcept {
    if (walk.count == Walk::room) return;
    const Edge& edge = edges_[walk.next];
    const bool is_second = edge.id[1] == walk.id;
    walk.others[walk.count] = edge.id[!is_second];
    walk.slots[walk.count] = walk.next - 1;
    walk.count += walk.next != 0;
    walk.next = edge.next[is_second];
    cpu::prefetch(&edges_[walk.next]);
  }
  // Calls f(other, slot) for all pairs of the object, listed or not.
  template <class F>
  void each_pair(const Walk& walk, F&& f) const;
  // Takes what was found, in any order, into the linked form; the sorted one follows when asked.
  void commit_linked(Objects& objects);
  // All pairs in canonical order: finds what began and ended, and takes them as the sorted form,
  // on so many tasks. The linked form is lost.
  void commit_sorted(const Pair* pairs, std::size_t count, std::size_t id_limit,
                     const Executor& executor, unsigned tasks);
  // Nothing began or ended.
  void commit_nothing() noexcept;

  void reserve_for(const PairSet& other);
  void copy(const PairSet& other) noexcept;

 private:
  // That of a slot has the number after it. Edge 0 is of no pair: where a list ends.
  struct Edge {
    ObjectId id[2];  // the first one's none: a free slot
    std::uint32_t next[2], previous[2];
  };
  // What the sorted form holds: all pairs; those before the last commit; or neither.
  enum class Sorted : std::uint8_t { now, before, lost };

  void reserve_slots(std::size_t begun);
  // Of the pairs that begin in a commit that which so many come before.
  std::uint32_t slot_for(std::size_t taken) const noexcept;
  void link(Objects& objects, const LivePair& pair) noexcept;
  void unlink(Objects& objects, std::uint32_t slot) noexcept;
  void prefetch_neighbours(std::uint32_t slot) const noexcept;
  // Which the next in the list of one of its objects has before it. Edge 0 may have any.
  std::uint32_t& before_next(const Edge& edge, int side) noexcept {
    Edge& next = edges_[edge.next[side]];
    return next.previous[next.id[1] == edge.id[side]];
  }
  void finish(std::size_t begun, std::size_t ended, Sorted sorted) noexcept;

  List<Edge> edges_;
  List<std::uint32_t> free_slots_;
  List<LivePair> sorted_, spare_;
  List<LivePair> begun_, ended_, next_begun_, next_ended_;
  std::size_t count_ = 0, slot_limit_ = 0;
  Sorted state_ = Sorted::now;
};

template <class F>
void PairSet::each_pair(const Walk& walk, F&& f) const {
  for (std::uint32_t k = 0; k < walk.count; ++k) f(walk.others[k], walk.slots[k]);
  for (std::uint32_t e = walk.next; e != 0;) {
    const Edge& edge = edges_[e];
    const bool is_second = edge.id[1] == walk.id;
    f(edge.id[!is_second], e - 1);
    e = edge.next[is_second];
  }
}

}  // namespace throng::live
