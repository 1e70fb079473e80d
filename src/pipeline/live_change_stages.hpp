// Pairs that begin and end: how they are gathered in canonical order, and given their slots.
//
// A list is looked at in tiles of so many. A tile's changes are written somewhere among those of
// others, in their own order, those that begin first; it notes where, and how many. Sums of these
// numbers tell where each tile's changes stand among all that begin, and that end.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "pipeline/live_object_stages.hpp"

namespace throng::pipeline {

THRONG_HD inline std::uint64_t pair_key(std::uint32_t first, std::uint32_t second) noexcept {
  return std::uint64_t{first} << 32 | second;
}
template <class P>
THRONG_HD std::uint64_t pair_key(const P& p) noexcept {
  return pair_key(p.first, p.second);
}

// A list in canonical order, of Pair or LivePair.
template <class P>
struct Sorted {
  P* pairs;
  std::uint64_t count;

  // How many come before it.
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
  // Where it stands; null: nowhere.
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

// Where a gathering goes, or some one after the other. What does not fit is counted alone.
struct Tiles {
  static constexpr std::uint32_t size = 256;  // a warp's: eight looks of each lane

  Pair* out;
  std::uint64_t capacity;
  std::uint32_t* begins;  // how many, a tile of `tiles`; behind these, how many end; and one more
  std::uint32_t* bases;   // where they stand, a tile
  std::uint64_t tiles;
  Changed* told;

  static constexpr std::uint64_t of(std::uint64_t count) noexcept {
    return (count + size - 1) / size;
  }
  // For a gathering behind one of so many.
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

// A thread goes through every so many of a tile's changes; after the sums of `begins` were made.
struct TileWalk {
  static constexpr std::uint32_t threads = 32;  // a tile

  const Pair* changes;
  const std::uint32_t *sums, *bases;
  std::uint64_t tiles;

  std::uint64_t count() const noexcept { return tiles * threads; }
  // f(pair, place among all that begin).
  template <class F>
  THRONG_HD void begun(std::uint64_t i, const F& f) const noexcept {
    const std::uint64_t tile = i / threads;
    const std::uint32_t at = sums[tile], n = sums[tile + 1] - at;
    for (auto k = static_cast<std::uint32_t>(i % threads); k < n; k += threads)
      f(changes[bases[tile] + k], at + k);
  }
  // f(pair, place among all that end).
  template <class F>
  THRONG_HD void ended(std::uint64_t i, const F& f) const noexcept {
    const std::uint64_t tile = i / threads;
    const std::uint32_t at = sums[tiles + tile], n = sums[tiles + tile + 1] - at;
    const std::uint32_t skipped = sums[tile + 1] - sums[tile];
    for (auto k = static_cast<std::uint32_t>(i % threads); k < n; k += threads)
      f(changes[bases[tile] + skipped + k], at - sums[tiles] + k);
  }
};

// Slots that became free last are the first to be given again, in the order of the pairs.
struct GiveSlots {
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
// They are free for the next update.
struct TakeSlots {
  TileWalk walk;
  Candidates before, now;     // these may be the same
  std::uint32_t* free_slots;  // behind those that stay
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

}  // namespace throng::pipeline
