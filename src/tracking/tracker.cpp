#include "tracking/tracker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "base/parallel_region.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"

namespace throng::tracking {
namespace {

using base::cost;

// Objects per work chunk.
constexpr std::size_t search_chunk = 64;
constexpr double no_limit = 1e300;

// The number of tasks for this much work.
unsigned tasks_for(std::size_t count, double each_ns, const Options& options) noexcept {
  return static_cast<double>(count) * each_ns < cost.parallel_ns ? 1 : base::threads_of(options);
}
// A search around an object or for a query, whose comparisons cost about as much as the rest.
double search_ns() noexcept { return 2 * cost.local_object_ns; }
// To visit all objects.
unsigned tasks_to_visit(std::size_t objects, const Options& options) noexcept {
  return tasks_for(objects, cost.visit_ns, options);
}

// Calls f(begin, end) for ranges of objects, with several threads where that pays.
template <class F>
void each_range(std::size_t objects, const Options& options, const F& f) {
  const unsigned tasks = tasks_to_visit(objects, options);
  base::ChunkQueue shares(objects, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) f(begin, end);
  };
  base::run_tasks(base::executor_of(options), tasks, task);
}

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

// Estimates the cost of `count` queries from a sample of at most 16.
template <class Cost>
double cost_of(std::size_t count, const Cost& cost_of_one) noexcept {
  const std::size_t sampled = std::min<std::size_t>(count, 16);
  double sum = 0;
  for (std::size_t k = 0; k < sampled; ++k) sum += cost_of_one(count * k / sampled);
  return sampled == 0 ? 0 : sum / static_cast<double>(sampled) * static_cast<double>(count);
}

}  // namespace

Tracker::Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept
    : engine_(memory, already_held),
      objects_(engine_.memory(), margin),
      pairs_(engine_.memory()),
      cells_(engine_.memory()),
      forest_(engine_.memory()),
      queries_(engine_),
      local_updates_(engine_.memory()),
      found_(engine_.memory()) {}

bool Tracker::has_nan(const Boxes& boxes, const Options& options) noexcept {
  std::atomic<bool> found{false};
  each_range(boxes.size(), options, [&](std::size_t begin, std::size_t end) {
    if (Objects::has_nan(boxes, begin, end)) found = true;
  });
  return found;
}

void Tracker::move_all(const Boxes& boxes, const Options& options) noexcept {
  THRONG_RANGE("move all");
  placement_valid_ = false;
  std::atomic<std::size_t> dirty{0};
  std::atomic<std::int64_t> inactive{0};
  each_range(objects_.limit(), options, [&](std::size_t begin, std::size_t end) {
    std::int64_t more;
    dirty += objects_.move_range(boxes, begin, end, more);
    inactive += more;
  });
  objects_.count_marked(dirty, inactive);
}

void Tracker::update(const Options& options, Result& r) {
  THRONG_RANGE("update");
  using Clock = std::chrono::steady_clock;
  const auto start = options.measure_stages ? Clock::now() : Clock::time_point{};
  r.plan.threads = base::threads_of(options);
  r.plan.algorithm = Algorithm::grid;
  r.plan.reason = "nothing changed";
  const std::size_t changed = objects_.dirty_count();
  if (changed == 0) {
    pairs_.commit_nothing();
  } else {
    const unsigned team = tasks_for(changed, search_ns(), options);
    base::ParallelRegion::run(base::executor_of(options), team, [&](const Executor& executor) {
      Options adjusted = options;
      adjusted.executor = &executor;
      find_changes(adjusted, team, r);
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

// The steps of an update in which objects changed.
void Tracker::find_changes(const Options& options, unsigned team, Result& r) {
  const UpdateInput in = costs_.measured(
      {objects_.count(), pairs_.count(), objects_.dirty_count(), index_, links_valid_});
  const UpdateChoice choice = choose_update(in);
  if (choice.local) {
    // 1. Bring index and links up to date.
    columns_valid_ = false;
    if (choice.build != Index::absent) build_index(choice.build, options);
    link_pairs();
    // 2. Place the changed objects in the index. 3. Search around them; commit the events.
    ensure_capacity(options);
    const PodVector<ObjectId>& dirty = objects_.dirty_list();
    if (!place(dirty.data(), dirty.size(), choice.full_ns / (2 * cost.comparison_ns))) {
      costs_.add_waste(choice.full_ns);  // they are too wide for cells
      index_ = Index::absent;
    } else if (search_around_changed(in, choice, team, options, r)) {
      return;
    }
    // 4. If that costs more than a full search, search all.
  } else {
    costs_.add_full_search(in, choice);
    index_ = Index::absent;
  }
  find_all(options, r);
}

// Builds cells if they suit, otherwise a forest. An old forest stays if they do not.
void Tracker::build_index(Index wanted, const Options& options) {
  THRONG_RANGE("build index");
  const double most = forest_comparisons(objects_.count(), pairs_.count());
  if (objects_.sparse()) objects_.list_alive();
  if (wanted == Index::forest) {
    build_forest(false);
  } else if (index_ != Index::forest || cells_.is_suitable(objects_, most)) {
    index_ = Index::absent;
    blocks_valid_ = false;
    if (cells_.make(objects_, most, base::executor_of(options),
                    tasks_to_visit(objects_.limit(), options)))
      index_ = Index::cells;
    else
      build_forest(false);
  }
  costs_.add_build(index_, objects_.count());
}

void Tracker::build_forest(bool others_unset) {
  forest_.build(objects_, others_unset);
  index_ = Index::forest;
}

void Tracker::link_pairs() {
  if (links_valid_) return;
  pairs_.link_all(objects_);
  links_valid_ = true;
}

// Cells that cannot hold all objects are built again.
void Tracker::ensure_capacity(const Options& options) {
  if (index_ == Index::cells &&
      !cells_.has_capacity_for(objects_.count() + objects_.removed_count()))
    build_index(Index::cells, options);
}

// Places changed objects in the index; ids may occur twice. Returns false, with only some of them
// placed, if searches would visit too many lines of cells.
bool Tracker::place(const ObjectId* ids, std::size_t count, double max_lines) {
  if (index_ == Index::cells) return cells_.place_all(objects_, ids, count, max_lines);
  if (forest_.has_capacity_for(count)) {
    forest_.place_all(objects_, ids, count);
  } else {
    for (std::size_t i = 0; i < count; ++i) objects_.body(ids[i]).bucket = none;
    index_ = Index::absent;
    build_forest(true);
  }
  return true;
}

// Returns false if the search was aborted because it cost more than a full search.
bool Tracker::search_around_changed(const UpdateInput& in, const UpdateChoice& choice,
                                    unsigned tasks, const Options& options, Result& r) {
  THRONG_RANGE("search around changed objects");
  const PodVector<ObjectId>& dirty = objects_.dirty_list();
  r.plan.reason = "few objects changed: incremental search around them";
  r.plan.threads = tasks;
  local_updates_.make(tasks);
  for (unsigned t = 0; t < tasks; ++t) local_updates_[t].start();
  const bool in_forest = index_ == Index::forest;
  const LocalUpdate::Scene scene{objects_, pairs_, cells_, in_forest ? &forest_ : nullptr};
  base::Cancellation stop(options.stop);
  const auto max_work = static_cast<std::uint64_t>(choice.full_ns / cost.comparison_ns / tasks);
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
  r.comparisons = work.compared;
  r.visited = work.visited;
  costs_.add_local_search(in, choice, in_forest, work, searched);
  if (searched != dirty.size()) return false;
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

// A full search. Adds its work to that of an aborted search.
void Tracker::find_all(const Options& options, Result& r) {
  columns_valid_ = false;
  const bool sparse = objects_.sparse();
  // Indices into the list of ids in use, if that is much shorter.
  const Boxes all = sparse ? objects_.packed_view() : objects_.view();
  const std::uint64_t compared = r.comparisons, visited = r.visited;
  r = find_into(engine_, found_, all, nullptr, objects_.margin(), options);
  if (!r.ok()) return;
  r.comparisons += compared;
  r.visited += visited;
  if (sparse) {
    const PodVector<ObjectId>& ids = objects_.alive_ids();
    for (Pair& pair : found_) pair = {ids[pair.first], ids[pair.second]};
  }
  pairs_.commit_sorted(found_.data(), found_.size(), objects_.limit(), base::executor_of(options),
                       base::threads_of(options));
  links_valid_ = false;
  pair_scans_ = 0;
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
  links_valid_ = other.links_valid_.load();
  pair_scans_ = 0;
  costs_.copy(other.costs_);
}

// Without links, scans all pairs a few times, then links them.
std::size_t Tracker::pairs_of(ObjectId id, LivePair* out, std::size_t capacity) noexcept {
  if (id >= objects_.limit()) return 0;
  if (!links_valid_ && static_cast<double>(++pair_scans_) > cost.guard) {
    const std::unique_lock<base::Mutex> lock(prepare_mutex_, std::try_to_lock);
    try {
      if (lock) link_pairs();
    } catch (const base::AllocationFailed&) {  // a scan still works
    }
  }
  return links_valid_ ? pairs_.pairs_by_links(objects_, id, out, capacity)
                      : pairs_.pairs_by_scan(id, out, capacity);
}

// ---- queries ----

// Prepares `count` queries: places changed objects in the index, or builds one if it pays. The
// first of several concurrent queries does it. Returns where to search, and what an index saves.
template <class Query>
Tracker::Prepared Tracker::prepare_queries(bool concurrent, std::size_t count, const Query& query,
                                           const Options& options) {
  // A concurrent query holds the lock while it builds, so it uses one thread: while waiting for
  // tasks it could be given a task of another query that needs the same lock.
  Options own = options;
  if (concurrent) own.threads = 1;
  if (!placement_valid_.load(std::memory_order_acquire)) {
    const std::lock_guard<base::Mutex> lock(prepare_mutex_);
    if (!placement_valid_.load(std::memory_order_relaxed)) place_for_queries(own);
  }
  const QueryIndex no_index{.columns = columns()};
  // Few objects: a loop over all is as fast.
  if (static_cast<double>(objects_.limit()) * cost.visit_ns < cost.index_query_ns)
    return {no_index, 0};
  const double index_ns = static_cast<double>(count) * cost.index_query_ns;
  const double saved_ns =
      cost_of(count, [&](std::size_t i) { return no_index.cost(objects_, query(i)); }) - index_ns;
  const auto build_pays = [&] {
    return index_ == Index::absent ? costs_.index_pays(objects_.count(), saved_ns)
                                   : index_ == Index::cells && costs_.forest_pays(objects_.count());
  };
  const auto blocks_pay = [&] {
    return index_ == Index::cells && !blocks_valid_ && far_cells_ > objects_.count();
  };
  if (build_pays() || blocks_pay()) {
    const std::lock_guard<base::Mutex> lock(prepare_mutex_);
    // Other threads may still search the cells, which therefore stay while a forest is built.
    if (build_pays())
      build_index(costs_.forest_pays(objects_.count()) ? Index::forest : Index::cells, own);
    if (blocks_pay()) {
      far_cells_ = 0;
      cells_.make_blocks(objects_);
      blocks_valid_ = true;
    }
  }
  const Index index = index_;
  if (index == Index::forest) return {{.forest = &forest_}, saved_ns};
  if (index == Index::absent) return {no_index, saved_ns};
  return {{.cells = &cells_, .blocks = blocks_valid_ ? &cells_.blocks() : nullptr}, saved_ns};
}

void Tracker::place_for_queries(const Options& options) {
  objects_.dirty_list();
  ensure_capacity(options);
  if (index_ != Index::absent) {
    objects_.place_changed(
        [this](const ObjectId* changed, std::size_t count) { place(changed, count, no_limit); });
  }
  if (cells_.blocks().is_stale()) {
    blocks_valid_ = false;
    cells_.clear_blocks();
  }
  placement_valid_.store(true, std::memory_order_release);
}

// Accounts for the work of queries. Columns may hold far more than the average where boxes are
// clustered, so queries without an index may cost more than estimated.
void Tracker::note_queries(const Prepared& prepared, const Work& work, std::size_t queries,
                           std::size_t hits, Result& r) noexcept {
  const QueryIndex& in = prepared.index;
  const double actual_ns = cost.visit_ns * static_cast<double>(work.total()) -
                           cost.index_query_ns * static_cast<double>(queries);
  costs_.add_saved(in.cells || in.forest ? prepared.saved_ns
                                         : std::max(prepared.saved_ns, actual_ns));
  if (in.cells) costs_.add_queries_in_cells(work, queries, hits);
  if (work.far != 0) far_cells_ += work.far;
  r.comparisons = work.compared;
  r.visited = work.visited;
  r.found = r.written = hits;
}

std::optional<Columns> Tracker::columns() noexcept {
  if (!columns_valid_) return std::nullopt;
  return Columns{{engine_.grid(), *engine_.single_grid_plan()}, objects_.dirty_list()};
}

void Tracker::find_overlaps(Queries& caller, const Boxes& boxes, const Options& options,
                            Result& r) {
  THRONG_RANGE("find overlaps");
  const bool concurrent = &caller != &queries_;
  base::Cancellation stop(options.stop);
  if (static_cast<double>(boxes.size()) * cost.local_object_ns <
      static_cast<double>(objects_.limit()) * cost.full_object_ns) {
    const Prepared prepared = prepare_queries(
        concurrent, boxes.size(), [&](std::size_t i) { return boxes[i]; }, options);
    const Work work =
        caller.find_overlaps(objects_, prepared.index, boxes, base::executor_of(options),
                             tasks_for(boxes.size(), search_ns(), options), stop);
    note_queries(prepared, work, boxes.size(), caller.overlaps().size(), r);
  } else {
    // A two-set search. The engine is shared with updates and overwrites its columns.
    if (!concurrent) columns_valid_ = false;
    const Boxes view = objects_.view();
    r = find_into(caller.engine(), caller.overlaps(), boxes, &view, 0, options);
    r.inactive = 0;
    r.found = r.written = caller.overlaps().size();
  }
  caller.clear_hits();  // the overlaps may have been collected there
  if (stop()) r.status = Status::stopped;
}

void Tracker::find_hits(Queries& caller, const Sweeps& sweeps, const Options& options, Result& r) {
  THRONG_RANGE("find hits");
  base::Cancellation stop(options.stop);
  const Prepared prepared = prepare_queries(
      &caller != &queries_, sweeps.count,
      [&](std::size_t i) { return base::MovingBox(sweeps.data[i]); }, options);
  const Work work = caller.find_hits(objects_, prepared.index, sweeps, base::executor_of(options),
                                     tasks_for(sweeps.count, search_ns(), options), stop);
  note_queries(prepared, work, sweeps.count, caller.hits().size(), r);
  if (stop()) r.status = Status::stopped;
}

SweepHit Tracker::find_first_hit(const Cast& cast, const Options& options, Result& r) {
  THRONG_RANGE("find first hit");
  const Prepared prepared = prepare_queries(
      true, 1, [&](std::size_t) -> const base::MovingBox& { return cast.path; }, options);
  Work work;
  const SweepHit hit = tracking::find_first_hit(objects_, prepared.index, cast, work);
  note_queries(prepared, work, 1, hit.object != none, r);
  return hit;
}

}  // namespace throng::tracking
