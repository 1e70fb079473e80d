#include "grid/plan/stats.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/bounds.hpp"
#include "base/quantize.hpp"

namespace throng::grid {
namespace {

constexpr float largest = std::numeric_limits<float>::max();

// A box of the sample. Each loop processes all axes together, as one axis alone would wait for its
// own sums.
struct Corners {
  float lower[3], upper[3];

  double centre(int k) const noexcept { return 0.5 * double{lower[k]} + 0.5 * double{upper[k]}; }
};

Corners corners_of(const Box& b) noexcept {
  return {
      {base::clamp_finite(b.lower.x), base::clamp_finite(b.lower.y), base::clamp_finite(b.lower.z)},
      {base::clamp_finite(b.upper.x), base::clamp_finite(b.upper.y),
       base::clamp_finite(b.upper.z)}};
}

struct Range {
  double lower[3], upper[3];
  bool skewed[3] = {false, false, false};  // half of the boxes begin in a small part of the range
};

// Shrinks [low, high] to exclude a few boxes far beyond the rest. Returns whether half of the boxes
// begin in a small part of the range, but not all at one place; this is checked only if centres
// differ (`apart`).
bool trim(const Corners* sample, std::uint32_t count, int k, bool apart, double& low,
          double& high) noexcept {
  float lowers[max_sample] = {}, uppers[max_sample] = {};
  for (std::uint32_t i = 0; i < count; ++i) {
    lowers[i] = sample[i].lower[k];
    uppers[i] = sample[i].upper[k];
  }
  const std::uint32_t cut = count / 20, quarter = count / 4;
  float* const end = lowers + count;
  std::nth_element(lowers, lowers + cut, end);
  std::nth_element(uppers, uppers + (count - 1 - cut), uppers + count);
  const double inner_low = lowers[cut];
  const double inner_high = std::max(inner_low, double{uppers[count - 1 - cut]});
  const double slack = 0.5 * (inner_high - inner_low);
  low = std::max(low, inner_low - slack);
  high = std::min(high, inner_high + slack);
  if (!apart) return false;
  std::nth_element(lowers + cut, lowers + quarter, end);
  std::nth_element(lowers + quarter, end - quarter, end);
  const double half = double{end[-static_cast<std::ptrdiff_t>(quarter)]} - double{lowers[quarter]};
  return half > 0 && 16 * half < high - low;
}

// The range of the sample, excluding a few boxes that stretch it far beyond the rest.
Range trimmed_range(const Corners* sample, std::uint32_t count) noexcept {
  float low[3] = {largest, largest, largest}, high[3] = {-largest, -largest, -largest};
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
    range.skewed[k] = trim(sample, count, k, deviation[k] > 0, range.lower[k], range.upper[k]);
  }
  return range;
}

// The fraction of the sample's pairs that slabs along an axis do not separate: some slab, of equal
// slabs between two positions, holds a part of both boxes.
template <class Position>
double unseparated_fraction(const Corners* sample, std::uint32_t count, int k, double low,
                            double high, const Position& position) noexcept {
  constexpr std::uint32_t slabs = 128;
  std::uint32_t begin[slabs] = {}, end[slabs] = {};
  const double scale = slabs / std::max(high - low, least_length);
  const auto slab_of = [&](float x) {
    const double part = (double{position(x)} - low) * scale;
    return static_cast<std::uint32_t>(std::clamp(part, 0.0, slabs - 1.0));
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    ++begin[slab_of(sample[i].lower[k])];
    ++end[slab_of(sample[i].upper[k])];
  }
  double apart = 0, ended = 0;
  for (std::uint32_t slab = 0; slab < slabs; ++slab) {
    apart += ended * begin[slab];
    ended += end[slab];
  }
  return 1 - apart / (0.5 * count * (count - 1.0));
}

// Switches an axis to positions by bits if their slabs separate many more boxes than slabs of the
// range do. The centre is 0, the least coordinate or the middle one. Also if all coordinates are
// denormal or nearly so, as processors multiply these slowly. Returns whether it switched.
bool switch_to_bits(Corners* sample, std::uint32_t count, int k, const Range& range,
                    Stats& s) noexcept {
  constexpr double many = 4;
  constexpr double tiny = 8 * double{std::numeric_limits<float>::min()};
  if (range.lower[k] >= range.upper[k]) return false;
  bool take = range.lower[k] > -tiny && range.upper[k] < tiny;
  if (range.skewed[k] && !take) {
    const auto itself = [](float x) { return x; };
    float lowers[max_sample] = {};
    for (std::uint32_t i = 0; i < count; ++i) lowers[i] = sample[i].lower[k];
    std::nth_element(lowers, lowers + count / 2, lowers + count);
    const float middle = lowers[count / 2];
    for (const float centre : {0.0f, *std::min_element(lowers, lowers + count), middle}) {
      const auto position = [centre](float x) { return base::position_by_bits(x, centre); };
      float low = largest, high = -largest;
      for (std::uint32_t i = 0; i < count; ++i) {
        low = std::min(low, position(sample[i].lower[k]));
        high = std::max(high, position(sample[i].upper[k]));
      }
      take = many * unseparated_fraction(sample, count, k, low, high, position) <
             unseparated_fraction(sample, count, k, range.lower[k], range.upper[k], itself);
      if (!take) continue;
      s.centre[k] = centre;
      break;
    }
  }
  s.by_bits[k] = take;
  for (std::uint32_t i = 0; i < count && take; ++i) {
    sample[i].lower[k] = base::position_by_bits(sample[i].lower[k], s.centre[k]);
    sample[i].upper[k] = base::position_by_bits(sample[i].upper[k], s.centre[k]);
  }
  return take;
}

// The cells of the sample's boxes: indices along each axis, of 2^finest cells over the range.
constexpr int finest = Stats::levels - 1;
struct CellIndices {
  std::uint32_t count;
  std::uint8_t along[3][max_sample];

  CellIndices(const Corners* sample, std::uint32_t boxes, const Range& range) noexcept
      : count(boxes) {
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

// The probability that two of `count` boxes share something, if `same` pairs do. Pairs of two
// different boxes: a box counted with itself would make small samples look clustered. Two standard
// deviations are subtracted.
double pair_probability(double same, std::uint32_t count) noexcept {
  return (same - 2 * std::sqrt(same)) / (0.5 * count * (count - 1.0));
}

// The probability that two boxes of the sample share a cell, with 2^levels[k] cells along axis k.
double shared_cell_probability(const CellIndices& places, const int (&levels)[3]) noexcept {
  // A hash table: low bits of a cell's index, linear probing.
  constexpr unsigned slots = 2 * max_sample;
  std::uint32_t cell[slots];  // index + 1; 0: free
  std::uint16_t boxes[slots];
  std::fill(cell, cell + slots, 0u);
  const auto of = [&](int k, std::uint32_t i) {
    return std::uint32_t{places.along[k][i]} >> (finest - levels[k]);
  };
  std::uint64_t same = 0;
  for (std::uint32_t i = 0; i < places.count; ++i) {
    const std::uint32_t at = ((of(2, i) << levels[1] | of(1, i)) << levels[0] | of(0, i)) + 1;
    unsigned slot = at % slots;
    while (cell[slot] != at && cell[slot] != 0) slot = (slot + 1) % slots;
    if (cell[slot] == 0) boxes[slot] = 0;
    cell[slot] = at;
    same += boxes[slot]++;
  }
  return pair_probability(static_cast<double>(same), places.count);
}

// Of one axis alone: see Stats::effective_slabs.
void measure_slabs(const CellIndices& places, int axis,
                   double (&effective_slabs)[Stats::levels]) noexcept {
  std::uint32_t boxes[1 << finest] = {};
  for (std::uint32_t i = 0; i < places.count; ++i) ++boxes[places.along[axis][i]];
  for (int r = finest; r >= 0; --r) {
    std::uint64_t same = 0;
    for (int c = 0; c < 1 << r; ++c) {
      const std::uint64_t of_slab = boxes[c];
      same += (of_slab * of_slab - of_slab) / 2;
    }
    const double all = 1 << r;
    effective_slabs[r] =
        1 / std::max(pair_probability(static_cast<double>(same), places.count), 1 / all);
    for (int c = 0; c < 1 << r; c += 2) boxes[c / 2] = boxes[c] + boxes[c + 1];
  }
}

// Measures the density relative to an even spread. If cells of an eighth of the range are
// clustered, smaller ones may be more so.
constexpr double clustered_threshold = 2;
void measure_density(const CellIndices& places, const Range& range, Stats& s) noexcept {
  if (places.count < 128) return;
  // If boxes are about as large as the range, all are neighbours wherever their centres lie: that
  // axis is one cell.
  struct Cells {
    int levels[3];
    double chance, density_ratio;
  };
  const auto density_in_cells = [&](int levels) {
    Cells cells;
    int all = 0;
    for (int k = 0; k < 3; ++k) {
      cells.levels[k] = 4 * s.extent[k] >= range.upper[k] - range.lower[k] ? 0 : levels;
      all += cells.levels[k];
    }
    cells.chance = shared_cell_probability(places, cells.levels);
    cells.density_ratio = std::ldexp(cells.chance, all);
    return cells;
  };
  Cells cells = density_in_cells(3);
  if (cells.density_ratio > clustered_threshold) {
    const Cells smaller = density_in_cells(5);
    if (smaller.density_ratio > cells.density_ratio) cells = smaller;
  }
  s.density_ratio = std::clamp(cells.density_ratio, 1.0, 4096.0);
  s.clustered = s.density_ratio > clustered_threshold;
  if (!s.clustered) return;
  for (int k = 0; k < 3; ++k) {
    if (cells.levels[k] != 0) {
      measure_slabs(places, k, s.effective_slabs[k]);
    } else {
      for (int r = 0; r <= finest; ++r) s.effective_slabs[k][r] = 1 << r;
    }
  }
  const auto beyond = [&](const int(&levels)[3], double chance) {
    for (int k = 0; k < 3; ++k) chance *= s.effective_slabs[k][levels[k]];
    return std::max(1.0, chance);
  };
  s.joint_correlation = beyond(cells.levels, cells.chance);
  for (int k = 0; k < 3; ++k) {
    int across[3] = {cells.levels[0], cells.levels[1], cells.levels[2]};
    across[k] = 0;
    s.axis_correlation[k] =
        std::min(s.joint_correlation, beyond(across, shared_cell_probability(places, across)));
  }
}

// Compares a few boxes with the whole sample: see Stats::layer_overlap.
void measure_windows(const Corners* sample, std::uint32_t count, const Range& range,
                     Stats& s) noexcept {
  constexpr std::uint32_t probes = 8;
  if (s.clustered || count < 4 * probes) return;
  for (int k = 0; k < 3; ++k) {
    float lowers[max_sample];
    for (std::uint32_t i = 0; i < count; ++i) lowers[i] = sample[i].lower[k];
    std::uint32_t all = 0;
    double extents = 0;
    for (std::uint32_t probe = 0; probe < probes; ++probe) {
      const Corners& box = sample[probe * count / probes];
      const float low = box.lower[k], high = box.upper[k];
      for (std::uint32_t i = 0; i < count; ++i)
        all += static_cast<std::uint32_t>(lowers[i] >= low) &
               static_cast<std::uint32_t>(lowers[i] <= high);
      const double from = std::max(double{low}, range.lower[k]);
      extents += std::max(0.0, std::min(double{high}, range.upper[k]) - from);
    }
    const double others = all - probes;  // each begins within itself
    const double share = (others - 2 * std::sqrt(others)) / (probes * (count - 1.0));
    const double length = std::max(range.upper[k] - range.lower[k], least_length);
    const double even = extents / (probes * length);
    if (share > clustered_threshold * even) s.layer_overlap[k] = share - even;
  }
}

}  // namespace

double Stats::effective_slabs_at(std::uint32_t axis, std::uint32_t slabs) const noexcept {
  const double* const of = effective_slabs[axis];
  const unsigned r = static_cast<unsigned>(std::bit_width(std::max(slabs, 1u))) - 1;
  const double whole = std::uint32_t{1} << r;
  if (r >= finest) {  // extrapolates the last ratio
    const double rise = std::clamp(std::log2(of[finest] / of[finest - 1]), 0.0, 1.0);
    return of[finest] * std::pow(slabs / double{1 << finest}, rise);
  }
  return of[r] + (of[r + 1] - of[r]) * (slabs / whole - 1);
}

Stats measure(const Box* boxes, std::uint32_t count, std::uint64_t query_count,
              std::uint64_t target_count) noexcept {
  Stats s;
  s.query_count = query_count;
  s.target_count = target_count;
  s.comparisons = 0.5 * static_cast<double>(query_count) * static_cast<double>(target_count);
  if (count == 0) return s;
  Corners sample[max_sample];
  for (std::uint32_t i = 0; i < count; ++i) sample[i] = corners_of(boxes[i]);
  Range range;
  for (bool taken = true; taken;) {  // the range changes with the positions
    range = trimmed_range(sample, count);
    taken = false;
    for (int k = 0; k < 3; ++k)
      taken |= !s.by_bits[k] && switch_to_bits(sample, count, k, range, s);
  }
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
  measure_density(CellIndices(sample, count, range), range, s);
  measure_windows(sample, count, range, s);
  return s;
}

}  // namespace throng::grid
