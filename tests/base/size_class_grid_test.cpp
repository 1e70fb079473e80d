// The separate rules by which a size-class grid loses no pair and reports none twice.
#include "base/size_class_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "base/bounds.hpp"
#include "support/hard_boxes.hpp"
#include "support/lattices.hpp"
#include "support/random.hpp"

namespace throng::base {
namespace {

using tests::infinity;
using tests::Random;

// A grid that the planner could produce, with odd numbers of cells and any origin.
SizeClassGrid random_grid(Random& r) {
  SizeClassGrid grid;
  std::uint32_t cells[3];
  grid.unit = std::ldexp(1.0f, r.between(-3, 12));
  grid.uses_knots = r.one_in(2);
  for (int k = 0; k < 3; ++k) {
    cells[k] = 1 + r.below(r.one_in(3) ? 3 : 300);
    float length = r.magnitude(-4, 12) * grid.unit;
    grid.origin[k] = r.in(-1, 1) * r.magnitude(-4, 14) * grid.unit;
    if (grid.uses_knots) {
      // Spans of any length, zero included; the last span has a length, so that it has cells.
      Knots& knots = grid.knots[k];
      knots.at[0] = grid.origin[k];
      for (std::uint32_t i = 0; i < knot_spans; ++i) {
        const bool none = i + 1 < knot_spans && r.one_in(5);
        knots.at[i + 1] = knots.at[i] + (none ? 0 : length * r.magnitude(-20, 0));
        if (i + 1 == knot_spans) knots.at[i + 1] = tests::nudge(knots.at[i + 1], 1);
        const float span = knots.at[i + 1] - knots.at[i];
        knots.scale[i] = span > 0 ? 1 / span : 0;
      }
      grid.origin[k] = 0;
      length = knot_spans;
    }
    grid.scale[k] = static_cast<float>(cells[k]) / length;
    grid.last[k] = static_cast<float>(cells[k] - 1);
  }
  grid.class_count = static_cast<std::uint32_t>(r.between(1, 6));
  std::uint32_t offset = 0;
  for (std::uint32_t c = 0; c < grid.class_count; ++c) {
    SizeClass& k = grid.classes[c];
    k.offset = offset;
    for (int axis = 0; axis < 3; ++axis) {
      // Not nested: a later class may be finer on an axis.
      k.shift[axis] = c + 1 == grid.class_count ? 22 : r.below(5);
      k.cells[axis] = ((cells[axis] - 1) >> k.shift[axis]) + 1;
    }
    offset += k.cells[0] * k.cells[1] * k.cells[2];
  }
  grid.world_cells = offset;
  grid.table_cells = offset;
  return grid;
}

// Length of one cell, or the mean with knots.
float cell_length(const SizeClassGrid& grid, int axis) {
  return static_cast<float>(
      (coordinate_before(grid, axis, grid.last[axis] + 1) - coordinate_before(grid, axis, 0)) /
      (grid.last[axis] + 1));
}
float coordinate(const SizeClassGrid& grid, int axis, Random& r) {
  if (r.one_in(40)) return r.one_in(2) ? infinity : -infinity;
  // The float nearest to a cell edge, a neighbour of it, or any value.
  const float cell = static_cast<float>(r.between(-2, static_cast<int>(grid.last[axis]) + 2));
  const auto at = static_cast<float>(coordinate_before(grid, axis, cell));
  return r.one_in(4) ? at + r.in(-2, 2) * cell_length(grid, axis)
                     : tests::nudge(at, r.between(-2, 2));
}

Box random_box(const SizeClassGrid& grid, Random& r) {
  Box b;
  for (int k = 0; k < 3; ++k) {
    float low = coordinate(grid, k, r), high = coordinate(grid, k, r);
    if (r.one_in(2)) high = low + r.in(0, 2) * cell_length(grid, k);
    if (high < low) std::swap(low, high);
    (&b.lower.x)[k] = low;
    (&b.upper.x)[k] = high;
  }
  return b;
}

// coordinate_before() is the inverse of cells_before().
TEST(SizeClassGrid, CellsBeforeAndWhere) {
  Random r(11);
  for (int round = 0; round < 200; ++round) {
    const SizeClassGrid grid = random_grid(r);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 50; ++k) {
        const float x = coordinate(grid, axis, r), before = cells_before(grid, axis, x);
        ASSERT_GE(before, 0);
        ASSERT_LE(before, grid.last[axis] + 1);
        ASSERT_EQ(std::min(static_cast<float>(static_cast<int>(before)), grid.last[axis]),
                  static_cast<float>(cell_of(grid, axis, x)));
        // To float precision, products included.
        const auto where = static_cast<float>(coordinate_before(grid, axis, before));
        const float slack = 1e-4f * (grid.last[axis] + 1);
        ASSERT_GE(before, cells_before(grid, axis, tests::nudge(where, -3)) - slack);
        ASSERT_LE(before, cells_before(grid, axis, tests::nudge(where, 3)) + slack);
      }
    }
  }
}

TEST(SizeClassGrid, CellsAreMonotonic) {
  Random r(1);
  for (int round = 0; round < 200; ++round) {
    const SizeClassGrid grid = random_grid(r);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(cell_of(grid, axis, -infinity), 0);
      EXPECT_EQ(cell_of(grid, axis, infinity), static_cast<int>(grid.last[axis]));
      for (int k = 0; k < 200; ++k) {
        const float x = coordinate(grid, axis, r), y = coordinate(grid, axis, r);
        ASSERT_LE(cell_of(grid, axis, std::min(x, y)), cell_of(grid, axis, std::max(x, y)));
        ASSERT_LE(cell_of(grid, axis, x), cell_of(grid, axis, tests::nudge(x, 1)));
      }
    }
  }
}

TEST(SizeClassGrid, EveryBoxBelongsToAClassInWhichItSpansTwoCells) {
  Random r(2);
  int finest = 0, coarsest = 0;
  for (int round = 0; round < 500; ++round) {
    const SizeClassGrid grid = random_grid(r);
    for (int k = 0; k < 40; ++k) {
      const CellSpan span = cells_of(grid, random_box(grid, r));
      const std::uint32_t c = class_of(grid, span);
      ASSERT_LT(c, grid.class_count);
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t shift = grid.classes[c].shift[axis];
        ASSERT_LE((span.upper[axis] >> shift) - (span.lower[axis] >> shift), 1);
      }
      finest += c == 0;
      coarsest += c > 0 && c + 1 == grid.class_count;
    }
  }
  EXPECT_GT(finest, 1000);
  EXPECT_GT(coarsest, 1000);
}

// The central lemma of the grid.
TEST(SizeClassGrid, StorageCellIsInTheSearchedRange) {
  Random r(3);
  int overlapping = 0, at_first = 0, at_last = 0;
  for (int round = 0; round < 3000; ++round) {
    const SizeClassGrid grid = random_grid(r);
    std::vector<Box> boxes;
    for (int k = 0; k < 30; ++k) boxes.push_back(random_box(grid, r));
    for (const Box& a : boxes) {
      const CellSpan from = cells_of(grid, a);
      for (const Box& b : boxes) {
        if (!overlaps(a, b)) continue;
        ++overlapping;
        const CellSpan to = cells_of(grid, b);
        const SizeClass& c = grid.classes[class_of(grid, to)];
        for (int k = 0; k < 3; ++k) {
          const int storage_cell = to.lower[k] >> c.shift[k];
          ASSERT_GE(storage_cell, (from.lower[k] >> c.shift[k]) - 1);
          ASSERT_LE(storage_cell, from.upper[k] >> c.shift[k]);
          at_first += storage_cell == (from.lower[k] >> c.shift[k]) - 1;
          at_last += storage_cell == (from.upper[k] >> c.shift[k]);
        }
      }
    }
  }
  EXPECT_GT(overlapping, 100000);
  EXPECT_GT(at_first, 1000) << "neither end may be skipped";
  EXPECT_GT(at_last, 1000);
}

TEST(SizeClassGrid, GroupsPackAndUnpack) {
  for (std::uint32_t present = 0; present < 8; ++present) {
    std::set<std::uint32_t> seen;
    for (std::uint32_t index = 0; index < group_count(present); ++index) {
      const std::uint32_t bits = unpack_group(present, index);
      EXPECT_EQ(bits & ~present, 0u);
      EXPECT_EQ(pack_group(present, bits), index);
      seen.insert(bits);
    }
    EXPECT_EQ(seen.size(), group_count(present));
  }
}

// Of two boxes that may pair exactly one searches for the other; within one group and class either
// does, by the order of cells. Of two that may not pair, none does.
TEST(SizeClassGrid, ExactlyOneSearches) {
  for (const bool two_sets : {false, true}) {
    const std::uint32_t present = two_sets ? 7 : 3;
    for (std::uint32_t g = 0; g < 8; ++g)
      for (std::uint32_t h = 0; h < 8; ++h)
        for (std::uint32_t c = 0; c < 4; ++c)
          for (std::uint32_t d = 0; d < 4; ++d) {
            if (((g | h) & ~present) != 0) continue;
            const SearchMode there = search_mode(present, g, c, h, d),
                             back = search_mode(present, h, d, g, c);
            const bool may = !(g & h & static_bit) && (!two_sets || ((g ^ h) & second_bit));
            const int searches = (there == SearchMode::all) + (back == SearchMode::all);
            if (!may) {
              EXPECT_EQ(there, SearchMode::no);
            } else if (g == h && c == d) {
              EXPECT_EQ(there, SearchMode::forward);
            } else {
              EXPECT_EQ(searches, 1) << g << ' ' << c << ' ' << h << ' ' << d;
              EXPECT_NE(there, SearchMode::forward);
            }
            // Searches coarser cells, of which a box touches at most three per axis.
            if (may && c < d && !((g ^ h) & everywhere_bit)) {
              EXPECT_EQ(there, SearchMode::all);
            }
            // A box in every world cannot select a world to search.
            if ((g & everywhere_bit) && !(h & everywhere_bit)) {
              EXPECT_EQ(there, SearchMode::no);
            }
          }
  }
}

TEST(SizeClassGrid, CellsOfTheTableAreDistinct) {
  Random r(5);
  for (int round = 0; round < 60; ++round) {
    SizeClassGrid grid = random_grid(r);
    if (grid.world_cells > 200000) continue;
    grid.present = r.below(8);
    grid.world_slots = 1 + r.below(3);
    grid.table_cells = grid.world_cells * group_count(grid.present) * grid.world_slots;
    std::vector<bool> taken(grid.table_cells, false);
    for (std::uint32_t world = 0; world < grid.world_slots; ++world)
      for (std::uint32_t g = 0; g < group_count(grid.present); ++g)
        for (std::uint32_t c = 0; c < grid.class_count; ++c)
          for (std::uint32_t z = 0; z < grid.classes[c].cells[2]; ++z)
            for (std::uint32_t y = 0; y < grid.classes[c].cells[1]; ++y) {
              const auto at = [&](std::uint32_t w) {
                return row_start(grid, part_of(grid, w, g, c), static_cast<int>(y),
                                 static_cast<int>(z));
              };
              const std::uint32_t start = at(world);
              ASSERT_EQ(start, at(world + grid.world_slots));
              for (std::uint32_t x = 0; x < grid.classes[c].cells[0]; ++x) {
                ASSERT_LT(start + x, grid.table_cells);
                ASSERT_FALSE(taken[start + x]);
                taken[start + x] = true;
              }
            }
  }
}

// Uniform hashing: no part of the table holds much more than its share.
TEST(SizeClassGrid, HashedRowsSpread) {
  SizeClassGrid grid;
  grid.hashed = true;
  grid.table_cells = 64 * 1000;
  grid.classes[0].cells[1] = 300;
  std::vector<int> parts(64);
  for (int z = 0; z < 300; ++z)
    for (int y = 0; y < 300; ++y) {
      const std::uint32_t start = row_start(grid, part_of(grid, 0, 0, 0), y, z);
      ASSERT_LT(start, grid.table_cells);
      ++parts[start / 1000];
    }
  for (const int rows : parts) {
    EXPECT_GT(rows, 300 * 300 / 64 * 8 / 10);
    EXPECT_LT(rows, 300 * 300 / 64 * 12 / 10);
  }
}

}  // namespace
}  // namespace throng::base
