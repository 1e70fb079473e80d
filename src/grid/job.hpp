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
  // Of the grid's memory: 0 is the call's, which a team shares; above are a worker's own.
  unsigned depth = 0;
};

}  // namespace throng::grid
