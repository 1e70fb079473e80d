// What Result::visited of a search counts.
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

// Accesses other than comparisons: brute force counts each box once; a grid counts each column,
// each box once per column, and a second pass if the buffer was too small.
TEST(Visited, CountsBoxesColumnsAndPasses) {
  BoxList boxes = uniform_boxes(20000, 1);
  const Boxes few(boxes.data(), 300), all = boxes;
  Options options;
  options.threads = 1;
  options.algorithm = Algorithm::all_pairs;
  Pair none;
  EXPECT_EQ(Finder(options).find(few, &none, 0).visited, 300u);
  EXPECT_EQ(Finder(options).find(few, all, &none, 0).visited, 20300u);

  options.algorithm = Algorithm::grid;
  const Result grid = Finder(options).find(all, &none, 0);
  const std::uint64_t columns = grid.plan.columns[0] * grid.plan.columns[1] * grid.plan.columns[2];
  EXPECT_GE(grid.visited, boxes.size() + columns);
  EXPECT_LE(grid.visited, 4 * boxes.size() + columns);

  // A thousand boxes that span too many columns: each is tested in every column.
  for (std::size_t i = 0; i < boxes.size(); i += 20) boxes[i] = {{0, 0, 0}, {40, 40, 40}};
  options.cell_scale = 0.25f;
  const Result wide = Finder(options).find(all, &none, 0);
  const std::uint64_t finer = wide.plan.columns[0] * wide.plan.columns[1] * wide.plan.columns[2];
  EXPECT_GE(wide.visited, 500 * finer) << finer << " columns";
  options.cell_scale = 1;

  // All boxes in one place: the estimated capacity is too small.
  const BoxList heap(2000, boxes[1]);
  Finder finder(options);
  const Result cold = finder.find(Boxes(heap)), warm = finder.find(Boxes(heap));
  EXPECT_EQ(cold.found, warm.found);
  EXPECT_GT(cold.comparisons, warm.comparisons * 3 / 2);
  EXPECT_GT(cold.visited, warm.visited * 3 / 2);
}

}  // namespace
}  // namespace throng::tests
