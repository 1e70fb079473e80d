// Finding: the columns of a grid, then pairs of wide boxes, which are in no column.
#include <algorithm>

#include "base/threads.hpp"
#include "grid/all_pairs.hpp"
#include "grid/plan/estimate_pair_count.hpp"
#include "grid/sweep/column_search.hpp"

namespace throng::grid {

void BinnedGrid::find(Search& search, const Problem& problem, const base::GridPlan& plan,
                      Worker* const* team, unsigned task_count, unsigned depth) {
  team[0]->visited += columns_;
  std::span<const std::uint32_t> order;
  if (task_count > 1 && columns_ > task_count) order = largest_first();
  const bool even = order.empty();
  // If columns differ in size, the largest are taken first by any task, each taking the next before
  // it runs the current one, to prefetch it; otherwise each task has its own range.
  StealingRanges ranges(even ? columns_ : order.size(), even ? task_count : 1);
  const auto column_at = [&](std::uint64_t i) {
    const auto at = static_cast<std::uint32_t>(i);
    return even ? at : order[at];
  };
  auto task = [&](unsigned t) {
    search.guarded([&] {
      team[t]->use_sweep();
      ColumnSearch columns(search, problem, plan, *this, *team[t], depth);
      std::uint64_t i = 0, next = 0;
      for (bool any = ranges.take(t, i); any && !search.over(); i = next) {
        const bool known = even ? ranges.peek(t, next) : ranges.take(t, next);
        columns.run(column_at(i), known ? column_at(next) : RecordPrefetcher::no_column);
        any = even ? ranges.take(t, next) : known;
      }
    });
  };
  run_tasks(*search.executor, task_count, task);
  if (search.over()) return;
  search.guarded([&] { find_wide(search, problem, *team[0]); });
}

std::size_t BinnedGrid::estimate_pair_count(Search& search, const Problem& problem,
                                            const base::GridPlan& plan, Worker& worker) {
  count_records();
  ColumnSearch columns(search, problem, plan, *this, worker, 0);
  return grid::estimate_pair_count(
      search, worker, columns_, [this](std::uint32_t c) { return sizes_[c]; },
      [&](std::uint32_t c) { columns.run(c, RecordPrefetcher::no_column); });
}

// Counts the records of each column; returns the total.
std::uint64_t BinnedGrid::count_records() {
  std::uint32_t* sizes = sizes_.ensure(columns_);
  std::uint64_t total = 0;
  for (std::uint32_t c = 0; c < columns_; ++c) {
    std::uint64_t size = 0;
    for (unsigned chain = 0; chain < 2 * tasks_; ++chain) {
      const std::uintptr_t tail = tails_[std::size_t{chain} * columns_ + c];
      if (tail == 0) continue;
      const std::uintptr_t block = block_of(tail);
      size += reinterpret_cast<const Block*>(block)->before + (tail - block) / sizeof(Record);
    }
    sizes[c] = static_cast<std::uint32_t>(std::min<std::uint64_t>(size, 0xffffffffu));
    total += sizes[c];
  }
  return total;
}

// The non-empty columns by decreasing size, so that no large one is left for the end. Empty result
// if sizes are similar: keep their order.
std::span<const std::uint32_t> BinnedGrid::largest_first() {
  const std::uint64_t total = count_records();
  const std::uint32_t* sizes = sizes_.data();
  const std::uint32_t most = *std::max_element(sizes, sizes + columns_);
  if (most < 2 * (total / columns_ + 1)) return {};
  std::uint32_t* order = order_.ensure(columns_);
  std::size_t count = 0;
  for (std::uint32_t c = 0; c < columns_; ++c) {
    order[count] = c;
    count += sizes[c] != 0;
  }
  std::sort(order, order + count,
            [sizes](std::uint32_t x, std::uint32_t y) { return sizes[x] > sizes[y]; });
  return {order, count};
}

// Pairs of two wide boxes: no column contains these.
void BinnedGrid::find_wide(Search& search, const Problem& problem, Worker& worker) {
  if ((wide_count_[0] | wide_count_[1]) == 0) return;
  for (unsigned side = 0; side < 2; ++side) {
    const std::uint32_t count = wide_count_[side];
    std::uint32_t* ids = wide_ids_[side].ensure(count + 1);
    std::uint32_t* labels = wide_labels_[side].ensure(count + 1);
    for (std::uint32_t i = 0; i < count; ++i) {
      labels[i] = wide_[side][i].id - id_offset_[side];
      ids[i] = problem.parent ? problem.parent->ids[labels[i]] : labels[i];
    }
  }
  Problem wide = problem;
  wide.queries = {problem.queries.boxes, wide_ids_[0].data(), wide_count_[0],
                  wide_labels_[0].data()};
  wide.targets = {problem.targets.boxes, wide_ids_[1].data(), wide_count_[1],
                  wide_labels_[1].data()};
  Worker* const team[] = {&worker};
  BinReport ignored;
  load_all_pairs(search, wide, team, ignored);
  find_all_pairs(search, wide, team, 1);
}

}  // namespace throng::grid
