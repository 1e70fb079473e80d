// Tracker's part in queries: chooses what they search, and builds cells once queries are many.
#include <algorithm>
#include <mutex>

#include "base/profile.hpp"
#include "base/threads.hpp"
#include "tracking/tracker.hpp"

namespace throng::tracking {
namespace {

// Overlaps of many boxes with all objects as a two-set search, per object; one query in cells.
constexpr double search_object_ns = 8, cell_query_ns = 1500;
// Without an index: visiting a column record; comparing a box.
constexpr double record_ns = 1, compared_ns = 5;
constexpr double no_limit = 1e300;
// Scanning a pair in pairs_of(); building PairsByObject, per pair and per object.
constexpr double scan_pair_ns = 0.5, build_pair_ns = 6, build_object_ns = 2;
// Building block data costs, per object, as much as visiting this many cells.
constexpr double block_build_cells = 0.5;
// Columns are unused once more than one in this many objects has changed.
constexpr std::size_t min_objects_per_change = 32;

// Estimates the cost of `count` queries from a sample of at most 16: cost(i).
template <class Cost>
double cost_of(std::size_t count, const Cost& cost) noexcept {
  const std::size_t sampled = std::min<std::size_t>(count, 16);
  double sum = 0;
  for (std::size_t k = 0; k < sampled; ++k) sum += cost(count * k / sampled);
  return sampled == 0 ? 0 : sum / static_cast<double>(sampled) * static_cast<double>(count);
}

}  // namespace

// A concurrent query holds the lock while it builds, so it uses one thread: while waiting for tasks
// it could be given a task of another query that needs the same lock.
Options Tracker::preparation_options(const Queries& caller, const Options& options) const noexcept {
  Options adjusted = options;
  if (&caller != &queries_) adjusted.threads = 1;
  return adjusted;
}

// Places changed objects in the index; the first of several concurrent queries does it.
void Tracker::place_for_queries(const Queries& caller, const Options& options) {
  if (placement_valid_.load(std::memory_order_acquire)) return;
  const std::lock_guard<std::mutex> lock(prepare_mutex_);
  if (placement_valid_.load(std::memory_order_relaxed)) return;
  objects_.dirty_list();
  if (index_ == Index::cells &&
      !cells_.has_capacity_for(objects_.count() + objects_.removed_count()))
    build_index(preparation_options(caller, options));
  if (index_ != Index::absent) {
    objects_.place_changed([this](const ObjectId* changed, std::size_t count) {
      if (index_ == Index::cells)
        place_in_cells(changed, count, no_limit);
      else
        place_in_forest(changed, count);
    });
  }
  if (cells_.blocks().is_stale()) {
    blocks_valid_ = false;
    cells_.clear_blocks();
  }
  placement_valid_.store(true, std::memory_order_release);
}

// Cells are built once they would have saved these queries their building cost, or had done so
// before the last full search. This holds for many single queries, too. So the total cost is less
// than three times that of the best choices.
void Tracker::note_query_cost(const Queries& caller, std::size_t count, double ns,
                              const Options& options) {
  const double saved = std::max(0.0, ns - cell_query_ns * static_cast<double>(count));
  const double cells = cell_ns * static_cast<double>(objects_.count());
  double sum = query_savings_ns_.load(std::memory_order_relaxed);
  if (sum <= cells) sum = query_savings_ns_.fetch_add(saved, std::memory_order_relaxed) + saved;
  if (index_ != Index::absent || std::max(sum, earlier_savings_ns_) <= cells) return;
  // While another thread builds them, small queries continue without cells.
  std::unique_lock<std::mutex> lock(prepare_mutex_, std::defer_lock);
  if (saved > cells)
    lock.lock();
  else if (!lock.try_lock())
    return;
  if (index_ == Index::absent) build_index(preparation_options(caller, options));
}

// Builds block data once sweeps visited as many cells as that costs; with blocks they skip most.
void Tracker::note_cells_visited(std::uint64_t cells) noexcept {
  if (blocks_valid_ || index_ != Index::cells || cells == 0) return;
  cells_visited_ += cells;
  if (block_build_cells * static_cast<double>(objects_.count()) >
      static_cast<double>(cells_visited_))
    return;
  const std::unique_lock<std::mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock || blocks_valid_) return;
  cells_visited_ = 0;
  try {
    cells_.make_blocks(objects_);
    blocks_valid_ = true;
  } catch (const grid::AllocationFailed&) {  // the sweeps are complete without blocks
  }
}

// Accounts for cost above the estimate in queries without an index: where boxes are clustered, the
// visited columns may hold far more than the average.
void Tracker::note_excess_cost(const Queries& caller, const Work& work, double expected,
                               const Options& options) noexcept {
  if (index_ != Index::absent) return;
  const double cost = record_ns * static_cast<double>(work.visited) +
                      compared_ns * static_cast<double>(work.compared);
  if (cost <= expected) return;
  try {
    note_query_cost(caller, 0, cost - expected, options);
  } catch (const grid::AllocationFailed&) {  // the queries are complete without cells
  }
}

// Accounts for queries in cells that did more work than in a forest. Other threads may still search
// the cells, so those stay unchanged while the forest is built.
void Tracker::note_query_work(const Work& work, std::size_t queries, std::size_t hits) noexcept {
  if (index_ != Index::cells) return;
  const double allowed = allowed_per_search * static_cast<double>(queries) +
                         allowed_per_pair * static_cast<double>(hits);
  add_waste(comparison_ns * (static_cast<double>(work.total()) - allowed));
  if (!forest_pays()) return;
  const std::unique_lock<std::mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock || index_ != Index::cells) return;
  wasted_ns_ = 0;
  changed_since_build_ = 0;
  try {
    build_forest(false);
  } catch (const grid::AllocationFailed&) {  // the queries are complete without a forest
  }
}

std::optional<Columns> Tracker::columns() noexcept {
  if (!columns_valid_ || objects_.dirty_count() > objects_.count() / min_objects_per_change)
    return std::nullopt;
  return Columns{{engine_.grid(), *engine_.single_grid_plan()}, objects_.dirty_list()};
}
QueryIndex Tracker::query_index() noexcept {
  const Index index = index_;
  if (index == Index::forest) return {.forest = &forest_};
  if (index == Index::cells)
    return {.cells = &cells_, .blocks = blocks_valid_ ? &cells_.blocks() : nullptr};
  return {.columns = columns()};
}

// Without links, scans all pairs until that has cost as much as building PairsByObject.
std::size_t Tracker::pairs_of(ObjectId id, LivePair* out, std::size_t capacity) noexcept {
  if (id >= objects_.limit()) return 0;
  if (links_valid_) return pairs_.pairs_by_links(objects_, id, out, capacity);
  if (object_pairs_valid_.load(std::memory_order_acquire) || build_object_pairs())
    return by_object_.of(pairs_.sorted_list(), id, out, capacity);
  return pairs_.pairs_by_scan(id, out, capacity);
}

// Builds PairsByObject if enough pairs were scanned; false: not yet, or another thread is building
// it.
bool Tracker::build_object_pairs() noexcept {
  const auto pairs = static_cast<double>(pairs_.count());
  const auto looked = static_cast<double>(pairs_scanned_ += pairs_.count());
  if (scan_pair_ns * looked <
      build_pair_ns * pairs + build_object_ns * static_cast<double>(objects_.limit()))
    return false;
  const std::unique_lock<std::mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock) return false;
  if (object_pairs_valid_) return true;
  pairs_scanned_ = 0;
  try {
    by_object_.make(pairs_.sorted_list(), objects_.limit());
  } catch (const grid::AllocationFailed&) {
    return false;  // a scan of all pairs still works
  }
  object_pairs_valid_.store(true, std::memory_order_release);
  return true;
}

void Tracker::find_overlaps(Queries& caller, const Boxes& boxes, const Options& options,
                            Result& r) {
  THRONG_RANGE("find overlaps");
  // cost of a two-set search
  const double all = search_object_ns * static_cast<double>(objects_.limit());
  const bool few = search_ns * static_cast<double>(boxes.size()) < all;
  bool single_queries = false;
  double expected = 0;
  if (few) {
    place_for_queries(caller, options);
    const QueryIndex now{.columns = columns()};
    const double cost =
        cost_of(boxes.size(), [&](std::size_t i) { return now.cost(objects_, boxes[i]); });
    expected = std::min(cost, all);
    note_query_cost(caller, boxes.size(), expected, options);
    single_queries = index_ != Index::absent || cost < all;
  }
  grid::Cancellation stop(options.stop);
  if (single_queries) {
    const Work work =
        caller.find_overlaps(objects_, query_index(), boxes, grid::executor_of(options),
                             grid::threads_of(options), stop);
    r.comparisons = work.compared;
    r.visited = work.visited;
    note_query_work(work, boxes.size(), caller.overlaps().size());
    note_excess_cost(caller, work, expected, options);
  } else {
    // the engine is shared with updates and overwrites its columns
    if (&caller == &queries_) columns_valid_ = false;
    const Boxes view = objects_.view();
    r = find_into(caller.engine(), caller.overlaps(), boxes, &view, 0, options);
    r.inactive = 0;
  }
  caller.clear_hits();  // the overlaps may have been collected there
  r.found = r.written = caller.overlaps().size();
  if (stop()) r.status = Status::stopped;
}

void Tracker::find_hits(Queries& caller, const Sweeps& sweeps, const Options& options, Result& r) {
  THRONG_RANGE("find hits");
  place_for_queries(caller, options);
  const QueryIndex now{.columns = columns()};
  const double cost =
      cost_of(sweeps.count, [&](std::size_t i) { return now.cost(objects_, sweeps.data[i]); });
  note_query_cost(caller, sweeps.count, cost, options);
  grid::Cancellation stop(options.stop);
  std::uint64_t far = 0;
  const Work work = caller.find_hits(objects_, query_index(), sweeps, grid::executor_of(options),
                                     grid::threads_of(options), stop, far);
  r.comparisons = work.compared;
  r.visited = work.visited;
  note_cells_visited(far);
  note_query_work(work, sweeps.count, caller.hits().size());
  note_excess_cost(caller, work, cost, options);
  r.found = r.written = caller.hits().size();
  if (stop()) r.status = Status::stopped;
}

}  // namespace throng::tracking
