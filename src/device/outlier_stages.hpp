// If few objects left their fat boxes: the per-thread steps that repair the candidates instead of
// finding all again. An outlier is an object whose fat box has changed since all candidates were
// found last, so that its place in that grid is invalid. Let L be the objects that left just now;
// all of them are outliers. Candidates without an object of L stay. A candidate with one is
//   - with an object that is no outlier: found in the old grid, which still is valid for that one;
//   - with an outlier: found among the outliers, which are binned into a small grid of their own.
#pragma once

#include <cstdint>

#include "device/pair_update_stages.hpp"

namespace throng::device {

// Objects that left their fat boxes, as pairs (id, 0).
struct FindEscaped {
  ObjectView objects;
  std::uint64_t bound() const noexcept { return objects.limit; }
  THRONG_HD std::uint64_t count() const noexcept { return objects.limit; }
  THRONG_HD bool operator()(std::uint64_t index, Pair& pair, std::uint32_t&) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    pair = {i, 0};
    constexpr std::uint8_t both = alive_bit | moved_bit;
    return (objects.state[i] & both) == both && !objects.holds(i, load_box(objects.boxes + i));
  }
};
// Launched without reading the number of objects found: does nothing if they are too many.
struct FattenEscaped {
  ObjectView objects;
  const Pair* escaped;
  const Report* found;
  std::uint64_t most;
  Record* queries;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i >= found->found || found->found > most) return;
    const std::uint32_t id = escaped[i].first;
    const Box fat = objects.fat_box(load_box(objects.boxes + id));
    objects.fat[id] = fat;
    objects.state[id] |= outlier_bit | escaped_bit;
    queries[i] = Record{fat.lower, id, fat.upper, 0};
  }
};

struct FindOutliers {
  ObjectView objects;
  std::uint64_t bound() const noexcept { return objects.limit; }
  THRONG_HD std::uint64_t count() const noexcept { return objects.limit; }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    pair = {static_cast<std::uint32_t>(i), 0};
    return (objects.state[i] & (alive_bit | outlier_bit)) == (alive_bit | outlier_bit);
  }
};
struct GatherOutliers {
  ObjectView objects;
  const Pair* outliers;
  Box* boxes;
  Filter* filters;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const std::uint32_t id = outliers[i].first;
    boxes[i] = load_box(objects.fat + id);
    filters[i] = {objects.group ? objects.group[id] : ~0u, objects.mask ? objects.mask[id] : ~0u,
                  objects.owner ? objects.owner[id] : -1, -1,
                  objects.is_static ? objects.is_static[id] : std::uint8_t{0}};
  }
};
// Pairs of outliers one of which left just now.
struct FindOutlierPairs {
  ObjectView objects;
  const Pair* outliers;
  const Pair* found;
  const Report* report;  // of these pairs; if more than `capacity` were found, none is examined
  std::uint64_t capacity;
  std::uint64_t bound() const noexcept { return capacity; }
  THRONG_HD std::uint64_t count() const noexcept {
    return report->found <= capacity ? report->found : 0;
  }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    const std::uint32_t a = outliers[found[i].first].first, b = outliers[found[i].second].first;
    pair = a < b ? Pair{a, b} : Pair{b, a};
    return ((objects.state[a] | objects.state[b]) & escaped_bit) != 0;
  }
};

// Merges the kept candidates and the fresh ones into one sorted list: each element's place is its
// rank in its own list plus its rank in the other. No pair is in both.
struct FlagKept {
  Candidates before;
  const std::uint8_t* state;
  std::uint32_t* flags;  // one entry more, for the sum
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    flags[i] = 0;
    if (i >= before.count) return;
    const LivePair c = before.pairs[i];
    flags[i] = ((state[c.first] | state[c.second]) & escaped_bit) == 0 ? 1u : 0u;
  }
};
struct MergeKept {
  Candidates before;
  Sorted<const Pair> fresh;
  const std::uint32_t* sums;
  LivePair* now;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (sums[i + 1] == sums[i]) return;
    const LivePair c = before.pairs[i];
    now[sums[i] + fresh.place(c)] = c;
  }
};
struct MergeFresh {
  Candidates before;
  const Pair* fresh;
  const std::uint32_t* sums;
  LivePair* now;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = fresh[i];
    now[i + sums[before.place(p)]] = {p.first, p.second, slot_in(before, p)};
  }
};

}  // namespace throng::device
