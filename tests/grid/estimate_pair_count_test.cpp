// Estimates from a few columns or worlds: sufficient and close if these are similar, none if they
// are not.
#include <gtest/gtest.h>

#include <throng/find_pairs.hpp>
#include <throng/large_pages.hpp>

#include "base/threads.hpp"
#include "grid/bin/grid.hpp"
#include "grid/emit/worker.hpp"
#include "grid/plan/filter_partition.hpp"
#include "grid/plan/make_plan.hpp"
#include "grid/steps.hpp"
#include "grid/sweep/sweep_columns.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

using BoxList = std::vector<Box>;

void set_up(Search& search, const Boxes& a, const Boxes& b, base::Memory& memory) {
  search.a = &a;
  search.b = &b;
  search.kernels = find_kernels(Isa::automatic);
  search.executor = &base::default_executor();
  search.memory = &memory;
}

struct Estimate {
  std::size_t pairs = 0;
  bool stopped = false;
};

Estimate estimate_pair_count(const BoxList& boxes, const BoxList* others, float margin = 0,
                             const std::atomic<bool>* stop = nullptr) {
  base::Memory memory(large_pages(), 0);
  const Boxes a = boxes, b = others ? *others : boxes;
  Search search;
  set_up(search, a, b, memory);
  search.two_sets = others != nullptr;
  search.margin = margin;
  Problem problem;
  problem.queries = {&a, nullptr, static_cast<std::uint32_t>(a.size())};
  problem.targets = {&b, nullptr, others ? static_cast<std::uint32_t>(b.size()) : 0};
  problem.self = !others;
  const GridPlan plan = make_plan(search, problem, Algorithm::grid);
  BinnedGrid grid(memory);
  Worker worker(memory);
  Worker* const workers[] = {&worker};
  worker.begin(search);
  const Job job{search, problem, plan, workers};
  bin(job, grid);
  search.stop = stop;
  const std::size_t estimated = grid::estimate_pair_count(job, grid);
  EXPECT_EQ(search.sink, nullptr);
  return {estimated, search.failed()};
}

BoxList cubes(std::size_t count, float world, std::uint64_t seed) {
  tests::Random random(seed);
  BoxList boxes(count);
  for (Box& box : boxes) {
    const Vec3 at = random.point(0, world);
    box = {at, {at.x + 1, at.y + 1, at.z + 1}};
  }
  return boxes;
}

void expect_close(std::size_t estimated, std::size_t found) {
  EXPECT_GE(estimated, found);
  EXPECT_LE(static_cast<double>(estimated), 1.25 * static_cast<double>(found));
}

TEST(EstimatePairCount, SufficientIfColumnsAreSimilar) {
  for (const float world : {92.0f, 60.0f, 50.0f}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      SCOPED_TRACE(std::to_string(world) + ", seed " + std::to_string(seed));
      const BoxList boxes = cubes(120000, world, seed);
      expect_close(estimate_pair_count(boxes, nullptr).pairs, find_pairs(boxes).size());
    }
  }
}

TEST(EstimatePairCount, SufficientForTwoSetsAndMargin) {
  const BoxList boxes = cubes(120000, 80, 4), others = cubes(90000, 80, 5);
  expect_close(estimate_pair_count(boxes, &others).pairs, find_pairs(boxes, others).size());
  Options options;
  options.margin = 0.25f;
  expect_close(estimate_pair_count(boxes, nullptr, 0.25f).pairs, find_pairs(boxes, options).size());
}

// Half of the boxes in clusters.
TEST(EstimatePairCount, NoneIfColumnsDiffer) {
  BoxList boxes = cubes(60000, 90, 6);
  tests::Random random(7);
  Vec3 cluster{};
  for (std::size_t i = 0; i < boxes.size() / 2; ++i) {
    if (i % 750 == 0) cluster = random.point(0, 90);
    const Vec3 off = random.point(0, 0.5f);
    const Vec3 at = {cluster.x + off.x, cluster.y + off.y, cluster.z + off.z};
    boxes[i] = {at, {at.x + 1, at.y + 1, at.z + 1}};
  }
  EXPECT_EQ(estimate_pair_count(boxes, nullptr).pairs, 0u);
}

TEST(EstimatePairCount, NoneForFewColumns) {
  for (const std::uint64_t seed : {1, 2, 3, 4})
    EXPECT_EQ(estimate_pair_count(cubes(20000, 40, seed), nullptr).pairs, 0u) << seed;
}

TEST(EstimatePairCount, NothingWithoutPairs) {
  BoxList boxes;
  for (int i = 0; i < 120000; ++i) {
    const Vec3 at = {static_cast<float>(i % 50) * 2, static_cast<float>(i / 50 % 50) * 2,
                     static_cast<float>(i / 2500) * 2};
    boxes.push_back({at, {at.x + 1, at.y + 1, at.z + 1}});
  }
  EXPECT_EQ(estimate_pair_count(boxes, nullptr).pairs, 0u);
  for (Box& box : boxes) std::swap(box.lower.x, box.upper.x);
  EXPECT_EQ(estimate_pair_count(boxes, nullptr).pairs, 0u) << "no active box";
}

// `worlds` worlds of 60 boxes; in every tenth the boxes are `apart` times as far apart.
void expect_of_worlds(std::size_t worlds, float apart, bool close) {
  tests::Random random(9);
  BoxList boxes;
  std::vector<std::int32_t> world;
  for (std::size_t i = 0; i < 60 * worlds; ++i) {
    const auto w = static_cast<std::int32_t>(i / 60);
    const Vec3 at = random.point(0, w % 10 == 0 ? 4 * apart : 4);
    boxes.push_back({at, {at.x + 1, at.y + 1, at.z + 1}});
    world.push_back(w);
  }
  Boxes view = boxes;
  view.filters.world = {world.data(), world.size()};
  base::Memory memory(large_pages(), 0);
  Search search;
  set_up(search, view, view, memory);
  FilterPartition partition(memory);
  BinReport report;
  partition.split(search, report);
  ASSERT_EQ(partition.problem_count(), worlds);
  Worker worker(memory);
  const std::size_t estimated = partition.estimate_pair_count(search, Algorithm::automatic, worker);
  if (close)
    expect_close(estimated, find_pairs(view).size());
  else
    EXPECT_EQ(estimated, 0u);
}

TEST(EstimatePairCount, Worlds) {
  expect_of_worlds(500, 1, true);
  expect_of_worlds(500, 0.25f, false);
  expect_of_worlds(60, 1, false);
}

TEST(EstimatePairCount, EndsWhenStopped) {
  const std::atomic<bool> stop{true};
  EXPECT_TRUE(estimate_pair_count(cubes(120000, 92, 1), nullptr, 0, &stop).stopped);
}

}  // namespace
}  // namespace throng::grid
