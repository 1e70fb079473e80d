// The partition of space into one region per rank, and which regions a box overlaps. No MPI: also
// used by the scaling model and by tests.
//
// Everything is computed on keys, integers ordered like the floats, so that the rounding mode and
// flush-to-zero state of a rank's caller cannot change the result.
//
// Why each pair is reported by exactly one rank. The reference corner h of a pair is, on each axis,
// the larger of the two lower corners. Cuts are half-open: below the cut is left, at or above it is
// right, so h lies in exactly one region. The rank of that region has both boxes: if two boxes
// overlap, h satisfies lower <= h <= upper for each box on every axis. At a cut c, h < c implies
// lower < c, and h >= c implies upper >= c, so visit() descends to the side of h for both boxes. By
// induction both reach the region of h. Infinities are ordinary keys. With a margin the same
// holds for any key box that contains the expanded box, as long as all ranks compute the same one:
// see key_box_of.
//
// Functions marked THRONG_HD also run on a GPU: device_stages.hpp.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <throng/types.hpp>

#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"

namespace throng::mpi {

using Key = std::int32_t;

// -0 and 0 have the same key. Not defined for NaN.
THRONG_HD constexpr Key key_of(float x) noexcept {
  const auto bits = std::bit_cast<std::int32_t>(x);
  return bits >= 0 ? bits : std::numeric_limits<std::int32_t>::min() - bits;
}
constexpr float float_of(Key key) noexcept {
  return std::bit_cast<float>(key >= 0 ? key : std::numeric_limits<std::int32_t>::min() - key);
}

// A closed box of keys. Empty if a lower key is above the upper one (inactive boxes).
struct KeyBox {
  Key lower[3], upper[3];

  THRONG_HD bool empty() const noexcept {
    return lower[0] > upper[0] || lower[1] > upper[1] || lower[2] > upper[2];
  }
};

// The keys of the box expanded by the margin; empty for a box with a NaN or lower > upper. Requires
// the default floating-point environment.
THRONG_HD inline KeyBox key_box_of(const Box& box, float margin) noexcept {
  if (!base::is_active(box)) return {{1, 1, 1}, {0, 0, 0}};
  const Box b = margin > 0 ? base::expand(box, margin) : box;
  return {{key_of(b.lower.x), key_of(b.lower.y), key_of(b.lower.z)},
          {key_of(b.upper.x), key_of(b.upper.y), key_of(b.upper.z)}};
}

// Half-open, [lower, upper) on each axis; the largest key means unbounded.
struct Bounds {
  Key lower[3], upper[3];

  bool meets(const KeyBox& r) const noexcept {
    bool all = true;
    for (int k = 0; k < 3; ++k) all &= (r.lower[k] < upper[k]) & (r.upper[k] >= lower[k]);
    return all & !r.empty();
  }
};

struct Cut {
  Key at = 0;
  std::int32_t axis = 0;
};

THRONG_HD constexpr int middle_of(int begin, int end) noexcept { return begin + (end - begin) / 2; }

// A non-owning view of the cuts of `count` regions; see Regions.
struct Tree {
  const Cut* cuts;
  int count;

  // Calls f(rank) in ascending order for each rank whose region is overlapped, until f returns
  // false; returns whether it never did.
  template <class F>
  THRONG_HD bool visit(const KeyBox& key_box, F&& f) const {
    if (key_box.empty()) return true;
    struct {
      int begin, end;
    } later[32];  // pending right children, at most one per level
    int waiting = 0;
    int begin = 0, end = count;
    for (;;) {
      while (end - begin > 1) {
        const int m = middle_of(begin, end);
        const Cut c = cuts[m];
        const bool left = key_box.lower[c.axis] < c.at;
        if (left && key_box.upper[c.axis] >= c.at) later[waiting++] = {m, end};
        (left ? end : begin) = m;
      }
      if (!f(begin)) return false;
      if (waiting == 0) return true;
      begin = later[--waiting].begin;
      end = later[waiting].end;
    }
  }
};

// A tree over the ranks 0 .. count-1: the node [begin, end) is cut at middle(begin, end). Each rank
// but 0 is the middle of exactly one node, so the tree is an array of one cut per rank.
class Regions {
 public:
  explicit Regions(int count = 1) : cuts_(static_cast<std::size_t>(count)) {}

  int count() const noexcept { return static_cast<int>(cuts_.size()); }
  static int middle(int begin, int end) noexcept { return middle_of(begin, end); }
  Cut& cut(int middle) noexcept { return cuts_[static_cast<std::size_t>(middle)]; }
  const Cut& cut(int middle) const noexcept { return cuts_[static_cast<std::size_t>(middle)]; }
  Cut* data() noexcept { return cuts_.data(); }
  Tree tree() const noexcept { return {cuts_.data(), count()}; }

  // The rank whose region contains the point.
  int owner_of(const Key (&at)[3]) const noexcept {
    int begin = 0, end = count();
    while (end - begin > 1) {
      const int m = middle(begin, end);
      const Cut& c = cut(m);
      (at[c.axis] < c.at ? end : begin) = m;
    }
    return begin;
  }

  template <class F>
  bool visit(const KeyBox& key_box, F&& f) const {
    return tree().visit(key_box, f);
  }

  // The bounds of the node [begin, end), which must be in the tree.
  Bounds bounds(int begin, int end) const noexcept;

 private:
  std::vector<Cut> cuts_;
};

}  // namespace throng::mpi
