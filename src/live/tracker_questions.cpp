// Tracker's part in queries: chooses what they search, and builds cells once queries are many.
#include <algorithm>
#include <mutex>

#include "core/profile.hpp"
#include "cpu/threads.hpp"
#include "live/tracker.hpp"

namespace throng::live {
namespace {

// Overlaps of many boxes with all objects as a two-set search, per object; one query in cells.
constexpr double search_object_ns = 8, question_ns = 1500;
// Without an index: visiting a column record; comparing a box.
constexpr double record_ns = 1, compared_ns = 5;
constexpr double no_limit = 1e300;
// Scanning a pair in pairs_of(); building PairsByObject, per pair and per object.
constexpr double look_ns = 0.5, index_pair_ns = 6, index_object_ns = 2;
// Building block data costs, per object, as much as visiting this many cells.
constexpr double block_cells = 0.5;
// Columns are unused once more than one in this many objects has changed.
constexpr std::size_t most_listed = 32;

// Estimates the cost of `count` queries from a sample of at most 16: cost(i).
template <class Cost>
double cost_of(std::size_t count, const Cost& cost) noexcept {
  const std::size_t priced = std::min<std::size_t>(count, 16);
  double sum = 0;
  for (std::size_t k = 0; k < priced; ++k) sum += cost(count * k / priced);
  return priced == 0 ? 0 : sum / static_cast<double>(priced) * static_cast<double>(count);
}

}  // namespace

// A concurrent query holds the lock while it builds, so it uses one thread: while waiting for tasks
// it could be given a task of another query that needs the same lock.
Options Tracker::to_prepare(const Queries& by, const Options& options) const noexcept {
  Options mine = options;
  if (&by != &queries_) mine.threads = 1;
  return mine;
}

// Places changed objects in the index; the first of several concurrent queries does it.
void Tracker::get_ready(const Queries& by, const Options& options) {
  if (ready_.load(std::memory_order_acquire)) return;
  const std::lock_guard<std::mutex> lock(preparing_);
  if (ready_.load(std::memory_order_relaxed)) return;
  objects_.dirty_list();
  if (index_ == Index::cells && !cells_.takes(objects_.count() + objects_.removed_count()))
    make_index(to_prepare(by, options));
  if (index_ != Index::absent) {
    objects_.place_changed([this](const ObjectId* changed, std::size_t count) {
      if (index_ == Index::cells)
        settle_in_cells(changed, count, no_limit);
      else
        settle_in_forest(changed, count);
    });
  }
  if (cells_.blocks().worn()) {
    blocked_ = false;
    cells_.forget_blocks();
  }
  ready_.store(true, std::memory_order_release);
}

// Cells are built once they would have saved these queries their building cost, or had done so
// before the last full search. This holds for many single queries, too. So the total cost is less
// than three times that of the best choices.
void Tracker::asked(const Queries& by, std::size_t count, double ns, const Options& options) {
  const double saved = std::max(0.0, ns - question_ns * static_cast<double>(count));
  const double cells = cell_ns * static_cast<double>(objects_.count());
  double sum = asked_.load(std::memory_order_relaxed);
  if (sum <= cells) sum = asked_.fetch_add(saved, std::memory_order_relaxed) + saved;
  if (index_ != Index::absent || std::max(sum, asked_before_) <= cells) return;
  // While another thread builds them, small queries continue without cells.
  std::unique_lock<std::mutex> lock(preparing_, std::defer_lock);
  if (saved > cells)
    lock.lock();
  else if (!lock.try_lock())
    return;
  if (index_ == Index::absent) make_index(to_prepare(by, options));
}

// Builds block data once sweeps visited as many cells as that costs; with blocks they skip most.
void Tracker::walked(std::uint64_t cells) noexcept {
  if (blocked_ || index_ != Index::cells || cells == 0) return;
  walked_ += cells;
  if (block_cells * static_cast<double>(objects_.count()) > static_cast<double>(walked_)) return;
  const std::unique_lock<std::mutex> lock(preparing_, std::try_to_lock);
  if (!lock || blocked_) return;
  walked_ = 0;
  try {
    cells_.make_blocks(objects_);
    blocked_ = true;
  } catch (const cpu::NoMemory&) {  // the sweeps are complete without blocks
  }
}

// Accounts for cost above the estimate in queries without an index: where boxes are clustered, the
// visited columns may hold far more than the average.
void Tracker::cost_more(const Queries& by, const Work& work, double expected,
                        const Options& options) noexcept {
  if (index_ != Index::absent) return;
  const double cost = record_ns * static_cast<double>(work.visited) +
                      compared_ns * static_cast<double>(work.compared);
  if (cost <= expected) return;
  try {
    asked(by, 0, cost - expected, options);
  } catch (const cpu::NoMemory&) {  // the queries are complete without cells
  }
}

// Accounts for queries in cells that did more work than in a forest. Other threads may still search
// the cells, so those stay unchanged while the forest is built.
void Tracker::looked_at(const Work& work, std::size_t queries, std::size_t hits) noexcept {
  if (index_ != Index::cells) return;
  const double fair =
      fair_search * static_cast<double>(queries) + fair_per_pair * static_cast<double>(hits);
  waste(comparison_ns * (static_cast<double>(work.total()) - fair));
  if (!forest_pays()) return;
  const std::unique_lock<std::mutex> lock(preparing_, std::try_to_lock);
  if (!lock || index_ != Index::cells) return;
  wasted_ = 0;
  changed_ = 0;
  try {
    build_forest(false);
  } catch (const cpu::NoMemory&) {  // the queries are complete without a forest
  }
}

std::optional<Columns> Tracker::columns() noexcept {
  if (!columned_ || objects_.dirty_count() > objects_.count() / most_listed) return std::nullopt;
  return Columns{{engine_.grid(), *engine_.whole_plan()}, objects_.dirty_list()};
}
Ground Tracker::ground() noexcept {
  const Index index = index_;
  if (index == Index::forest) return {.forest = &forest_};
  if (index == Index::cells)
    return {.cells = &cells_, .blocks = blocked_ ? &cells_.blocks() : nullptr};
  return {.columns = columns()};
}

// Without links, scans all pairs until that has cost as much as building PairsByObject.
std::size_t Tracker::pairs_of(ObjectId id, LivePair* out, std::size_t room) noexcept {
  if (id >= objects_.limit()) return 0;
  if (linked_) return pairs_.linked_of(objects_, id, out, room);
  if (indexed_.load(std::memory_order_acquire) || index_pairs())
    return by_object_.of(pairs_.in_order(), id, out, room);
  return pairs_.sorted_of(id, out, room);
}

// Builds PairsByObject if enough pairs were scanned; false: not yet, or another thread is building
// it.
bool Tracker::index_pairs() noexcept {
  const auto pairs = static_cast<double>(pairs_.count());
  const auto looked = static_cast<double>(looked_ += pairs_.count());
  if (look_ns * looked <
      index_pair_ns * pairs + index_object_ns * static_cast<double>(objects_.limit()))
    return false;
  const std::unique_lock<std::mutex> lock(preparing_, std::try_to_lock);
  if (!lock) return false;
  if (indexed_) return true;
  looked_ = 0;
  try {
    by_object_.make(pairs_.in_order(), objects_.limit());
  } catch (const cpu::NoMemory&) {
    return false;  // a scan of all pairs still works
  }
  indexed_.store(true, std::memory_order_release);
  return true;
}

void Tracker::find_overlaps(Queries& by, const Boxes& boxes, const Options& options, Result& r) {
  THRONG_RANGE("find overlaps");
  // cost of a two-set search
  const double all = search_object_ns * static_cast<double>(objects_.limit());
  const bool few = search_ns * static_cast<double>(boxes.size()) < all;
  bool one_by_one = false;
  double expected = 0;
  if (few) {
    get_ready(by, options);
    const Ground now{.columns = columns()};
    const double cost =
        cost_of(boxes.size(), [&](std::size_t i) { return now.cost(objects_, boxes[i]); });
    expected = std::min(cost, all);
    asked(by, boxes.size(), expected, options);
    one_by_one = index_ != Index::absent || cost < all;
  }
  cpu::Stop stop(options.stop);
  if (one_by_one) {
    const Work work = by.find_overlaps(objects_, ground(), boxes, cpu::executor_of(options),
                                       cpu::threads_of(options), stop);
    r.comparisons = work.compared;
    r.visited = work.visited;
    looked_at(work, boxes.size(), by.overlaps().size());
    cost_more(by, work, expected, options);
  } else {
    // the engine is shared with updates and overwrites its columns
    if (&by == &queries_) columned_ = false;
    const Boxes view = objects_.view();
    r = find_into(by.engine(), by.overlaps(), boxes, &view, 0, options);
    r.inactive = 0;
  }
  by.forget_hits();  // the overlaps may have been collected there
  r.found = r.written = by.overlaps().size();
  if (stop()) r.status = Status::stopped;
}

void Tracker::find_hits(Queries& by, const Sweeps& sweeps, const Options& options, Result& r) {
  THRONG_RANGE("find hits");
  get_ready(by, options);
  const Ground now{.columns = columns()};
  const double cost =
      cost_of(sweeps.count, [&](std::size_t i) { return now.cost(objects_, sweeps.data[i]); });
  asked(by, sweeps.count, cost, options);
  cpu::Stop stop(options.stop);
  std::uint64_t far = 0;
  const Work work = by.find_hits(objects_, ground(), sweeps, cpu::executor_of(options),
                                 cpu::threads_of(options), stop, far);
  r.comparisons = work.compared;
  r.visited = work.visited;
  walked(far);
  looked_at(work, sweeps.count, by.hits().size());
  cost_more(by, work, cost, options);
  r.found = r.written = by.hits().size();
  if (stop()) r.status = Status::stopped;
}

}  // namespace throng::live
