#include "grid/sweep/sweep_columns.hpp"

#include <span>

#include "base/threads.hpp"
#include "grid/all_pairs.hpp"
#include "grid/emit/worker.hpp"
#include "grid/plan/estimate_pair_count.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/sweep/column_search.hpp"

namespace throng::grid {
namespace {

// Pairs of two wide boxes: no column contains these.
void find_wide(const Job& job, const BinnedGrid& grid) {
  const Problem& problem = job.problem;
  const std::size_t of_queries = grid.wide(0).size(), count = of_queries + grid.wide(1).size();
  if (count == 0) return;
  RecursionScratch& scratch = job.team[0]->scratch(job.depth + 1);
  std::uint32_t* const ids = scratch.ids.ensure(count + 1);
  std::uint32_t* const labels = scratch.labels.ensure(count + 1);
  std::size_t at = 0;
  for (unsigned side = 0; side < 2; ++side) {
    for (const WideBox& box : grid.wide(side)) {
      labels[at] = box.id - problem.id_offset(side);
      ids[at] = problem.parent ? problem.parent->ids[labels[at]] : labels[at];
      ++at;
    }
  }
  const auto side = [&](const Boxes* boxes, std::size_t first, std::size_t size) {
    return BoxSubset{boxes, ids + first, static_cast<std::uint32_t>(size), labels + first};
  };
  Problem wide = problem;
  wide.queries = side(problem.queries.boxes, 0, of_queries);
  wide.targets = side(problem.targets.boxes, of_queries, count - of_queries);
  const Job brute{job.search, wide, job.plan, job.team.first(1), job.depth};
  load_all_pairs(brute);
  find_all_pairs(brute);
}

}  // namespace

void sweep_columns(const Job& job, BinnedGrid& grid) {
  const auto task_count = static_cast<unsigned>(job.team.size());
  const std::uint32_t columns = grid.column_count();
  job.team[0]->visited += columns;
  std::span<const std::uint32_t> order;
  if (task_count > 1 && columns > task_count) order = grid.largest_first();
  const bool even = order.empty();
  // If columns differ in size, the largest are taken first by any task, each taking the next before
  // it runs the current one, to prefetch it; otherwise each task has its own range.
  base::StealingRanges ranges(even ? columns : order.size(), even ? task_count : 1);
  const auto column_at = [&](std::uint64_t i) {
    const auto at = static_cast<std::uint32_t>(i);
    return even ? at : order[at];
  };
  auto task = [&](unsigned t) {
    job.search.guarded([&] {
      Worker& worker = *job.team[t];
      worker.use_sweep();
      ColumnSearch search(job, grid, worker);
      std::uint64_t i = 0, next = 0;
      for (bool any = ranges.take(t, i); any && !job.search.over(); i = next) {
        const bool known = even ? ranges.peek(t, next) : ranges.take(t, next);
        search.run(column_at(i), known ? column_at(next) : RecordPrefetcher::no_column);
        any = even ? ranges.take(t, next) : known;
      }
    });
  };
  base::run_tasks(*job.search.executor, task_count, task);
  if (job.search.over()) return;
  job.search.guarded([&] { find_wide(job, grid); });
}

std::size_t estimate_pair_count(const Job& job, BinnedGrid& grid) {
  const std::span<const std::uint32_t> sizes = grid.count_records();
  Worker& worker = *job.team[0];
  ColumnSearch search(job, grid, worker);
  return estimate_pair_count(
      job.search, worker, grid.column_count(), [&](std::uint32_t c) { return sizes[c]; },
      [&](std::uint32_t c) { search.run(c, RecordPrefetcher::no_column); });
}

}  // namespace throng::grid
