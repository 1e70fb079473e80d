// What Finder::explain tells: why a search costs what it does, and what would make it faster.
#pragma once

#include <throng/cpp17.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

struct Explanation {
  Result result;               // of the search that is explained: plan, times, comparisons, pairs
  std::uint64_t boxes = 0;     // of both sets, inactive ones included
  std::uint64_t cells = 0;     // columns of the grid; 0: there is no one grid for all boxes
  std::uint64_t entries = 0;   // boxes in cells: a box is in every cell that it touches
  std::uint64_t occupied = 0;  // cells with a box in them
  double tests_per_pair = 0;   // candidate pairs compared for each found; 0: none was found
  double tests_per_box = 0;    // and for each box
  std::uint64_t memory_bytes = 0;

  // Boxes by their largest extent, a factor of two from class to class, the smallest first. Boxes
  // without extent are a class below 0, infinite ones the last; classes without boxes are left out.
  struct SizeClass {
    float from = 0, below = 0;  // world units
    std::uint64_t boxes = 0;
    double cells_per_box = 0;  // 0 where there are no cells
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
    Box bounds{};  // within the range of the grid; the outermost cells go on to infinity
    std::uint64_t boxes = 0;
  };
  std::vector<DenseCell> densest;  // up to ten

  // Boxes in each cell, of plan.columns[0] x [1] x [2] cells, the last axis fastest; empty where
  // there are no cells.
  std::vector<std::uint32_t> occupancy;
  Box grid{};  // what the cells divide into equal parts; the outermost cells go on to infinity
  // Cells by how many boxes are in them, a factor of two from class to class, the emptiest first;
  // empty cells are in none, and classes without cells are left out.
  struct CellClass {
    std::uint64_t from = 0, below = 0;  // boxes in a cell
    std::uint64_t cells = 0;
    std::uint64_t boxes = 0;  // in all of them
  };
  std::vector<CellClass> cell_classes;

  struct Part {
    const char* what = "";
    std::uint64_t bytes = 0;
  };
  std::vector<Part> memory;

  // What would make it faster, each a sentence with its reason; empty where nothing stands out.
  std::vector<std::string> advice;
};

}  // namespace throng
