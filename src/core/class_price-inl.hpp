// What a box is expected to cost in each candidate of the class planner. Included by
// core/class_planner.hpp alone.
//
// A thread looks after one candidate, and a row of threads after all.
#pragma once

#include "core/class_planner.hpp"

#if defined(__CUDA_ARCH__)
#define THRONG_SET(bits, value) atomicOr(&(bits), value)
#else
#define THRONG_SET(bits, value) (bits) |= (value)  // the host runs a phase's threads in turn
#endif

namespace throng::core {

// The classes of some boxes of the sample.
THRONG_HD inline void ClassPlanner::fit(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (row >= rows) return;
  float side[3];
  for (int k = 0; k < 3; ++k) side[k] = s.side[k][candidate];
  const std::uint32_t last = s.class_count[candidate] - 1, step = s.look_step, count = s.looks;
  // Those beyond the last, up to as many as are averaged at once, are of no class.
  THRONG_UNROLL(1)
  for (std::uint32_t look = row; look < count + at_once - 1; look += rows) {
    if (look >= count) {
      s.late.fit[candidate][look] = max_size_classes;
      continue;
    }
    float e[3];
    for (int k = 0; k < 3; ++k) e[k] = s.value[k][look * step];
    std::uint32_t c = 0;
    THRONG_UNROLL(1)
    for (; c < last; ++c) {
      const std::uint32_t shifts = s.shift[c][candidate];
      if (e[0] <= side[0] * times(shifts & 0xff) && e[1] <= side[1] * times(shifts >> 8 & 0xff) &&
          e[2] <= side[2] * times(shifts >> 16))
        break;
    }
    s.late.fit[candidate][look] = static_cast<std::uint8_t>(c);
    THRONG_SET(s.used[candidate], 1u << c);
  }
}

// The share and the mean extents of each class that has boxes; these are numbered.
THRONG_HD inline void ClassPlanner::average(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t candidate = t % candidates, row = t / candidates;
  if (row >= rows) return;
  const std::uint32_t used = s.used[candidate], step = s.look_step, count = s.looks;
  // Axes of classes: along each the share is found anew.
  THRONG_UNROLL(1)
  for (std::uint32_t item = row; item < 3 * max_size_classes; item += rows) {
    const std::uint32_t c = item / 3, k = item % 3;
    if (!(used >> c & 1)) continue;
    const float length = s.length[k];
    float share = 0, sum = 0;
    std::uint32_t first = 0;
    // Adding nothing instead of a branch: the loads of some boxes are under way together.
    THRONG_UNROLL(1)
    do {
      THRONG_UNROLL(at_once)
      for (std::uint32_t q = 0; q < at_once; ++q) {
        const std::uint32_t look = first + q;
        const bool own = s.late.fit[candidate][look] == c;
        const std::uint32_t at = look * step < sample_size ? look * step : sample_size - 1;
        const float extent = lesser(s.value[k][at], length);
        share += own ? 1.0f : 0.0f;
        sum += own ? extent : 0.0f;
      }
      first += at_once;
    } while (first < count);
    const std::uint32_t number = bits_of(used & ((1u << c) - 1));
    s.late.extent[number][k][candidate] = quotient(sum, share);
    if (k != 0) continue;
    s.late.used[number][candidate] = static_cast<std::uint8_t>(c);
    s.late.share[number][candidate] = share;
  }
}

// How many other boxes of its world have their centre within `radius` of a box's, along every axis.
// Counts of exponent e are of distances below 2^(e+1): at `radius` between those of e-1 and of e.
THRONG_HD inline float ClassPlanner::neighbours(const Shared& s, float radius) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(radius);
  const std::uint32_t exponent = bits >> 23;
  if (exponent == 0) return 0;
  const float above = s.neighbours[exponent], below = s.neighbours[exponent - 1];
  const float part = std::bit_cast<float>((bits & 0x7fffff) | 127u << 23) - 1;
  return below + (above - below) * part;
}

// What boxes of one class cost that look for those of another, or of their own.
THRONG_HD inline float ClassPlanner::price_of(std::uint32_t candidate, std::uint32_t from,
                                              std::uint32_t to, const Shared& s,
                                              const GridLimits& limits) noexcept {
  const std::uint32_t shifts = s.shift[s.late.used[to][candidate]][candidate];
  const float share = s.late.share[from][candidate], taken = static_cast<float>(s.looks);
  const float boxes = static_cast<float>(limits.boxes);
  const bool hashed = s.hashed[candidate];
  float width[3] = {}, least = 0, looked_up = 1, cells = 1;
  // One axis after the other; the widths move up, as an index that is computed would need memory.
  THRONG_UNROLL(1)
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t shift = shifts >> 8 * k & 0xff;
    const float large = s.side[k][candidate] * times(shift);
    const float extent = s.late.extent[from][k][candidate];
    const std::uint32_t there = shifts == one_cell ? 1 : cells_of(s.cells[k][candidate], shift);
    const float across = lesser(quotient(extent, large) + 2, static_cast<float>(there));
    if (k > 0) looked_up *= across;
    cells *= across;
    const float wide = lesser(extent + 2 * large, s.length[k]);
    least = k == 0 || wide < least ? wide : least;
    width[0] = width[1];
    width[1] = width[2];
    width[2] = wide;
  }
  float compared = neighbours(s, 0.5f * least);
  THRONG_UNROLL(1)
  for (int k = 0; k < 3; ++k) {
    compared *= quotient(width[0], least);
    width[0] = width[1];
    width[1] = width[2];
  }
  compared = 1 + quotient(lesser(compared, s.most_neighbours) * s.late.share[to][candidate], taken);
  float one = compared + looked_up * row_cost;
  if (hashed)
    one = compared * hash_compare_cost + looked_up * hash_row_cost +
          quotient(cells * hash_cell_cost * boxes, static_cast<float>(limits.table_cells));
  one += class_cost;
  return quotient((from == to ? 0.5f : 1.0f) * one * share, taken);
}

// Each class with itself and those after it.
THRONG_HD inline void ClassPlanner::price(std::uint32_t t, Shared& s,
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

THRONG_HD inline void ClassPlanner::add_up(std::uint32_t candidate, Shared& s) noexcept {
  const std::uint32_t used = bits_of(s.used[candidate]);
  float sum = 0;
  THRONG_UNROLL(2)
  for (std::uint32_t k = 0; k < used * (used + 1) / 2; ++k) sum += s.late.cost[k][candidate];
  s.cost[candidate] = sum;
}

// The first of the cheapest.
THRONG_HD inline void ClassPlanner::choose(std::uint32_t candidate, Shared& s) noexcept {
  const float own = s.cost[candidate];
  std::uint32_t before = 0;
  THRONG_UNROLL(2)
  for (std::uint32_t k = 0; k < candidates; k += 4) {
    const Four others = load_four(s.cost + k);
    for (std::uint32_t q = 0; q < 4; ++q) {
      const float other = others.value[q];
      before += (other < own) | ((k + q < candidate) & (other == own));
    }
  }
  if (before == 0) s.best = candidate;
}

}  // namespace throng::core

#undef THRONG_SET
