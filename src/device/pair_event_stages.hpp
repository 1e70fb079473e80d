// Begin and end events of pairs: how they are gathered in sorted order and get their slots.
//
// A list is processed in tiles. A tile's changes are written to one contiguous range, at an
// arbitrary place among those of other tiles, sorted, begin events first. The tile records the
// place and the two counts. Prefix sums of these counts give the rank of each tile's changes among
// all begin events and among all end events.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "device/object_stages.hpp"

namespace throng::device {

THRONG_HD inline std::uint64_t pair_key(std::uint32_t first, std::uint32_t second) noexcept {
  return std::uint64_t{first} << 32 | second;
}
template <class P>
THRONG_HD std::uint64_t pair_key(const P& p) noexcept {
  return pair_key(p.first, p.second);
}

// A sorted list of Pair or LivePair.
template <class P>
struct Sorted {
  P* pairs;
  std::uint64_t count;

  // The number of elements before `wanted`.
  template <class Q>
  THRONG_HD std::uint64_t place(const Q& wanted) const noexcept {
    const std::uint64_t key = pair_key(wanted);
    std::uint64_t begin = 0, end = count;
    while (begin < end) {
      const std::uint64_t middle = begin + (end - begin) / 2;
      if (pair_key(pairs[middle]) < key)
        begin = middle + 1;
      else
        end = middle;
    }
    return begin;
  }
  // The element that equals `wanted`, or null.
  template <class Q>
  THRONG_HD P* find(const Q& wanted) const noexcept {
    const std::uint64_t at = place(wanted);
    return at < count && pair_key(pairs[at]) == pair_key(wanted) ? pairs + at : nullptr;
  }
};
using Candidates = Sorted<LivePair>;
THRONG_HD inline std::uint32_t slot_in(const Candidates& list, const Pair& pair) noexcept {
  const LivePair* at = list.find(pair);
  return at ? at->slot : no_slot;
}

enum class Change : std::uint8_t { none, begins, ends };

// The output of one gathering, or of several in succession. Changes beyond the capacity are only
// counted.
struct Tiles {
  static constexpr std::uint32_t size = 256;  // per warp: eight elements per lane

  Pair* out;
  std::uint64_t capacity;
  std::uint32_t*
      begins;            // begin counts of `tiles` tiles, then their end counts, and one entry more
  std::uint32_t* bases;  // place of each tile's changes
  std::uint64_t tiles;
  EventCounts* event_counts;

  static constexpr std::uint64_t of(std::uint64_t count) noexcept {
    return (count + size - 1) / size;
  }
  // The part of a gathering that follows one of `others` tiles.
  Tiles after(std::uint64_t others) const noexcept {
    Tiles t = *this;
    t.begins += others;
    t.bases += others;
    return t;
  }
  THRONG_HD void note(std::uint64_t tile, std::uint64_t base, std::uint32_t begun,
                      std::uint32_t ended) const noexcept {
    bases[tile] = static_cast<std::uint32_t>(base);
    begins[tile] = begun;
    begins[tiles + tile] = ended;
  }
};

// Strided loop of a thread over a tile's changes; after the prefix sums of `begins`.
struct TileWalk {
  static constexpr std::uint32_t threads = 32;  // per tile

  const Pair* changes;
  const std::uint32_t *sums, *bases;
  std::uint64_t tiles;

  std::uint64_t count() const noexcept { return tiles * threads; }
  // f(pair, rank among all begin events).
  template <class F>
  THRONG_HD void begun(std::uint64_t i, const F& f) const noexcept {
    const std::uint64_t tile = i / threads;
    const std::uint32_t at = sums[tile], n = sums[tile + 1] - at;
    for (auto k = static_cast<std::uint32_t>(i % threads); k < n; k += threads)
      f(changes[bases[tile] + k], at + k);
  }
  // f(pair, rank among all end events).
  template <class F>
  THRONG_HD void ended(std::uint64_t i, const F& f) const noexcept {
    const std::uint64_t tile = i / threads;
    const std::uint32_t at = sums[tiles + tile], n = sums[tiles + tile + 1] - at;
    const std::uint32_t skipped = sums[tile + 1] - sums[tile];
    for (auto k = static_cast<std::uint32_t>(i % threads); k < n; k += threads)
      f(changes[bases[tile] + skipped + k], at - sums[tiles] + k);
  }
};

// Assigns slots to begun pairs, in sorted order: most recently freed slots first.
struct AssignSlots {
  TileWalk walk;
  Candidates now;
  const std::uint32_t* free_slots;
  std::uint32_t free_count, slot_limit;
  LivePair* begun;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    walk.begun(index, [&](const Pair& p, std::uint32_t i) {
      const std::uint32_t slot =
          i < free_count ? free_slots[free_count - 1 - i] : slot_limit + i - free_count;
      begun[i] = {p.first, p.second, slot};
      now.find(p)->slot = slot;
    });
  }
};
// Frees the slots of ended pairs for the next update.
struct FreeSlots {
  TileWalk walk;
  Candidates before, now;     // may be the same
  std::uint32_t* free_slots;  // after those that stay free
  LivePair* ended;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    walk.ended(index, [&](const Pair& p, std::uint32_t i) {
      LivePair* at = before.find(p);
      ended[i] = *at;
      free_slots[i] = at->slot;
      if (now.pairs != before.pairs) at = now.find(p);
      if (at) at->slot = no_slot;
    });
  }
};

}  // namespace throng::device
