#include "grid/steps.hpp"

#include "grid/all_pairs.hpp"
#include "grid/emit/worker.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/sweep/sweep_columns.hpp"

namespace throng::grid {

BinReport bin(const Job& job, BinnedGrid& grid) {
  return job.plan.all_pairs ? load_all_pairs(job) : grid.bin(job);
}

void sweep(const Job& job, BinnedGrid& grid) {
  if (job.plan.all_pairs)
    find_all_pairs(job);
  else
    sweep_columns(job, grid);
}

void solve_on_one_worker(Search& search, const Problem& problem, const GridPlan& plan,
                         Worker& worker, unsigned depth) {
  Worker* const team[] = {&worker};
  const Job job{search, problem, plan, team, depth};
  BinnedGrid& grid = worker.scratch(depth).space;
  bin(job, grid);  // inactive boxes were reported when the problem was made
  if (!search.failed()) sweep(job, grid);
}

}  // namespace throng::grid
