#include "core/planner.hpp"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>

namespace throng::core {
namespace {

// A range that is shorter counts as so long: below the least float, as boxes may be that small.
constexpr double least_length = 1e-44;

float clamp_finite(float x) noexcept {
  return x < -FLT_MAX ? -FLT_MAX : (x > FLT_MAX ? FLT_MAX : x);
}

// A box of the sample. All axes go through each loop together, as one alone would wait for its
// own sums.
struct Corners {
  float lower[3], upper[3];

  double centre(int k) const noexcept { return 0.5 * double{lower[k]} + 0.5 * double{upper[k]}; }
};

Corners corners_of(const Box& b) noexcept {
  return {{clamp_finite(b.lower.x), clamp_finite(b.lower.y), clamp_finite(b.lower.z)},
          {clamp_finite(b.upper.x), clamp_finite(b.upper.y), clamp_finite(b.upper.z)}};
}

struct Range {
  double lower[3], upper[3];
};

// All but a few boxes that stretch [low, high] far beyond the rest.
void trim(const Corners* sample, std::uint32_t count, int k, double& low, double& high) noexcept {
  float lowers[max_sample] = {}, uppers[max_sample] = {};
  for (std::uint32_t i = 0; i < count; ++i) {
    lowers[i] = sample[i].lower[k];
    uppers[i] = sample[i].upper[k];
  }
  const std::uint32_t cut = count / 20;
  std::nth_element(lowers, lowers + cut, lowers + count);
  std::nth_element(uppers, uppers + (count - 1 - cut), uppers + count);
  const double inner_low = lowers[cut];
  const double inner_high = std::max(inner_low, double{uppers[count - 1 - cut]});
  const double slack = 0.5 * (inner_high - inner_low);
  low = std::max(low, inner_low - slack);
  high = std::min(high, inner_high + slack);
}

// The range that holds all of the sample, unless a few boxes stretch it far beyond the rest.
Range trimmed_range(const Corners* sample, std::uint32_t count) noexcept {
  float low[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, high[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
  double mean[3] = {0, 0, 0}, deviation[3] = {0, 0, 0};
  for (std::uint32_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], sample[i].lower[k]);
      high[k] = std::max(high[k], sample[i].upper[k]);
      mean[k] += sample[i].centre(k);
    }
  }
  for (double& m : mean) m /= count;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) deviation[k] += std::fabs(sample[i].centre(k) - mean[k]);
  }
  Range range;
  for (int k = 0; k < 3; ++k) {
    range.lower[k] = low[k];
    range.upper[k] = high[k];
    // Uniform data spans 4 mean deviations, a normal distribution's sample of 512 about 8.
    if (double{high[k]} - double{low[k]} <= 9 * deviation[k] / count || count < 8) continue;
    trim(sample, count, k, range.lower[k], range.upper[k]);
  }
  return range;
}

// Where the boxes of a sample lie: the number of a cell along each axis, of 2^finest all along the
// range.
constexpr int finest = Stats::halvings - 1;
struct Places {
  std::uint32_t count;
  std::uint8_t along[3][max_sample];

  Places(const Corners* sample, std::uint32_t boxes, const Range& range) noexcept : count(boxes) {
    for (int k = 0; k < 3; ++k) {
      constexpr double most = 1 << finest;
      const double scale = most / std::max(range.upper[k] - range.lower[k], least_length);
      for (std::uint32_t i = 0; i < count; ++i) {
        const double part = (sample[i].centre(k) - range.lower[k]) * scale;
        along[k][i] = static_cast<std::uint8_t>(std::clamp(part, 0.0, most - 1));
      }
    }
  }
};

// The chance that two of `count` boxes share something, where `same` pairs of them do. Two
// different boxes: a box counted with itself would make small samples look crowded. What chance may
// have brought is left out.
double chance_of(double same, std::uint32_t count) noexcept {
  return (same - 2 * std::sqrt(same)) / (0.5 * count * (count - 1.0));
}

// The chance that two boxes of the sample share a cell, where 2^halvings[k] of them lie along an
// axis.
double chance_in_cells(const Places& places, const int (&halvings)[3]) noexcept {
  // By the low bits of a cell's number, or the next slot that is free.
  constexpr unsigned slots = 2 * max_sample;
  std::uint32_t cell[slots];  // its number, and one more
  std::uint16_t boxes[slots];
  std::fill(cell, cell + slots, 0u);
  const auto of = [&](int k, std::uint32_t i) {
    return std::uint32_t{places.along[k][i]} >> (finest - halvings[k]);
  };
  std::uint64_t same = 0;
  for (std::uint32_t i = 0; i < places.count; ++i) {
    const std::uint32_t at = ((of(2, i) << halvings[1] | of(1, i)) << halvings[0] | of(0, i)) + 1;
    unsigned slot = at % slots;
    while (cell[slot] != at && cell[slot] != 0) slot = (slot + 1) % slots;
    if (cell[slot] == 0) boxes[slot] = 0;
    cell[slot] = at;
    same += boxes[slot]++;
  }
  return chance_of(static_cast<double>(same), places.count);
}

// The same of an axis by itself, of each number of cells.
void measure_axis(const Places& places, int axis, double (&chance)[Stats::halvings]) noexcept {
  std::uint32_t boxes[1 << finest] = {};
  for (std::uint32_t i = 0; i < places.count; ++i) ++boxes[places.along[axis][i]];
  for (int r = finest; r >= 0; --r) {
    std::uint64_t same = 0;
    for (int c = 0; c < 1 << r; ++c) same += std::uint64_t{boxes[c]} * (boxes[c] - 1) / 2;
    chance[r] = std::max(chance_of(static_cast<double>(same), places.count), 1.0 / (1 << r));
    for (int c = 0; c < 1 << r; c += 2) boxes[c / 2] = boxes[c] + boxes[c + 1];
  }
}

// How many times more neighbours a box has than if all were spread evenly. Where cells of an eighth
// of the range are crowded, smaller ones may be more so.
constexpr double crowded_from = 2;
void measure_crowding(const Places& places, const Range& range, Stats& s) noexcept {
  if (places.count < 128) return;
  // Where boxes are about as large as the range all are neighbours, wherever their centres lie:
  // that axis is one cell.
  int halvings[3], all = 0;
  for (int k = 0; k < 3; ++k) {
    halvings[k] = 4 * s.extent[k] >= range.upper[k] - range.lower[k] ? 0 : 3;
    all += halvings[k];
  }
  double most = std::ldexp(chance_in_cells(places, halvings), all);
  if (most > crowded_from) {
    int smaller[3], of_smaller = 0;
    for (int k = 0; k < 3; ++k) of_smaller += smaller[k] = halvings[k] == 0 ? 0 : 5;
    const double crowding = std::ldexp(chance_in_cells(places, smaller), of_smaller);
    if (crowding > most) {
      most = crowding;
      std::copy(smaller, smaller + 3, halvings);
    }
  }
  s.crowding = std::clamp(most, 1.0, 4096.0);
  s.crowded = s.crowding > crowded_from;
  if (!s.crowded) return;
  for (int k = 0; k < 3; ++k) measure_axis(places, k, s.together[k]);
  const auto beyond = [&](const int(&cells)[3]) {
    double by_axes = 1;
    for (int k = 0; k < 3; ++k) by_axes *= s.together[k][cells[k]];
    return std::max(1.0, chance_in_cells(places, cells) / by_axes);
  };
  s.beyond_all = beyond(halvings);
  for (int k = 0; k < 3; ++k) {
    int across[3] = {halvings[0], halvings[1], halvings[2]};
    across[k] = 0;
    s.beyond_across[k] = std::min(s.beyond_all, beyond(across));
  }
}

constexpr std::uint32_t column_counts[] = {1,   2,   3,   4,   5,   6,    7,    8,    10,   12,
                                           14,  16,  20,  24,  28,  32,   40,   48,   56,   64,
                                           80,  96,  112, 128, 160, 192,  224,  256,  320,  384,
                                           448, 512, 640, 768, 896, 1024, 1536, 2048, 3072, 4096};

// Columns have numbers of 32 bits: a plan has 2^17 at most, sections times parts, as price() and
// the loops over sections see to. A position along an axis, columns * 32768 - 1 at most, fits 31.
static_assert(std::uint64_t{max_columns_per_axis} * words_per_column <= 0x7fffffffu);
Quantiser make_map(const Stats& s, const std::uint32_t (&columns)[3]) noexcept {
  Quantiser map;
  for (int k = 0; k < 3; ++k) {
    const double length = double{s.upper[k]} - double{s.lower[k]};
    const double wanted = columns[k] * double{words_per_column} / std::max(length, least_length);
    map.origin[k] = s.lower[k];
    map.scale[k] = static_cast<float>(std::min(wanted, 3e38));
    map.max[k] = largest_index(columns[k]);
    map.columns[k] = columns[k];
  }
  map.stride[0] = columns[1] * columns[2];
  map.stride[1] = columns[2];
  map.stride[2] = 1;
  return map;
}

}  // namespace

double Stats::chance_together(std::uint32_t axis, std::uint32_t cells) const noexcept {
  const double* const chance = together[axis];
  const int r = std::bit_width(cells) - 1;
  const double whole = std::uint32_t{1} << r;
  if (r >= finest) {  // as from the last but one to the last
    const double fall = std::max(-1.0, std::log2(chance[finest] / chance[finest - 1]));
    return chance[finest] * std::pow(cells / double{1 << finest}, fall);
  }
  return chance[r] + (chance[r + 1] - chance[r]) * (cells / whole - 1);
}

Stats measure(const Box* boxes, std::uint32_t count, std::uint64_t query_count,
              std::uint64_t target_count) noexcept {
  Stats s;
  s.query_count = query_count;
  s.target_count = target_count;
  if (count == 0) return s;
  Corners sample[max_sample];
  for (std::uint32_t i = 0; i < count; ++i) sample[i] = corners_of(boxes[i]);
  const Range range = trimmed_range(sample, count);
  for (int k = 0; k < 3; ++k) {
    s.lower[k] = static_cast<float>(range.lower[k]);
    s.upper[k] = static_cast<float>(range.upper[k]);
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    double extent[3];
    for (int k = 0; k < 3; ++k) {
      const double l = std::max(double{sample[i].lower[k]}, range.lower[k]);
      const double u = std::min(double{sample[i].upper[k]}, range.upper[k]);
      extent[k] = std::max(0.0, u - l);
      s.extent[k] += extent[k];
    }
    for (int k = 0; k < 3; ++k) s.product[k] += extent[(k + 1) % 3] * extent[(k + 2) % 3];
  }
  for (int k = 0; k < 3; ++k) {
    s.extent[k] /= count;
    s.product[k] /= count;
  }
  measure_crowding(Places(sample, count, range), range, s);
  return s;
}

GridPlan plan(const Stats& s, const SweepCost& sweep_cost, Algorithm forced,
              float cell_scale) noexcept {
  GridPlan best;
  const double n = static_cast<double>(s.target_count);
  const double work = static_cast<double>(s.query_count);
  if (forced == Algorithm::all_pairs ||
      (forced == Algorithm::automatic && s.target_count <= all_pairs_limit)) {
    best.all_pairs = true;
    best.expected_ns = 0.5 * n * work * brute_ns;
    best.reason = forced == Algorithm::all_pairs ? "brute force was asked for"
                                                 : "so few boxes that brute force is fastest";
    return best;
  }
  // Along an axis without extent all boxes meet: it is neither swept nor cut.
  double length[3], extents[3];
  for (int k = 0; k < 3; ++k) {
    const double range = double{s.upper[k]} - double{s.lower[k]};
    length[k] = std::max(range, least_length);
    extents[k] = range > 0 ? s.extent[k] : length[k];
  }
  const double most_columns = std::clamp(n / 48, 1.0, double{1u << 17});
  // Columns swept along x, as far as their number does not matter. `window`: the share of a
  // column's boxes that begin within one of them.
  struct Sweep {
    double share_x, share_y, share_z, share_yz, window, word_parts, most_parts;
  };
  const auto along = [&](std::uint32_t x) {
    const std::uint32_t y = (x + 1) % 3, z = (x + 2) % 3;
    Sweep sweep;
    sweep.share_x = std::min(1.0, extents[x] / length[x]);
    sweep.share_y = extents[y] / length[y];
    sweep.share_z = extents[z] / length[z];
    sweep.share_yz = s.product[x] / (length[y] * length[z]);
    sweep.window = sweep.share_x;
    if (s.crowded) {
      const double cells = std::clamp(1 / std::max(sweep.share_x, 1e-9), 1.0, 1e9);
      const double chance = s.chance_together(x, static_cast<std::uint32_t>(cells));
      sweep.window = std::min(1.0, chance * s.beyond_all / s.beyond_across[x]);
    }
    // Long columns are cut, where their boxes are short enough for that: to stay in the cache, and
    // for an extent to be some words long, as equal words cost a look at the floats.
    sweep.word_parts = std::ceil(extent_words / (words_per_column * std::max(sweep.share_x, 1e-9)));
    sweep.most_parts = std::min(4096.0, std::floor(0.125 / std::max(sweep.share_x, 1e-9)) + 1);
    return sweep;
  };
  // A box crosses as many of the cy - 1 boundaries as its extent's share of the range.
  const auto replicas_of = [](const Sweep& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double y = cy - 1, z = cz - 1;
    return 1 + sweep.share_y * y + sweep.share_z * z + sweep.share_yz * y * z;
  };
  // What no plan of so many columns or more costs less than.
  const double least_record_ns = record_ns + sweep_cost(0);
  const auto least = [&](const Sweep& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double replicas = replicas_of(sweep, cy, cz);
    return work * (box_ns - replica_ns + replicas * (replica_ns + least_record_ns)) +
           empty_ns * cy * cz;
  };
  // Of the columns across x those that have boxes, as two boxes share one by that chance; where
  // boxes are a little crowded, but spread over all columns, they have so many more neighbours.
  const auto with_boxes = [&](std::uint32_t x, std::uint32_t cy, std::uint32_t cz) {
    if (!s.crowded) return static_cast<double>(cy) * cz / s.crowding;
    const double y = s.chance_together((x + 1) % 3, cy);
    const double z = s.chance_together((x + 2) % 3, cz);
    return std::max(1.0, 1 / (y * z * s.beyond_across[x]));
  };
  struct Price {
    double parts, replicas, cost;
  };
  const auto price = [&](std::uint32_t x, const Sweep& sweep, std::uint32_t cy, std::uint32_t cz) {
    const double sections = static_cast<double>(cy) * cz;
    const double replicas = replicas_of(sweep, cy, cz);
    const double full = with_boxes(x, cy, cz);
    const double per_column = n * replicas / full;
    double parts = sweep.word_parts;
    if (per_column > cached_records) parts = std::max(parts, std::ceil(per_column / part_records));
    if (parts > 1) {
      parts = std::min({parts, sweep.most_parts, std::floor(most_columns / sections)});
      parts = std::max(1.0, parts);
    }
    const double cut = 1 + sweep.share_x * (parts - 1);
    const double record = record_ns + (per_column / parts > cached_records ? uncached_ns : 0) +
                          sweep_cost(per_column * sweep.window);
    const double cost =
        work * (box_ns + replica_ns * (replicas * cut - 1) + replicas * cut * record) +
        (empty_ns * sections + (column_ns - empty_ns) * full) * parts;
    return Price{parts, replicas * cut, cost};
  };
  std::uint32_t best_columns[3] = {1, 1, 1};
  best.expected_ns = DBL_MAX;
  const auto take = [&](std::uint32_t x, std::uint32_t cy, std::uint32_t cz, const Price& p) {
    best.expected_ns = p.cost;
    best.replicas = p.replicas;
    best.sweep_axis = x;
    best_columns[x] = static_cast<std::uint32_t>(p.parts);
    best_columns[(x + 1) % 3] = cy;
    best_columns[(x + 2) % 3] = cz;
  };
  // Whether columns may be so many along an axis that is not swept.
  const auto may_cut = [&](std::uint32_t axis, std::uint32_t count) {
    return count == 1 || extents[axis] < length[axis];
  };
  // Every second number along each axis, and then those around the cheapest.
  constexpr std::uint32_t numbers = sizeof column_counts / sizeof *column_counts;
  std::uint32_t best_y = 0, best_z = 0;
  for (std::uint32_t x = 0; x < 3; ++x) {
    const Sweep sweep = along(x);
    for (std::uint32_t y = 0; y < numbers; y += 2) {
      const std::uint32_t cy = column_counts[y];
      if (cy > most_columns || !may_cut((x + 1) % 3, cy)) break;
      if (least(sweep, cy, 1) >= best.expected_ns) break;
      for (std::uint32_t z = 0; z < numbers; z += 2) {
        const std::uint32_t cz = column_counts[z];
        if (static_cast<double>(cy) * cz > most_columns || !may_cut((x + 2) % 3, cz)) break;
        if (least(sweep, cy, cz) >= best.expected_ns) break;
        const Price p = price(x, sweep, cy, cz);
        if (p.cost >= best.expected_ns) continue;
        take(x, cy, cz, p);
        best_y = y;
        best_z = z;
      }
    }
  }
  const Sweep along_best = along(best.sweep_axis);
  for (std::uint32_t y = best_y - (best_y != 0); y <= std::min(best_y + 1, numbers - 1); ++y) {
    for (std::uint32_t z = best_z - (best_z != 0); z <= std::min(best_z + 1, numbers - 1); ++z) {
      const std::uint32_t cy = column_counts[y], cz = column_counts[z];
      if (static_cast<double>(cy) * cz > most_columns) continue;
      if (!may_cut((best.sweep_axis + 1) % 3, cy) || !may_cut((best.sweep_axis + 2) % 3, cz))
        continue;
      const Price p = price(best.sweep_axis, along_best, cy, cz);
      if (p.cost < best.expected_ns) take(best.sweep_axis, cy, cz, p);
    }
  }
  if (cell_scale != 1) {
    // Finer cells keep to what binds every plan, and a box to a few columns: as near to the scale
    // that is asked for as that allows.
    const std::uint32_t x = best.sweep_axis, y = (x + 1) % 3, z = (x + 2) % 3;
    const std::uint32_t planned[2] = {best_columns[y], best_columns[z]};
    const auto scaled = [&](std::uint32_t count, std::uint32_t axis, double scale) {
      if (extents[axis] >= length[axis]) return 1u;
      return static_cast<std::uint32_t>(
          std::clamp(std::round(count / scale), 1.0, double{max_columns_per_axis}));
    };
    for (double scale = double{cell_scale};; scale *= 1.125) {
      if (cell_scale < 1 && scale >= 1) break;  // the plan stands as it is
      const std::uint32_t cy = scaled(planned[0], y, scale), cz = scaled(planned[1], z, scale);
      const Price p = price(x, along(x), cy, cz);
      const bool few =
          static_cast<double>(cy) * cz <= most_columns && p.replicas <= most_scaled_replicas;
      if (cell_scale < 1 && !few) continue;
      take(x, cy, cz, p);
      break;
    }
  }
  best.crowded = s.crowded;
  best.map = make_map(s, best_columns);
  best.reason = forced == Algorithm::grid ? "the grid was asked for"
                : best.map.column_count() == 1
                    ? "few or wide boxes: one column, swept along its longest axis"
                    : "columns wide enough that few boxes span two, narrow enough that sweep "
                      "windows are short";
  return best;
}

}  // namespace throng::core
