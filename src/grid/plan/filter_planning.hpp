// How the search applies filters: worlds, and static boxes.
#pragma once

#include "grid/bin/grid.hpp"

namespace throng::grid {

// Reads the filters of a search of `whole` and plans with them. Returns true: one problem, with the
// plan in `plan`; the checks left for boxes and pairs are set in the search. Returns false: split
// into problems per world and for moving and static boxes (filter_partition.hpp).
bool plan_with_filters(Search&, const Problem& whole, Algorithm forced, unsigned task_count,
                       FilterClasses&, GridPlan& plan);

}  // namespace throng::grid
