// The result of Finder::explain: why a search costs what it does, and what would make it faster.
#pragma once

#include <throng/cpp17.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

struct Explanation {
  Result result;               // of the explained search: plan, times, comparisons, pairs
  std::uint64_t boxes = 0;     // of both sets, inactive ones included
  std::uint64_t cells = 0;     // columns of the grid; 0: no single grid for all boxes
  std::uint64_t entries = 0;   // boxes in cells, each counted in every cell that it touches
  std::uint64_t occupied = 0;  // non-empty cells
  double tests_per_pair = 0;   // candidate pairs compared per pair found; 0: none found
  double tests_per_box = 0;    // candidate pairs compared per box
  std::uint64_t memory_bytes = 0;

  // Boxes by largest extent, one class per factor of two, the smallest first. Boxes of extent 0
  // form a class below 0, infinite ones the last class. Empty classes are omitted.
  struct SizeClass {
    float from = 0, below = 0;  // world units
    std::uint64_t boxes = 0;
    double cells_per_box = 0;  // 0 without cells
  };
  std::vector<SizeClass> size_classes;

  struct LargeBox {
    std::uint32_t index = 0;
    bool in_second_set = false;
    float extent = 0;  // the largest of the three, world units
    std::uint64_t cells = 0;
  };
  std::vector<LargeBox> largest;  // up to ten

  struct DenseCell {
    Box bounds{};  // clipped to the grid; the outermost cells extend to infinity
    std::uint64_t boxes = 0;
  };
  std::vector<DenseCell> densest;  // up to ten

  // Boxes per cell, shape plan.columns[0] x [1] x [2], last axis fastest; empty without cells.
  std::vector<std::uint32_t> occupancy;
  Box grid{};  // divided by the cells into equal parts; the outermost cells extend to infinity
  // Cells by number of boxes, one class per factor of two, the emptiest first. Empty cells and
  // empty classes are omitted.
  struct CellClass {
    std::uint64_t from = 0, below = 0;  // boxes per cell
    std::uint64_t cells = 0;
    std::uint64_t boxes = 0;  // total
  };
  std::vector<CellClass> cell_classes;

  // The expected times of brute force and of the best grid that is swept along each axis, the
  // shortest first. The first grid is chosen; brute force for few boxes or on request. Filters are
  // ignored. Empty without a single plan for all boxes.
  struct Candidate {
    Algorithm algorithm = Algorithm::grid;
    std::uint32_t sweep_axis = 0;
    std::uint32_t columns[3] = {1, 1, 1};
    double expected_ns = 0;  // on one thread
  };
  std::vector<Candidate> candidates;

  struct Part {
    const char* what = "";
    std::uint64_t bytes = 0;
  };
  std::vector<Part> memory;

  // What would make it faster, one sentence each with its reason; empty if nothing stands out.
  std::vector<std::string> advice;
};

}  // namespace throng
