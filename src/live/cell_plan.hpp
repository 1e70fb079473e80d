// What cells should be like, from a sample of the objects.
#pragma once

#include <cstddef>
#include <cstdint>

#include "live/list.hpp"
#include "live/objects.hpp"

namespace throng::live {

struct CellPlan {
  // Thin: at least 1 << thinner times as long as thick.
  static constexpr int thinner = 3;
  // Where nearly all boxes begin along an axis, and how far they lie apart.
  struct Extent {
    double begin, length;
  };
  // A box that is looked at: its longest side, of a thin one an eighth of that; where it begins,
  // how long it is, in which world, and in which cell of that it begins.
  struct Sampled {
    double side;
    float lower[3], extent[3];
    std::int32_t world;
    std::uint64_t cell;
  };

  double span = 1;                  // of the first class
  bool crowded = false;             // many boxes lie in a cell of two spans
  bool thin = false;                // most boxes are
  bool worlds = false;              // there are several
  double expected_comparisons = 0;  // of a search
  // Cells of less are not to be had: their scale is at most 1e30 (CellMap).
  static constexpr double least_span = 16e-30;
  Extent extent[3] = {{0, 1}, {0, 1}, {0, 1}};

  // For the active objects. `sample` is room; throws cpu::NoMemory.
  static CellPlan of(const Objects& objects, List<Sampled>& sample);
};

}  // namespace throng::live
