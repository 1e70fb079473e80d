// Chooses the cell size and layout from a sample of the objects.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tracking/objects.hpp"
#include "tracking/pod_vector.hpp"

namespace throng::tracking {

struct CellPlan {
  // Thin: at least 1 << thin_levels times as long as thick.
  static constexpr int thin_levels = 3;
  // Range of the lower corners along an axis, outliers excluded.
  struct Extent {
    double begin, length;
  };
  // A sampled box: its longest side (of a thin one, an eighth of that), lower corner, extents and
  // world; a hash of the world and the cell of its lower corner.
  struct Sampled {
    double side;
    float lower[3], extent[3];
    std::int32_t world;
    std::uint64_t cell;
  };

  double span = 1;                  // of the first class
  bool clustered = false;           // many boxes per cell of two spans
  bool thin = false;                // most boxes are thin
  bool worlds = false;              // several worlds are in use
  double expected_comparisons = 0;  // per search
  // Smallest span: the scale is at most 1e30 (CellMap).
  static constexpr double min_span = 16e-30;
  Extent extent[3] = {{0, 1}, {0, 1}, {0, 1}};

  // Plans for the active objects. `sample` is scratch; throws base::AllocationFailed.
  static CellPlan of(const Objects& objects, PodVector<Sampled>& sample);
};

}  // namespace throng::tracking
