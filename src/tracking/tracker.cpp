#include "tracking/tracker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "base/parallel_region.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"

namespace throng::tracking {
namespace {

// Cost model, ns, measured as in the header. Full search, per object and per pair; fraction of a
// thread's speed that each further thread adds.
constexpr double find_object_ns = 18, find_pair_ns = 14, thread_efficiency = 0.7;
// Per changed object: placing it in a cell (forest) and reporting its events; per pair that it had;
// per cache line of cells that its search visits.
constexpr double place_ns = 70, place_in_forest_ns = 600, previous_pair_ns = 45, line_ns = 15;
// Per comparison of a full search; matters where comparisons far outnumber objects.
constexpr double full_comparison_ns = 0.25;
// Decay, per full search, of a comparison estimate that caused it; and the longest interval, in
// updates, after which the incremental search is tried again.
constexpr double estimate_decay = 0.01;
// Longest backoff: cells are tried again after this many changes per object. Doubles each time the
// waste reached the cost of a forest.
constexpr std::size_t max_retry_interval = 64;
constexpr std::uint32_t max_wait_updates = 8;
// An incremental search is not aborted before this much work.
constexpr double min_work = 4096;
// Linking one pair.
constexpr double link_ns = 30;
// Cells count as outdated when a search compares twice as many boxes per pair as in new cells, and
// more than this.
constexpr double outdated_comparisons = 64;
// Below this many objects a forest saves too little.
constexpr std::size_t min_forest_objects = 256;
// Number of searches after which the weight of older ones has halved.
constexpr double estimate_half_life = 256;
// Prefetch distance, in objects.
constexpr std::size_t place_ahead = 32;
// Minimum changed objects for a second thread; objects per work chunk.
constexpr std::size_t min_parallel_searches = 400, search_chunk = 64;
// Minimum objects for a second thread in move_all().
constexpr std::size_t min_parallel_moves = 20000;

// Grows the list for the engine's output; null when out of memory.
Pair* grow_list(void* list, std::size_t count) {
  try {
    auto& found = *static_cast<PodVector<Pair>*>(list);
    found.reserve_discard(grid::with_spare(count, found.capacity()));
    return found.data();
  } catch (const grid::AllocationFailed&) {
    return nullptr;
  }
}

unsigned tasks_to_move(std::size_t objects, const Options& options) noexcept {
  return objects < min_parallel_moves ? 1 : grid::threads_of(options);
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
  grid::ChunkQueue shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      if (Objects::has_nan(boxes, begin, end)) found = true;
    }
  };
  grid::run_tasks(grid::executor_of(options), tasks, task);
  return found;
}

void Tracker::move_all(const Boxes& boxes, const Options& options) noexcept {
  THRONG_RANGE("move all");
  placement_valid_ = false;
  const std::size_t n = objects_.limit();
  const unsigned tasks = tasks_to_move(n, options);
  std::atomic<std::size_t> dirty{0};
  std::atomic<std::int64_t> inactive{0};
  grid::ChunkQueue shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      std::int64_t more;
      dirty += objects_.move_range(boxes, begin, end, more);
      inactive += more;
    }
  };
  grid::run_tasks(grid::executor_of(options), tasks, task);
  objects_.count_marked(dirty, inactive);
}

void Tracker::update(const Options& options, Result& r) {
  THRONG_RANGE("update");
  using Clock = std::chrono::steady_clock;
  const auto start = options.measure_stages ? Clock::now() : Clock::time_point{};
  const unsigned tasks = grid::threads_of(options);
  r.plan.threads = tasks;
  r.plan.algorithm = Algorithm::grid;
  r.plan.reason = "nothing changed";
  const std::size_t changed = objects_.dirty_count();
  if (changed == 0) {
    pairs_.commit_nothing();
  } else {
    const unsigned team = changed < min_parallel_searches ? 1 : tasks;
    grid::ParallelRegion::run(grid::executor_of(options), team, [&](const Executor& executor) {
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
  const auto objects = static_cast<double>(objects_.count());
  const auto pairs = static_cast<double>(pairs_.count());
  const auto changed = static_cast<double>(objects_.dirty_count());
  const double threads = 1 + thread_efficiency * (tasks - 1);
  const double all =
      (objects * std::max(find_object_ns, full_search_ns_) + pairs * find_pair_ns) / threads;
  const double clear_dirty = index_ == Index::forest ? place_in_forest_ns : place_ns;
  const auto incremental_cost = [&](double comparisons) {
    const double search = search_ns + comparison_ns * comparisons +
                          previous_pair_ns * 2 * pairs / std::max(objects, 1.0);
    return changed * (clear_dirty + search / threads);
  };
  double few = incremental_cost(expected_comparisons_);
  budget_ns = all * threads;
  if (few >= all) {
    // These searches may be cheaper than earlier ones, so they are tried now and then.
    if (index_ != Index::forest)
      add_waste(all - incremental_cost(std::min(expected_comparisons_, allowed_comparisons())));
    expected_comparisons_ += estimate_decay * (initial_comparisons - expected_comparisons_);
    few = incremental_cost(initial_comparisons);
    if (few >= all || --retry_countdown_ != 0) return false;
    retry_countdown_ = 1;
  }
  if (index_ == Index::absent || !links_valid_) {
    regret_ += all - few;
    if (regret_ < objects * cell_ns + pairs * link_ns && !forest_pays()) return false;
    if (index_ == Index::absent) build_index(options);
    if (!links_valid_) pairs_.link_all(objects_);
    links_valid_ = true;
    regret_ = 0;
  } else if (index_ == Index::forest) {
    if (changed_since_build_ > retry_interval_ * objects_.count()) {
      if (cells_.is_suitable(objects_, allowed_comparisons())) {
        build_index(options);
        rebuilt_once_ = true;
      }
      changed_since_build_ = 0;
    }
  } else if (forest_pays() || regret_ > objects * cell_ns) {
    build_index(options);
  }
  changed_since_build_ += objects_.dirty_count();
  if (place_dirty(options, all / line_ns)) return true;
  // The changed objects are too wide for cells. If this happens twice in a row, build a forest.
  regret_ = 0;
  if (!std::exchange(changed_too_wide_, true)) return false;
  index_ = Index::absent;
  build_forest(false);
  return true;
}

// Comparisons per search that a forest would need, too.
double Tracker::allowed_comparisons() const noexcept {
  const auto objects = static_cast<double>(std::max<std::size_t>(objects_.count(), 1));
  return allowed_per_search + allowed_per_pair * 2 * static_cast<double>(pairs_.count()) / objects;
}

void Tracker::add_waste(double ns) noexcept {
  if (ns > 0) wasted_ns_.fetch_add(ns, std::memory_order_relaxed);
}

bool Tracker::forest_pays() const noexcept {
  return wasted_ns_.load(std::memory_order_relaxed) >
         forest_ns * static_cast<double>(std::max(objects_.count(), min_forest_objects));
}

void Tracker::build_index(const Options& options) {
  THRONG_RANGE("build index");
  // Many changes since the cells were built may explain the waste; accepted as the reason only
  // once.
  const bool outdated =
      index_ == Index::cells && changed_since_build_ > objects_.count() / 8 && !rebuilt_once_;
  const bool try_cells = outdated || !forest_pays();
  rebuilt_once_ = outdated && forest_pays();
  if (!try_cells) retry_interval_ = std::min(2 * retry_interval_, max_retry_interval);
  index_ = Index::absent;
  blocks_valid_ = false;
  if (objects_.sparse()) objects_.list_alive();
  if (links_valid_) regret_ = 0;
  new_cell_comparisons_ = 0;
  // If the cells were not outdated, new ones would waste as much.
  if (outdated) wasted_ns_ = 0;
  changed_since_build_ = 0;
  if (try_cells && cells_.make(objects_, allowed_comparisons(), grid::executor_of(options),
                               tasks_to_move(objects_.limit(), options)))
    index_ = Index::cells;
  else
    build_forest(false);
}

void Tracker::build_forest(bool others_unset) {
  THRONG_RANGE("build forest");
  forest_.build(objects_, others_unset);
  wasted_ns_ = 0;
  index_ = Index::forest;
}

// Places changed objects in the index. Returns false, with only some of them placed, if searches
// would visit too many lines.
bool Tracker::place_dirty(const Options& options, double max_lines) {
  if (index_ == Index::cells &&
      !cells_.has_capacity_for(objects_.count() + objects_.removed_count()))
    build_index(options);
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
  grid::Cancellation stop(options.stop);
  const auto max_work =
      static_cast<std::uint64_t>(std::max(budget_ns / comparison_ns / tasks, min_work));
  grid::ChunkQueue shares(dirty.size(), tasks, tasks == 1 ? dirty.size() : search_chunk);
  grid::run_tasks_or_throw(grid::executor_of(options), tasks, [&](unsigned t) {
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
  update_estimates(work, searched);
  if (searched != dirty.size()) {
    retry_wait_ = std::min(2 * retry_wait_, max_wait_updates);
    retry_countdown_ = retry_wait_;
    return false;
  }
  retry_countdown_ = retry_wait_ = 1;
  pairs_.reserve_events(begun, ended);
  for (unsigned t = 0; t < tasks; ++t) {
    pairs_.next_begun().push(local_updates_[t].begun());
    pairs_.next_ended().push(local_updates_[t].ended());
  }
  local_updates_.match(tasks);
  pairs_.commit_linked(objects_);
  return true;
}

// Updates the estimates for the next searches from the work of these.
void Tracker::update_estimates(const Work& work, std::size_t searched) noexcept {
  const auto searches = static_cast<double>(searched);
  const bool in_forest = index_ == Index::forest;
  const auto compared = static_cast<double>(in_forest ? work.total() : work.compared);
  expected_comparisons_ +=
      (compared / searches - expected_comparisons_) * searches / (searches + estimate_half_life);
  if (in_forest) return;
  add_waste(comparison_ns * (compared - allowed_comparisons() * searches));
  const auto objects = static_cast<double>(objects_.count());
  const double pairs = 1 + 2 * static_cast<double>(pairs_.count()) / std::max(objects, 1.0);
  const double allowed =
      std::max(outdated_comparisons, 2 * new_cell_comparisons_ * pairs) * searches;
  if (new_cell_comparisons_ == 0) {
    new_cell_comparisons_ = (compared / searches + 1) / pairs;
  } else {
    regret_ += comparison_ns * std::max(0.0, compared - allowed);
  }
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
  earlier_savings_ns_ = query_savings_ns_.exchange(0);
  const bool sparse = objects_.sparse();
  // Indices into the list of ids in use, if that is much shorter.
  const Boxes all = sparse ? objects_.packed_view() : objects_.view();
  r = find_into(engine_, found_, all, nullptr, objects_.margin(), options);
  if (!r.ok()) return;
  full_search_ns_ = full_comparison_ns * static_cast<double>(r.comparisons) /
                    static_cast<double>(std::max<std::size_t>(objects_.count(), 1));
  if (sparse) {
    const PodVector<ObjectId>& ids = objects_.alive_ids();
    for (Pair& pair : found_) pair = {ids[pair.first], ids[pair.second]};
  }
  pairs_.commit_sorted(found_.data(), found_.size(), objects_.limit(), grid::executor_of(options),
                       tasks);
  links_valid_ = object_pairs_valid_ = false;
  pairs_scanned_ = 0;
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
  pairs_scanned_ = 0;
  links_valid_ = other.links_valid_;
  regret_ = other.regret_;
  wasted_ns_ = other.wasted_ns_.load();
  changed_since_build_ = other.changed_since_build_;
  rebuilt_once_ = other.rebuilt_once_;
  retry_interval_ = other.retry_interval_;
  changed_too_wide_ = other.changed_too_wide_;
  full_search_ns_ = other.full_search_ns_;
  retry_countdown_ = other.retry_countdown_;
  retry_wait_ = other.retry_wait_;
  query_savings_ns_ = other.query_savings_ns_.load();
  earlier_savings_ns_ = other.earlier_savings_ns_;
  new_cell_comparisons_ = other.new_cell_comparisons_;
  expected_comparisons_ = other.expected_comparisons_;
}

}  // namespace throng::tracking
