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

#include "pipeline/live_change_stages.hpp"

namespace throng::pipeline {

// Adapts a list to the search interface, so that the device gathers the hits: one test per element.
template <class Look>
struct EachOnce {
  Look look;

  THRONG_HD std::uint64_t count() const noexcept { return look.count(); }
  class Walk {
   public:
    THRONG_HD Walk(const Look& look, std::uint64_t i) noexcept : look_(look), i_(i) {}
    THRONG_HD bool over() const noexcept { return over_; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return compared_; }
    THRONG_HD bool step(Pair& pair) noexcept {
      over_ = true;
      return look_(i_, pair, compared_);
    }

   private:
    const Look& look_;
    std::uint64_t i_;
    std::uint32_t compared_ = 0;
    bool over_ = false;
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(look, i); }
};

// The uncertain candidates, each with a flag for being a pair now: the top bit of the first id,
// which no id has. Valid for these candidates and fat boxes while no object becomes inactive or
// active.
struct Doubtful {
  static constexpr std::uint32_t is_pair = 0x80000000u;
  Pair* pairs;
  std::uint64_t capacity;
  const Changed* told;  // of the gathering; there may be too many to list

  THRONG_HD bool listed() const noexcept { return pairs && told->count <= capacity; }
};
struct LookForDoubtful {
  Candidates candidates;
  LiveView live;
  THRONG_HD std::uint64_t count() const noexcept { return candidates.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    const LivePair c = candidates.pairs[i];
    pair = {c.first | (c.slot != no_slot ? Doubtful::is_pair : 0), c.second};
    Box a, b;
    const bool sure = lean(c.first, a) && lean(c.second, b) && core::overlaps(a, b);
    return sure ? Change::none : Change::begins;
  }

 private:
  // Returns false if the box does not contain its inner box: inactive boxes, and boxes at
  // coordinates where floats are coarser than the margin.
  THRONG_HD bool lean(std::uint32_t id, Box& box) const noexcept {
    const Box now = load_box(live.boxes + id);
    box = live.lean_box(load_box(live.fat + id));
    return core::is_active(now) && live.inside(box, live.grown(now));
  }
};
// Stores them in order.
struct ListDoubtful {
  TileWalk walk;
  Doubtful list;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    if (!list.listed()) return;
    walk.begun(index, [&](const Pair& p, std::uint32_t i) { list.pairs[i] = p; });
  }
};

THRONG_HD inline bool are_pair(const LiveView& live, const Pair& p) noexcept {
  const Box a = load_box(live.boxes + p.first), b = load_box(live.boxes + p.second);
  return core::is_active(a) && core::is_active(b) && core::overlaps(live.grown(a), live.grown(b));
}
THRONG_HD inline bool has_mover(const LiveView& live, const Pair& p) noexcept {
  return ((live.state[p.first] | live.state[p.second]) & moved_bit) != 0;
}

// Candidates that became a pair or ceased to be one. Launched after CheckAll without reading its
// report: `told` decides on the device whether to compare and whether these candidates are valid.
struct Retest {
  Candidates candidates;
  LiveView live;
  const Checked* told;  // null: unconditional
  bool nan_allowed, moved_before;
  // The list, if it exists and is valid; updated here.
  Doubtful doubtful{};
  bool all_listed = false;  // most of them have moved: skipping the test of moved bits is cheaper

  THRONG_HD std::uint64_t count() const noexcept {
    const std::uint64_t all = by_list() ? doubtful.told->count : candidates.count;
    if (!told) return all;
    const bool wanted = told->good(nan_allowed) && !told->left && (told->moved || moved_before);
    return wanted ? all : 0;
  }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    bool was_pair;
    const bool listed = by_list();
    if (listed) {
      pair = doubtful.pairs[i];
      was_pair = (pair.first & Doubtful::is_pair) != 0;
      pair.first &= ~Doubtful::is_pair;
    } else {
      const LivePair c = candidates.pairs[i];
      pair = {c.first, c.second};
      was_pair = c.slot != no_slot;
    }
    if (!(listed && all_listed) && !has_mover(live, pair)) return Change::none;
    ++compared;
    const bool is_pair = are_pair(live, pair);
    if (is_pair == was_pair) return Change::none;
    if (listed) doubtful.pairs[i].first = pair.first | (is_pair ? Doubtful::is_pair : 0);
    return is_pair ? Change::begins : Change::ends;
  }

 private:
  THRONG_HD bool by_list() const noexcept { return doubtful.listed() && !(told && told->gone); }
};

// When new candidates replace the old ones: begun pairs, among the new, and ended pairs, among the
// old. If few boxes left theirs, pairs of objects that did not move are unchanged.
struct LookForBegun {
  Candidates now;
  LiveView live;
  // If few boxes left theirs: the number of old candidates kept, and of fresh ones. Otherwise null.
  const std::uint32_t* kept;
  std::uint64_t fresh;
  THRONG_HD std::uint64_t count() const noexcept { return kept ? *kept + fresh : now.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    const LivePair c = now.pairs[i];
    pair = {c.first, c.second};
    if (c.slot != no_slot || (kept && !has_mover(live, pair))) return Change::none;
    ++compared;
    return are_pair(live, pair) ? Change::begins : Change::none;
  }
};
struct LookForEnded {
  Candidates before, now;
  LiveView live;
  bool movers_alone;
  bool refiltered;  // a pair that overlaps may no longer be a candidate
  THRONG_HD std::uint64_t count() const noexcept { return before.count; }
  THRONG_HD Change operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
    const LivePair c = before.pairs[i];
    pair = {c.first, c.second};
    if (c.slot == no_slot || (movers_alone && !has_mover(live, pair))) return Change::none;
    ++compared;
    const bool stays = are_pair(live, pair) && !(refiltered && !now.find(pair));
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
struct FlagLive {
  Candidates candidates;
  std::uint32_t* flags;  // one entry more, for the sum
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    flags[i] = i < candidates.count && candidates.pairs[i].slot != no_slot ? 1u : 0u;
  }
};
struct GatherLive {
  Candidates candidates;
  const std::uint32_t* sums;
  LivePair* out;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (sums[i + 1] != sums[i]) out[sums[i]] = candidates.pairs[i];
  }
};

}  // namespace throng::pipeline
