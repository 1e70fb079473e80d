// Chooses the cells and classes of a class grid from a sample of the boxes. What it chooses makes
// the search fast or slow, never wrong (core/class_grid.hpp).
//
// Written for one block of threads in phases, with a barrier after each; the host runs the threads
// of a phase in turn. Only comparisons, integer sums and sums in a fixed order: both choose the
// same.
#pragma once

#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "core/class_grid.hpp"
#include "core/hd.hpp"

namespace throng::core {

constexpr std::uint32_t sample_size = 128;

struct GridSample {
  Box boxes[sample_size];
  std::int32_t worlds[sample_size];  // -2: the box takes no part
};

// Some boxes together.
struct Reach {
  float most[6];            // the corners: lower ends negated, so that the greatest counts of all
  std::uint32_t worlds;     // the highest world, and one
  std::uint32_t changes;    // boxes whose next one has another world
  std::uint32_t looked_at;  // boxes
};

// What a grid must keep to.
struct GridLimits {
  std::uint64_t boxes = 0;
  std::uint32_t table_cells = 1;  // of all classes, groups and worlds together
  std::uint32_t row_cells = 1;    // the longest row of a hashed grid
  std::uint32_t present = 0;      // group bits
  bool has_worlds = false;
  float cell_scale = 1;  // cells so many times as long as the cheapest
};

// Costs in units of one comparison; only their ratios matter. Estimates, to be fitted on a device.
constexpr float row_cost = 1.5f;        // looking up a row of cells
constexpr float hash_row_cost = 3.0f;   // scattered over the table
constexpr float hash_cell_cost = 1.5f;  // strangers met in a cell of a hashed row
constexpr float class_cost = 1.0f;      // a class looked into

class ClassPlanner {
 public:
  static constexpr std::uint32_t threads = 512;
  static constexpr int phases = 7;
  static constexpr std::uint32_t parts = threads / sample_size;
  static constexpr std::uint32_t sizes = 16, schemes = 3;

  struct Shared {
    GridSample loaded, sample;  // as looked up; the active ones alone
    std::uint32_t count;        // of those
    Reach reaches[threads];     // of all that a thread has seen, many more than the sample
    Reach range[threads / 32];
    std::uint32_t rank[7][sample_size];  // of extents, and of centres
    float extent[4][sample_size];        // sorted, per axis; the longest
    float centre[3][sample_size];        // sorted
    std::uint32_t near[2][256];          // pairs by the exponent of their distance; of one world
    std::uint32_t within[2][256];        // the same, up to there
    std::uint32_t least[2];              // the least exponent within which there are some
    const std::uint32_t* reach;          // one of these two
    float scale;                         // neighbours of a box for each of its pairs
    float low[3], length[3];             // the range that holds nearly all boxes
    float unit;                          // at this distance a box has one neighbour
    std::uint32_t base;                  // the least exponent that the sample resolves
    float base_neighbours, shrink;       // neighbours within it; what is left of them at half of it
    float worlds;                        // about how many
    float cost[sizes * schemes];
  };

  // `loaded` and `reaches` are in place.
  THRONG_HD static void run(int phase, std::uint32_t t, Shared& s, const GridLimits& limits,
                            ClassGrid& grid) noexcept {
    if (phase == 0) gather(t, s);
    if (phase == 1) rank(t, s);
    if (phase == 2) scatter(t, s);
    if (phase == 3) summarise(t, s, limits);
    if (phase == 4 && t == 0) resolve(s, limits);
    if (phase == 5 && t < sizes * schemes) {
      ClassGrid candidate;
      s.cost[t] = 0;
      if (s.count) {
        build(t, 1, s, limits, candidate);
        s.cost[t] = price(s, limits, candidate);
      }
    }
    if (phase == 6 && t == 0) {
      std::uint32_t best = 0;
      for (std::uint32_t c = 1; c < sizes * schemes; ++c)
        if (s.cost[c] < s.cost[best]) best = c;
      if (s.count)
        build(best, limits.cell_scale, s, limits, grid);
      else
        grid = ClassGrid{}, finish(grid, limits, 1);
    }
  }

  // What a thread has seen.
  THRONG_HD static Reach nothing() noexcept {
    return {{-most, -most, -most, -most, -most, -most}, 0, 0, 0};
  }
  THRONG_HD static Reach reach_of(const Box& b) noexcept {
    return {{-cut(b.lower.x), -cut(b.lower.y), -cut(b.lower.z), cut(b.upper.x), cut(b.upper.y),
             cut(b.upper.z)},
            0,
            0,
            0};
  }
  THRONG_HD static void join(Reach& a, const Reach& b) noexcept {
    for (int k = 0; k < 6; ++k) a.most[k] = greater(a.most[k], b.most[k]);
    a.worlds = a.worlds > b.worlds ? a.worlds : b.worlds;
    a.changes += b.changes;
    a.looked_at += b.looked_at;
  }

 private:
  static constexpr float most = 1e18f;  // products of three lengths stay finite

  THRONG_HD static float at(const Vec3& v, int k) noexcept {
    return k == 0 ? v.x : k == 1 ? v.y : v.z;
  }
  THRONG_HD static float cut(float x) noexcept { return x < -most ? -most : x > most ? most : x; }
  THRONG_HD static float lesser(float a, float b) noexcept { return a < b ? a : b; }
  THRONG_HD static float greater(float a, float b) noexcept { return a > b ? a : b; }
  THRONG_HD static float extent_of(const Box& b, int k) noexcept {
    return cut(at(b.upper, k)) - cut(at(b.lower, k));
  }
  THRONG_HD static float centre_of(const Box& b, int k) noexcept {
    return 0.5f * cut(at(b.lower, k)) + 0.5f * cut(at(b.upper, k));
  }
  THRONG_HD static float longest_of(const Box& b) noexcept {
    return greater(extent_of(b, 0), greater(extent_of(b, 1), extent_of(b, 2)));
  }
  THRONG_HD static float power_of_two(std::uint32_t exponent) noexcept {
    return std::bit_cast<float>(exponent << 23);
  }

  THRONG_HD static float sorted_value(const Box& b, int k) noexcept {
    return k < 3 ? extent_of(b, k) : k == 3 ? longest_of(b) : centre_of(b, k - 4);
  }

  // The active boxes together, the parts of the range, and zeros.
  THRONG_HD static void gather(std::uint32_t t, Shared& s) noexcept;

  // Some threads a box: how many of a part of the boxes come before it, by extents and by centres,
  // and how near those are.
  THRONG_HD static void rank(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void scatter(std::uint32_t t, Shared& s) noexcept;
  THRONG_HD static void summarise(std::uint32_t t, Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static void resolve(Shared& s, const GridLimits& limits) noexcept;
  THRONG_HD static float neighbours(const Shared& s, float radius) noexcept;
  THRONG_HD static void lay_out(std::uint32_t scheme, const float (&side)[3], float longest,
                                const Shared& s, const GridLimits& limits,
                                ClassGrid& grid) noexcept;
  THRONG_HD static void finish(ClassGrid& grid, const GridLimits& limits, float worlds) noexcept;
  THRONG_HD static float price(const Shared& s, const GridLimits& limits,
                               const ClassGrid& grid) noexcept;
  THRONG_HD static void build(std::uint32_t candidate, float scale, const Shared& s,
                              const GridLimits& limits, ClassGrid& grid) noexcept;
};

}  // namespace throng::core

#include "core/class_planner-inl.hpp"
