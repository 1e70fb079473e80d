// Boxes of doubles: floats stand for them in a search, and where two of these are equal, which
// tells nothing, the doubles decide.
//
// A coordinate x is stood for by f(x) = float(x - origin), the same origin for all, both steps
// rounded to nearest. Both are non-decreasing, and so is f. So if f(x) < f(y) then x < y, and if
// f(x) > f(y) then x > y: what floats tell apart, doubles tell in the same way. The words of a
// grid are a non-decreasing map of floats (core/quantise.hpp), so the same holds of words: equal
// ones alone are looked at, and nothing else in a search knows of doubles. Boxes that overlap as
// doubles overlap as floats, so none is lost where floats choose what is asked: a column, a range.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>

#include "core/bounds.hpp"
#include "cpu/prefetch.hpp"
#include "cpu/threads.hpp"

namespace throng::cpu {

struct Doubles {
  const DoubleBoxes* a = nullptr;  // pair.first is of a, pair.second of b
  const DoubleBoxes* b = nullptr;  // a itself where there is one set
  float margin = 0;

  bool is_flat() const noexcept { return a->is_flat() && b->is_flat(); }
  bool overlap(Pair pair) const noexcept {
    return core::overlaps(box(*a, pair.first), box(*b, pair.second));
  }
  void prefetch(Pair pair) const noexcept {
    prefetch(*a, pair.first);
    prefetch(*b, pair.second);
  }

 private:
  DoubleBox box(const DoubleBoxes& set, std::uint32_t id) const noexcept {
    return margin != 0 ? core::expand(set[id], margin) : set[id];
  }
  static void prefetch(const DoubleBoxes& set, std::uint32_t id) noexcept {
    if (!set.packed_data()) return;
    const char* const box = set.packed_data() + id * set.stride_bytes();
    prefetch_to_read(box);
    prefetch_to_read(box + sizeof(DoubleBox) - sizeof(double));
  }
};

// Where floats are to be finest: where most boxes are, if that is far from 0 for how they are
// spread, else 0. Any origin is right.
DoubleVec3 choose_origin(const Doubles& doubles) noexcept;

// Writes the float box that stands for each box of `boxes`, grown by the margin. One with a NaN has
// a NaN, an inactive one stays so: it is asked of the doubles.
void stand_for(const DoubleBoxes& boxes, const DoubleVec3& origin, float margin,
               const Executor& executor, unsigned tasks, Box* out);

}  // namespace throng::cpu
