// The sweep of all columns of a grid.
#pragma once

#include <cstddef>

#include "grid/bin/grid.hpp"
#include "grid/job.hpp"

namespace throng::grid {

// Finds the pairs of all columns, and those of wide boxes.
void sweep_columns(const Job&, BinnedGrid&);

// Estimates the number of pairs that sweep_columns() finds; see plan/estimate_pair_count.hpp.
std::size_t estimate_pair_count(const Job&, BinnedGrid&);

}  // namespace throng::grid
