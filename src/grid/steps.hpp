// The steps of a search after its plan (plan/make_plan.hpp), and the same steps for a part of it.
#pragma once

#include "grid/bin/grid.hpp"
#include "grid/job.hpp"

namespace throng::grid {

// Reads all boxes: into the columns of `grid`, or for brute force into arrays of the first worker.
BinReport bin(const Job&, BinnedGrid& grid);
// Finds the pairs of what bin() read. Worker::begin() comes before, Worker::finish() after: the
// last pairs are still in the workers.
void sweep(const Job&, BinnedGrid& grid);

// Both steps on one worker, for a column of a grid of depth - 1, or for one world of many.
void solve_on_one_worker(Search&, const Problem&, const GridPlan&, Worker&, unsigned depth);

}  // namespace throng::grid
