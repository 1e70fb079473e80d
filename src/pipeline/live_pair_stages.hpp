// Pairs that live on a device: what one thread does of an update. Candidates are all pairs of fat
// boxes that filters allow, in canonical order, each with the slot of the pair that it is, if it is
// one now. While no box leaves its fat box, the pairs are among them:
//   a pair overlaps; each box lies in its fat box; so the fat boxes overlap, and it is a candidate.
// An update compares the candidates again and lists those that changed; where boxes left theirs,
// the candidates are found anew first, and take over the slots of those before.
// Most pairs overlap by so much that they need not be compared. Each object has a lean box, too,
// which lies in its box while that does not leave. Where those of two objects overlap, they are a
// pair whatever they do:
//   a.lower <= lean a.lower <= lean b.upper <= b.upper, and so on all sides, without rounding.
// The other candidates are in doubt; once there is a list of them, an update compares no others.
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

// As a search, so that whoever runs it gathers the hits: one look at each of a list.
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

// Candidates that are in doubt, each with whether it is a pair now: the top bit of the first id,
// which no id has. Good for these candidates and fat boxes while no object turns.
struct Doubtful {
  static constexpr std::uint32_t is_pair = 0x80000000u;
  Pair* pairs;
  std::uint64_t capacity;
  const Report* report;  // of the search that listed them; they may be too many to be listed

  THRONG_HD bool listed() const noexcept { return pairs && report->found <= capacity; }
};
struct LookForDoubtful {
  Candidates candidates;
  LiveView live;
  std::uint64_t bound() const noexcept { return candidates.count; }
  THRONG_HD std::uint64_t count() const noexcept { return candidates.count; }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    const LivePair c = candidates.pairs[i];
    pair = {c.first | (c.slot != no_slot ? Doubtful::is_pair : 0), c.second};
    Box a, b;
    return !(lean(c.first, a) && lean(c.second, b) && core::overlaps(a, b));
  }

 private:
  // False where the object does not hold it: one that is inactive, or so far out that floats do not
  // tell them apart.
  THRONG_HD bool lean(std::uint32_t id, Box& box) const noexcept {
    const Box now = load_box(live.boxes + id);
    box = live.lean_box(load_box(live.fat + id));
    return core::is_active(now) && live.inside(box, live.grown(now));
  }
};

// Candidates that became a pair, or are one no longer. Put behind CheckAll without a look at what
// it told: `told` says whether there is anything to compare, and whether these are the candidates.
struct Retest {
  Candidates candidates;
  LiveView live;
  const Checked* told;  // null: there is nothing to depend on
  bool nan_allowed, moved_before;
  bool movers_alone;  // what did not move is what it was
  // Where there is such a list, and may be looked at; kept up to date.
  Doubtful doubtful{};

  std::uint64_t bound() const noexcept { return candidates.count; }
  THRONG_HD std::uint64_t count() const noexcept {
    const std::uint64_t all = by_list() ? doubtful.report->found : candidates.count;
    if (!told) return all;
    const bool wanted = told->good(nan_allowed) && !told->left && (told->moved || moved_before);
    return wanted ? all : 0;
  }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t& compared) const noexcept {
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
    if (movers_alone && !((live.state[pair.first] | live.state[pair.second]) & moved_bit))
      return false;
    compared = 1;
    const Box a = load_box(live.boxes + pair.first), b = load_box(live.boxes + pair.second);
    const bool is_pair =
        core::is_active(a) && core::is_active(b) && core::overlaps(live.grown(a), live.grown(b));
    if (listed && is_pair != was_pair)
      doubtful.pairs[i].first = pair.first | (is_pair ? Doubtful::is_pair : 0);
    return is_pair != was_pair;
  }

 private:
  THRONG_HD bool by_list() const noexcept { return doubtful.listed() && !(told && told->turned); }
};

// Pairs that are not even candidates any more; with states, of those that left their fat boxes.
struct Vanished {
  Candidates before, now;
  const std::uint8_t* state;
  std::uint64_t bound() const noexcept { return before.count; }
  THRONG_HD std::uint64_t count() const noexcept { return before.count; }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    const LivePair c = before.pairs[i];
    pair = {c.first, c.second};
    if (c.slot == no_slot) return false;
    if (state && !((state[c.first] | state[c.second]) & leaving_bit)) return false;
    return !now.find(pair);
  }
};

// What was found becomes the candidates; those that are pairs stay so for now.
struct CarrySlots {
  const Pair* found;
  Candidates before;
  LivePair* now;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = found[i];
    now[i] = {p.first, p.second, slot_in(before, p)};
  }
};

// Changes in canonical order: first which of them begin, 1 each; and, with the sums of these, the
// two lists.
struct FlagBegun {
  const Pair* changes;
  std::uint64_t count;
  Candidates before;
  std::uint32_t* flags;  // and one more, 0, for the sum of all
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    flags[i] = i < count && slot_in(before, changes[i]) == no_slot ? 1u : 0u;
  }
};
struct SplitChanges {
  const Pair* changes;
  Candidates before;
  const std::uint32_t* sums;
  LivePair *begun, *ended;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair p = changes[i];
    const std::uint32_t at = sums[i];
    if (sums[i + 1] != at)
      begun[at] = {p.first, p.second, no_slot};
    else
      ended[i - at] = {p.first, p.second, slot_in(before, p)};
  }
};

// Slots that became free last are the first to be given again, in the order of the pairs.
struct GiveSlots {
  LivePair* begun;
  Candidates now;
  const std::uint32_t* free_slots;
  std::uint32_t free_count, slot_limit;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    const std::uint32_t slot =
        i < free_count ? free_slots[free_count - 1 - i] : slot_limit + i - free_count;
    begun[i].slot = slot;
    now.find(begun[i])->slot = slot;
  }
};
// They are free for the next update.
struct TakeSlots {
  const LivePair* ended;
  Candidates now;
  std::uint32_t* free_slots;  // behind those that stay
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    free_slots[i] = ended[i].slot;
    if (LivePair* at = now.find(ended[i])) at->slot = no_slot;
  }
};

// The candidates that are pairs, put together.
struct FlagLive {
  Candidates candidates;
  std::uint32_t* flags;  // and one more
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
