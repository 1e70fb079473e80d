// The device's planner on ordinary and adversarial scenes: the grid is always valid, and good on
// the scenes that it is tuned for.
#include <gtest/gtest.h>

#include <memory>

#include "device/host_device.hpp"
#include "device/pipeline.hpp"
#include "support/hard_boxes.hpp"

namespace throng::device {
namespace {

using tests::BoxList;

struct Planned {
  base::SizeClassGrid grid;
  GridLimits limits;
  std::unique_ptr<PlanGrid::Shared> shared = std::make_unique<PlanGrid::Shared>();
};

Planned plan(const Boxes& boxes, std::uint32_t present = 0, float cell_scale = 1) {
  Planned p;
  Input in = make_input(boxes, nullptr, {});
  in.present = present;
  Report report;
  p.limits = {boxes.size(),  static_cast<std::uint32_t>(boxes.size() * 9 / 4 + 1024),
              8192,          present,
              in.has_worlds, cell_scale};
  std::uint32_t occupied[occupied_words];
  std::fill(std::begin(occupied), std::end(occupied), 7u);
  const PlanGrid planner{in, p.limits, &p.grid, occupied, &report};
  planner(*p.shared, [](const auto& phase) {
    for (std::uint32_t t = 0; t < PlanGrid::threads; ++t) phase(t);
  });
  EXPECT_EQ(std::count(std::begin(occupied), std::end(occupied), 0u), occupied_words);
  return p;
}

// Side of the finest cells of a uniform grid.
float finest_side(const base::SizeClassGrid& grid, int axis) {
  EXPECT_FALSE(grid.uses_knots);
  return 1 / (grid.scale[axis] * grid.unit);
}

void expect_sound(const Planned& p) {
  const base::SizeClassGrid& grid = p.grid;
  ASSERT_GE(grid.class_count, 1u);
  ASSERT_LE(grid.class_count, base::max_size_classes);
  double cells = 0;  // exact below 2^53, and never too small
  for (std::uint32_t c = 0; c < grid.class_count; ++c) {
    const base::SizeClass& k = grid.classes[c];
    if (!grid.hashed) {
      EXPECT_EQ(k.offset, cells);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto finest = static_cast<std::uint32_t>(grid.last[axis]) + 1;
      EXPECT_LE(finest, base::max_class_cells);
      EXPECT_EQ(k.cells[axis], ((finest - 1) >> k.shift[axis]) + 1);
      if (grid.hashed) {
        EXPECT_LE(k.cells[axis], p.limits.row_cells);
      }
      if (c + 1 == grid.class_count) {
        EXPECT_EQ(k.cells[axis], 1u) << "some box may fit nowhere";
      }
    }
    if (c + 1 < grid.class_count) {
      EXPECT_GT(k.cells[0] + k.cells[1] + k.cells[2], 3u) << "two classes of one cell";
    }
    cells += double{1} * k.cells[0] * k.cells[1] * k.cells[2];
  }
  EXPECT_LE(grid.table_cells, p.limits.table_cells);
  if (!grid.hashed) {
    EXPECT_EQ(grid.world_cells, cells);
    EXPECT_GE(grid.world_slots, 1u);
    EXPECT_LE(std::uint64_t{grid.world_slots} * grid.world_cells * base::group_count(grid.present),
              grid.table_cells);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(std::isfinite(grid.origin[axis]));
    EXPECT_TRUE(std::isfinite(grid.scale[axis]));
    EXPECT_GT(grid.scale[axis], 0);
  }
}

TEST(Planning, IsSoundOnHardScenes) {
  for (const auto& scene : tests::hard_scenes(3000)) {
    SCOPED_TRACE(scene.name);
    for (const std::uint32_t present : {0u, 1u, 7u}) expect_sound(plan(scene.boxes, present));
    for (const float scale : {1 / 64.0f, 0.3f, 64.0f}) expect_sound(plan(scene.boxes, 1, scale));
  }
  expect_sound(plan(BoxList(1, tests::cube(0, 0, 0, 1))));
  expect_sound(plan(BoxList(50, {{1, 1, 1}, {0, 0, 0}})));  // none is active
}

// Cells for points may be as small as floats allow: 2^66 cells must not overflow to zero.
TEST(Planning, PointsFarApart) {
  tests::Random r(9);
  for (const float size : {1e-6f, 1.0f, 1e6f, 1e30f}) {
    BoxList boxes;
    for (int k = 0; k < 4000; ++k) boxes.push_back(tests::cube(r.point(-size, size), 0));
    expect_sound(plan(boxes));
  }
}

// Equal cubes at a usual density: cells as large as a box, all boxes in the first class.
TEST(Planning, EqualCubesGetCellsOfTheirSize) {
  const BoxList boxes = tests::uniform_boxes(20000, 3);
  const Planned p = plan(boxes);
  EXPECT_FALSE(p.grid.hashed);
  std::size_t first = 0;
  for (const Box& b : boxes) first += base::class_of(p.grid, base::cells_of(p.grid, b)) == 0;
  EXPECT_EQ(first, boxes.size());
  for (int k = 0; k < 3; ++k) {
    EXPECT_GE(finest_side(p.grid, k), 1.0f);
    EXPECT_LE(finest_side(p.grid, k), 2.1f);
  }
}

// Clusters in an empty world: a dense table would exceed its capacity.
TEST(Planning, SparseWorldsAreHashed) {
  BoxList boxes;
  tests::Random r(4);
  for (int cluster = 0; cluster < 50; ++cluster) {
    const Vec3 at = r.point(-5000, 5000);
    for (int k = 0; k < 400; ++k)
      boxes.push_back(tests::cube(at.x + r.in(0, 12), at.y + r.in(0, 12), at.z + r.in(0, 12), 1));
  }
  const Planned p = plan(boxes);
  EXPECT_TRUE(p.grid.hashed);
  for (int k = 0; k < 3; ++k)
    EXPECT_LE(finest_side(p.grid, k), 10.0f) << "cells as large as clusters";
}

TEST(Planning, OneFarBoxDoesNotStretchTheGrid) {
  BoxList boxes = tests::uniform_boxes(20000, 3);
  boxes[7] = tests::cube(1e30f, 1e30f, -1e30f, 1);
  const Planned p = plan(boxes);
  for (int k = 0; k < 3; ++k) EXPECT_LE(finest_side(p.grid, k), 3.0f);
}

// Inactive boxes do not influence the sample.
TEST(Planning, TheSampleIsOfActiveBoxes) {
  const BoxList boxes = tests::uniform_boxes(20000, 3);
  const Planned plain = plan(boxes);
  for (const bool first : {false, true}) {
    BoxList some = boxes;
    for (std::size_t i = 0; i < 5000; ++i)
      some[first ? i : some.size() - 1 - i].lower.y = std::numeric_limits<float>::quiet_NaN();
    const Planned p = plan(some);
    expect_sound(p);
    EXPECT_GT(p.shared->count, plain.shared->count / 2);
    EXPECT_LT(p.shared->count, plain.shared->count);
    for (std::uint32_t k = 0; k < p.shared->count; ++k)
      for (int axis = 0; axis < 3; ++axis) EXPECT_GE(p.shared->value[axis][k], 0.0f) << k;
  }
}

// Cell sizes double from class to class up to the largest boxes of the sample, then grow eightfold.
TEST(Planning, ClassesReachToTheLargestBoxes) {
  tests::Random r(8);
  BoxList boxes;
  for (int k = 0; k < 20000; ++k) {
    const float size = k % 10 ? 1.0f : 20.0f;
    boxes.push_back(tests::cube(r.point(0, 100), size));
  }
  const Planned p = plan(boxes);
  const base::SizeClassGrid& grid = p.grid;
  ASSERT_GT(grid.class_count, 3u);
  for (std::uint32_t c = 0; c + 2 < grid.class_count; ++c) {
    const auto side = static_cast<float>(1u << grid.classes[c].shift[0]) * finest_side(grid, 0);
    const std::uint32_t step = grid.classes[c + 1].shift[0] - grid.classes[c].shift[0];
    EXPECT_EQ(step, side < 20 ? 1u : 3u) << side;
  }
}

// One world if there are none; otherwise the number of worlds of the boxes.
TEST(Planning, WorldsAreSeen) {
  tests::Random r(9);
  BoxList boxes;
  std::vector<std::int32_t> worlds;
  for (int k = 0; k < 20000; ++k) {
    boxes.push_back(tests::cube(r.point(0, 20), 1));
    worlds.push_back(k % 200);
  }
  Boxes view = boxes;
  const Planned one = plan(view), many = plan([&] {
                                    view.filters.world = {worlds.data(), worlds.size()};
                                    return view;
                                  }());
  EXPECT_EQ(one.shared->worlds, 1);
  EXPECT_GT(many.shared->worlds, 50);
  EXPECT_LT(many.shared->worlds, 800);
}

// Tiles for few boxes, unless an algorithm is given.
TEST(Planning, FewBoxesNeedNoGrid) {
  using OnHost = Pipeline<HostDevice>;
  Input in;
  for (const std::uint64_t count : {std::uint64_t{0}, tile_search_limit, tile_search_limit + 1}) {
    in.count = static_cast<std::uint32_t>(count);
    EXPECT_EQ(OnHost::brute_force(in, Algorithm::automatic), count <= tile_search_limit);
    EXPECT_TRUE(OnHost::brute_force(in, Algorithm::all_pairs));
    EXPECT_FALSE(OnHost::brute_force(in, Algorithm::grid));
  }
}

struct Sizes {
  static constexpr std::uint32_t sorted_above = 4097;
  static std::size_t scan_cells_bytes(std::size_t cells) { return cells / 4096 * 8; }
  static std::size_t sort_cells_bytes(std::size_t count) { return count < 100000 ? 555 : 888; }
};

TEST(Workspace, PartsDoNotOverlap) {
  for (const std::uint32_t count : {1u, 31u, 4097u, 4098u, 1000000u}) {
    Workspace w;
    const std::size_t bytes = w.carve<Sizes>(count, nullptr);
    char* base = reinterpret_cast<char*>(std::uintptr_t{1} << 40);  // never read
    EXPECT_EQ(w.carve<Sizes>(count, base), bytes);
    const std::size_t sorted = count > 4097 ? count : 0;
    const std::pair<const void*, std::size_t> parts[] = {
        {w.report, sizeof(Report)},
        {w.worlds, sizeof(WorldsReport)},
        {w.occupied, Workspace::occupied_count * 4},
        {w.grid, sizeof(base::SizeClassGrid)},
        {w.sums, Sizes::scan_cells_bytes(Workspace::scanned(w.table_cells))},
        {w.table, Workspace::scanned(w.table_cells) * 4},
        {sorted ? nullptr : w.places, std::size_t{sorted ? 0 : count} * 8},
        {w.cells, sorted * 8},
        {w.ids, sorted * 8},
        {w.records, std::size_t{count} * sizeof(Record)},
        {w.scratch, w.scratch_bytes}};
    const char* end = base;
    EXPECT_EQ(static_cast<void*>(w.places) == w.cells, sorted != 0);
    EXPECT_EQ(w.scratch_bytes, sorted == 0 ? 0u : sorted >= 100000 ? 888u : 555u);
    for (const auto& [at, size] : parts) {
      if (!at) continue;
      const char* p = static_cast<const char*>(at);
      EXPECT_GE(p, end);
      EXPECT_EQ((p - base) % 256, 0);
      end = p + size;
    }
    EXPECT_LE(end, base + bytes);
    // The cost per box: 49 bytes, sorted 57, plus a constant.
    EXPECT_LE(bytes, std::size_t{count} * (sorted ? 57 : 49) + 100000);
  }
}

}  // namespace
}  // namespace throng::device
