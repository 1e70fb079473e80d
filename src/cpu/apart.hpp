// What filters keep apart, and how: worlds, and static boxes from those that move.
#pragma once

#include "cpu/grid.hpp"

namespace throng::cpu {

// Reads the filters of a search of `whole`, and plans with them. True: there is one problem, and
// `plan` is its plan; what else is to be asked of boxes and pairs hangs on the search. False:
// worlds, and boxes that move and static ones, are better made problems of their own
// (partition.hpp).
bool plan_with_filters(Search&, const Problem& whole, Algorithm forced, unsigned task_count, Kinds&,
                       core::GridPlan& plan);

}  // namespace throng::cpu
