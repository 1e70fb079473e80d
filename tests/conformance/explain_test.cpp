// The explanation of a search, against plain counts of the same boxes.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <string_view>
#include <vector>

#include <throng/throng.hpp>

#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

float extent(const Box& b) {
  return std::max({b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z});
}

TEST(Explain, CountsAreThoseOfTheBoxes) {
  BoxList boxes = uniform_boxes(5000, 3);
  boxes[17] = {{0, 0, 0}, {90, 60, 1}};  // for any sweep axis
  boxes[4711] = {{-3, 1, 1}, {20, 30, 2}};
  boxes[99] = {{1, 1, 1}, {0, 0, 0}};  // inactive
  boxes[100] = {{1, 1, 1}, {1, 1, 1}};
  Finder finder;
  const Explanation e = finder.explain(boxes);
  EXPECT_EQ(e.boxes, 5000u);
  EXPECT_EQ(e.result.found, reference_pairs(boxes).pairs.size());
  EXPECT_EQ(finder.pairs().size(), e.result.found) << "the pairs are available as after find";
  EXPECT_EQ(e.result.inactive, 1u);

  std::uint64_t in_classes = 0;
  double entries = 0;
  for (const Explanation::SizeClass& c : e.size_classes) {
    std::uint64_t counted = 0;
    for (const Box& b : boxes) {
      if (b.lower.x > b.upper.x) continue;
      counted += c.below == 0 ? extent(b) == 0 : extent(b) >= c.from && extent(b) < c.below;
    }
    EXPECT_EQ(c.boxes, counted) << c.from << " to " << c.below;
    in_classes += c.boxes;
    entries += c.cells_per_box * static_cast<double>(c.boxes);
  }
  EXPECT_EQ(in_classes, 4999u);
  EXPECT_EQ(e.size_classes.front().below, 0) << "the point";
  EXPECT_NEAR(entries, static_cast<double>(e.entries), 0.5);

  ASSERT_EQ(e.largest.size(), 10u);
  EXPECT_EQ(e.largest[0].index, 17u);
  EXPECT_EQ(e.largest[0].extent, 90);
  EXPECT_EQ(e.largest[1].index, 4711u);
  EXPECT_TRUE(std::is_sorted(e.largest.begin(), e.largest.end(),
                             [](const auto& p, const auto& q) { return p.extent > q.extent; }));
  EXPECT_GT(e.largest[0].cells, 1u);

  EXPECT_EQ(e.cells,
            e.result.plan.columns[0] * e.result.plan.columns[1] * e.result.plan.columns[2]);
  EXPECT_LE(e.occupied, e.cells);
  ASSERT_EQ(e.occupancy.size(), e.cells);
  EXPECT_EQ(std::accumulate(e.occupancy.begin(), e.occupancy.end(), std::uint64_t{0}), e.entries);
  EXPECT_EQ(*std::max_element(e.occupancy.begin(), e.occupancy.end()), e.densest[0].boxes);
  EXPECT_LE(e.grid.lower.x, e.densest[0].bounds.lower.x);
  EXPECT_GE(e.grid.upper.x, e.densest[0].bounds.upper.x);
  // The densest cell is at the reported position.
  std::size_t at = 0;
  const float lower[3] = {e.grid.lower.x, e.grid.lower.y, e.grid.lower.z};
  const float upper[3] = {e.grid.upper.x, e.grid.upper.y, e.grid.upper.z};
  const Box& dense = e.densest[0].bounds;
  const float middle[3] = {(dense.lower.x + dense.upper.x) / 2, (dense.lower.y + dense.upper.y) / 2,
                           (dense.lower.z + dense.upper.z) / 2};
  for (int k = 0; k < 3; ++k) {
    const auto columns = static_cast<float>(e.result.plan.columns[k]);
    at = at * e.result.plan.columns[k] +
         static_cast<std::size_t>((middle[k] - lower[k]) / (upper[k] - lower[k]) * columns);
  }
  EXPECT_EQ(e.occupancy[at], e.densest[0].boxes);
  EXPECT_GE(e.entries, 4999u);
  std::uint64_t cells = 0, in_cells = 0, last = 0;
  for (const Explanation::CellClass& c : e.cell_classes) {
    EXPECT_GE(c.from, last) << "in order";
    EXPECT_GE(c.boxes, c.cells * c.from);
    EXPECT_LT(c.boxes, c.cells * c.below);
    cells += c.cells;
    in_cells += c.boxes;
    last = c.below;
  }
  EXPECT_EQ(cells, e.occupied);
  EXPECT_EQ(in_cells, e.entries);
  EXPECT_GT(e.memory_bytes, 0u);
  EXPECT_EQ(e.memory_bytes, finder.memory_bytes());
  std::uint64_t in_parts = 0;
  for (const Explanation::Part& part : e.memory) {
    in_parts += part.bytes;
    if (part.what == std::string_view("pairs")) {
      EXPECT_GE(part.bytes, e.result.found * sizeof(Pair));
    }
  }
  EXPECT_EQ(in_parts, e.memory_bytes);
  // Four ways, the cheapest first; of the grids the first is the one that was taken.
  ASSERT_EQ(e.candidates.size(), 4u);
  EXPECT_EQ(std::count_if(e.candidates.begin(), e.candidates.end(),
                          [](const auto& c) { return c.algorithm == Algorithm::all_pairs; }),
            1);
  for (std::size_t i = 0; i + 1 < e.candidates.size(); ++i)
    EXPECT_LE(e.candidates[i].expected_ns, e.candidates[i + 1].expected_ns);
  const auto taken = std::find_if(e.candidates.begin(), e.candidates.end(),
                                  [](const auto& c) { return c.algorithm == Algorithm::grid; });
  EXPECT_EQ(taken->sweep_axis, e.result.plan.sweep_axis);
  EXPECT_EQ(taken->expected_ns, e.result.plan.expected_ns);
  EXPECT_TRUE(std::equal(taken->columns, taken->columns + 3, e.result.plan.columns));
}

const Explanation::Candidate& brute_force_of(const Explanation& e) {
  return *std::find_if(e.candidates.begin(), e.candidates.end(),
                       [](const auto& c) { return c.algorithm == Algorithm::all_pairs; });
}

// Brute force compares the boxes of two sets, not those within one.
TEST(Explain, PriceOfBruteForce) {
  const BoxList few = uniform_boxes(100, 6), many = uniform_boxes(4900, 7);
  Finder finder;
  const Explanation two = finder.explain(few, many);
  BoxList all = few;
  all.insert(all.end(), many.begin(), many.end());
  const Explanation one = finder.explain(all);
  ASSERT_EQ(two.candidates.size(), 4u);
  ASSERT_EQ(one.candidates.size(), 4u);
  // 100 x 4900 comparisons, and 5000^2 / 2.
  EXPECT_GT(brute_force_of(one).expected_ns, 10 * brute_force_of(two).expected_ns);

  Options options;
  options.isa = Isa::scalar;
  EXPECT_GT(brute_force_of(Finder(options).explain(all)).expected_ns,
            2 * brute_force_of(one).expected_ns)
      << "one box at a time";
}

TEST(Explain, CandidatesOfOtherCellWidths) {
  const BoxList boxes = uniform_boxes(20000, 8);
  Options options;
  options.cell_scale = 0.5f;
  const Explanation e = Finder(options).explain(boxes);
  EXPECT_EQ(std::count_if(e.candidates.begin(), e.candidates.end(),
                          [&](const auto& c) {
                            return c.algorithm == Algorithm::grid &&
                                   std::equal(c.columns, c.columns + 3, e.result.plan.columns);
                          }),
            1)
      << "the grid that was taken is listed";
}

TEST(Explain, NoCandidatesForManyProblems) {
  const BoxList list = uniform_boxes(4000, 9);
  Boxes boxes = list;
  std::vector<std::int32_t> worlds(list.size());
  for (std::size_t i = 0; i < worlds.size(); ++i) worlds[i] = static_cast<std::int32_t>(i % 40);
  boxes.filters.world = worlds;
  for (const Algorithm algorithm : {Algorithm::automatic, Algorithm::all_pairs}) {
    Options options;
    options.algorithm = algorithm;
    EXPECT_TRUE(Finder(options).explain(boxes).candidates.empty()) << to_string(algorithm);
  }
}

// The boxes reported for a cell are those that touch its bounds; boxes on the bounds may count for
// the neighbour cell, so counts may differ slightly.
TEST(Explain, DensestCellsHoldTheirBoxes) {
  BoxList boxes = uniform_boxes(20000, 4);
  Random r(5);
  for (int i = 0; i < 3000; ++i) boxes[static_cast<std::size_t>(i)] = cube(2, 2, 2, 0.01f);
  Finder finder;
  const Explanation e = finder.explain(boxes);
  ASSERT_EQ(e.densest.size(), 10u);
  EXPECT_GE(e.densest[0].boxes, 3000u);
  std::uint64_t last = e.densest[0].boxes;
  for (const Explanation::DenseCell& cell : e.densest) {
    EXPECT_LE(cell.boxes, last);
    last = cell.boxes;
    std::uint64_t touching = 0;
    Box inside = cell.bounds;
    for (const Box& b : boxes) {
      touching += b.lower.x <= inside.upper.x && inside.lower.x <= b.upper.x &&
                  b.lower.y <= inside.upper.y && inside.lower.y <= b.upper.y &&
                  b.lower.z <= inside.upper.z && inside.lower.z <= b.upper.z;
    }
    // The outermost cells also hold everything beyond them.
    EXPECT_NEAR(static_cast<double>(touching), static_cast<double>(cell.boxes),
                0.2 * static_cast<double>(cell.boxes) + 8);
  }
}

TEST(Explain, EmptyCellsAreNotAmongTheDensest) {
  // Two heaps in opposite corners: no other cell has a box.
  BoxList boxes;
  for (int i = 0; i < 20000; ++i) {
    const float at = i % 2 == 0 ? 0.0f : 1000.0f, step = 0.001f * static_cast<float>(i % 100);
    boxes.push_back(cube(at + step, at, at, 0.0005f));
  }
  Options options;
  options.algorithm = Algorithm::grid;
  Finder finder(options);
  const Explanation e = finder.explain(boxes);
  ASSERT_GT(e.cells, 10u);
  ASSERT_LT(e.occupied, 10u);
  EXPECT_EQ(e.densest.size(), e.occupied);
  for (const Explanation::DenseCell& cell : e.densest) EXPECT_GT(cell.boxes, 0u);
}

TEST(Explain, AdviceMatchesMeasurements) {
  const auto says = [](const Explanation& e, const char* word) {
    return std::any_of(e.advice.begin(), e.advice.end(), [&](const std::string& text) {
      return text.find(word) != std::string::npos;
    });
  };
  BoxList boxes = uniform_boxes(20000, 6);
  Finder finder;
  EXPECT_FALSE(says(finder.explain(boxes), "overlap nothing"));
  for (std::size_t i = 0; i < 8000; ++i) boxes[i] = {{1, 1, 1}, {0, 0, 0}};
  EXPECT_TRUE(says(finder.explain(boxes), "40 % of the boxes overlap nothing"));
  EXPECT_TRUE(says(finder.explain(uniform_boxes(50, 1)), "are few"));
  BoxList same = identical_boxes(3000, 2);
  EXPECT_TRUE(says(finder.explain(same), "pairs per box fill"));
  Options options;
  options.order = Order::canonical;
  // This depends on measured times: the text must follow them, and at least one of some attempts is
  // undisturbed.
  bool said = false;
  for (int tries = 0; tries < 50 && !said; ++tries) {
    const Explanation e = Finder(options).explain(same);
    said = says(e, "Order::any");
    EXPECT_EQ(said, e.result.times.order_ms > 0.3 * e.result.times.total_ms);
  }
  EXPECT_TRUE(said);
}

TEST(Explain, TwoSetsWorldsAndFewBoxes) {
  const BoxList a = uniform_boxes(3000, 7);
  BoxList b = uniform_boxes(2000, 8);
  b[5].upper.z += 100;
  Finder finder;
  const Explanation two = finder.explain(a, b);
  EXPECT_EQ(two.boxes, 5000u);
  EXPECT_EQ(two.result.found, find_pairs(a, b).size());
  EXPECT_TRUE(two.largest[0].in_second_set);
  EXPECT_EQ(two.largest[0].index, 5u);
  std::vector<std::int32_t> worlds;
  for (std::size_t i = 0; i < a.size(); ++i) worlds.push_back(static_cast<std::int32_t>(i % 40));
  Boxes view = a;
  view.filters.world = {worlds.data(), worlds.size()};
  const Explanation apart = finder.explain(view);
  EXPECT_EQ(apart.cells, 0u) << "one problem per world";
  EXPECT_TRUE(apart.densest.empty());
  EXPECT_FALSE(apart.size_classes.empty());
  EXPECT_EQ(finder.explain(BoxList{}).boxes, 0u);
  const Explanation few = finder.explain(uniform_boxes(20, 1));
  EXPECT_EQ(few.cells, 0u) << "brute force";
}

TEST(Explain, RefusesWhatFindRefuses) {
  BoxList boxes = uniform_boxes(100, 9);
  boxes[40].lower.x = std::numeric_limits<float>::quiet_NaN();
  Finder finder;
  try {
    finder.explain(boxes);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::nan_box);
    EXPECT_EQ(error.result().first_invalid, 40u);
  }
  boxes[40].lower.x = -std::numeric_limits<float>::infinity();
  boxes[41] = {{-std::numeric_limits<float>::infinity(), 0, 0}, {0, 0, 0}};
  const Explanation e = finder.explain(boxes);
  EXPECT_EQ(e.largest[0].extent, std::numeric_limits<float>::infinity());
  Options options;
  options.backend = Backend::emulated;
  EXPECT_THROW(Finder(options).explain(boxes), Error);
}

}  // namespace
}  // namespace throng::tests
