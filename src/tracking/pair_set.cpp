#include "tracking/pair_set.hpp"

#include <algorithm>
#include <utility>

#include "base/threads.hpp"
#include "tracking/merge_pairs.hpp"
#include "tracking/radix_sort.hpp"

namespace throng::tracking {
namespace {

// Prefetch distances: edges, in events; slots, in pairs.
constexpr std::size_t ahead = 8, slots_ahead = 16;

}  // namespace

PairSet::PairSet(base::Memory& memory) noexcept
    : edges_(memory),
      free_slots_(memory),
      sorted_(memory),
      scratch_(memory),
      begun_(memory),
      ended_(memory),
      next_begun_(memory),
      next_ended_(memory) {}

void PairSet::reserve_slots(std::size_t begun) {
  const std::size_t fresh = begun > free_slots_.size() ? begun - free_slots_.size() : 0;
  const std::size_t limit = slot_limit_ + fresh;
  if (limit >= none) throw base::AllocationFailed{limit * sizeof(Edge)};
  free_slots_.reserve(limit);
}

// Free slots, last to first, then new ones.
std::uint32_t PairSet::slot_for(std::size_t taken) const noexcept {
  const std::size_t free = free_slots_.size();
  return taken < free ? free_slots_[free - 1 - taken]
                      : static_cast<std::uint32_t>(slot_limit_ + (taken - free));
}

void PairSet::link(Objects& objects, const LivePair& pair) noexcept {
  const std::uint32_t e = pair.slot + 1;
  Edge& edge = edges_[e];
  edge.id[0] = pair.first;
  edge.id[1] = pair.second;
  for (int side = 0; side < 2; ++side) {
    std::uint32_t& head = objects.body(edge.id[side]).first_edge;
    edge.next[side] = head;
    edge.previous[side] = 0;
    back_link_of_next(edge, side) = e;
    head = e;
  }
}

void PairSet::unlink(Objects& objects, std::uint32_t slot) noexcept {
  Edge& edge = edges_[slot + 1];
  for (int side = 0; side < 2; ++side) {
    const ObjectId id = edge.id[side];
    const std::uint32_t next = edge.next[side], previous = edge.previous[side];
    back_link_of_next(edge, side) = previous;
    if (previous != 0)
      edges_[previous].next[edges_[previous].id[1] == id] = next;
    else
      objects.body(id).first_edge = next;
  }
  edge.id[0] = none;
}

void PairSet::prefetch_neighbours(std::uint32_t slot) const noexcept {
  const Edge& edge = edges_[slot + 1];
  for (const std::uint32_t other : {edge.next[0], edge.next[1], edge.previous[0], edge.previous[1]})
    base::prefetch(&edges_[other]);
}

void PairSet::link_all(Objects& objects) {
  edges_.reserve(slot_limit_ + 1);
  const PodVector<LivePair>& all = sorted(objects.limit());  // may read the edges
  edges_.resize(slot_limit_ + 1);
  for (Edge& edge : edges_) edge = {{none, none}, {0, 0}, {0, 0}};
  for (std::size_t id = 0; id < objects.limit(); ++id) {
    objects.body(static_cast<ObjectId>(id)).first_edge = 0;
  }
  for (const LivePair& pair : all) link(objects, pair);
}

// Completes a commit. The slots of ended pairs were appended to the free ones, so pairs that begin
// in the same commit never get them.
void PairSet::finish(std::size_t begun, std::size_t ended, Sorted sorted) noexcept {
  const std::size_t free = free_slots_.size(), used = std::min(begun, free);
  std::uint32_t* const fresh = free_slots_.data() + free;
  std::copy(fresh, fresh + ended, fresh - used);
  free_slots_.resize(free - used + ended);
  slot_limit_ += begun - used;
  count_ = count_ + begun - ended;
  state_ = sorted;
}

void PairSet::commit_linked(Objects& objects) {
  const std::size_t begun = next_begun_.size(), ended = next_ended_.size();
  if (begun + ended == 0) return commit_nothing();
  const std::size_t count = count_ + begun - ended;
  reserve_slots(begun);
  edges_.reserve(slot_limit_ + 1 + begun);
  sorted_.reserve(std::max({count, begun, ended}));
  scratch_.reserve(std::max({count, begun, ended}));
  // Nothing fails from here on.
  sort_pairs(next_begun_.data(), scratch_.data(), begun, objects.limit());
  sort_pairs(next_ended_.data(), scratch_.data(), ended, objects.limit());
  edges_.resize(slot_limit_ + 1 + begun - std::min(begun, free_slots_.size()));
  for (std::size_t i = 0; i < ended; ++i) {
    if (i + ahead < ended) prefetch_neighbours(next_ended_[i + ahead].slot);
    unlink(objects, next_ended_[i].slot);
    free_slots_[free_slots_.size() + i] = next_ended_[i].slot;
  }
  for (std::size_t i = 0; i < begun; ++i) {
    if (i + ahead < begun) {
      const LivePair& soon = next_begun_[i + ahead];
      for (const ObjectId id : {soon.first, soon.second})
        base::prefetch(&edges_[objects.body(id).first_edge]);
    }
    LivePair& pair = next_begun_[i];
    pair.slot = slot_for(i);
    link(objects, pair);
  }
  begun_.swap(next_begun_);
  ended_.swap(next_ended_);
  finish(begun, ended, state_ == Sorted::current ? Sorted::previous : Sorted::invalid);
}

void PairSet::commit_nothing() noexcept {
  if (state_ == Sorted::previous) state_ = Sorted::invalid;
  begun_.clear();
  ended_.clear();
}

void PairSet::commit_sorted(const Pair* pairs, std::size_t count, std::size_t id_limit,
                            const Executor& executor, unsigned tasks) {
  sorted(id_limit);
  reserve_events(count, count_);
  scratch_.reserve(count);
  const MergeInput in{pairs, count, sorted_.data(), count_};
  const MergeOutput out{scratch_.data(), next_begun_.data(), next_ended_.data()};
  MergePart parts[max_merge_parts];
  const unsigned part_count = divide(in, tasks, parts);
  base::parallel_for(
      executor, std::min(tasks, part_count / 2), part_count / 2,
      [&](std::size_t p, unsigned) { merge(in, out, parts[2 * p], parts[2 * p + 1]); });
  std::size_t begun = 0, ended = 0;
  for (MergePart* part = parts; part != parts + part_count; ++part) {
    part->begun_before = std::exchange(begun, begun + part->begun);
    part->ended_before = std::exchange(ended, ended + part->ended);
  }
  reserve_slots(begun);
  sorted_.reserve(count);
  begun_.reserve(begun);
  ended_.reserve(ended);
  // Nothing fails from here on.
  base::parallel_for(executor, std::min(tasks, part_count), part_count,
                     [&](std::size_t p, unsigned) {
                       const MergePart& part = parts[p];
                       for (std::size_t k = 0; k < part.begun; ++k) {
                         const LivePair* const pair = next_begun_.data() + part.begin + k;
                         const std::size_t taken = part.begun_before + k;
                         base::prefetch_l1(pair + base::pairs_ahead);
                         base::prefetch(begun_.data() + taken + base::pairs_ahead);
                         if (k + slots_ahead < part.begun)
                           base::prefetch(&scratch_[pair[slots_ahead].slot]);
                         const std::uint32_t slot = slot_for(taken);
                         scratch_[pair->slot].slot = slot;
                         begun_[taken] = {pair->first, pair->second, slot};
                       }
                       for (std::size_t k = 0; k < part.ended; ++k) {
                         const LivePair& pair = next_ended_[part.existing_begin + k];
                         ended_[part.ended_before + k] = pair;
                         free_slots_[free_slots_.size() + part.ended_before + k] = pair.slot;
                       }
                     });
  begun_.resize(begun);
  ended_.resize(ended);
  scratch_.resize(count);
  sorted_.swap(scratch_);
  finish(begun, ended, Sorted::current);
}

const PodVector<LivePair>& PairSet::sorted(std::size_t id_limit) noexcept {
  if (state_ == Sorted::previous) {
    // One merge: the previous pairs without the ended ones, and the begun ones.
    std::size_t b = 0, e = 0;
    scratch_.clear();
    for (const LivePair& pair : sorted_) {
      if (e < ended_.size() && ended_[e].slot == pair.slot && key_of(ended_[e]) == key_of(pair)) {
        ++e;
        continue;
      }
      while (b < begun_.size() && pair_less(begun_[b], pair)) scratch_.push(begun_[b++]);
      scratch_.push(pair);
    }
    while (b < begun_.size()) scratch_.push(begun_[b++]);
    sorted_.swap(scratch_);
  } else if (state_ == Sorted::invalid) {
    sorted_.clear();
    for (std::size_t e = 1; e < edges_.size(); ++e) {
      const Edge& edge = edges_[e];
      if (edge.id[0] != none)
        sorted_.push({edge.id[0], edge.id[1], static_cast<std::uint32_t>(e - 1)});
    }
    sort_pairs(sorted_.data(), scratch_.data(), sorted_.size(), id_limit);
  }
  state_ = Sorted::current;
  return sorted_;
}

std::size_t PairSet::pairs_by_links(const Objects& objects, ObjectId id, LivePair* out,
                                    std::size_t capacity) const noexcept {
  std::size_t count = 0;
  for (std::uint32_t e = objects.body(id).first_edge; e != 0; ++count) {
    const Edge& edge = edges_[e];
    if (count < capacity) out[count] = {edge.id[0], edge.id[1], e - 1};
    e = edge.next[edge.id[1] == id];
  }
  if (count <= capacity) std::sort(out, out + count, pair_less);
  return count;
}

std::size_t PairSet::pairs_by_scan(ObjectId id, LivePair* out,
                                   std::size_t capacity) const noexcept {
  std::size_t count = 0;
  const auto take = [&](const LivePair& pair) {
    if (count < capacity) out[count] = pair;
    ++count;
  };
  const LivePair* pair = sorted_.begin();
  for (; pair != sorted_.end() && pair->first < id; ++pair) {
    if (pair->second == id) take(*pair);
  }
  for (; pair != sorted_.end() && pair->first == id; ++pair) take(*pair);
  return count;
}

void PairSet::reserve_for(const PairSet& other) {
  edges_.reserve(other.edges_.size());
  free_slots_.reserve(other.slot_limit_);
  sorted_.reserve(std::max(other.sorted_.size(), other.count_));
  scratch_.reserve(std::max(other.sorted_.size(), other.count_));
  begun_.reserve(other.begun_.size());
  ended_.reserve(other.ended_.size());
}

void PairSet::copy(const PairSet& other) noexcept {
  edges_.copy(other.edges_);
  free_slots_.copy(other.free_slots_);
  sorted_.copy(other.sorted_);
  begun_.copy(other.begun_);
  ended_.copy(other.ended_);
  count_ = other.count_;
  slot_limit_ = other.slot_limit_;
  state_ = other.state_;
}

}  // namespace throng::tracking
