#include "tracking/tracker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "base/parallel_region.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"

namespace throng::tracking {
namespace {

// Prefetch distance, in objects.
constexpr std::size_t place_ahead = 32;
// Minimum changed objects for a second thread; objects per work chunk.
constexpr std::size_t min_parallel_searches = 400, search_chunk = 64;
constexpr double no_limit = 1e300;
// Columns are unused once more than one in this many objects has changed.
constexpr std::size_t min_objects_per_change = 32;
// Minimum objects for a second thread in move_all().
constexpr std::size_t min_parallel_moves = 20000;

// Grows the list for the engine's output; null when out of memory.
Pair* grow_list(void* list, std::size_t count) {
  try {
    auto& found = *static_cast<PodVector<Pair>*>(list);
    found.reserve_discard(grid::with_spare(count, found.capacity()));
    return found.data();
  } catch (const base::AllocationFailed&) {
    return nullptr;
  }
}

unsigned tasks_to_move(std::size_t objects, const Options& options) noexcept {
  return objects < min_parallel_moves ? 1 : base::threads_of(options);
}

// Estimates the cost of `count` queries from a sample of at most 16: cost(i).
template <class Cost>
double cost_of(std::size_t count, const Cost& cost) noexcept {
  const std::size_t sampled = std::min<std::size_t>(count, 16);
  double sum = 0;
  for (std::size_t k = 0; k < sampled; ++k) sum += cost(count * k / sampled);
  return sampled == 0 ? 0 : sum / static_cast<double>(sampled) * static_cast<double>(count);
}

}  // namespace

Tracker::Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept
    : engine_(memory, already_held),
      objects_(engine_.memory(), margin),
      pairs_(engine_.memory()),
      by_object_(engine_.memory()),
      cells_(engine_.memory()),
      forest_(engine_.memory()),
      insert_queue_(engine_.memory()),
      queries_(engine_),
      local_updates_(engine_.memory()),
      found_(engine_.memory()) {}

bool Tracker::has_nan(const Boxes& boxes, const Options& options) noexcept {
  const std::size_t n = boxes.size();
  const unsigned tasks = tasks_to_move(n, options);
  if (tasks == 1) return Objects::has_nan(boxes, 0, n);
  std::atomic<bool> found{false};
  base::ChunkQueue shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      if (Objects::has_nan(boxes, begin, end)) found = true;
    }
  };
  base::run_tasks(base::executor_of(options), tasks, task);
  return found;
}

void Tracker::move_all(const Boxes& boxes, const Options& options) noexcept {
  THRONG_RANGE("move all");
  placement_valid_ = false;
  const std::size_t n = objects_.limit();
  const unsigned tasks = tasks_to_move(n, options);
  std::atomic<std::size_t> dirty{0};
  std::atomic<std::int64_t> inactive{0};
  base::ChunkQueue shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      std::int64_t more;
      dirty += objects_.move_range(boxes, begin, end, more);
      inactive += more;
    }
  };
  base::run_tasks(base::executor_of(options), tasks, task);
  objects_.count_marked(dirty, inactive);
}

void Tracker::update(const Options& options, Result& r) {
  THRONG_RANGE("update");
  using Clock = std::chrono::steady_clock;
  const auto start = options.measure_stages ? Clock::now() : Clock::time_point{};
  const unsigned tasks = base::threads_of(options);
  r.plan.threads = tasks;
  r.plan.algorithm = Algorithm::grid;
  r.plan.reason = "nothing changed";
  const std::size_t changed = objects_.dirty_count();
  if (changed == 0) {
    pairs_.commit_nothing();
  } else {
    const unsigned team = changed < min_parallel_searches ? 1 : tasks;
    base::ParallelRegion::run(base::executor_of(options), team, [&](const Executor& executor) {
      Options adjusted = options;
      adjusted.executor = &executor;
      apply_changes(adjusted, tasks, r);
    });
    if (!r.ok()) return;
    objects_.clear_dirty();
  }
  r.found = r.written = pairs_.count();
  r.inactive = objects_.inactive();
  if (options.measure_stages) {
    r.times.total_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }
}

void Tracker::apply_changes(const Options& options, unsigned tasks, Result& r) {
  double budget_ns = 0;
  if (prepare_incremental(options, tasks, budget_ns)) {
    columns_valid_ = false;
    r.plan.reason = "few objects changed: incremental search around them";
    if (search_incrementally(options, tasks, budget_ns, r)) return;
    // The search was aborted, but the changed objects are in the index.
    const Result aborted = r;
    find_all(options, tasks, r);
    r.comparisons += aborted.comparisons;
    r.visited += aborted.visited;
  } else {
    index_ = Index::absent;
    find_all(options, tasks, r);
  }
}

// Decides whether the incremental search is cheaper; if so, builds the index, links the pairs and
// places the changed objects. Affects cost only, never results. The incremental search is to be
// aborted once it has cost `budget_ns`.
bool Tracker::prepare_incremental(const Options& options, unsigned tasks, double& budget_ns) {
  const CostModel::Choice choice = costs_.choose(sizes(), objects_.dirty_count(), tasks, index_);
  if (!choice.incremental) return false;
  budget_ns = choice.budget_ns;
  if (index_ == Index::absent || !links_valid_) {
    if (!costs_.building_pays(sizes(), choice.saved_ns)) return false;
    if (index_ == Index::absent) build_index(options);
    if (!links_valid_) pairs_.link_all(objects_);
    links_valid_ = true;
    costs_.index_is_ready();
  } else if (index_ == Index::forest) {
    if (costs_.retry_of_cells_is_due(sizes())) {
      const bool suitable = cells_.is_suitable(objects_, CostModel::allowed_comparisons(sizes()));
      if (suitable) build_index(options);
      costs_.cells_were_retried(suitable);
    }
  } else if (costs_.cells_are_poor(sizes())) {
    build_index(options);
  }
  costs_.add_changed(objects_.dirty_count());
  if (place_dirty(options, choice.max_lines)) return true;
  // The changed objects are too wide for cells. If this happens twice in a row, build a forest.
  if (!costs_.note_too_wide()) return false;
  index_ = Index::absent;
  build_forest(false);
  return true;
}

void Tracker::build_index(const Options& options) {
  THRONG_RANGE("build index");
  const bool try_cells = costs_.begin_build(sizes(), index_, links_valid_);
  index_ = Index::absent;
  blocks_valid_ = false;
  if (objects_.sparse()) objects_.list_alive();
  if (try_cells &&
      cells_.make(objects_, CostModel::allowed_comparisons(sizes()), base::executor_of(options),
                  tasks_to_move(objects_.limit(), options)))
    index_ = Index::cells;
  else
    build_forest(false);
}

void Tracker::build_forest(bool others_unset) {
  THRONG_RANGE("build forest");
  forest_.build(objects_, others_unset);
  costs_.forest_is_built();
  index_ = Index::forest;
}

// Cells that cannot hold all objects are built again.
void Tracker::ensure_capacity(const Options& options) {
  if (index_ == Index::cells &&
      !cells_.has_capacity_for(objects_.count() + objects_.removed_count()))
    build_index(options);
}

// Places changed objects in the index. Returns false, with only some of them placed, if searches
// would visit too many lines.
bool Tracker::place_dirty(const Options& options, double max_lines) {
  ensure_capacity(options);
  const PodVector<ObjectId>& dirty = objects_.dirty_list();
  if (index_ == Index::cells) return place_in_cells(dirty.data(), dirty.size(), max_lines);
  place_in_forest(dirty.data(), dirty.size());
  return true;
}

// Ids may occur twice.
void Tracker::place_in_forest(const ObjectId* dirty, std::size_t count) {
  constexpr std::uint32_t queued = none - 1;
  insert_queue_.reserve_discard(count);
  if (!forest_.has_capacity_for(count)) {
    for (std::size_t i = 0; i < count; ++i) objects_.body(dirty[i]).bucket = none;
    index_ = Index::absent;
    build_forest(true);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const ObjectId id = dirty[i];
    std::uint32_t& bucket = objects_.body(id).bucket;
    if (bucket == queued) continue;
    if (bucket != none) forest_.erase(bucket);
    bucket = none;
    if (!objects_.is_active(id)) continue;
    bucket = queued;
    insert_queue_.push(id);
  }
  forest_.insert(objects_, insert_queue_.data(), insert_queue_.size());
}

bool Tracker::place_in_cells(const ObjectId* dirty, std::size_t count, double max_lines) noexcept {
  double lines = 0;
  Cells::Place places[place_ahead];
  for (std::size_t i = 0; i + 1 < count + place_ahead; ++i) {
    if (i < count) {
      if (i + place_ahead < count) objects_.prefetch(dirty[i + place_ahead]);
      const ObjectId id = dirty[i];
      Cells::Place& place = places[i % place_ahead];
      place.bucket = none;
      if (objects_.body(id).bucket != none) cells_.prefetch(objects_.body(id).bucket);
      if (objects_.is_active(id)) {
        Box storage;
        place =
            cells_.place(objects_.expanded(id, storage), worlds_of(objects_, objects_.filter(id)));
        lines += static_cast<double>(place.lines);
        if (lines > max_lines) return false;
        cells_.prefetch(place.bucket);
      }
    }
    if (constexpr std::size_t half = place_ahead / 2; i >= half && i - half < count) {
      const std::uint32_t bucket = objects_.body(dirty[i - half]).bucket;
      if (bucket != none) cells_.prefetch_chain(bucket);
    }
    if (i + 1 < place_ahead) continue;
    const ObjectId id = dirty[i + 1 - place_ahead];
    const Cells::Place& place = places[(i + 1) % place_ahead];
    Body& body = objects_.body(id);
    Box storage;
    if (place.bucket != none && place.bucket == body.bucket) {
      cells_.replace(id, objects_.expanded(id, storage), place);
      continue;
    }
    if (body.bucket != none) cells_.erase(id, body.bucket);
    if (place.bucket != none) cells_.insert(id, objects_.expanded(id, storage), place);
    body.bucket = place.bucket;
  }
  return true;
}

// Returns false if the search was aborted.
bool Tracker::search_incrementally(const Options& options, unsigned tasks, double budget_ns,
                                   Result& r) {
  THRONG_RANGE("incremental search");
  const PodVector<ObjectId>& dirty = objects_.dirty_list();
  tasks = dirty.size() < min_parallel_searches ? 1 : tasks;
  r.plan.threads = tasks;
  local_updates_.make(tasks);
  for (unsigned t = 0; t < tasks; ++t) local_updates_[t].start();
  const bool in_forest = index_ == Index::forest;
  const LocalUpdate::Scene scene{objects_, pairs_, cells_, in_forest ? &forest_ : nullptr};
  base::Cancellation stop(options.stop);
  const std::uint64_t max_work = CostModel::max_work(budget_ns, tasks);
  base::ChunkQueue shares(dirty.size(), tasks, tasks == 1 ? dirty.size() : search_chunk);
  base::run_tasks_or_throw(base::executor_of(options), tasks, [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);)
      local_updates_[t].search(scene, dirty.data() + begin, end - begin, max_work, stop);
  });
  if (stop()) {
    r.status = Status::stopped;
    return true;
  }
  std::size_t begun = 0, ended = 0, searched = 0;
  Work work;
  for (unsigned t = 0; t < tasks; ++t) {
    begun += local_updates_[t].begun().size();
    ended += local_updates_[t].ended().size();
    searched += local_updates_[t].searched();
    work += local_updates_[t].work();
  }
  r.comparisons += work.compared;
  r.visited += work.visited;
  costs_.note_searches(sizes(), work, searched, in_forest);
  const bool completed = searched == dirty.size();
  costs_.incremental_search_ended(completed);
  if (!completed) return false;
  pairs_.reserve_events(begun, ended);
  for (unsigned t = 0; t < tasks; ++t) {
    pairs_.next_begun().push(local_updates_[t].begun());
    pairs_.next_ended().push(local_updates_[t].ended());
  }
  local_updates_.match(tasks);
  pairs_.commit_linked(objects_);
  return true;
}

// All pairs in sorted order, as a Finder finds them.
Result Tracker::find_into(grid::Engine& engine, PodVector<Pair>& found, const Boxes& a,
                          const Boxes* b, float margin, const Options& options) {
  Options all = options;
  all.order = Order::canonical;
  all.nan = NanPolicy::inactive;
  all.algorithm = Algorithm::automatic;
  all.margin = margin;
  all.memory_cap_bytes = 0;
  found.clear();
  grid::Output output{found.data(), found.capacity(), grow_list, &found};
  const Result r = engine.find(a, b, all, &output, nullptr);
  if (r.ok()) found.resize(static_cast<std::size_t>(r.found));
  return r;
}

void Tracker::find_all(const Options& options, unsigned tasks, Result& r) {
  columns_valid_ = false;
  costs_.begin_full_search();
  const bool sparse = objects_.sparse();
  // Indices into the list of ids in use, if that is much shorter.
  const Boxes all = sparse ? objects_.packed_view() : objects_.view();
  r = find_into(engine_, found_, all, nullptr, objects_.margin(), options);
  if (!r.ok()) return;
  costs_.end_full_search(sizes(), r.comparisons);
  if (sparse) {
    const PodVector<ObjectId>& ids = objects_.alive_ids();
    for (Pair& pair : found_) pair = {ids[pair.first], ids[pair.second]};
  }
  pairs_.commit_sorted(found_.data(), found_.size(), objects_.limit(), base::executor_of(options),
                       tasks);
  links_valid_ = object_pairs_valid_ = false;
  costs_.begin_lists();
  columns_valid_ = !sparse && engine_.single_grid_plan() != nullptr;
}

void Tracker::reserve_for(const Tracker& other) {
  objects_.reserve_for(other.objects_);
  pairs_.reserve_for(other.pairs_);
  if (other.index_ == Index::cells) cells_.reserve_for(other.cells_);
  if (other.index_ == Index::forest) forest_.reserve_for(other.forest_);
}

void Tracker::copy(const Tracker& other) noexcept {
  objects_.copy(other.objects_);
  pairs_.copy(other.pairs_);
  if (other.index_ == Index::cells) cells_.copy(other.cells_);
  if (other.index_ == Index::forest) forest_.copy(other.forest_);
  placement_valid_ = false;
  columns_valid_ = false;
  index_ = other.index_.load();
  blocks_valid_ = false;
  object_pairs_valid_ = false;
  links_valid_ = other.links_valid_;
  costs_.copy(other.costs_);
}

// ---- queries: what they search, and when they build an index ----

namespace {

// A concurrent query holds the lock while it builds, so it uses one thread: while waiting for tasks
// it could be given a task of another query that needs the same lock.
Options preparation_options(bool concurrent, const Options& options) noexcept {
  Options adjusted = options;
  if (concurrent) adjusted.threads = 1;
  return adjusted;
}

}  // namespace

// Places changed objects in the index; the first of several concurrent queries does it.
void Tracker::place_for_queries(bool concurrent, const Options& options) {
  if (placement_valid_.load(std::memory_order_acquire)) return;
  const std::lock_guard<base::Mutex> lock(prepare_mutex_);
  if (placement_valid_.load(std::memory_order_relaxed)) return;
  objects_.dirty_list();
  ensure_capacity(preparation_options(concurrent, options));
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

// Builds cells once they would have paid for the queries.
void Tracker::note_query_cost(bool concurrent, std::size_t count, double ns,
                              const Options& options) {
  const CostModel::Cells cells = costs_.note_query_cost(sizes(), count, ns);
  if (index_ != Index::absent || cells == CostModel::Cells::do_not_pay) return;
  // While another thread builds them, small queries continue without cells.
  std::unique_lock<base::Mutex> lock(prepare_mutex_, std::defer_lock);
  if (cells == CostModel::Cells::pay_for_this_call)
    lock.lock();
  else if (!lock.try_lock())
    return;
  if (index_ == Index::absent) build_index(preparation_options(concurrent, options));
}

// Builds block data once sweeps visited as many cells as that costs; with blocks they skip most.
void Tracker::note_cells_visited(std::uint64_t cells) noexcept {
  if (blocks_valid_ || index_ != Index::cells || cells == 0) return;
  if (!costs_.blocks_pay(sizes(), cells)) return;
  const std::unique_lock<base::Mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock || blocks_valid_) return;
  costs_.begin_blocks();
  try {
    cells_.make_blocks(objects_);
    blocks_valid_ = true;
  } catch (const base::AllocationFailed&) {  // the sweeps are complete without blocks
  }
}

// Accounts for cost above the estimate in queries without an index: where boxes are clustered, the
// visited columns may hold far more than the average.
void Tracker::note_excess_cost(bool concurrent, const Work& work, double expected,
                               const Options& options) noexcept {
  if (index_ != Index::absent) return;
  const double cost = CostModel::unindexed_ns(work);
  if (cost <= expected) return;
  try {
    note_query_cost(concurrent, 0, cost - expected, options);
  } catch (const base::AllocationFailed&) {  // the queries are complete without cells
  }
}

// Accounts for queries in cells that did more work than in a forest. Other threads may still search
// the cells, so those stay unchanged while the forest is built.
void Tracker::note_query_work(const Work& work, std::size_t queries, std::size_t hits) noexcept {
  if (index_ != Index::cells) return;
  costs_.note_queries_in_cells(work, queries, hits);
  if (!costs_.forest_pays(sizes())) return;
  const std::unique_lock<base::Mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock || index_ != Index::cells) return;
  costs_.begin_forest();
  try {
    build_forest(false);
  } catch (const base::AllocationFailed&) {  // the queries are complete without a forest
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
  if (!costs_.lists_pay(sizes(), objects_.limit())) return false;
  const std::unique_lock<base::Mutex> lock(prepare_mutex_, std::try_to_lock);
  if (!lock) return false;
  if (object_pairs_valid_) return true;
  costs_.begin_lists();
  try {
    by_object_.make(pairs_.sorted_list(), objects_.limit());
  } catch (const base::AllocationFailed&) {
    return false;  // a scan of all pairs still works
  }
  object_pairs_valid_.store(true, std::memory_order_release);
  return true;
}

void Tracker::find_overlaps(Queries& caller, const Boxes& boxes, const Options& options,
                            Result& r) {
  THRONG_RANGE("find overlaps");
  const bool concurrent = &caller != &queries_;
  const double all = CostModel::two_set_search_ns(objects_.limit());
  const bool few = CostModel::searches_ns(boxes.size()) < all;
  bool single_queries = false;
  double expected = 0;
  if (few) {
    place_for_queries(concurrent, options);
    const QueryIndex now{.columns = columns()};
    const double cost =
        cost_of(boxes.size(), [&](std::size_t i) { return now.cost(objects_, boxes[i]); });
    expected = std::min(cost, all);
    note_query_cost(concurrent, boxes.size(), expected, options);
    single_queries = index_ != Index::absent || cost < all;
  }
  base::Cancellation stop(options.stop);
  if (single_queries) {
    const Work work =
        caller.find_overlaps(objects_, query_index(), boxes, base::executor_of(options),
                             base::threads_of(options), stop);
    r.comparisons = work.compared;
    r.visited = work.visited;
    note_query_work(work, boxes.size(), caller.overlaps().size());
    note_excess_cost(concurrent, work, expected, options);
  } else {
    // the engine is shared with updates and overwrites its columns
    if (!concurrent) columns_valid_ = false;
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
  const bool concurrent = &caller != &queries_;
  place_for_queries(concurrent, options);
  const QueryIndex now{.columns = columns()};
  const double cost = cost_of(sweeps.count, [&](std::size_t i) {
    return now.cost(objects_, base::MovingBox(sweeps.data[i]));
  });
  note_query_cost(concurrent, sweeps.count, cost, options);
  base::Cancellation stop(options.stop);
  std::uint64_t far = 0;
  const Work work = caller.find_hits(objects_, query_index(), sweeps, base::executor_of(options),
                                     base::threads_of(options), stop, far);
  r.comparisons = work.compared;
  r.visited = work.visited;
  note_cells_visited(far);
  note_query_work(work, sweeps.count, caller.hits().size());
  note_excess_cost(concurrent, work, cost, options);
  r.found = r.written = caller.hits().size();
  if (stop()) r.status = Status::stopped;
}

SweepHit Tracker::find_first_hit(const Cast& cast, const Options& options, Result& r) {
  THRONG_RANGE("find first hit");
  place_for_queries(true, options);
  const double cost = QueryIndex{.columns = columns()}.cost(objects_, cast.path);
  note_query_cost(true, 1, cost, options);
  std::uint64_t far = 0;
  Work work;
  const SweepHit hit = tracking::find_first_hit(objects_, query_index(), cast, work, far);
  r.found = r.written = hit.object != none;
  r.comparisons = work.compared;
  r.visited = work.visited;
  note_cells_visited(far);
  note_query_work(work, 1, r.found);
  note_excess_cost(true, work, cost, options);
  return hit;
}

}  // namespace throng::tracking
