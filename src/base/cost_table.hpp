// The tuned numbers by which the CPU search and persistent objects choose between ways to the same
// result. scripts/costs measures what they are worth: it changes one at a time and runs scenes of
// the benchmark, on one thread with the widest vectors, without queries. Sizes of buffers, samples
// and digits stand where they are used.
#pragma once

#include <algorithm>

namespace throng::base {

// The cost of comparing a box with a window of `window` boxes: the cheaper of two sweeps, one with
// a cheap start, one with cheap comparisons.
struct SweepCost {
  double start_ns, box_ns;
  double long_start_ns, long_box_ns;

  constexpr double operator()(double window) const noexcept {
    return std::min(start_ns + box_ns * window, long_start_ns + long_box_ns * window);
  }
};

// Times are ns on one thread of the machine of docs/explanation/benchmarks.md; only their ratios
// matter.
struct CostTable {
  // The grid's planner (grid/plan/planner.cpp, grid_prices.hpp).
  double box_ns = 3;               // per box binned, or read by brute force
  double replica_ns = 5;           // per further column of a box
  double record_ns = 6;            // per record sorted in a column
  double column_ns = 150;          // per column that has boxes
  double empty_ns = 15;            // per column that has none
  double brute_force_ns = 0.25;    // per comparison of brute force
  double brute_force_boxes = 112;  // up to so many, brute force is faster than any grid
  double extent_steps =
      32;  // a column is divided until extents are about so many quantization steps

  // A finer grid for one column, or brute force (grid/plan/refine_column.cpp).
  double refine_boxes = 512;      // least number of boxes
  double refine_sweep_ns = 20;    // least expected time of the sweep, per box
  double refine_share = 0.6;      // largest share of the sweep's time
  double refine_replicas = 2;     // largest number of columns per box
  double tie_ns = 10;             // per tie, which the floats decide
  double forbidden_share = 0.25;  // least share of comparisons that filters forbid, to avoid these

  // Filters (grid/plan/filter_planning.cpp).
  double world_distance = 0.25;    // worlds are in one place if boxes of one world are at least so
                                   // far apart, relative to any two boxes
  double worlds_together_ns = 25;  // per box: worlds are searched together if that takes no longer
  double separation_ns = 25;       // per box, to search static boxes separately

  // The sweep: with vectors of 16 coordinates or more, of 8, and without vectors.
  SweepCost sweep_wide = {0.5, 0.16, 4, 0.08};
  SweepCost sweep_narrow = {0.5, 0.2, 0.5, 0.2};
  SweepCost sweep_scalar = {1, 2, 1, 2};
  double broadcast_window = 20;  // targets beyond a vector, from which broadcasting pays
  double shared_steps = 32;      // queries of a vector continue together for so many targets each
  double set_ratio = 32;   // two sets are one strip unless one has so many times more boxes there:
                           // then only those near the others are compared
  double set_window = 64;  // and while the plan expects no longer windows

  // Threads and memory (grid/engine.hpp, grid/engine.cpp, grid/bin/grid.cpp).
  double threads_boxes = 6000;     // from so many boxes on a second thread pays
  double team_boxes = 65536;       // from so many boxes on one problem of many takes all threads
  double wide_columns = 64;        // a box in more columns is stored apart
  double stream_bytes = 67108864;  // records leave the last-level cache before they are read

  // Updates of persistent objects (tracking/cost_model.cpp).
  double full_object_ns = 18;     // a full search, per object
  double full_pair_ns = 14;       // the same, per pair
  double local_object_ns = 150;   // a search around one changed object, without its comparisons
  double comparison_ns = 6;       // per box that it compares
  double average_searches = 256;  // in the average of these comparisons, so many searches weigh as
                                  // much as all before them
  double index_build_ns = 35;     // building cells, per object; listing pairs by object, per pair
  double forest_build_ns = 250;   // building a forest, per object
  double forest_comparisons = 512;      // a search in a forest costs as many comparisons in cells,
  double forest_pair_comparisons = 16;  // and so many more per pair
  double guard = 16;       // guards against rare losses: one in so many tries, or so many times the
                           // changes, may be in vain
  double class_lines = 6;  // searching a further class of box sizes, in lines of cells

  // Queries (tracking/tracker.cpp, tracking/queries.cpp), and threads of both.
  double visit_ns = 1.6;        // without an index, per object or record
  double index_query_ns = 400;  // with an index
  double parallel_ns = 20'000;  // least work for a second thread
};

#if defined(THRONG_TUNE_COSTS)
inline CostTable cost;
#else
inline constexpr CostTable cost;
#endif

}  // namespace throng::base
