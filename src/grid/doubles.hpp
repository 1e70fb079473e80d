// Boxes of doubles: the search uses rounded floats; on equal floats, which decide nothing, the
// doubles decide.
//
// A coordinate x is represented by f(x) = float(x - origin), the same origin for all, both steps
// rounded to nearest. Both are non-decreasing, and so is f. So f(x) < f(y) implies x < y, and f(x)
// > f(y) implies x > y: the floats order what they distinguish as the doubles do. Quantized
// coordinates are a non-decreasing map of floats (base/quantize.hpp), so the same holds for them:
// only ties are decided by doubles, and no other part of a search uses doubles. Boxes that overlap
// as doubles overlap as floats, so no candidate is lost.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>

#include "base/bounds.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"

namespace throng::grid {

struct Doubles {
  const DoubleBoxes* a = nullptr;  // set of pair.first; b is that of pair.second
  const DoubleBoxes* b = nullptr;  // equal to a if there is one set
  float margin = 0;

  bool is_flat() const noexcept { return a->is_flat() && b->is_flat(); }
  bool overlap(Pair pair) const noexcept {
    return base::overlaps(box(*a, pair.first), box(*b, pair.second));
  }
  void prefetch(Pair pair) const noexcept {
    prefetch(*a, pair.first);
    prefetch(*b, pair.second);
  }

 private:
  DoubleBox box(const DoubleBoxes& set, std::uint32_t id) const noexcept {
    return margin != 0 ? base::expand(set[id], margin) : set[id];
  }
  static void prefetch(const DoubleBoxes& set, std::uint32_t id) noexcept {
    if (!set.packed_data()) return;
    const char* const box = set.packed_data() + id * set.stride_bytes();
    base::prefetch_l2(box);
    base::prefetch_l2(box + sizeof(DoubleBox) - sizeof(double));
  }
};

// The origin: the point of finest float resolution. The median of the boxes if that is far from 0
// relative to their spread, else 0. Any origin is correct.
DoubleVec3 choose_origin(const Doubles& doubles) noexcept;

// Writes the float box for each box of `boxes`, expanded by the margin. NaN and inactive boxes stay
// NaN and inactive, as decided on the doubles.
void round_to_floats(const DoubleBoxes& boxes, const DoubleVec3& origin, float margin,
                     const Executor& executor, unsigned tasks, Box* out);

}  // namespace throng::grid
