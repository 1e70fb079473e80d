#include "live/tracker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "core/profile.hpp"
#include "cpu/team.hpp"
#include "cpu/threads.hpp"

namespace throng::live {
namespace {

// Cost model, ns, measured as in the header. Full search, per object and per pair; fraction of a
// thread's speed that each further thread adds.
constexpr double find_object_ns = 18, find_pair_ns = 14, thread_share = 0.7;
// Per changed object: placing it in a cell (forest) and reporting its events; per pair that it had;
// per cache line of cells that its search visits.
constexpr double settle_ns = 70, settle_in_forest_ns = 600, had_pair_ns = 45, line_ns = 15;
// Per comparison of a full search; matters where comparisons far outnumber objects.
constexpr double found_comparison_ns = 0.25;
// Decay, per full search, of a comparison estimate that caused it; and the longest interval, in
// updates, after which the incremental search is tried again.
constexpr double forgotten = 0.01;
// Longest backoff: cells are tried again after this many changes per object. Doubles each time the
// waste reached the cost of a forest.
constexpr std::size_t most_patience = 64;
constexpr std::uint32_t most_wait = 8;
// An incremental search is not aborted before this much work.
constexpr double least_work = 4096;
// Linking one pair.
constexpr double link_ns = 30;
// Cells count as outdated when a search compares twice as many boxes per pair as in new cells, and
// more than this.
constexpr double outdated_comparisons = 64;
// Below this many objects a forest saves too little.
constexpr std::size_t least_objects_of_forest = 256;
// Number of searches after which the weight of older ones has halved.
constexpr double memory_of_searches = 256;
// Prefetch distance, in objects.
constexpr std::size_t settle_ahead = 32;
// Minimum changed objects for a second thread; objects per work chunk.
constexpr std::size_t threads_search_from = 400, search_step = 64;
// Minimum objects for a second thread in move_all().
constexpr std::size_t threads_move_from = 20000;

// Grows the list for the engine's output; null when out of memory.
Pair* grow_list(void* list, std::size_t count) {
  try {
    auto& found = *static_cast<List<Pair>*>(list);
    found.renew(cpu::with_spare(count, found.capacity()));
    return found.data();
  } catch (const cpu::NoMemory&) {
    return nullptr;
  }
}

unsigned tasks_to_move(std::size_t objects, const Options& options) noexcept {
  return objects < threads_move_from ? 1 : cpu::threads_of(options);
}

}  // namespace

Tracker::Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept
    : engine_(memory, already_held),
      objects_(engine_.memory(), margin),
      pairs_(engine_.memory()),
      by_object_(engine_.memory()),
      cells_(engine_.memory()),
      forest_(engine_.memory()),
      entering_(engine_.memory()),
      queries_(engine_),
      around_(engine_.memory()),
      found_(engine_.memory()) {}

bool Tracker::has_nan(const Boxes& boxes, const Options& options) noexcept {
  const std::size_t n = boxes.size();
  const unsigned tasks = tasks_to_move(n, options);
  if (tasks == 1) return Objects::has_nan(boxes, 0, n);
  std::atomic<bool> found{false};
  cpu::Shares shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      if (Objects::has_nan(boxes, begin, end)) found = true;
    }
  };
  cpu::run_tasks(cpu::executor_of(options), tasks, task);
  return found;
}

void Tracker::move_all(const Boxes& boxes, const Options& options) noexcept {
  THRONG_RANGE("move all");
  ready_ = false;
  const std::size_t n = objects_.limit();
  const unsigned tasks = tasks_to_move(n, options);
  std::atomic<std::size_t> dirty{0};
  std::atomic<std::int64_t> inactive{0};
  cpu::Shares shares(n, tasks, 1024);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);) {
      std::int64_t more;
      dirty += objects_.move_range(boxes, begin, end, more);
      inactive += more;
    }
  };
  cpu::run_tasks(cpu::executor_of(options), tasks, task);
  objects_.marked(dirty, inactive);
}

void Tracker::update(const Options& options, Result& r) {
  THRONG_RANGE("update");
  using Clock = std::chrono::steady_clock;
  const auto start = options.measure_stages ? Clock::now() : Clock::time_point{};
  const unsigned tasks = cpu::threads_of(options);
  r.plan.threads = tasks;
  r.plan.algorithm = Algorithm::grid;
  r.plan.reason = "nothing changed";
  const std::size_t changed = objects_.dirty_count();
  if (changed == 0) {
    pairs_.commit_nothing();
  } else {
    const unsigned team = changed < threads_search_from ? 1 : tasks;
    cpu::Team::lead(cpu::executor_of(options), team, [&](const Executor& executor) {
      Options mine = options;
      mine.executor = &executor;
      catch_up(mine, tasks, r);
    });
    if (!r.ok()) return;
    objects_.settle();
  }
  r.found = r.written = pairs_.count();
  r.inactive = objects_.inactive();
  if (options.measure_stages) {
    r.times.total_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }
}

void Tracker::catch_up(const Options& options, unsigned tasks, Result& r) {
  double most_ns = 0;
  if (few_changed(options, tasks, most_ns)) {
    columned_ = false;
    r.plan.reason = "few objects changed: incremental search around them";
    if (search_around(options, tasks, most_ns, r)) return;
    // The search was aborted, but the changed objects are in the index.
    const Result given_up = r;
    find_all(options, tasks, r);
    r.comparisons += given_up.comparisons;
    r.visited += given_up.visited;
  } else {
    index_ = Index::absent;
    find_all(options, tasks, r);
  }
}

// Decides whether the incremental search is cheaper; if so, builds the index, links the pairs and
// places the changed objects. Affects cost only, never results. The incremental search is to be
// aborted once it has cost `most_ns`.
bool Tracker::few_changed(const Options& options, unsigned tasks, double& most_ns) {
  const auto objects = static_cast<double>(objects_.count());
  const auto pairs = static_cast<double>(pairs_.count());
  const auto changed = static_cast<double>(objects_.dirty_count());
  const double threads = 1 + thread_share * (tasks - 1);
  const double all = (objects * std::max(find_object_ns, all_ns_) + pairs * find_pair_ns) / threads;
  const double settle = index_ == Index::forest ? settle_in_forest_ns : settle_ns;
  const auto cost_of_few = [&](double comparisons) {
    const double search =
        search_ns + comparison_ns * comparisons + had_pair_ns * 2 * pairs / std::max(objects, 1.0);
    return changed * (settle + search / threads);
  };
  double few = cost_of_few(comparisons_);
  most_ns = all * threads;
  if (few >= all) {
    // These searches may be cheaper than earlier ones, so they are tried now and then.
    if (index_ != Index::forest)
      waste(all - cost_of_few(std::min(comparisons_, fair_comparisons())));
    comparisons_ += forgotten * (first_comparisons - comparisons_);
    few = cost_of_few(first_comparisons);
    if (few >= all || --try_in_ != 0) return false;
    try_in_ = 1;
  }
  if (index_ == Index::absent || !linked_) {
    regret_ += all - few;
    if (regret_ < objects * cell_ns + pairs * link_ns && !forest_pays()) return false;
    if (index_ == Index::absent) make_index(options);
    if (!linked_) pairs_.link_all(objects_);
    linked_ = true;
    regret_ = 0;
  } else if (index_ == Index::forest) {
    if (changed_ > patience_ * objects_.count()) {
      if (cells_.suit(objects_, fair_comparisons())) {
        make_index(options);
        retried_ = true;
      }
      changed_ = 0;
    }
  } else if (forest_pays() || regret_ > objects * cell_ns) {
    make_index(options);
  }
  changed_ += objects_.dirty_count();
  if (settle_all(options, all / line_ns)) return true;
  // The changed objects are too wide for cells. If this happens twice in a row, build a forest.
  regret_ = 0;
  if (!std::exchange(too_wide_, true)) return false;
  index_ = Index::absent;
  build_forest(false);
  return true;
}

// Comparisons per search that a forest would need, too.
double Tracker::fair_comparisons() const noexcept {
  const auto objects = static_cast<double>(std::max<std::size_t>(objects_.count(), 1));
  return fair_search + fair_per_pair * 2 * static_cast<double>(pairs_.count()) / objects;
}

void Tracker::waste(double ns) noexcept {
  if (ns > 0) wasted_.fetch_add(ns, std::memory_order_relaxed);
}

bool Tracker::forest_pays() const noexcept {
  return wasted_.load(std::memory_order_relaxed) >
         forest_ns * static_cast<double>(std::max(objects_.count(), least_objects_of_forest));
}

void Tracker::make_index(const Options& options) {
  THRONG_RANGE("build index");
  // Many changes since the cells were built may explain the waste; accepted as the reason only
  // once.
  const bool outdated = index_ == Index::cells && changed_ > objects_.count() / 8 && !retried_;
  const bool try_cells = outdated || !forest_pays();
  retried_ = outdated && forest_pays();
  if (!try_cells) patience_ = std::min(2 * patience_, most_patience);
  index_ = Index::absent;
  blocked_ = false;
  if (objects_.sparse()) objects_.list_alive();
  if (linked_) regret_ = 0;
  usual_comparisons_ = 0;
  // If the cells were not outdated, new ones would waste as much.
  if (outdated) wasted_ = 0;
  changed_ = 0;
  if (try_cells && cells_.make(objects_, fair_comparisons(), cpu::executor_of(options),
                               tasks_to_move(objects_.limit(), options)))
    index_ = Index::cells;
  else
    build_forest(false);
}

void Tracker::build_forest(bool others_are_none) {
  THRONG_RANGE("build forest");
  forest_.build(objects_, others_are_none);
  wasted_ = 0;
  index_ = Index::forest;
}

// Places changed objects in the index. Returns false, with only some of them placed, if searches
// would visit too many lines.
bool Tracker::settle_all(const Options& options, double most_lines) {
  if (index_ == Index::cells && !cells_.takes(objects_.count() + objects_.removed_count()))
    make_index(options);
  const List<ObjectId>& dirty = objects_.dirty_list();
  if (index_ == Index::cells) return settle_in_cells(dirty.data(), dirty.size(), most_lines);
  settle_in_forest(dirty.data(), dirty.size());
  return true;
}

// Ids may occur twice.
void Tracker::settle_in_forest(const ObjectId* dirty, std::size_t count) {
  constexpr std::uint32_t queued = none - 1;
  entering_.renew(count);
  if (!forest_.takes(count)) {
    for (std::size_t i = 0; i < count; ++i) objects_.body(dirty[i]).home = none;
    index_ = Index::absent;
    build_forest(true);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const ObjectId id = dirty[i];
    std::uint32_t& home = objects_.body(id).home;
    if (home == queued) continue;
    if (home != none) forest_.erase(home);
    home = none;
    if (!objects_.is_active(id)) continue;
    home = queued;
    entering_.push(id);
  }
  forest_.insert(objects_, entering_.data(), entering_.size());
}

bool Tracker::settle_in_cells(const ObjectId* dirty, std::size_t count,
                              double most_lines) noexcept {
  double lines = 0;
  Cells::Place places[settle_ahead];
  for (std::size_t i = 0; i + 1 < count + settle_ahead; ++i) {
    if (i < count) {
      if (i + settle_ahead < count) objects_.prefetch(dirty[i + settle_ahead]);
      const ObjectId id = dirty[i];
      Cells::Place& place = places[i % settle_ahead];
      place.home = none;
      if (objects_.body(id).home != none) cells_.prefetch(objects_.body(id).home);
      if (objects_.is_active(id)) {
        Box room;
        place = cells_.place(objects_.grown(id, room), worlds_of(objects_, objects_.filter(id)));
        lines += static_cast<double>(place.lines);
        if (lines > most_lines) return false;
        cells_.prefetch(place.home);
      }
    }
    if (constexpr std::size_t half = settle_ahead / 2; i >= half && i - half < count) {
      const std::uint32_t home = objects_.body(dirty[i - half]).home;
      if (home != none) cells_.prefetch_chain(home);
    }
    if (i + 1 < settle_ahead) continue;
    const ObjectId id = dirty[i + 1 - settle_ahead];
    const Cells::Place& place = places[(i + 1) % settle_ahead];
    Body& body = objects_.body(id);
    Box room;
    if (place.home != none && place.home == body.home) {
      cells_.replace(id, objects_.grown(id, room), place);
      continue;
    }
    if (body.home != none) cells_.erase(id, body.home);
    if (place.home != none) cells_.insert(id, objects_.grown(id, room), place);
    body.home = place.home;
  }
  return true;
}

// Returns false if the search was aborted.
bool Tracker::search_around(const Options& options, unsigned tasks, double most_ns, Result& r) {
  THRONG_RANGE("incremental search");
  const List<ObjectId>& dirty = objects_.dirty_list();
  tasks = dirty.size() < threads_search_from ? 1 : tasks;
  r.plan.threads = tasks;
  around_.make(tasks);
  for (unsigned t = 0; t < tasks; ++t) around_[t].start();
  const bool in_forest = index_ == Index::forest;
  const Around::Scene scene{objects_, pairs_, cells_, in_forest ? &forest_ : nullptr};
  cpu::Stop stop(options.stop);
  const auto most_work =
      static_cast<std::uint64_t>(std::max(most_ns / comparison_ns / tasks, least_work));
  cpu::Shares shares(dirty.size(), tasks, tasks == 1 ? dirty.size() : search_step);
  cpu::run_tasks_or_throw(cpu::executor_of(options), tasks, [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);)
      around_[t].search(scene, dirty.data() + begin, end - begin, most_work, stop);
  });
  if (stop()) {
    r.status = Status::stopped;
    return true;
  }
  std::size_t begun = 0, ended = 0, searched = 0;
  Work work;
  for (unsigned t = 0; t < tasks; ++t) {
    begun += around_[t].begun().size();
    ended += around_[t].ended().size();
    searched += around_[t].searched();
    work += around_[t].work();
  }
  r.comparisons += work.compared;
  r.visited += work.visited;
  learn(work, searched);
  if (searched != dirty.size()) {
    try_wait_ = std::min(2 * try_wait_, most_wait);
    try_in_ = try_wait_;
    return false;
  }
  try_in_ = try_wait_ = 1;
  pairs_.make_room(begun, ended);
  for (unsigned t = 0; t < tasks; ++t) {
    pairs_.next_begun().push(around_[t].begun());
    pairs_.next_ended().push(around_[t].ended());
  }
  around_.match(tasks);
  pairs_.commit_linked(objects_);
  return true;
}

// Updates the estimates for the next searches from the work of these.
void Tracker::learn(const Work& work, std::size_t searched) noexcept {
  const auto searches = static_cast<double>(searched);
  const bool in_forest = index_ == Index::forest;
  const auto compared = static_cast<double>(in_forest ? work.total() : work.compared);
  comparisons_ += (compared / searches - comparisons_) * searches / (searches + memory_of_searches);
  if (in_forest) return;
  waste(comparison_ns * (compared - fair_comparisons() * searches));
  const auto objects = static_cast<double>(objects_.count());
  const double pairs = 1 + 2 * static_cast<double>(pairs_.count()) / std::max(objects, 1.0);
  const double fair = std::max(outdated_comparisons, 2 * usual_comparisons_ * pairs) * searches;
  if (usual_comparisons_ == 0) {
    usual_comparisons_ = (compared / searches + 1) / pairs;
  } else {
    regret_ += comparison_ns * std::max(0.0, compared - fair);
  }
}

// All pairs in sorted order, as a Finder finds them.
Result Tracker::find_into(cpu::Engine& engine, List<Pair>& found, const Boxes& a, const Boxes* b,
                          float margin, const Options& options) {
  Options all = options;
  all.order = Order::canonical;
  all.nan = NanPolicy::inactive;
  all.algorithm = Algorithm::automatic;
  all.margin = margin;
  all.memory_cap_bytes = 0;
  found.clear();
  cpu::Output output{found.data(), found.capacity(), grow_list, &found};
  const Result r = engine.find(a, b, all, &output, nullptr);
  if (r.ok()) found.resize(static_cast<std::size_t>(r.found));
  return r;
}

void Tracker::find_all(const Options& options, unsigned tasks, Result& r) {
  columned_ = false;
  asked_before_ = asked_.exchange(0);
  const bool sparse = objects_.sparse();
  // Indices into the list of ids in use, if that is much shorter.
  const Boxes all = sparse ? objects_.packed_view() : objects_.view();
  r = find_into(engine_, found_, all, nullptr, objects_.margin(), options);
  if (!r.ok()) return;
  all_ns_ = found_comparison_ns * static_cast<double>(r.comparisons) /
            static_cast<double>(std::max<std::size_t>(objects_.count(), 1));
  if (sparse) {
    const List<ObjectId>& ids = objects_.alive_ids();
    for (Pair& pair : found_) pair = {ids[pair.first], ids[pair.second]};
  }
  pairs_.commit_sorted(found_.data(), found_.size(), objects_.limit(), cpu::executor_of(options),
                       tasks);
  linked_ = indexed_ = false;
  looked_ = 0;
  columned_ = !sparse && engine_.whole_plan() != nullptr;
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
  ready_ = false;
  columned_ = false;
  index_ = other.index_.load();
  blocked_ = false;
  indexed_ = false;
  looked_ = 0;
  linked_ = other.linked_;
  regret_ = other.regret_;
  wasted_ = other.wasted_.load();
  changed_ = other.changed_;
  retried_ = other.retried_;
  patience_ = other.patience_;
  too_wide_ = other.too_wide_;
  all_ns_ = other.all_ns_;
  try_in_ = other.try_in_;
  try_wait_ = other.try_wait_;
  asked_ = other.asked_.load();
  asked_before_ = other.asked_before_;
  usual_comparisons_ = other.usual_comparisons_;
  comparisons_ = other.comparisons_;
}

}  // namespace throng::live
