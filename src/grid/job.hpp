// What the steps of a search work on.
#pragma once

#include <span>

#include "grid/plan/planner.hpp"
#include "grid/search.hpp"

namespace throng::grid {

class Worker;

// One problem with its plan, for a team of workers.
struct Job {
  Search& search;
  const Problem& problem;
  const GridPlan& plan;
  std::span<Worker* const> team;
  unsigned depth =
      0;  // of the grid's memory: 0 the call's, which a team shares; above, a worker's own
};

}  // namespace throng::grid
