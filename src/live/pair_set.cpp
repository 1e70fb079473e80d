#include "live/pair_set.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "cpu/sink.hpp"
#include "cpu/threads.hpp"
#include "live/sort.hpp"

namespace throng::live {
namespace {

// Edges are asked for so many changes ahead.
constexpr std::size_t ahead = 8;

// Of a merge at most so many parts, of which tasks take two by turns.
constexpr unsigned most_parts = 256;

// One of them: new pairs [begin, end), live ones [live_begin, live_end); how many of them begin and
// end, and how many of all parts before it.
struct Part {
  std::size_t begin, end, live_begin, live_end;
  std::size_t begun, ended, begun_before, ended_before;
};

void put(LivePair& to, std::uint64_t ids, std::uint32_t slot) noexcept {
  std::memcpy(&to, &ids, sizeof ids);
  to.slot = slot;
}

// What is merged, and where to: what begins of a part as far on as its new pairs are, and what ends
// as its live ones.
struct Arrays {
  const Pair* pairs;
  const LivePair* live;
  LivePair *out, *begun, *ended;
};

// How far a part's merge has come. A step takes a new pair, that begins, or a live one, that ends,
// or both: so what has begun is steps without live ones, and what has ended steps without new ones.
// All three are counted from the sum of where the part begins.
struct Merge {
  std::size_t i, j, steps;  // new pairs, live ones

  explicit Merge(const Part& part) noexcept
      : i(part.begin), j(part.live_begin), steps(part.begin + part.live_begin) {}

  // The new pair gets the slot that it had if it lived already; one that begins has its index in
  // the place of a slot. No branch on what comes next, as nobody can guess it.
  //
  // The index is cut to 32 bits, and that is enough. Whoever uses it has called reserve_slots()
  // before, which refuses 2^32 - 1 slots or more, and there are as many slots as pairs at least:
  // those that lived keep theirs, and each that begun gets one that is free or new.
  void step(const Arrays& of) noexcept {
    cpu::prefetch_to_stream(of.pairs + i + cpu::pairs_ahead);
    cpu::prefetch_to_stream(of.live + j + cpu::pairs_ahead);
    cpu::prefetch(of.out + i + cpu::pairs_ahead);
    const std::uint64_t p = ids_at(of.pairs + i), l = ids_at(of.live + j);
    const std::uint64_t a = key_of(p), b = key_of(l);
    const std::uint32_t slot = of.live[j].slot;
    put(of.out[i], p, slot);
    put(of.begun[steps - j], p, static_cast<std::uint32_t>(i));
    put(of.ended[steps - i], l, slot);
    i += a <= b;
    j += b <= a;
    ++steps;
  }
  // How many steps can be made whatever comes.
  std::size_t sure(const Part& part) const noexcept {
    return std::min(part.end - i, part.live_end - j);
  }
  // Once nothing is left of one list.
  void finish(const Arrays& of, Part& part) noexcept {
    for (; i < part.end; ++i, ++steps) {
      put(of.out[i], ids_at(of.pairs + i), none);
      put(of.begun[steps - j], ids_at(of.pairs + i), static_cast<std::uint32_t>(i));
    }
    for (; j < part.live_end; ++j, ++steps) of.ended[steps - i] = of.live[j];
    part.begun = steps - j - part.begin;
    part.ended = steps - i - part.live_begin;
  }
};

// In copies of all that is looked at, as no store can change those.
template <class... Merges>
void go_on(const Arrays of, std::size_t count, Merges&... merges) noexcept {
  const auto in_copies = [&](auto... copies) {
    for (; count != 0; --count) (copies.step(of), ...);
    ((merges = copies), ...);
  };
  in_copies(merges...);
}

// Two parts in turn, as the steps of each wait for one another.
void merge(const Arrays& of, Part& first, Part& second) noexcept {
  Merge one(first), two(second);
  while (const std::size_t count = std::min(one.sure(first), two.sure(second)))
    go_on(of, count, one, two);
  while (const std::size_t count = one.sure(first)) go_on(of, count, one);
  while (const std::size_t count = two.sure(second)) go_on(of, count, two);
  one.finish(of, first);
  two.finish(of, second);
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

// What began and ended is told, and the slots of what ended are free, but only for the next commit:
// what began in this one never has the slot of a pair that ends in it.
void PairSet::finish(Sorted sorted) noexcept {
  for (const LivePair& pair : ended_) free_slots_.push(pair.slot);
  count_ = count_ + begun_.size() - ended_.size();
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
  begun_.swap(next_begun_);
  ended_.swap(next_ended_);
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
  // In parts that begin at the same pair in both lists, two by two.
  const auto part_count =
      2 * static_cast<unsigned>(std::min<std::size_t>(
              (count + count_) / 8192 + 1, std::min(tasks == 1 ? 1 : 4 * tasks, most_parts / 2)));
  tasks = std::min(tasks, part_count / 2);
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
  const Arrays arrays{pairs, sorted_.data(), spare_.data(), next_begun_.data(), next_ended_.data()};
  cpu::run_by_turns(executor, tasks, part_count / 2, [&](std::size_t p, unsigned) {
    merge(arrays, parts[2 * p], parts[2 * p + 1]);
  });
  std::size_t begun = 0, ended = 0;
  for (Part* part = parts; part != parts + part_count; ++part) {
    part->begun_before = std::exchange(begun, begun + part->begun);
    part->ended_before = std::exchange(ended, ended + part->ended);
  }
  reserve_slots(begun);
  sorted_.reserve(count);
  begun_.reserve(begun);
  ended_.reserve(ended);
  // From here on nothing fails.
  const std::size_t free = free_slots_.size();
  cpu::run_by_turns(executor, tasks, part_count, [&](std::size_t p, unsigned) {
    const Part& part = parts[p];
    for (std::size_t k = 0; k < part.begun; ++k) {
      const LivePair& pair = next_begun_[part.begin + k];
      const std::size_t taken = part.begun_before + k;
      // Free ones from the last to the first, then new ones.
      const std::uint32_t slot = taken < free
                                     ? free_slots_[free - 1 - taken]
                                     : static_cast<std::uint32_t>(slot_limit_ + (taken - free));
      spare_[pair.slot].slot = slot;
      begun_[taken] = {pair.first, pair.second, slot};
    }
    const LivePair* const from = next_ended_.data() + part.live_begin;
    std::copy(from, from + part.ended, ended_.data() + part.ended_before);
  });
  const std::size_t used = std::min(begun, free);
  free_slots_.resize(free - used);
  slot_limit_ += begun - used;
  begun_.resize(begun);
  ended_.resize(ended);
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
