// Expected cost per box of each candidate of the size class planner. Included only by
// device/plan/size_class_planner.hpp.
//
// A thread processes one candidate, a row of threads all of them.
#pragma once

#include "device/plan/size_class_planner.hpp"

#if defined(__CUDA_ARCH__)
#define THRONG_SET(bits, value) atomicOr(&(bits), value)
#else
#define THRONG_SET(bits, value) (bits) |= (value)  // host threads run sequentially
#endif

namespace throng::device {

// The class of each priced box: the first that it fits. A thread processes several boxes together.
THRONG_HD inline void SizeClassPlanner::fit(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (row >= rows) return;
  constexpr std::uint32_t together = 4;
  float side[3];
  std::uint32_t cells[3];
  for (int k = 0; k < 3; ++k) {
    side[k] = s.side[k][candidate];
    cells[k] = s.cells[k][candidate];
  }
  const std::uint32_t last = s.class_count[candidate] - 1, step = s.priced_step,
                      count = s.priced_count;
  std::uint32_t used = 0;
  // Entries beyond the last box, up to a multiple of at_once, have no class.
  THRONG_UNROLL(1)
  for (std::uint32_t first = row; first < count + at_once - 1; first += together * rows) {
    float e[together][3];
    std::uint32_t c[together];
    THRONG_UNROLL(together)
    for (std::uint32_t q = 0; q < together; ++q) {
      const std::uint32_t box = first + q * rows < count ? first + q * rows : 0;
      for (int k = 0; k < 3; ++k) e[q][k] = s.value[k][box * step];
      c[q] = 0;
    }
    bool more = true;
    THRONG_UNROLL(1)
    for (std::uint32_t k = 0; k < last && more; ++k) {
      const std::uint32_t shifts = s.shift[k][candidate];
      float bound[3];
      // One cell fits any box.
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t shift = shifts >> 8 * axis & 0xff;
        bound[axis] = cells_of(cells[axis], shift) == 1 ? any_extent : side[axis] * times(shift);
      }
      more = false;
      THRONG_UNROLL(together)
      for (std::uint32_t q = 0; q < together; ++q) {
        const bool fits = (e[q][0] <= bound[0]) & (e[q][1] <= bound[1]) & (e[q][2] <= bound[2]);
        const bool on = (c[q] == k) & !fits;
        c[q] += on;
        more |= on;
      }
    }
    THRONG_UNROLL(together)
    for (std::uint32_t q = 0; q < together; ++q) {
      const std::uint32_t box = first + q * rows;
      const bool none = box >= count;
      if (box < count + at_once - 1)
        s.late.fit[candidate][box] =
            static_cast<std::uint8_t>(none ? base::max_size_classes : c[q]);
      used |= none ? 0 : 1u << c[q];
    }
  }
  if (used != 0) THRONG_SET(s.used[candidate], used);
}

// The share and mean extents of each class that has boxes, numbered consecutively.
THRONG_HD inline void SizeClassPlanner::average(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (row >= rows) return;
  const std::uint32_t used = s.used[candidate], count = s.priced_count;
  // One item per class and axis; each computes the share again.
  THRONG_UNROLL(1)
  for (std::uint32_t item = row; item < 3 * base::max_size_classes; item += rows) {
    const std::uint32_t c = item / 3, k = item % 3;
    if (!(used >> c & 1)) continue;
    float share = 0, sum = 0;
    std::uint32_t first = 0;
    // Adding 0 instead of a branch overlaps the loads of several boxes.
    THRONG_UNROLL(1)
    do {
      THRONG_UNROLL(at_once / 4)
      for (std::uint32_t four = first; four < first + at_once; four += 4) {
        const std::uint32_t fits = load_bytes(&s.late.fit[candidate][four]);
        const Four extents = load_four(&s.seen[k][four]);
        THRONG_UNROLL(4)
        for (std::uint32_t q = 0; q < 4; ++q) {
          const bool own = (fits >> 8 * q & 0xff) == c;
          share += own ? 1.0f : 0.0f;
          sum += own ? extents.value[q] : 0.0f;
        }
      }
      first += at_once;
    } while (first < count);
    const std::uint32_t number = bits_of(used & ((1u << c) - 1));
    s.late.across[number][k][candidate] = quotient(sum, share * s.side[k][candidate]);
    if (k != 0) continue;
    s.late.used[number][candidate] = static_cast<std::uint8_t>(c);
    s.late.share[number][candidate] = share;
  }
}

// The number of other boxes of the same world with their centre within `radius` along every axis.
// Counts of exponent e are of distances below 2^(e+1): `radius` is interpolated between those of
// e-1 and of e.
THRONG_HD inline float SizeClassPlanner::neighbours(const Shared& s, float radius) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(radius);
  const std::uint32_t exponent = bits >> 23;
  if (exponent == 0) return 0;
  const float above = s.neighbours[exponent], below = s.neighbours[exponent - 1];
  const float part = std::bit_cast<float>((bits & 0x7fffff) | 127u << 23) - 1;
  return below + (above - below) * part;
}

// Cost of boxes of one class that search another class, or their own.
THRONG_HD inline float SizeClassPlanner::price_of(std::uint32_t candidate, std::uint32_t from,
                                                  std::uint32_t to, const Shared& s,
                                                  const GridLimits& limits) noexcept {
  const std::uint32_t shifts = s.shift[s.late.used[to][candidate]][candidate];
  const float share = s.late.share[from][candidate];
  const float boxes = static_cast<float>(limits.boxes);
  const bool hashed = s.hashed[candidate];
  float width[3] = {}, narrow = 0, looked_up = 1, cells = 1;
  // Axis by axis; the widths shift up, as a computed index would need memory.
  THRONG_UNROLL(1)
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t shift = shifts >> 8 * k & 0xff;
    const float cell = times(shift), extent = s.late.across[from][k][candidate];  // in finest cells
    const std::uint32_t there = shifts == one_cell ? 1 : cells_of(s.cells[k][candidate], shift);
    const float across = lesser(extent * power_of_two(127 - shift) + 2, static_cast<float>(there));
    if (k > 0) looked_up *= across;
    cells *= across;
    // Unbounded boxes share one place along that axis.
    const float wide =
        s.unbounded[k] ? 0 : lesser(s.side[k][candidate] * (extent + 2 * cell), s.length[k]);
    narrow = wide > 0 && (narrow == 0 || wide < narrow) ? wide : narrow;
    width[0] = width[1];
    width[1] = width[2];
    width[2] = wide;
  }
  const float inverse = narrow > 0 ? quotient(1, narrow) : 0;
  float compared = narrow > 0 ? neighbours(s, 0.5f * narrow) : s.most_neighbours;
  for (int k = 0; k < 3; ++k) compared *= width[k] > 0 ? width[k] * inverse : 1;
  compared =
      1 + lesser(compared, s.most_neighbours) * s.late.share[to][candidate] * s.per_priced_box;
  float one = compared + looked_up * row_cost;
  if (hashed)
    one = compared * hash_compare_cost + looked_up * hash_row_cost +
          quotient(cells * hash_cell_cost * boxes, static_cast<float>(limits.table_cells));
  one += class_cost;
  return (from == to ? 0.5f : 1.0f) * one * share * s.per_priced_box;
}

// Each class with itself and those after it.
THRONG_HD inline void SizeClassPlanner::price(std::uint32_t t, Shared& s,
                                              const GridLimits& limits) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (row >= rows) return;
  const std::uint32_t used = bits_of(s.used[candidate]);
  THRONG_UNROLL(1)
  for (std::uint32_t k = row; k < used * (used + 1) / 2; k += rows) {
    std::uint32_t from = 0, after = k;
    THRONG_UNROLL(1)
    for (; after >= used - from; ++from) after -= used - from;
    s.late.cost[k][candidate] = price_of(candidate, from, from + after, s, limits);
  }
}

THRONG_HD inline void SizeClassPlanner::sum_costs(std::uint32_t candidate, Shared& s) noexcept {
  const std::uint32_t used = bits_of(s.used[candidate]);
  float sum = 0;
  THRONG_UNROLL(2)
  for (std::uint32_t k = 0; k < used * (used + 1) / 2; ++k) sum += s.late.cost[k][candidate];
  // If no sampled box is of the finest class (for rods, of the finest seven), some boxes still are
  // by chance, and every search visits that class too: a coarser candidate, which has the same
  // cells without it, costs less.
  const std::uint32_t finest = candidate / sizes == 1 ? 0x7f : 1;
  if (!(s.used[candidate] & finest)) sum *= unused_cost;
  s.cost[candidate] = sum;
}

// The first of the cheapest. Cost bits have the order of the costs.
THRONG_HD inline void SizeClassPlanner::choose(std::uint32_t t, Shared& s) noexcept {
#if defined(__CUDA_ARCH__)
  static_assert(candidates > 32 && candidates <= 64);
  if (t >= 32) return;
  constexpr std::uint32_t none = ~0u;
  const std::uint32_t own = std::bit_cast<std::uint32_t>(s.cost[t]);
  const std::uint32_t other =
      t + 32 < candidates ? std::bit_cast<std::uint32_t>(s.cost[t + 32]) : none;
  std::uint32_t least = own < other ? own : other;
  for (int half = 16; half > 0; half /= 2) {
    const std::uint32_t there = __shfl_xor_sync(~0u, least, half);
    least = there < least ? there : least;
  }
  const unsigned first = __ballot_sync(~0u, own == least);
  const unsigned second = __ballot_sync(~0u, other == least);
  if (t == 0)
    s.best = first != 0 ? __ffs(static_cast<int>(first)) - 1 : 31 + __ffs(static_cast<int>(second));
#else
  if (t != 0) return;
  const auto bits = [&](std::uint32_t k) { return std::bit_cast<std::uint32_t>(s.cost[k]); };
  s.best = 0;
  for (std::uint32_t k = 1; k < candidates; ++k)
    if (bits(k) < bits(s.best)) s.best = k;
#endif
}

}  // namespace throng::device

#undef THRONG_SET
