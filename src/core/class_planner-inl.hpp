// The steps of the class planner. Included by core/class_planner.hpp alone.
#pragma once

#include "core/class_planner.hpp"

#if defined(__CUDA_ARCH__)
#define THRONG_ADD(counter, value) atomicAdd(&(counter), value)
#else
#define THRONG_ADD(counter, value) (counter) += (value)  // the host runs a phase's threads in turn
#endif

namespace throng::core {

THRONG_HD inline void ClassPlanner::gather(std::uint32_t t, Shared& s) noexcept {
  if (t < 256) s.near[0][t] = s.near[1][t] = 0;
  if (t < 2) s.least[t] = 254;
  if (t < threads / 32) {
    Reach all = s.reaches[32 * t];
    for (std::uint32_t j = 1; j < 32; ++j) join(all, s.reaches[32 * t + j]);
    s.range[t] = all;
  }
  if (t >= sample_size) return;
  for (int k = 0; k < 7; ++k) s.rank[k][t] = 0;
  std::uint32_t before = 0;
  for (std::uint32_t j = 0; j < t; ++j) before += s.loaded.worlds[j] != -2;
  const bool active = s.loaded.worlds[t] != -2;
  if (active) {
    s.sample.boxes[before] = s.loaded.boxes[t];
    s.sample.worlds[before] = s.loaded.worlds[t];
  }
  if (t + 1 == sample_size) s.count = before + active;
}

THRONG_HD inline void ClassPlanner::rank(std::uint32_t t, Shared& s) noexcept {
  const std::uint32_t n = s.count, own = t / parts;
  if (own >= n) return;
  float value[7];
  for (int k = 0; k < 7; ++k) value[k] = sorted_value(s.sample.boxes[own], k);
  std::uint32_t before[7] = {};
  for (std::uint32_t j = t % parts; j < n; j += parts) {
    const Box other = s.sample.boxes[j];
    float distance = 0;
    for (int k = 0; k < 7; ++k) {
      const float v = sorted_value(other, k);
      before[k] += v < value[k] || (v == value[k] && j < own);
      if (k >= 4) distance = greater(distance, v < value[k] ? value[k] - v : v - value[k]);
    }
    if (j >= own) continue;
    // Without the sign, which a difference of zeros may have.
    const std::uint32_t exponent = std::bit_cast<std::uint32_t>(distance) >> 23 & 0xff;
    THRONG_ADD(s.near[0][exponent], 1);
    const std::int32_t v = s.sample.worlds[own], w = s.sample.worlds[j];
    if (v == w || v < 0 || w < 0) THRONG_ADD(s.near[1][exponent], 1);
  }
  for (int k = 0; k < 7; ++k) THRONG_ADD(s.rank[k][own], before[k]);
}

THRONG_HD inline void ClassPlanner::scatter(std::uint32_t t, Shared& s) noexcept {
  if (t >= s.count) return;
  for (int k = 0; k < 7; ++k) {
    const float value = sorted_value(s.sample.boxes[t], k);
    (k < 4 ? s.extent[k] : s.centre[k - 4])[s.rank[k][t]] = value;
  }
}

// The first threads: the range of an axis. All: how many pairs lie within a distance.
THRONG_HD inline void ClassPlanner::summarise(std::uint32_t t, Shared& s,
                                              const GridLimits& limits) noexcept {
  const std::uint32_t n = s.count;
  if (n == 0) return;
  if (t < 3) {
    const int k = static_cast<int>(t);
    Reach all = s.range[0];
    for (std::uint32_t j = 1; j < threads / 32; ++j) join(all, s.range[j]);
    float low = -all.most[k], high = all.most[k + 3];
    // Without the few that stretch it; these are clamped into the outermost cells.
    const float inner_low = s.centre[k][n / 20], inner_high = s.centre[k][n - 1 - n / 20];
    const float slack = 0.5f * (inner_high - inner_low) + s.extent[k][n - 1 - n / 10];
    low = greater(low, inner_low - slack);
    high = lesser(high, inner_high + slack);
    // And with what even many samples miss of the ends.
    const float missed = n < limits.boxes ? (high - low) * (1.0f / 512) : 0.0f;
    s.low[k] = low - missed;
    s.length[k] = greater(high - low + 2 * missed, 1e-30f);
  }
  const std::uint32_t which = t / 256, exponent = t % 256;
  std::uint32_t sum = 0;
  for (std::uint32_t k = 0; k <= exponent; ++k) sum += s.near[which][k];
  s.within[which][exponent] = sum;
  // The least distance within which the sample has some pairs: one thread finds it.
  if (sum >= 8 && sum - s.near[which][exponent] < 8 && exponent < 254) s.least[which] = exponent;
}

// How the boxes crowd.
THRONG_HD inline void ClassPlanner::resolve(Shared& s, const GridLimits& limits) noexcept {
  if (s.count == 0) return;
  const float n = static_cast<float>(s.count), pairs = greater(0.5f * n * (n - 1), 1);
  const float same_world = static_cast<float>(s.within[1][255]);
  // Where the sample has few pairs of one world, those of all worlds tell how boxes lie.
  const bool enough = same_world >= 32;
  s.worlds = 1;
  if (limits.has_worlds) {
    Reach all = s.range[0];
    for (std::uint32_t j = 1; j < threads / 32; ++j) join(all, s.range[j]);
    // Worlds are numbered without gaps, mostly, or their boxes stand together.
    const float numbered = static_cast<float>(all.worlds);
    const float apart = static_cast<float>(all.changes) / static_cast<float>(all.looked_at) *
                        static_cast<float>(limits.boxes);
    s.worlds = greater(1, enough ? pairs / same_world : lesser(numbered, apart));
  }
  s.reach = s.within[enough ? 1 : 0];
  s.base = s.least[enough ? 1 : 0];
  s.scale = static_cast<float>(limits.boxes) / pairs / (enough ? 1 : s.worlds);
  // Below the least distance that the sample resolves, growth is carried on.
  const auto sum = static_cast<float>(s.reach[s.base]);
  s.base_neighbours = sum > 0 ? s.scale * sum : 1;
  const float growth = sum > 0 ? static_cast<float>(s.reach[s.base + 1]) / sum : 8;
  s.shrink = 1 / lesser(8, greater(2, growth));
  float reach = s.base_neighbours;
  std::uint32_t exponent = s.base;
  for (; reach > 1 && exponent > 1; --exponent) reach *= s.shrink;
  while (neighbours(s, power_of_two(exponent)) < 1 && exponent < 250) ++exponent;
  s.unit = power_of_two(exponent);
}

// How many other boxes of its world have their centre within `radius` of a box's, along every axis.
THRONG_HD inline float ClassPlanner::neighbours(const Shared& s, float radius) noexcept {
  const std::uint32_t exponent = std::bit_cast<std::uint32_t>(radius) >> 23;
  // Counts of exponent e are of distances below 2^(e+1): at `radius` between those of e-1 and of e.
  const auto count = [&](std::uint32_t e) {
    if (e >= s.base) return s.scale * static_cast<float>(s.reach[e < 255 ? e : 255]);
    float c = s.base_neighbours;
    for (std::uint32_t k = e; k < s.base && c > 1e-9f; ++k) c *= s.shrink;
    return c;
  };
  const float above = count(exponent), below = exponent ? count(exponent - 1) : 0;
  const float part = exponent ? radius / power_of_two(exponent) - 1 : 0;
  return below + (above - below) * part;
}

// Cells and classes from the sides of the finest cells.
THRONG_HD inline void ClassPlanner::lay_out(std::uint32_t scheme, const float (&side)[3],
                                            float longest, const Shared& s,
                                            const GridLimits& limits, ClassGrid& grid) noexcept {
  std::uint32_t cells[3];
  for (int k = 0; k < 3; ++k) {
    float count = s.length[k] / greater(side[k], 1e-30f);
    const float bound = static_cast<float>(max_class_cells);
    count = count < 1 ? 1 : count > bound ? bound : count;
    cells[k] = static_cast<std::uint32_t>(count);
  }
  for (grid.hashed = false;;) {
    for (int k = 0; k < 3; ++k) {
      grid.origin[k] = s.low[k];
      grid.scale[k] = lesser(static_cast<float>(cells[k]) / s.length[k], 1e30f);
      grid.last[k] = static_cast<float>(cells[k] - 1);
    }
    // Isotropic: each class has cells twice as large, and eight times beyond the sample's largest
    // boxes, where few are to be expected. For rods: a class for each axis, or two, along which
    // boxes are long.
    std::uint32_t jump = scheme == 1 ? 1 : 0;
    const float reach = scheme == 1 ? longest : s.extent[3][s.count - 1];
    while (jump < 20 && side[0] * static_cast<float>(1u << jump) < reach) ++jump;
    std::uint32_t c = 0;
    for (; c + 1 < max_size_classes; ++c) {
      const std::uint32_t level = c <= jump ? c : jump + 3 * (c - jump);
      std::uint32_t shift[3] = {level, level, level};
      if (scheme == 1) {
        // none, x, y, z, yz, zx, xy, all; then larger ones.
        const std::uint32_t axes = c == 0   ? 0
                                   : c <= 3 ? 1u << (c - 1)
                                   : c <= 6 ? 7u ^ (1u << (c - 4))
                                            : 7;
        const std::uint32_t more = c > 7 ? 2 * (c - 7) : 0;
        for (int k = 0; k < 3; ++k) shift[k] = axes >> k & 1 ? jump + more : 0;
      }
      bool single = true;
      for (int k = 0; k < 3; ++k) {
        shift[k] = shift[k] < 22 ? shift[k] : 22;
        grid.classes[c].shift[k] = shift[k];
        grid.classes[c].cells[k] = ((cells[k] - 1) >> shift[k]) + 1;
        single = single && grid.classes[c].cells[k] == 1;
      }
      if (single) break;
    }
    for (int k = 0; k < 3; ++k) {  // the last one has one cell
      grid.classes[c].shift[k] = 22;
      grid.classes[c].cells[k] = 1;
    }
    grid.class_count = c + 1;
    finish(grid, limits, s.worlds);
    if (!grid.hashed) return;
    bool short_rows = true;
    for (int k = 0; k < 3; ++k) {  // y and z too: their numbers must fit a row's hash and offsets
      short_rows = short_rows && cells[k] <= limits.row_cells;
      cells[k] = cells[k] < limits.row_cells ? cells[k] : limits.row_cells;
    }
    if (short_rows) return;
  }
}

// Offsets, and whether the table holds it all.
THRONG_HD inline void ClassPlanner::finish(ClassGrid& grid, const GridLimits& limits,
                                           float worlds) noexcept {
  grid.present = limits.present;
  grid.table_cells = limits.table_cells;
  std::uint64_t sum = 0;
  for (std::uint32_t c = 0; c < grid.class_count; ++c) {
    const SizeClass& k = grid.classes[c];
    grid.classes[c].offset = static_cast<std::uint32_t>(sum);
    // A layer may have 2^44 cells, and all of them 2^66: what no table holds is cut off in time.
    constexpr std::uint64_t too_many = std::uint64_t{1} << 40;
    const std::uint64_t layer = std::uint64_t{k.cells[0]} * k.cells[1];
    const std::uint64_t cells = layer < too_many ? layer * k.cells[2] : too_many;
    sum = sum + cells < too_many ? sum + cells : too_many;
  }
  const std::uint64_t all = sum * group_count(limits.present);
  // A world's table stands beside those of some others; half of them must find room.
  const float slots = static_cast<float>(limits.table_cells) / static_cast<float>(all);
  grid.hashed = all > limits.table_cells || 2 * slots < worlds;
  grid.world_cells = grid.hashed ? 1 : static_cast<std::uint32_t>(sum);
  grid.world_slots = grid.hashed ? 1 : static_cast<std::uint32_t>(limits.table_cells / all);
}

// What a box is expected to cost: rows looked up, candidates compared.
THRONG_HD inline float ClassPlanner::price(const Shared& s, const GridLimits& limits,
                                           const ClassGrid& grid) noexcept {
  float share[max_size_classes] = {}, mean[max_size_classes][3] = {};
  float side[3];
  for (int k = 0; k < 3; ++k) side[k] = s.length[k] / (grid.last[k] + 1);
  const std::uint32_t step = s.count > 32 ? s.count / 32 : 1;
  float taken = 0;
  for (std::uint32_t j = 0; j < s.count; j += step) {
    const Box& b = s.sample.boxes[j];
    const float e[3] = {extent_of(b, 0), extent_of(b, 1), extent_of(b, 2)};
    std::uint32_t c = 0;
    for (; c + 1 < grid.class_count; ++c) {
      const SizeClass& k = grid.classes[c];
      if (e[0] <= side[0] * static_cast<float>(1u << k.shift[0]) &&
          e[1] <= side[1] * static_cast<float>(1u << k.shift[1]) &&
          e[2] <= side[2] * static_cast<float>(1u << k.shift[2]))
        break;
    }
    share[c] += 1;
    taken += 1;
    for (int k = 0; k < 3; ++k) mean[c][k] += lesser(e[k], s.length[k]);
  }
  float sum = 0;
  const float boxes = static_cast<float>(limits.boxes);
  for (std::uint32_t c = 0; c < grid.class_count; ++c) {
    if (share[c] == 0) continue;
    for (std::uint32_t d = c; d < grid.class_count; ++d) {
      if (share[d] == 0) continue;
      float width[3], least = 0, rows = 1, cells = 1;
      for (int k = 0; k < 3; ++k) {
        const float large = side[k] * static_cast<float>(1u << grid.classes[d].shift[k]);
        const float extent = mean[c][k] / share[c];
        width[k] = lesser(extent + 2 * large, s.length[k]);
        const float across =
            lesser(extent / large + 2, static_cast<float>(grid.classes[d].cells[k]));
        if (k > 0) rows *= across;
        cells *= across;
        least = k == 0 || width[k] < least ? width[k] : least;
      }
      float candidates = neighbours(s, 0.5f * least);
      for (int k = 0; k < 3; ++k) candidates *= width[k] / least;
      candidates = 1 + lesser(candidates, boxes / s.worlds) * share[d] / taken;
      float one = candidates + rows * (grid.hashed ? hash_row_cost : row_cost) + class_cost;
      if (grid.hashed)
        one += cells * hash_cell_cost * boxes / static_cast<float>(limits.table_cells);
      sum += (c == d ? 0.5f : 1.0f) * one * share[c] / taken;
    }
  }
  return sum;
}

// Candidate sizes: those of boxes, long and short, and such that cells hold some boxes each. Prices
// are those of a scale of 1: else a size would be chosen that undoes the scale.
THRONG_HD inline void ClassPlanner::build(std::uint32_t candidate, float scale, const Shared& s,
                                          const GridLimits& limits, ClassGrid& grid) noexcept {
  const std::uint32_t n = s.count, scheme = candidate / sizes, size = candidate % sizes;
  const float low = s.extent[3][n / 10], middle = s.extent[3][n / 2],
              high = s.extent[3][n - 1 - n / 10];
  const float thin = lesser(s.extent[0][n / 2], lesser(s.extent[1][n / 2], s.extent[2][n / 2]));
  const float bases[sizes] = {low,
                              middle,
                              high,
                              thin,
                              2 * low,
                              4 * low,
                              2 * thin,
                              2 * middle,
                              s.unit,
                              1.26f * s.unit,
                              1.59f * s.unit,
                              2 * s.unit,
                              2.52f * s.unit,
                              3.17f * s.unit,
                              4 * s.unit,
                              8 * s.unit};
  const float base = greater(bases[size] * 1.0001f * scale, 1e-30f);
  float side[3] = {base, base, base};
  if (scheme == 2) {  // the shape of the typical box
    const float typical = greater(middle, 1e-30f);
    for (int k = 0; k < 3; ++k)
      side[k] = greater(base * greater(s.extent[k][n / 2], typical * 0.01f) / typical, 1e-30f);
  }
  lay_out(scheme, side, high, s, limits, grid);
}

}  // namespace throng::core

#undef THRONG_ADD
