// Pairs of persistent objects on a device: the per-thread steps of an update. Candidates are all
// pairs of fat boxes that the filters allow, sorted, each with the slot of its pair if it is a pair
// now. While no box leaves its fat box, all pairs are candidates:
//   a pair overlaps; each box lies in its fat box; so the fat boxes overlap.
// An update compares the candidates again and lists the changes. If boxes left their fat boxes, the
// candidates are first found again, and inherit the slots of the old ones.
// Most pairs overlap so far that they need no comparison. Each object has an inner box too, which
// stays inside its box until the box leaves. If two inner boxes overlap, the objects are a pair:
//   a.lower <= inner a.lower <= inner b.upper <= b.upper, and so on all sides, without rounding.
// The other candidates are uncertain. Once they are listed, an update compares no others.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "device/list_search.hpp"
#include "device/pair_event_stages.hpp"

namespace throng::device {

// The uncertain candidates, each with a flag for being a pair now: the top bit of the first id,
// which no id has. Valid for these candidates and fat boxes while no object becomes inactive or
// active.
struct UncertainList {
  static constexpr std::uint32_t is_pair = 0x80000000u;
  Pair* pairs;
  std::uint64_t capacity;
  const EventCounts* report;  // of the gathering; there may be too many to list

  THRONG_HD bool listed() const noexcept { return pairs && report->count <= capacity; }
};
struct FindUncertain {
  Candidates candidates;
  ObjectView objects;
  THRONG_HD std::uint64_t count() const noexcept { return candidates.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    const LivePair c = candidates.pairs[i];
    pair = {c.first | (c.slot != no_slot ? UncertainList::is_pair : 0), c.second};
    Box a, b;
    const bool is_certain =
        has_inner_box(c.first, a) && has_inner_box(c.second, b) && base::overlaps(a, b);
    return is_certain ? Change::none : Change::begins;
  }

 private:
  // Returns false if the box does not contain its inner box: inactive boxes, and boxes at
  // coordinates where floats are coarser than the margin.
  THRONG_HD bool has_inner_box(std::uint32_t id, Box& box) const noexcept {
    const Box now = load_box(objects.boxes + id);
    box = objects.inner_box(load_box(objects.fat + id));
    return base::is_active(now) && objects.inside(box, objects.grown(now));
  }
};
// Stores them in order.
struct StoreUncertain {
  TileWalk walk;
  UncertainList list;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    if (!list.listed()) return;
    walk.begun(index, [&](const Pair& p, std::uint32_t i) { list.pairs[i] = p; });
  }
};

THRONG_HD inline bool are_pair(const ObjectView& objects, const Pair& p) noexcept {
  const Box a = load_box(objects.boxes + p.first), b = load_box(objects.boxes + p.second);
  return base::is_active(a) && base::is_active(b) &&
         base::overlaps(objects.grown(a), objects.grown(b));
}
THRONG_HD inline bool has_mover(const ObjectView& objects, const Pair& p) noexcept {
  return ((objects.state[p.first] | objects.state[p.second]) & moved_bit) != 0;
}

// Candidates that became a pair or ceased to be one. Launched after CheckAll without reading its
// report: `report` decides on the device whether to compare and whether these candidates are valid.
struct Retest {
  Candidates candidates;
  ObjectView objects;
  const CheckReport* report;  // null: unconditional
  bool nan_allowed, moved_before;
  // The list, if it exists and is valid; updated here.
  UncertainList uncertain{};
  bool all_listed = false;  // most of them have moved: skipping the test of moved bits is cheaper

  THRONG_HD std::uint64_t count() const noexcept {
    const std::uint64_t all = by_list() ? uncertain.report->count : candidates.count;
    if (!report) return all;
    const bool wanted =
        report->good(nan_allowed) && !report->left && (report->moved || moved_before);
    return wanted ? all : 0;
  }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    bool was_pair;
    const bool listed = by_list();
    if (listed) {
      pair = uncertain.pairs[i];
      was_pair = (pair.first & UncertainList::is_pair) != 0;
      pair.first &= ~UncertainList::is_pair;
    } else {
      const LivePair c = candidates.pairs[i];
      pair = {c.first, c.second};
      was_pair = c.slot != no_slot;
    }
    if (!(listed && all_listed) && !has_mover(objects, pair)) return Change::none;
    ++compared;
    const bool is_pair = are_pair(objects, pair);
    if (is_pair == was_pair) return Change::none;
    if (listed) uncertain.pairs[i].first = pair.first | (is_pair ? UncertainList::is_pair : 0);
    return is_pair ? Change::begins : Change::ends;
  }

 private:
  THRONG_HD bool by_list() const noexcept {
    return uncertain.listed() && !(report && report->activity_changed);
  }
};

// When new candidates replace the old ones: begun pairs, among the new, and ended pairs, among the
// old. If few boxes left theirs, pairs of objects that did not move are unchanged.
struct FindBegun {
  Candidates now;
  ObjectView objects;
  // If few boxes left theirs: the number of old candidates kept, and of fresh ones. Otherwise null.
  const std::uint32_t* kept;
  std::uint64_t fresh;
  THRONG_HD std::uint64_t count() const noexcept { return kept ? *kept + fresh : now.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    const LivePair c = now.pairs[i];
    pair = {c.first, c.second};
    if (c.slot != no_slot || (kept && !has_mover(objects, pair))) return Change::none;
    ++compared;
    return are_pair(objects, pair) ? Change::begins : Change::none;
  }
};
struct FindEnded {
  Candidates before, now;
  ObjectView objects;
  bool moved_only;
  bool filters_changed;  // a pair that overlaps may no longer be a candidate
  THRONG_HD std::uint64_t count() const noexcept { return before.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    const LivePair c = before.pairs[i];
    pair = {c.first, c.second};
    if (c.slot == no_slot || (moved_only && !has_mover(objects, pair))) return Change::none;
    ++compared;
    const bool stays = are_pair(objects, pair) && !(filters_changed && !now.find(pair));
    return stays ? Change::none : Change::ends;
  }
};

// The pairs found become the candidates and inherit their slots.
struct CarrySlots {
  const Pair* found;
  Candidates before;
  LivePair* now;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = found[i];
    now[i] = {p.first, p.second, slot_in(before, p)};
  }
};

// Compacts the candidates that are pairs.
struct FlagPairs {
  Candidates candidates;
  std::uint32_t* flags;  // one entry more, for the sum
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    flags[i] = i < candidates.count && candidates.pairs[i].slot != no_slot ? 1u : 0u;
  }
};
struct GatherPairs {
  Candidates candidates;
  const std::uint32_t* sums;
  LivePair* out;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (sums[i + 1] != sums[i]) out[sums[i]] = candidates.pairs[i];
  }
};

}  // namespace throng::device
