#include "live/pair_set.hpp"

#include <algorithm>
#include <cstring>

#include "cpu/sink.hpp"
#include "cpu/threads.hpp"
#include "live/sort.hpp"

namespace throng::live {
namespace {

// Edges are asked for so many changes ahead.
constexpr std::size_t ahead = 8;

// Of a merge at most so many parts, which tasks take by turns.
constexpr unsigned most_parts = 256;

// One of them: new pairs [begin, end), live ones [live_begin, live_end).
struct Part {
  std::size_t begin, end, live_begin, live_end;
  std::size_t begun, ended;
};

void put(LivePair& to, std::uint64_t ids, std::uint32_t slot) noexcept {
  std::memcpy(&to, &ids, sizeof ids);
  to.slot = slot;
}

// Writes the new pairs with the slots of those that lived already; begun ones with their index
// instead. No branch on what comes next, as nobody can guess it.
//
// The index is cut to 32 bits, and that is enough. Whoever uses it has called reserve_slots()
// before, which refuses 2^32 - 1 slots or more, and there are as many slots as pairs at least:
// those that lived keep theirs, and each that begun gets one that is free or new.
void merge(const Pair* pairs, const LivePair* live, Part& part, LivePair* out, LivePair* begun,
           LivePair* ended) noexcept {
  std::size_t i = part.begin, j = part.live_begin, begun_count = 0, ended_count = 0;
  while (i < part.end && j < part.live_end) {
    cpu::prefetch_to_stream(pairs + i + cpu::pairs_ahead);
    cpu::prefetch_to_stream(live + j + cpu::pairs_ahead);
    cpu::prefetch(out + i + cpu::pairs_ahead);
    const std::uint64_t p = ids_at(pairs + i), l = ids_at(live + j);
    const std::uint64_t a = key_of(p), b = key_of(l);
    const std::uint32_t slot = live[j].slot;
    put(out[i], p, slot);
    put(begun[begun_count], p, static_cast<std::uint32_t>(i));
    put(ended[ended_count], l, slot);
    begun_count += a < b;
    ended_count += b < a;
    i += a <= b;
    j += b <= a;
  }
  for (; i < part.end; ++i) {
    put(out[i], ids_at(pairs + i), none);
    put(begun[begun_count++], ids_at(pairs + i), static_cast<std::uint32_t>(i));
  }
  for (; j < part.live_end; ++j) ended[ended_count++] = live[j];
  part.begun = begun_count;
  part.ended = ended_count;
}

}  // namespace

PairSet::PairSet(cpu::Memory& memory) noexcept
    : edges_(memory),
      free_slots_(memory),
      sorted_(memory),
      spare_(memory),
      begun_(memory),
      ended_(memory),
      next_begun_(memory),
      next_ended_(memory) {}

void PairSet::reserve_slots(std::size_t begun) {
  const std::size_t fresh = begun > free_slots_.size() ? begun - free_slots_.size() : 0;
  const std::size_t limit = slot_limit_ + fresh;
  if (limit >= none) throw cpu::NoMemory{limit * sizeof(Edge)};
  free_slots_.reserve(limit);
}

std::uint32_t PairSet::take_slot() noexcept {
  return free_slots_.empty() ? static_cast<std::uint32_t>(slot_limit_++) : free_slots_.pop();
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
    before_next(edge, side) = e;
    head = e;
  }
}

void PairSet::unlink(Objects& objects, std::uint32_t slot) noexcept {
  Edge& edge = edges_[slot + 1];
  for (int side = 0; side < 2; ++side) {
    const ObjectId id = edge.id[side];
    const std::uint32_t next = edge.next[side], previous = edge.previous[side];
    before_next(edge, side) = previous;
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
    cpu::prefetch(&edges_[other]);
}

void PairSet::link_all(Objects& objects) {
  edges_.reserve(slot_limit_ + 1);
  const List<LivePair>& all = sorted(objects.limit());  // may yet come from the edges
  edges_.resize(slot_limit_ + 1);
  for (Edge& edge : edges_) edge = {{none, none}, {0, 0}, {0, 0}};
  for (std::size_t id = 0; id < objects.limit(); ++id) {
    objects.body(static_cast<ObjectId>(id)).first_edge = 0;
  }
  for (const LivePair& pair : all) link(objects, pair);
}

// What ended is told and its slots are free, but only for the next commit: what began in this one
// never has the slot of a pair that ends in it.
void PairSet::finish(Sorted sorted) noexcept {
  for (const LivePair& pair : next_ended_) free_slots_.push(pair.slot);
  count_ = count_ + next_begun_.size() - next_ended_.size();
  begun_.swap(next_begun_);
  ended_.swap(next_ended_);
  state_ = sorted;
}

void PairSet::commit_linked(Objects& objects) {
  const std::size_t begun = next_begun_.size(), ended = next_ended_.size();
  if (begun + ended == 0) return commit_nothing();
  const std::size_t count = count_ + begun - ended;
  reserve_slots(begun);
  edges_.reserve(slot_limit_ + 1 + begun);
  sorted_.reserve(std::max({count, begun, ended}));
  spare_.reserve(std::max({count, begun, ended}));
  // From here on nothing fails.
  sort_pairs(next_begun_.data(), spare_.data(), begun, objects.limit());
  sort_pairs(next_ended_.data(), spare_.data(), ended, objects.limit());
  for (std::size_t i = 0; i < ended; ++i) {
    if (i + ahead < ended) prefetch_neighbours(next_ended_[i + ahead].slot);
    unlink(objects, next_ended_[i].slot);
  }
  for (std::size_t i = 0; i < begun; ++i) {
    if (i + ahead < begun) {
      const LivePair& soon = next_begun_[i + ahead];
      for (const ObjectId id : {soon.first, soon.second})
        cpu::prefetch(&edges_[objects.body(id).first_edge]);
    }
    LivePair& pair = next_begun_[i];
    pair.slot = take_slot();
    edges_.resize(slot_limit_ + 1);
    link(objects, pair);
  }
  finish(state_ == Sorted::now ? Sorted::before : Sorted::lost);
}

void PairSet::commit_nothing() noexcept {
  if (state_ == Sorted::before) state_ = Sorted::lost;
  begun_.clear();
  ended_.clear();
}

void PairSet::commit_sorted(const Pair* pairs, std::size_t count, std::size_t id_limit,
                            const Executor& executor, unsigned tasks) {
  sorted(id_limit);
  make_room(count, count_);
  spare_.reserve(count);
  // In parts that begin at the same pair in both lists. Each writes where its own begins.
  const auto part_count = static_cast<unsigned>(std::min<std::size_t>(
      (count + count_) / 8192 + 1, std::min(tasks == 1 ? 1 : 4 * tasks, most_parts)));
  tasks = std::min(tasks, part_count);
  Part parts[most_parts];
  for (unsigned p = 0; p < part_count; ++p) {
    Part& part = parts[p];
    part.begin = p == 0 ? 0 : parts[p - 1].end;
    part.live_begin = p == 0 ? 0 : parts[p - 1].live_end;
    part.end = count / part_count * (p + 1);
    if (p + 1 == part_count || part.end == 0) part.end = count;
    part.live_end = count_;
    if (part.end < count) {
      const LivePair next{pairs[part.end].first, pairs[part.end].second, 0};
      part.live_end = static_cast<std::size_t>(
          std::lower_bound(sorted_.begin(), sorted_.end(), next, before) - sorted_.begin());
    }
  }
  cpu::run_by_turns(executor, tasks, part_count, [&](std::size_t p, unsigned) {
    merge(pairs, sorted_.data(), parts[p], spare_.data(), next_begun_.data() + parts[p].begin,
          next_ended_.data() + parts[p].live_begin);
  });
  std::size_t begun = 0, ended = 0;
  for (unsigned p = 0; p < part_count; ++p) {
    const LivePair* from = next_begun_.data() + parts[p].begin;
    std::copy(from, from + parts[p].begun, next_begun_.data() + begun);
    from = next_ended_.data() + parts[p].live_begin;
    std::copy(from, from + parts[p].ended, next_ended_.data() + ended);
    begun += parts[p].begun;
    ended += parts[p].ended;
  }
  next_begun_.resize(begun);
  next_ended_.resize(ended);
  reserve_slots(begun);
  sorted_.reserve(count);
  // From here on nothing fails.
  for (LivePair& pair : next_begun_) {
    const std::uint32_t slot = take_slot();
    spare_[pair.slot].slot = slot;
    pair.slot = slot;
  }
  spare_.resize(count);
  sorted_.swap(spare_);
  finish(Sorted::now);
}

const List<LivePair>& PairSet::sorted(std::size_t id_limit) noexcept {
  if (state_ == Sorted::before) {
    // One merge: the old ones but for those that ended, and those that began.
    std::size_t b = 0, e = 0;
    spare_.clear();
    for (const LivePair& pair : sorted_) {
      if (e < ended_.size() && ended_[e].slot == pair.slot && key_of(ended_[e]) == key_of(pair)) {
        ++e;
        continue;
      }
      while (b < begun_.size() && before(begun_[b], pair)) spare_.push(begun_[b++]);
      spare_.push(pair);
    }
    while (b < begun_.size()) spare_.push(begun_[b++]);
    sorted_.swap(spare_);
  } else if (state_ == Sorted::lost) {
    sorted_.clear();
    for (std::size_t e = 1; e < edges_.size(); ++e) {
      const Edge& edge = edges_[e];
      if (edge.id[0] != none)
        sorted_.push({edge.id[0], edge.id[1], static_cast<std::uint32_t>(e - 1)});
    }
    sort_pairs(sorted_.data(), spare_.data(), sorted_.size(), id_limit);
  }
  state_ = Sorted::now;
  return sorted_;
}

void PairSet::reserve_for(const PairSet& other) {
  edges_.reserve(other.edges_.size());
  free_slots_.reserve(other.slot_limit_);
  sorted_.reserve(std::max(other.sorted_.size(), other.count_));
  spare_.reserve(std::max(other.sorted_.size(), other.count_));
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

}  // namespace throng::live
