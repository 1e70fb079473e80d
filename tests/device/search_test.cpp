// The search in a grid that no planner would choose.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "base/threads.hpp"
#include "device/host_device.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"
#include "support/reference.hpp"

namespace throng::device {
namespace {

using tests::BoxList;

// 24 x 24 cells of the unit square, each a row, and a class of one cell.
base::SizeClassGrid many_rows(const GridLimits& limits) {
  base::SizeClassGrid grid;
  grid.scale[1] = grid.scale[2] = 24;
  grid.last[1] = grid.last[2] = 23;
  grid.class_count = 2;
  grid.present = limits.present;
  grid.world_cells = 24 * 24 + 1;
  grid.table_cells = limits.table_cells;
  grid.classes[0].cells[1] = grid.classes[0].cells[2] = 24;
  for (std::uint32_t& shift : grid.classes[1].shift) shift = 22;
  grid.classes[1].offset = 24 * 24;
  return grid;
}

class Planned : public HostDevice {
 public:
  Planned() : HostDevice(std::pmr::new_delete_resource(), HostDevice::Run{base::run_tasks}) {
    begin(base::default_executor(), 2);
  }
  static constexpr std::uint32_t sorted_above = ~0u;
  void plan(const PlanGrid& f, void* cleared, std::size_t bytes) const {
    std::memset(cleared, 0, bytes);
    std::fill_n(f.occupied, occupied_flags, 0u);
    *f.report = Report{};
    *f.grid = many_rows(f.limits);
  }
};

void expect_exact(const Boxes& boxes) {
  const Input in = make_input(boxes, nullptr, {});
  Workspace w;
  std::vector<char> memory(w.carve<Planned>(in.count, nullptr) + 256);
  const auto base = (reinterpret_cast<std::uintptr_t>(memory.data()) + 255) / 256 * 256;
  w.carve<Planned>(in.count, reinterpret_cast<char*>(base));
  Planned device;
  const Pipeline<Planned> pipeline(device);
  pipeline.build(in, false, w);
  ASSERT_LE(2 * w.grid->world_cells, w.table_cells);
  std::vector<Pair> pairs(boxes.size() * boxes.size());
  pipeline.find(in, false, w, {pairs.data(), pairs.size(), w.report});
  pairs.resize(w.report->found);
  EXPECT_TRUE(tests::same_pairs(pairs, tests::reference_pairs(boxes).pairs));
}

// Large boxes of one world overlap each other and, over more rows than there are boxes, small boxes
// of all worlds. Ranges found in their own world's cells must not be tested against the target of
// all worlds.
TEST(GridSearch, MoreRowsThanBoxes) {
  tests::Random random(3);
  BoxList boxes;
  std::vector<std::int32_t> worlds;
  const auto add = [&](float extent, std::int32_t world) {
    const Vec3 at{0, random.unit() * (1 - extent), random.unit() * (1 - extent)};
    boxes.push_back({at, {at.x, at.y + extent, at.z + extent}});
    worlds.push_back(world);
  };
  for (int i = 0; i < 100; ++i) add(0.03f, -1);
  for (int i = 0; i < 9; ++i) add(0.8f, i % 2);
  Boxes view = boxes;
  view.filters.world = {worlds.data(), worlds.size()};
  expect_exact(view);
  for (std::int32_t& world : worlds) world = 0;  // fine boxes search for the large ones
  expect_exact(view);
  expect_exact(boxes);
}

}  // namespace
}  // namespace throng::device
