// The distribution of the sample's boxes. Included only by device/plan/size_class_planner.hpp.
#pragma once

#include <algorithm>

#include "base/bounds.hpp"
#include "device/plan/size_class_planner.hpp"

#if defined(__CUDA_ARCH__)
#define THRONG_ADD(counter, value) atomicAdd(&(counter), value)
#else
#define THRONG_ADD(counter, value) (counter) += (value)  // host threads run sequentially
#endif

namespace throng::device {

// Reduces one of the nine members of eight reaches.
THRONG_HD inline void SizeClassPlanner::join_member(std::uint32_t member, const BoundsSummary* from,
                                                    std::uint32_t step,
                                                    BoundsSummary& to) noexcept {
  if (member < 6) {
    float all = from[0].most[member];
    THRONG_UNROLL(8)
    for (std::uint32_t j = 0; j < 8; ++j) all = greater(all, from[step * j].most[member]);
    to.most[member] = all;
    return;
  }
  std::uint32_t worlds = 0, changes = 0, sampled_count = 0;
  THRONG_UNROLL(2)
  for (std::uint32_t j = 0; j < 8; ++j) {
    const BoundsSummary& one = from[step * j];
    worlds = worlds > one.worlds ? worlds : one.worlds;
    changes += one.changes;
    sampled_count += one.sampled_count;
  }
  if (member == 6) to.worlds = worlds;
  if (member == 7) to.changes = changes;
  if (member == 8) to.sampled_count = sampled_count;
}

THRONG_HD inline bool SizeClassPlanner::is_sampled(const Early& e, std::uint32_t j) noexcept {
  return e.loaded.worlds[j] != -2;
}

// Partial ranges, active box counts per eight, and cleared counters.
THRONG_HD inline void SizeClassPlanner::gather(std::uint32_t t, Shared& s,
                                               const GridLimits& limits) noexcept {
  Early& e = s.early;
  THRONG_UNROLL(1)
  for (std::uint32_t k = t; k < 64 * (limits.has_worlds ? 9 : 6); k += threads)
    join_member(k / 64, e.reaches + k % 64, 64, e.range[k % 64]);
  if (t >= 384 && t < 400) {
    std::uint32_t active = 0;
    const std::uint32_t eight = t - 384;
    THRONG_UNROLL(2)
    for (std::uint32_t j = 0; j < 8; ++j) {
      e.order[8 * eight + j] = active;
      active += is_sampled(e, 8 * eight + j);
    }
    e.active[eight] = active;
  }
  e.near[t / 256][t % 256] = 0;
  if (t < 2) e.least[t] = 254;
}

// Compacts the active boxes, in order, with their values; the others follow.
THRONG_HD inline void SizeClassPlanner::compact(std::uint32_t t, Shared& s,
                                                const GridLimits& limits) noexcept {
  Early& e = s.early;
  const std::uint32_t own = t % sample_size;
  std::uint32_t before = e.order[own], all = 0;
  THRONG_UNROLL(4)
  for (std::uint32_t j = 0; j < 16; ++j) {
    const std::uint32_t active = e.active[j];
    before += j < own / 8 ? active : 0;
    all += active;
  }
  const bool active = is_sampled(e, own);
  const std::uint32_t to = active ? before : all + (own - before);
  constexpr float beyond = 0x1p127f;
  // Adding 0 turns -0 into +0, so that equal values differ by +0.
  if (t < sample_size) {
    if (active) s.world[to] = e.loaded.worlds[own];
    float extent = 0;
    THRONG_UNROLL(1)
    for (int k = 0; k < 3; ++k) {
      const float along = extent_of(e.loaded, own, k);
      extent = greater(extent, along < most ? along : 0);  // cells cannot separate unbounded boxes
    }
    s.value[longest][to] = active ? extent + 0.0f : beyond;
    if (t == 0) {
      s.count = all;
      s.uses_knots = false;
    }
  } else {
    const int k = static_cast<int>(t / sample_size) - 1;
    const float centre = 0.5f * e.loaded.most[3 + k][own] - 0.5f * e.loaded.most[k][own];
    s.value[k][to] = active ? extent_of(e.loaded, own, k) + 0.0f : beyond;
    s.value[centres + k][to] = active ? centre + 0.0f : beyond;
  }
  if (t < 8 * (limits.has_worlds ? 9 : 6)) join_member(t / 8, e.range + t % 8, 8, e.fewer[t % 8]);
}

// A warp sorts one of the values with a bitonic sort: a thread holds four adjacent elements.
THRONG_HD inline void SizeClassPlanner::sort(std::uint32_t t, Shared& s) noexcept {
  static_assert(32 * values <= threads / 2);
  const std::uint32_t k = t / 32;
  if (k >= values) return;
  float* const to = k < centres ? s.extent[k] : s.centre[k - centres];
#if defined(__CUDA_ARCH__)
  static_assert(sample_size == 128);
  const std::uint32_t lane = t % 32;
  Four own = load_four(s.value[k] + 4 * lane);
  const auto order = [](float& a, float& b, bool rising) {
    const float low = fminf(a, b), high = fmaxf(a, b);
    a = rising ? low : high;
    b = rising ? high : low;
  };
  THRONG_UNROLL(7)
  for (std::uint32_t size = 2; size <= sample_size; size *= 2) {
    // Half of all runs of `size` rise, half fall.
    THRONG_UNROLL(5)
    for (std::uint32_t far = size / 8; far > 0; far /= 2) {
      const bool low = ((lane & far) == 0) == ((4 * lane & size) == 0);
      for (float& v : own.value) {
        const float other = __shfl_xor_sync(~0u, v, static_cast<int>(far));
        v = low ? fminf(v, other) : fmaxf(v, other);
      }
    }
    const bool rising = (4 * lane & size) == 0;
    if (size == 2) {
      order(own.value[0], own.value[1], true);
      order(own.value[2], own.value[3], false);
      continue;
    }
    order(own.value[0], own.value[2], rising);
    order(own.value[1], own.value[3], rising);
    order(own.value[0], own.value[1], rising);
    order(own.value[2], own.value[3], rising);
  }
  for (std::uint32_t q = 0; q < 4; ++q) to[4 * lane + q] = own.value[q];
#else
  if (t % 32 != 0) return;
  std::copy_n(s.value[k], sample_size, to);
  std::sort(to, to + sample_size);
#endif
}

// Counts pairs by distance: each box is compared with its successors, cyclically, up to half of
// all.
THRONG_HD inline void SizeClassPlanner::count_distances(std::uint32_t t, Shared& s,
                                                        const GridLimits& limits) noexcept {
  // The other threads sort.
  constexpr std::uint32_t apart = threads / 2 / sample_size;
  const std::uint32_t n = s.count, own = t % sample_size;
  if (t < threads / 2 || own >= n) return;
  float centre[3];
  for (int k = 0; k < 3; ++k) centre[k] = s.value[centres + k][own];
  const std::int32_t world = s.world[own];
  constexpr std::uint32_t together = 4;
  THRONG_UNROLL(1)
  for (std::uint32_t first = t / sample_size % apart + 1; first <= n / 2;
       first += together * apart) {
    std::uint32_t at[together], distance[together];
    THRONG_UNROLL(together)
    for (std::uint32_t q = 0; q < together; ++q) {
      const std::uint32_t after = first + q * apart;
      at[q] = own + after < n ? own + after : own + after - n;
      // Absolute values, whose bits compare as integers.
      distance[q] = 0;
      for (int k = 0; k < 3; ++k) {
        const float along = s.value[centres + k][at[q]] - centre[k];
        const std::uint32_t bits = std::bit_cast<std::uint32_t>(along) & 0x7fffffff;
        distance[q] = distance[q] > bits ? distance[q] : bits;
      }
    }
    THRONG_UNROLL(together)
    for (std::uint32_t q = 0; q < together; ++q) {
      const std::uint32_t after = first + q * apart;
      // Two boxes half a cycle apart are compared once.
      if (after > n / 2 || (2 * after == n && own >= after)) continue;
      THRONG_ADD(s.early.near[0][distance[q] >> 23], 1u);
      if (!limits.has_worlds) continue;
      const std::int32_t w = s.world[at[q]];
      if (world == w || world < 0 || w < 0) THRONG_ADD(s.early.near[1][distance[q] >> 23], 1u);
    }
  }
}

// Pairs within a distance: prefix sums within groups of eight exponents.
THRONG_HD inline void SizeClassPlanner::accumulate_distances(std::uint32_t t, Shared& s,
                                                             const GridLimits& limits) noexcept {
  Early& e = s.early;
  if (!s.uses_knots && t < (limits.has_worlds ? 9 : 6)) join_member(t, e.fewer, 1, s.range);
  if (t < threads - 64) return;
  const std::uint32_t which = t / 32 % 2, eight = t % 32;
  std::uint32_t sum = 0;
  THRONG_UNROLL(2)
  for (std::uint32_t k = 0; k < 8; ++k) {
    sum += e.near[limits.has_worlds ? which : 0][8 * eight + k];
    e.within[which][8 * eight + k] = sum;
  }
  e.near_group_sums[which][eight] = sum;
}

// The first threads: the range of an axis. All: pairs within a distance.
THRONG_HD inline void SizeClassPlanner::measure_ranges(std::uint32_t t, Shared& s,
                                                       const GridLimits& limits) noexcept {
  const std::uint32_t n = s.count;
  Early& e = s.early;
  const std::uint32_t which = t / 256, exponent = t % 256;
  std::uint32_t sum = e.within[which][exponent];
  THRONG_UNROLL(32)
  for (std::uint32_t k = 0; k < 32; ++k) sum += k < exponent / 8 ? e.near_group_sums[which][k] : 0;
  e.within[which][exponent] = sum;
  // The least distance within which the sample has some pairs: one thread finds it.
  const std::uint32_t own = e.near[limits.has_worlds ? which : 0][exponent];
  if (sum >= 8 && sum - own < 8 && exponent < 254) e.least[which] = exponent;
  if (t >= 3) return;
  if (s.uses_knots) {
    s.low[t] = 0;
    s.length[t] = base::knot_spans;
    return;
  }
  s.unbounded[t] = !(s.extent[t][n / 2] < most);
  s.some_unbounded[t] = !s.unbounded[t] && (s.range.most[t] >= most || s.range.most[t + 3] >= most);
  float low = -s.range.most[t], high = s.range.most[t + 3];
  // Excludes the few boxes that stretch it; these are clamped into the outermost cells.
  const float inner_low = s.centre[t][n / 20], inner_high = s.centre[t][n - 1 - n / 20];
  // Unbounded boxes are excluded; if most boxes are unbounded there is one cell.
  std::uint32_t large = n - 1 - n / 10;
  THRONG_UNROLL(1)
  while (large > n / 2 && !(s.extent[t][large] < most)) --large;
  const float slack = 0.5f * (inner_high - inner_low) + s.extent[t][large];
  low = greater(low, inner_low - slack);
  high = lesser(high, inner_high + slack);
  // Plus a margin for ends that even many samples miss.
  const float missed = n < limits.boxes ? (high - low) * (1.0f / 512) : 0.0f;
  s.low[t] = low - missed;
  s.length[t] = greater(high - low + 2 * missed, shortest);
}

// The density of the boxes: one thread computes the scale, another how it falls at small distances.
THRONG_HD inline void SizeClassPlanner::resolve(std::uint32_t t, Shared& s,
                                                const GridLimits& limits) noexcept {
  if (t != 0 && t != 32) return;
  const Early& e = s.early;
  const float same_world = static_cast<float>(e.within[1][255]);
  // If the sample has few pairs of one world, all worlds together give the distribution.
  const bool enough = same_world >= 32;
  const std::uint32_t which = enough ? 1 : 0;
  if (t == 32) {
    // Below the least distance that the sample resolves, the growth rate is extrapolated.
    s.base = e.least[which];
    const auto sum = static_cast<float>(e.within[which][s.base]);
    s.base_pairs = sum;
    const float growth =
        sum > 0 ? quotient(static_cast<float>(e.within[which][s.base + 1]), sum) : 8;
    s.shrink = quotient(1, lesser(8, greater(2, growth)));
    return;
  }
  const float n = static_cast<float>(s.count), pairs = greater(0.5f * n * (n - 1), 1);
  const float boxes = static_cast<float>(limits.boxes);
  s.worlds = 1;
  if (limits.has_worlds) {
    // Worlds are mostly numbered without gaps, or their boxes are contiguous.
    const float numbered = static_cast<float>(s.range.worlds);
    const float apart =
        quotient(static_cast<float>(s.range.changes), static_cast<float>(s.range.sampled_count)) *
        boxes;
    s.worlds = greater(1, enough ? quotient(pairs, same_world) : lesser(numbered, apart));
  }
  s.most_neighbours = quotient(boxes, s.worlds);
  s.scale = quotient(quotient(boxes, pairs), enough ? 1 : s.worlds);
  s.which = which;
  s.best = 0;
  s.priced_step = s.count > 32 ? s.count / 32 : 1;
  const std::uint32_t some = s.count + s.priced_step - 1;  // the step is 1, 2, 3 or 4
  s.priced_count = s.priced_step == 3 ? some / 3 : some >> s.priced_step / 2;
}
THRONG_HD inline float SizeClassPlanner::base_neighbours(const Shared& s) noexcept {
  return s.base_pairs > 0 ? s.scale * s.base_pairs : 1;
}

// The number of other boxes of the same world with their centre within 2^(exponent+1) along every
// axis.
THRONG_HD inline float SizeClassPlanner::neighbours_within(const Shared& s,
                                                           std::uint32_t exponent) noexcept {
  if (exponent >= s.base) return s.scale * static_cast<float>(s.early.within[s.which][exponent]);
  float count = base_neighbours(s);
  THRONG_UNROLL(1)
  for (std::uint32_t k = exponent; k < s.base && count > 1e-9f; ++k) count *= s.shrink;
  return count;
}

// Neighbours for all distances, the unit distance, and the extents of the priced boxes.
THRONG_HD inline void SizeClassPlanner::spread(std::uint32_t t, Shared& s) noexcept {
  if (t == 257) s.per_priced_box = quotient(1, static_cast<float>(s.priced_count));
  if (t >= 320) {
    THRONG_UNROLL(1)
    for (std::uint32_t k = t - 320; k < 3 * max_priced; k += threads - 320) {
      const std::uint32_t axis = k / max_priced, box = k % max_priced;
      const std::uint32_t at = box < s.priced_count ? box * s.priced_step : 0;
      s.seen[axis][box] = lesser(s.value[axis][at], s.length[axis]);
    }
  }
  if (t > 256) return;
  std::uint32_t exponent = t;
  if (t == 256) {
    float reach = base_neighbours(s);
    exponent = s.base;
    THRONG_UNROLL(1)
    for (; reach > 1 && exponent > 1; --exponent) reach *= s.shrink;
    exponent = exponent > 0 ? exponent : 1;
  }
  // One thread continues until there is one neighbour.
  THRONG_UNROLL(1)
  for (;; ++exponent) {
    const float count = neighbours_within(s, t < 256 ? exponent : exponent - 1);
    if (t < 256) {
      s.neighbours[exponent] = count;
      return;
    }
    if (exponent >= 250 || !(count < 1)) break;
  }
  s.unit = power_of_two(exponent);
}

THRONG_HD inline void SizeClassPlanner::decide_knots(std::uint32_t t, Shared& s) noexcept {
  if (t != 0) return;
  const float cost = s.cost[s.best];
  s.uniform_is_better = s.uses_knots && cost > 0.5f * s.uniform_cost;
  s.again = !s.uses_knots && cost > knot_cost_threshold;
  s.uniform_cost = cost;
}

// Places knots such that each span holds about as many centres of the sample.
THRONG_HD inline void SizeClassPlanner::place_knots(std::uint32_t t, Shared& s) noexcept {
  constexpr std::uint32_t all = base::knot_spans + 1;
  if (t >= 3 * all) return;
  const std::uint32_t axis = t / all, k = t % all;
  const float low = s.low[axis], high = low + s.length[axis];
  const float centre = s.centre[axis][k * (s.count - 1) / base::knot_spans];
  s.knots[axis].at[k] = k == 0                  ? low
                        : k == base::knot_spans ? high
                                                : greater(low, lesser(centre, high));
}
THRONG_HD inline void SizeClassPlanner::measure_spans(std::uint32_t t, Shared& s) noexcept {
  if (t == 3 * base::knot_spans) s.uses_knots = true;
  if (t < 2) s.early.least[t] = 254;
  s.early.near[t / 256][t % 256] = 0;
  if (t >= 3 * base::knot_spans) return;
  base::Knots& knots = s.knots[t / base::knot_spans];
  const std::uint32_t k = t % base::knot_spans;
  const float span = knots.at[k + 1] - knots.at[k];
  knots.scale[k] = span > 0 ? lesser(quotient(1, span), 0x1p126f) : 0;
}
// Replaces the sample's coordinates by positions among knots.
THRONG_HD inline void SizeClassPlanner::place(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t own = t % sample_size, axis = t / sample_size;
  if (axis > 2 || own >= s.count) return;
  const float half = 0.5f * s.value[axis][own], centre = s.value[centres + axis][own];
  const float low = base::knot_position(s.knots[axis], centre - half);
  const float high = base::knot_position(s.knots[axis], centre + half);
  s.value[axis][own] = high - low;
  s.value[centres + axis][own] = 0.5f * (low + high);
}
THRONG_HD inline void SizeClassPlanner::place_longest(std::uint32_t t, Shared& s) noexcept {
  if (t >= s.count) return;
  float extent = 0;
  for (int k = 0; k < 3; ++k) {
    const bool some_unbounded =
        s.unbounded[k] || (s.some_unbounded[k] && s.value[k][t] >= base::knot_spans);
    extent = greater(extent, some_unbounded ? 0 : s.value[k][t]);
  }
  s.value[longest][t] = extent;
}

}  // namespace throng::device

#undef THRONG_ADD
