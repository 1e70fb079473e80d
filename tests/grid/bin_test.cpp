// Binning alone, on few boxes and a grid of unit columns made by hand: every box is in each column
// that it touches, once, with the bounds that it has there, or apart as a wide box; and the report
// counts those that take no part.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <throng/options.hpp>

#include "base/threads.hpp"
#include "grid/bin/grid.hpp"
#include "grid/emit/worker.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

using tests::BoxList;
using tests::Random;

constexpr std::uint32_t columns[3] = {6, 5, 4};

// Columns of width 1, from 0 on each axis.
GridPlan unit_columns() {
  GridPlan plan;
  std::uint32_t stride = 1;
  for (int k = 2; k >= 0; --k) {
    plan.map.columns[k] = plan.columns[k] = columns[k];
    plan.map.scale[k] = base::steps_per_column;
    plan.map.max[k] = base::largest_index(columns[k]);
    plan.map.stride[k] = stride;
    stride *= columns[k];
  }
  return plan;
}

struct Entry {
  std::vector<std::uint16_t> bounds;  // lower, then upper
  std::uint32_t id;
  bool operator<(const Entry& other) const {
    return std::tie(id, bounds) < std::tie(other.id, other.bounds);
  }
  bool operator==(const Entry&) const = default;
};
using Entries = std::vector<Entry>;

// What a side of a grid contains.
struct Contents {
  std::vector<Entries> columns;
  std::vector<std::uint32_t> wide;  // ids
  bool operator==(const Contents&) const = default;
};

// The column and the position in it, in steps, of a coordinate that is a multiple of a step.
struct Place {
  int column;
  std::uint16_t step;
};
Place place_of(float x, int axis) {
  const float inside = std::clamp(x, 0.0f, static_cast<float>(columns[axis]));
  if (inside == static_cast<float>(columns[axis]))
    return {static_cast<int>(columns[axis]) - 1, base::max_quantized};
  const float start = std::floor(inside);
  const float step = (inside - start) * base::steps_per_column;
  return {static_cast<int>(start), static_cast<std::uint16_t>(std::max(step, 1.0f))};
}

Contents expected(const BoxList& boxes, std::uint32_t first_id) {
  Contents all{std::vector<Entries>(columns[0] * columns[1] * columns[2]), {}};
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    const Box& b = boxes[i];
    const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
    const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
    if (!(lower[0] <= upper[0] && lower[1] <= upper[1] && lower[2] <= upper[2])) continue;
    double touched = 1;
    for (int k = 0; k < 3; ++k)
      touched *= place_of(upper[k], k).column - place_of(lower[k], k).column + 1;
    if (touched > base::cost.wide_columns) {
      all.wide.push_back(first_id + i);
      continue;
    }
    for (std::uint32_t c = 0; c < all.columns.size(); ++c) {
      const int at[3] = {static_cast<int>(c / (columns[1] * columns[2])),
                         static_cast<int>(c / columns[2] % columns[1]),
                         static_cast<int>(c % columns[2])};
      Entry entry{std::vector<std::uint16_t>(6), first_id + i};
      bool touches = true;
      for (int k = 0; k < 3; ++k) {
        const Place from = place_of(lower[k], k), to = place_of(upper[k], k);
        touches &= from.column <= at[k] && at[k] <= to.column;
        entry.bounds[k] = from.column < at[k] ? std::uint16_t{0} : from.step;
        entry.bounds[3 + k] = to.column > at[k] ? base::max_quantized : to.step;
      }
      if (touches) all.columns[c].push_back(entry);
    }
  }
  return all;
}

Contents contents(const BinnedGrid& grid, unsigned side) {
  Contents all;
  all.columns.resize(grid.column_count());
  for (std::uint32_t c = 0; c < grid.column_count(); ++c) {
    grid.each_record(c, side, [&](const Record& r) {
      all.columns[c].push_back(
          {{r.lower[0], r.lower[1], r.lower[2], r.upper[0], r.upper[1], r.upper[2]}, r.id});
    });
    std::sort(all.columns[c].begin(), all.columns[c].end());
  }
  for (const WideBox& box : grid.wide(side)) all.wide.push_back(box.id);
  std::sort(all.wide.begin(), all.wide.end());
  return all;
}

// Boxes of sixteenths: around the grid, some beyond it, of no extent, or over most of it.
BoxList sixteenths(std::uint32_t count, Random& random) {
  BoxList boxes(count);
  for (Box& b : boxes) {
    const int longest = random.one_in(8) ? 110 : random.one_in(4) ? 20 : 4;
    const auto lower = [&] { return static_cast<float>(random.between(-10, 105)) / 16; };
    const auto extent = [&] { return static_cast<float>(random.between(0, longest)) / 16; };
    b.lower = {lower(), lower(), lower()};
    b.upper = {b.lower.x + extent(), b.lower.y + extent(), b.lower.z + extent()};
  }
  return boxes;
}

struct Binned {
  Binned(const BoxList& queries, const BoxList& targets, Isa isa, unsigned tasks)
      : a(queries), b(targets) {
    search.a = &a;
    search.b = &b;
    search.two_sets = true;
    search.kernels = find_kernels(isa);
    search.executor = &base::default_executor();
    search.memory = &memory;
    problem.queries = {&a, nullptr, static_cast<std::uint32_t>(a.size())};
    problem.targets = {&b, nullptr, static_cast<std::uint32_t>(b.size())};
    problem.self = false;
    problem.target_id_offset = problem.queries.count;
    for (unsigned t = 0; t < tasks; ++t) workers.push_back(std::make_unique<Worker>(memory));
    for (auto& worker : workers) team.push_back(worker.get());
    report = grid.bin({search, problem, plan, team});
    EXPECT_FALSE(search.failed());
  }

  base::Memory memory{std::pmr::new_delete_resource(), 0};
  Boxes a, b;
  Search search;
  Problem problem;
  GridPlan plan = unit_columns();
  std::vector<std::unique_ptr<Worker>> workers;
  std::vector<Worker*> team;
  BinnedGrid grid{memory};
  BinReport report;
};

TEST(Bin, EachBoxIsInEachColumnThatItTouches) {
  Random random(1);
  for (const Isa isa : all_isas) {
    if (!find_kernels(isa)) continue;
    for (const unsigned tasks : {1u, 3u}) {
      for (const std::uint32_t count : {0u, 1u, 7u, 300u, 2000u}) {
        SCOPED_TRACE(std::string(to_string(isa)) + ", tasks " + std::to_string(tasks) + ", boxes " +
                     std::to_string(count));
        const BoxList queries = sixteenths(count, random), targets = sixteenths(50, random);
        Binned binned(queries, targets, isa, tasks);
        const Contents want[2] = {expected(queries, 0), expected(targets, count)};
        for (unsigned side = 0; side < 2; ++side)
          EXPECT_EQ(contents(binned.grid, side), want[side]) << "side " << side;
        const auto sizes = binned.grid.count_records();
        std::size_t records = 0;
        for (std::uint32_t c = 0; c < sizes.size(); ++c) {
          EXPECT_EQ(sizes[c], want[0].columns[c].size() + want[1].columns[c].size());
          records += sizes[c];
        }
        EXPECT_LE(records, binned.grid.record_bound());
        EXPECT_EQ(binned.report.inactive, 0u);
        if (count == 2000u) {
          EXPECT_FALSE(want[0].wide.empty()) << "the scene has wide boxes";
        }
      }
    }
  }
}

TEST(Bin, ReportsBoxesThatTakeNoPart) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  Random random(2);
  for (const Isa isa : all_isas) {
    if (!find_kernels(isa)) continue;
    SCOPED_TRACE(to_string(isa));
    BoxList queries = sixteenths(600, random), targets = sixteenths(300, random);
    std::swap(queries[3].lower.y, queries[3].upper.y);
    queries[3].upper.y -= 1;
    queries[511].upper.z = nan;
    queries[400].lower.x = nan;
    targets[0].lower.z = nan;
    const Binned binned(queries, targets, isa, 2);
    EXPECT_EQ(binned.report.inactive, 4u);
    EXPECT_EQ(binned.report.nan_count, 3u);
    EXPECT_EQ(binned.report.first_nan, 400u);
    EXPECT_FALSE(binned.report.nan_in_targets);
    EXPECT_EQ(contents(binned.grid, 0), expected(queries, 0));
    EXPECT_EQ(contents(binned.grid, 1), expected(targets, 600));
  }
}

// The largest columns first; no order where sizes are similar.
TEST(Bin, ColumnsBySize) {
  const auto cube = [](float x, float y, float z) {
    return Box{{x, y, z}, {x + 0.25f, y + 0.25f, z + 0.25f}};
  };
  BoxList boxes(30, cube(3.5f, 1.5f, 0.5f));
  boxes.insert(boxes.end(), 10, cube(0.5f, 0.5f, 0.5f));
  boxes.push_back(cube(4.5f, 3.5f, 2.5f));
  Binned uneven(boxes, {}, Isa::automatic, 2);
  const auto order = uneven.grid.largest_first();
  ASSERT_EQ(order.size(), 3u);
  EXPECT_EQ(order[0], 3 * 20 + 1 * 4 + 0u);
  EXPECT_EQ(order[1], 0u);
  EXPECT_EQ(order[2], 4 * 20 + 3 * 4 + 2u);

  BoxList even;
  for (std::uint32_t c = 0; c < 120; ++c)
    even.push_back(cube(static_cast<float>(c / 20) + 0.5f, static_cast<float>(c / 4 % 5) + 0.5f,
                        static_cast<float>(c % 4) + 0.5f));
  Binned similar(even, {}, Isa::automatic, 2);
  EXPECT_TRUE(similar.grid.largest_first().empty());
}

}  // namespace
}  // namespace throng::grid
