// Chooses the cells and classes of a size-class grid from a sample of the boxes. The choice affects
// speed, never correctness (base/size_class_grid.hpp).
//
// Written for one thread block in phases, with a barrier after each; the host runs the threads of a
// phase sequentially. Only comparisons, integer sums and sums in a fixed order: host and device
// choose the same grid. Every frame waits for this block, so its longest thread sets the cost: work
// is distributed over candidates, classes and sampled boxes. Dynamically indexed arrays are in
// shared memory, as thread-local ones would go to device memory.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"
#include "base/size_class_grid.hpp"

namespace throng::device {

constexpr std::uint32_t sample_size = 128;

// Bounds and world statistics of a set of boxes.
struct BoundsSummary {
  float most[6];          // the corners; lower ends negated, so that the maximum applies to all
  std::uint32_t worlds;   // the highest world + 1
  std::uint32_t changes;  // boxes whose successor has another world
  std::uint32_t sampled_count;  // boxes
};

struct GridSample {
  float most[6][sample_size];        // per box, as in BoundsSummary
  std::int32_t worlds[sample_size];  // -2: the box is excluded
};

// Limits of a grid.
struct GridLimits {
  std::uint64_t boxes = 0;
  std::uint32_t table_cells = 1;  // all classes, groups and worlds together
  std::uint32_t row_cells = 1;    // the longest row of a hashed grid
  std::uint32_t present = 0;      // group bits
  bool has_worlds = false;
  float cell_scale = 1;  // factor on the cheapest cell length
};

// Costs in units of one comparison; only their ratios matter. Estimates, not yet fitted on a
// device.
constexpr float row_cost = 1.5f;        // row lookup
constexpr float hash_row_cost = 10.0f;  // row lookup in a hashed table
constexpr float hash_cell_cost = 3.0f;  // boxes of other cells, per cell of a hashed row
constexpr float hash_compare_cost = 1.5f;
constexpr float class_cost = 1.0f;    // per class searched
constexpr float unused_cost = 1.25f;  // factor if no sampled box is of the finest class

// If the cheapest grid costs more per box, boxes are too uneven for cells of one length, or too
// dense: a second plan uses knots. Costs measured: uniform boxes 10 to 12, layers 6 to 12, clusters
// that a hash separates up to 60; two clusters 1,000 of their widths apart 171, 10,000 widths
// 7,100. Knots are used if they halve the cost: for the intended scenes the ratio is 0.44 or less;
// for heaps (static ones too) and rods it is 0.6 or more, and nothing is gained.
constexpr float knot_cost_threshold = 128.0f;

class SizeClassPlanner {
 public:
  static constexpr std::uint32_t threads = 512;
  static constexpr std::uint32_t parts = threads / sample_size;
  static constexpr std::uint32_t sizes = 16, schemes = 3, candidates = sizes * schemes;

  // Values per box: three extents, their maximum, the centre.
  static constexpr int values = 7, longest = 3, centres = 4;

  // 32 .. 63 boxes of the sample, rounded up to a multiple of at_once.
  static constexpr std::uint32_t max_priced = 72;

  // Scratch until the distribution of the boxes is known.
  struct Early {
    GridSample loaded;                  // as loaded
    BoundsSummary reaches[threads];     // of all boxes of a thread, many more than the sample
    BoundsSummary range[64], fewer[8];  // of 8 of these; of 8 of those
    std::uint32_t order[sample_size], active[16];  // active boxes before each within its 8; in all
                                                   // 8
    std::uint32_t near[2][256];    // pairs by exponent of their distance; same for one world
    std::uint32_t within[2][256];  // prefix sums of these
    std::uint32_t near_group_sums[2][32];  // of 8 exponents together
    std::uint32_t least[2];                // the least exponent with some pairs
  };
  // Scratch after that. The candidates' values are adjacent.
  struct Late {
    std::uint64_t before[base::max_size_classes][candidates];  // cells of a class; then of the
                                                               // classes before
    alignas(4) std::uint8_t fit[candidates][76];  // the class of each sampled box; an odd number of
                                                  // words per row avoids bank conflicts
    std::uint8_t used[base::max_size_classes][candidates];  // classes with boxes; per such class:
    float share[base::max_size_classes][candidates];
    float across[base::max_size_classes][3][candidates];  // mean extents, in finest cells
    float cost[base::max_size_classes * (base::max_size_classes + 1) / 2]
              [candidates];  // per pair of classes
  };
  struct Shared {
    std::int32_t world[sample_size];               // active boxes only
    std::uint32_t count;                           // active boxes
    BoundsSummary range;                           // of all boxes seen
    alignas(16) float value[values][sample_size];  // beyond `count`: greater than any
    float extent[4][sample_size];                  // sorted, per axis; then their maximum
    float centre[3][sample_size];                  // sorted
    float scale;                                   // neighbours per box for each pair
    float low[3], length[3];                       // range of nearly all boxes
    bool unbounded[3];                             // most boxes are, along that axis: one cell
    bool some_unbounded[3];                        // some boxes are, most are not
    bool uses_knots;                // second plan: box values are positions among knots
    bool again, uniform_is_better;  // a second plan follows; the first grid is better
    float uniform_cost;
    base::Knots knots[3];
    float unit;                     // distance with one neighbour per box
    std::uint32_t which;            // index of `near`: all worlds, or one
    std::uint32_t base;             // the least exponent that the sample resolves
    float base_pairs, shrink;       // pairs within it; factor per halving
    float neighbours[256];          // within 2^(e+1)
    float worlds, most_neighbours;  // estimates
    // Per candidate:
    std::uint32_t cells[3][candidates];   // finest cells
    float side[3][candidates];            // their length
    std::uint32_t doublings[candidates];  // classes twice as large as the one before
    std::uint32_t shift[base::max_size_classes][candidates];  // 8 bits per axis
    std::uint32_t class_count[candidates], used[candidates];  // bit mask of classes
    bool hashed[candidates], cut[candidates];  // cut: rows were too long; laid out again
    bool some_cut;
    alignas(16) float cost[candidates];
    std::uint32_t best;
    std::uint32_t priced_step, priced_count;  // the sampled boxes that are priced
    float per_priced_box;                     // 1 / priced_count
    alignas(16) float seen[3][max_priced];    // their extents, at most the range
    union {
      Early early;
      Late late;
    };
  };

  // Runs all phases. `each(phase)` calls phase(t) on all threads, then waits for them.
  // `early.loaded` and `early.reaches` are filled by the caller.
  template <class Each>
  THRONG_HD static void run(Shared& s, const GridLimits& limits, base::SizeClassGrid& grid,
                            const Each& each) noexcept {
    each([&](std::uint32_t t) { gather(t, s, limits); });
    each([&](std::uint32_t t) { compact(t, s, limits); });
    // Loops share one copy of the code: loading code that runs once takes longer than running it.
    bool chosen = false;
    THRONG_UNROLL(1)
    for (;;) {
      if (s.count != 0) {
        if (!chosen) {
          each([&](std::uint32_t t) { sort(t, s), count_distances(t, s, limits); });
          each([&](std::uint32_t t) { accumulate_distances(t, s, limits); });
          each([&](std::uint32_t t) { measure_ranges(t, s, limits); });
          each([&](std::uint32_t t) { resolve(t, s, limits); });
          each([&](std::uint32_t t) { spread(t, s); });
        }
        each([&](std::uint32_t t) { measure(t, chosen, s, limits); });
        bool retry = false;
        THRONG_UNROLL(1)
        for (;; retry = true) {
          each([&](std::uint32_t t) { divide(t, chosen, retry, s); });
          each([&](std::uint32_t t) { finish(t, chosen, retry, s, limits); });
          if (retry || !s.some_cut) break;
        }
        if (!chosen) {
          each([&](std::uint32_t t) { fit(t, s); });
          each([&](std::uint32_t t) { average(t, s); });
          each([&](std::uint32_t t) { price(t, s, limits); });
          each([&](std::uint32_t t) {
            if (t < candidates) sum_costs(t, s);
          });
          each([&](std::uint32_t t) { choose(t, s); });
          each([&](std::uint32_t t) { decide_knots(t, s); });
          if (s.uniform_is_better) break;
          // Candidates are compared at scale 1: otherwise the choice of size would undo the scale.
          chosen = limits.cell_scale != 1;
          if (chosen) continue;
        }
      }
      each([&](std::uint32_t t) { write(t, s, limits, grid); });
      if (s.count == 0 || !s.again) break;
      chosen = false;
      each([&](std::uint32_t t) { place_knots(t, s); });
      each([&](std::uint32_t t) { measure_spans(t, s); });
      each([&](std::uint32_t t) { place(t, s); });
      each([&](std::uint32_t t) { place_longest(t, s); });
    }
  }

  // A thread's BoundsSummary.
  THRONG_HD static BoundsSummary empty_summary() noexcept {
    return {{-most, -most, -most, -most, -most, -most}, 0, 0, 0};
  }
  THRONG_HD static BoundsSummary summary_of(const Box& b) noexcept {
    return {{-cut(b.lower.x), -cut(b.lower.y), -cut(b.lower.z), cut(b.upper.x), cut(b.upper.y),
             cut(b.upper.z)},
            0,
            0,
            0};
  }
  THRONG_HD static void join(BoundsSummary& a, const BoundsSummary& b) noexcept {
    for (int k = 0; k < 6; ++k) a.most[k] = greater(a.most[k], b.most[k]);
    a.worlds = a.worlds > b.worlds ? a.worlds : b.worlds;
    a.changes += b.changes;
    a.sampled_count += b.sampled_count;
  }

 private:
  // Unit of planned coordinates: 1e-41 and above are not denormal, as distances are compared by
  // exponent. Values beyond `most` (8e31 in input units) are equal, so that sums of 72 lengths stay
  // finite; lengths are at least `shortest`, so that reciprocals do.
  static constexpr float given_unit = 0x1p12f, most = 0x1p118f, shortest = 0x1p-120f;
  static constexpr float any_extent = 0x1p120f;  // greater than any extent

  THRONG_HD static float cut(float given) noexcept {
    const float x = given * given_unit;
    return x < -most ? -most : x > most ? most : x;
  }
  THRONG_HD static float lesser(float a, float b) noexcept { return a < b ? a : b; }
  THRONG_HD static float greater(float a, float b) noexcept { return a > b ? a : b; }
  THRONG_HD static float extent_of(const GridSample& s, std::uint32_t j, int k) noexcept {
    return s.most[3 + k][j] + s.most[k][j];
  }
  // A division costs about ten other operations.
  THRONG_HD THRONG_OUTLINE static float quotient(float a, float b) noexcept { return a / b; }
  THRONG_HD static float power_of_two(std::uint32_t exponent) noexcept {
    return std::bit_cast<float>(exponent << 23);
  }

  // Four values per load.
  struct Four {
    float value[4];
  };
  THRONG_HD static Four load_four(const float* at) noexcept {
#if defined(__CUDA_ARCH__)
    const float4 four = *reinterpret_cast<const float4*>(at);
    return {{four.x, four.y, four.z, four.w}};
#else
    return {{at[0], at[1], at[2], at[3]}};
#endif
  }
  // Four bytes, little-endian.
  THRONG_HD static std::uint32_t load_bytes(const std::uint8_t* at) noexcept {
#if defined(__CUDA_ARCH__)
    return *reinterpret_cast<const std::uint32_t*>(at);
#else
    return at[0] | at[1] << 8 | at[2] << 16 | static_cast<std::uint32_t>(at[3]) << 24;
#endif
  }
  // float(1 << shift)
  THRONG_HD static float times(std::uint32_t shift) noexcept { return power_of_two(127 + shift); }
  THRONG_HD static std::uint32_t bits_of(std::uint32_t mask) noexcept {
#if defined(__CUDA_ARCH__)
    return static_cast<std::uint32_t>(__popc(mask));
#else
    return static_cast<std::uint32_t>(std::popcount(mask));
#endif
  }

  // The distribution of the boxes: device/plan/size_class_sample-inl.hpp.
  THRONG_HD static void join_member(std::uint32_t member, const BoundsSummary* from,
                                    std::uint32_t step, BoundsSummary& to) noexcept;
  THRONG_HD static bool is_sampled(const Early& e, std::uint32_t j) noexcept;
  THRONG_HD static void gather(std::uint32_t t, Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static void compact(std::uint32_t t, Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static void sort(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void count_distances(std::uint32_t t, Shared& s,
                                        const GridLimits& limits) noexcept;
  THRONG_HD static void accumulate_distances(std::uint32_t t, Shared& s,
                                             const GridLimits& limits) noexcept;
  THRONG_HD static void measure_ranges(std::uint32_t t, Shared& s,
                                       const GridLimits& limits) noexcept;
  THRONG_HD static void resolve(std::uint32_t t, Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static float base_neighbours(const Shared& s) noexcept;
  THRONG_HD static float neighbours_within(const Shared& s, std::uint32_t exponent) noexcept;
  THRONG_HD static void spread(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void decide_knots(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void place_knots(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void measure_spans(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void place(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void place_longest(std::uint32_t t, Shared& s) noexcept;

  // The candidates: device/plan/size_class_candidates-inl.hpp.
  static constexpr std::uint32_t rows = threads / candidates;  // rows of threads, one thread per
                                                               // candidate
  static constexpr std::uint64_t too_many = std::uint64_t{1} << 40;
  static constexpr std::uint32_t one_cell = 22 << 16 | 22 << 8 | 22;  // shifts of the last class
  THRONG_HD static bool handles_candidate(std::uint32_t t, bool chosen, const Shared& s) noexcept;
  THRONG_HD static float side_of(std::uint32_t candidate, std::uint32_t axis, float scale,
                                 const Shared& s) noexcept;
  THRONG_HD static void measure(std::uint32_t t, bool chosen, Shared& s,
                                const GridLimits& limits) noexcept;
  THRONG_HD static std::uint32_t cells_of(std::uint32_t finest, std::uint32_t shift) noexcept;
  THRONG_HD static bool divide_bounded(std::uint32_t candidate, std::uint32_t c, const Shared& s,
                                       std::uint32_t (&shift)[3]) noexcept;
  THRONG_HD static void divide(std::uint32_t t, bool chosen, bool retry, Shared& s) noexcept;
  THRONG_HD static void divide_class(std::uint32_t candidate, std::uint32_t c, Shared& s) noexcept;
  THRONG_HD static void measure_side(std::uint32_t candidate, std::uint32_t axis,
                                     Shared& s) noexcept;
  THRONG_HD static void finish(std::uint32_t t, bool chosen, bool retry, Shared& s,
                               const GridLimits& limits) noexcept;
  THRONG_HD static bool too_large(std::uint64_t all, float worlds,
                                  const GridLimits& limits) noexcept;
  THRONG_HD static void write(std::uint32_t t, const Shared& s, const GridLimits& limits,
                              base::SizeClassGrid& grid) noexcept;

  // Expected cost per box, rows looked up and candidates compared:
  // device/plan/size_class_cost-inl.hpp.
  static constexpr std::uint32_t at_once = 8;
  THRONG_HD static float neighbours(const Shared& s, float radius) noexcept;
  THRONG_HD static void fit(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void average(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void price(std::uint32_t t, Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static float price_of(std::uint32_t candidate, std::uint32_t from, std::uint32_t to,
                                  const Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static void sum_costs(std::uint32_t candidate, Shared& s) noexcept;
  THRONG_HD static void choose(std::uint32_t t, Shared& s) noexcept;
};

}  // namespace throng::device

#include "device/plan/size_class_candidates-inl.hpp"
#include "device/plan/size_class_cost-inl.hpp"
#include "device/plan/size_class_sample-inl.hpp"
