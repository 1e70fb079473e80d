// The grid: its lists, and its pairs against the double loop.
#include "apps/paper/grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "apps/paper/failure.hpp"
#include "apps/paper/host.hpp"
#include "apps/paper/mapping.hpp"
#include "apps/paper/stepper.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::paper {
namespace {

using tests::BoxList;
const Box unit_cube{{0, 0, 0}, {1, 1, 1}};

struct Found {
  std::vector<Pair> pairs;
  std::uint64_t cells, entries;
};

Found search(const BoxList& boxes, double per_cell, const Box& environment,
             MappingKind mapping = MappingKind::formula, unsigned threads = 1) {
  Job job;
  job.variant.per_cell = per_cell;
  job.variant.mapping = mapping;
  job.n = boxes.size();
  job.environment = environment;
  job.threads = threads;
  const Step step = make_host_stepper(job)->step(boxes.data());
  Found found{step.pairs, step.cells, step.entries};
  std::sort(found.pairs.begin(), found.pairs.end());
  return found;
}

Found search(const BoxList& boxes, double per_cell, MappingKind mapping = MappingKind::formula,
             unsigned threads = 1) {
  return search(boxes, per_cell, environment_of(boxes.data(), boxes.size()), mapping, threads);
}

// Each box once in every cell that it touches, and in no other; each list exactly as long as
// needed.
TEST(GridLists, ContainEachBoxInAllItsCells) {
  const BoxList boxes = tests::rods(400, 3);
  const GridShape shape = make_grid(environment_of(boxes.data(), boxes.size()), boxes.size(), 2);
  const std::uint64_t cells = shape.cell_count();
  std::vector<std::uint32_t> counts(cells + 1);
  const CountEntries count{shape, boxes.data(), counts.data()};
  for (std::uint64_t i = 0; i < boxes.size(); ++i) count(i);
  std::vector<std::uint64_t> starts(cells + 1);
  HostDevice().scan(counts.data(), starts.data(), cells + 1);
  std::vector<std::uint32_t> entries(starts[cells], ~0u);
  const FillEntries fill{shape, boxes.data(), starts.data(), counts.data(), entries.data()};
  for (std::uint64_t i = 0; i < boxes.size(); ++i) fill(i);
  EXPECT_EQ(std::count(counts.begin(), counts.end(), 0u), static_cast<std::ptrdiff_t>(cells + 1));
  std::uint64_t expected = 0;
  for (std::uint32_t z = 0; z < shape.cells[2]; ++z)
    for (std::uint32_t y = 0; y < shape.cells[1]; ++y)
      for (std::uint32_t x = 0; x < shape.cells[0]; ++x) {
        const std::uint64_t cell = shape.index(x, y, z);
        std::vector<std::uint32_t> want,
            list(entries.begin() + static_cast<long>(starts[cell]),
                 entries.begin() + static_cast<long>(starts[cell + 1]));
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
          const auto in = [&](int axis, float low, float high, std::uint32_t at) {
            return shape.cell(axis, low) <= at && at <= shape.cell(axis, high);
          };
          const Box& b = boxes[i];
          if (in(0, b.lower.x, b.upper.x, x) && in(1, b.lower.y, b.upper.y, y) &&
              in(2, b.lower.z, b.upper.z, z))
            want.push_back(i);
        }
        std::sort(list.begin(), list.end());
        ASSERT_EQ(list, want) << "cell " << x << " " << y << " " << z;
        expected += want.size();
      }
  EXPECT_EQ(entries.size(), expected);
  EXPECT_GT(expected, boxes.size() * 2);
}

// On a device a warp shares a cell: 32 lanes, run sequentially here, find what one thread finds.
TEST(GridLists, LanesShareACell) {
  const BoxList boxes = tests::snapped_boxes(200, 4, 1.0f, 5);
  const GridShape shape = make_grid(environment_of(boxes.data(), boxes.size()), boxes.size(), 20);
  const std::uint64_t cells = shape.cell_count();
  std::vector<std::uint32_t> counts(cells + 1);
  for (std::uint64_t i = 0; i < boxes.size(); ++i)
    CountEntries{shape, boxes.data(), counts.data()}(i);
  std::vector<std::uint64_t> starts(cells + 1);
  HostDevice().scan(counts.data(), starts.data(), cells + 1);
  std::vector<std::uint32_t> entries(starts[cells]);
  const FillEntries fill{shape, boxes.data(), starts.data(), counts.data(), entries.data()};
  for (std::uint64_t i = 0; i < boxes.size(); ++i) fill(i);
  const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
  for (const std::uint32_t lanes : {1u, 7u, 32u}) {
    std::vector<Pair> pairs(truth.size() + 10, Pair{9, 9});
    std::uint64_t found = 0;
    const SearchCell<Formula<HardwareRoot<float>>> cell_search{
        shape,          boxes.data(), starts.data(),
        entries.data(), {},           {pairs.data(), pairs.size(), &found}};
    for (std::uint64_t cell = 0; cell < cells; ++cell)
      for (std::uint32_t lane = 0; lane < lanes; ++lane) cell_search(cell, lane, lanes);
    ASSERT_EQ(found, truth.size());
    pairs.resize(found);
    std::sort(pairs.begin(), pairs.end());
    EXPECT_EQ(pairs, truth) << lanes << " lanes";
  }
}

// Nothing is written past the end, and all are counted.
TEST(GridLists, CounterCountsPastTheCapacity) {
  std::vector<Pair> buffer(3, Pair{7, 7});
  std::uint64_t found = 0;
  const PairSink sink{buffer.data(), 2, &found};
  for (std::uint32_t i = 0; i < 5; ++i) sink({i, i + 1});
  EXPECT_EQ(found, 5u);
  EXPECT_EQ(buffer, (std::vector<Pair>{{0, 1}, {1, 2}, {7, 7}}));
}

TEST(Grid, FindsWhatTheDoubleLoopFinds) {
  std::uint64_t shared = 0;
  for (const tests::HardScene& scene : tests::hard_scenes(600)) {
    const std::vector<Pair> truth = tests::reference_pairs(scene.boxes).pairs;
    for (const double per_cell : {0.5, 2.0, 8.0, 100.0, 1e6}) {
      const Found found = search(scene.boxes, per_cell);
      EXPECT_EQ(found.pairs, truth) << scene.name << " X " << per_cell;
      shared += found.entries > scene.boxes.size();
    }
  }
  EXPECT_GT(shared, 50u);  // some boxes were in several cells
}

TEST(Grid, EveryMappingAndThreadCount) {
  for (const BoxList& boxes : {tests::snapped_boxes(500, 16, 0.1f, 18), tests::rods(500, 21)}) {
    const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
    ASSERT_GT(truth.size(), 100u);
    for (const MappingKind mapping :
         {MappingKind::formula, MappingKind::lazy, MappingKind::fold, MappingKind::exact})
      for (const unsigned threads : {1u, 4u})
        EXPECT_EQ(search(boxes, 4, mapping, threads).pairs, truth) << name(mapping);
  }
}

TEST(Grid, LatticesOfTouchingBoxes) {
  for (std::uint64_t seed = 100; seed < 140; ++seed) {
    const tests::Lattice lattice = tests::random_lattice(seed, 500);
    const BoxList boxes = make_lattice(lattice);
    const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
    for (const double per_cell : {1.0, 3.0, 30.0})
      ASSERT_EQ(search(boxes, per_cell).pairs, truth) << lattice.describe() << " X " << per_cell;
  }
}

// The environment may be smaller than the boxes' bounds, outside of them, or a point.
TEST(Grid, BoxesOutsideOfTheEnvironment) {
  const Box environments[] = {unit_cube,
                              {{-500, -500, -500}, {-400, -400, -400}},
                              {{3, 3, 3}, {3, 3, 3}},
                              {{-1e30f, 2, -1e30f}, {1e30f, 7, 1e30f}},
                              {{0, 0, 0}, {5, 5, 0}}};
  for (const BoxList& boxes : {tests::uniform_boxes(500, 8), tests::infinite_bounds(500, 13),
                               tests::sizes_to_10000(500, 20)}) {
    const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
    for (const Box& environment : environments)
      for (const double per_cell : {0.5, 8.0})
        EXPECT_EQ(search(boxes, per_cell, environment).pairs, truth);
  }
}

// Set up once, updated every step: boxes move, far out of the environment too, and a later step has
// more pairs than the first one's capacity.
TEST(Grid, StepsOverMovingBoxes) {
  Job job;
  job.n = 400;
  job.variant.per_cell = 4;
  std::vector<BoxList> frames;
  for (std::uint64_t f = 0; f < 4; ++f) {
    frames.push_back(tests::uniform_boxes(400, f + 1));
    for (Box& box : frames.back()) {
      box.lower.x += 5 * static_cast<float>(f);
      box.upper.x += 5 * static_cast<float>(f);
    }
  }
  frames.push_back(tests::identical_boxes(400, 9));
  frames.push_back(frames[0]);
  job.environment = environment_of(frames[0].data(), 400);
  const auto stepper = make_host_stepper(job);
  for (const BoxList& frame : frames) {
    std::vector<Pair> found = stepper->step(frame.data()).pairs;
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, tests::reference_pairs(frame).pairs);
  }
}

TEST(Grid, MemoryLimitIsExact) {
  Job job;
  job.n = 1000;
  job.environment = unit_cube;
  job.variant.per_cell = 8;  // 125 cells and one more count, 12 bytes each
  job.memory_bytes = 126 * 12;
  const auto stepper = make_host_stepper(job);
  BoxList overlapping_all(1000, Box{{0, 0, 0}, {1, 1, 1}});  // 125,000 entries
  try {
    stepper->step(overlapping_all.data());
    FAIL() << "not refused";
  } catch (const Failure& failure) {
    EXPECT_NE(std::string(failure.what()).find("500,000 bytes"), std::string::npos)
        << failure.what();
  }
  job.memory_bytes = 126 * 12 - 1;
  EXPECT_THROW(make_host_stepper(job), Failure);
  job.memory_bytes = 1 << 20;
  job.variant.mapping = MappingKind::stored;
  EXPECT_THROW(make_host_stepper(job), Failure);
}

}  // namespace
}  // namespace throng::paper
