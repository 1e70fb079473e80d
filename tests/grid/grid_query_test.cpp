// Region queries on a grid's columns: they report all boxes that overlap the region, and few
// others.
#include "grid/grid_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "grid/searched_grid.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

using tests::BoxList;
using tests::Random;

// Binned by one task or several, and searched: the records must stay unchanged.
class Grid {
 public:
  Grid(const BoxList& boxes, unsigned tasks, float cell_scale = 1)
      : searched_(boxes, SearchedGrid::How{tasks, cell_scale}) {}
  GridQuery grid_query() const { return {searched_.grid(), searched_.plan()}; }

 private:
  SearchedGrid searched_;
};

struct Sum {
  std::size_t overlapping = 0, others = 0;
};

void expect_reported(const Grid& grid, const BoxList& boxes, const Box& region, Sum& sum) {
  std::vector<bool> reported(boxes.size());
  grid.grid_query().each(region, [&](std::uint32_t id) { reported.at(id) = true; });
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const bool overlaps = base::is_active(boxes[i]) && base::overlaps(boxes[i], region);
    sum.overlapping += overlaps;
    sum.others += reported[i] && !overlaps;
    ASSERT_TRUE(reported[i] || !overlaps) << "box " << i;
  }
}

// Around some box, or touching one; with any corner moved far away; or everything.
Box any_region(Random& random, const BoxList& boxes) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const Box& a = boxes[random.below(static_cast<std::uint32_t>(boxes.size()))];
  const Box& b = boxes[random.below(static_cast<std::uint32_t>(boxes.size()))];
  Box r = a;
  if (random.one_in(3)) r.upper = r.lower;
  if (random.one_in(3)) r.lower = a.upper, r.upper = a.upper;
  if (random.one_in(4)) r.upper.x = b.lower.x;
  if (random.one_in(8)) r.lower.y = b.upper.y;
  if (random.one_in(16)) r.lower.z = -infinity;
  if (random.one_in(16)) r.upper.x = infinity;
  if (random.one_in(64)) r = {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
  return base::is_active(r) ? r : a;
}

TEST(GridQuery, HardScenes) {
  Random random(1);
  for (const tests::HardScene& scene : tests::hard_scenes(900)) {
    for (const unsigned tasks : {1u, 3u}) {
      SCOPED_TRACE(scene.name + std::string(", tasks ") + std::to_string(tasks));
      const BoxList boxes = scene.boxes;
      const Grid grid(boxes, tasks);
      Sum sum;
      for (int k = 0; k < 200; ++k) {
        const Box region = any_region(random, boxes);
        if (base::is_active(region)) expect_reported(grid, boxes, region, sum);
      }
    }
  }
}

TEST(GridQuery, FewFalsePositives) {
  Random random(2);
  const BoxList boxes = tests::uniform_boxes(20'000, 2);
  for (const unsigned tasks : {1u, 2u}) {
    const Grid grid(boxes, tasks);
    Sum sum;
    for (int k = 0; k < 400; ++k) expect_reported(grid, boxes, boxes[random.below(20'000)], sum);
    EXPECT_GE(sum.overlapping, 400u);
    EXPECT_LE(sum.others, sum.overlapping / 50);
  }
}

// Boxes that span too many columns to be binned, and the boundaries of that.
TEST(GridQuery, BoxesThatSpanManyColumns) {
  BoxList boxes = tests::uniform_boxes(20'000, 3);
  Vec3 end = {0, 0, 0};
  for (const Box& box : boxes)
    end = {std::max(end.x, box.upper.x), std::max(end.y, box.upper.y),
           std::max(end.z, box.upper.z)};
  boxes.push_back({{0, 0, 0}, end});
  boxes.push_back({{1, 1, 1}, {end.x, end.y / 2, end.z}});
  boxes.push_back({{1, 1, 1}, {end.x / 2, end.y, end.z / 2}});
  const Grid grid(boxes, 2, 0.25f);
  EXPECT_GT(grid.grid_query().columns_in(boxes[20'000]), 64u);
  Random random(3);
  Sum sum;
  for (int k = 0; k < 100; ++k) {
    const Vec3 at = random.point(0, end.x);
    expect_reported(grid, boxes, {at, at}, sum);
  }
  for (std::size_t i = 20'000; i < boxes.size(); ++i) {
    const auto next = [](float x) { return std::nextafter(x, 1e30f); };
    const Vec3 last = boxes[i].upper, beyond = {next(last.x), next(last.y), next(last.z)};
    expect_reported(grid, boxes, {last, last}, sum);
    expect_reported(grid, boxes, {beyond, beyond}, sum);
    expect_reported(grid, boxes, {boxes[i].lower, boxes[i].lower}, sum);
  }
  EXPECT_GE(sum.overlapping, 100u);
  EXPECT_LE(sum.others, sum.overlapping / 10);
}

TEST(GridQuery, ColumnCounts) {
  const BoxList boxes = tests::uniform_boxes(20'000, 4);
  const Grid grid(boxes, 1);
  const GridQuery query = grid.grid_query();
  const Vec3 low = {-1e30f, -1e30f, -1e30f}, high = {1e30f, 1e30f, 1e30f};
  const std::uint64_t all = query.columns_in({low, high});
  EXPECT_GT(all, 16u);
  EXPECT_EQ(query.columns_in({low, low}), 1u);
  EXPECT_EQ(query.columns_in({high, high}), 1u);
  EXPECT_EQ(query.columns_between(low, low), 0u);
  EXPECT_EQ(query.columns_between(low, high), query.columns_between(high, low));
  EXPECT_GE(query.columns_between(low, high) + 1, 4u);
  EXPECT_LE(query.columns_between(low, high) + 1, all);
  // As many records as boxes, plus replicas: about this cost for all of them.
  EXPECT_GE(query.cost(all), 20'000);
  EXPECT_LE(query.cost(all), 100'000);
}

}  // namespace
}  // namespace throng::grid
