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

// What things cost, in ns, measured on the machine of docs/benchmarks.md; only the ratios matter.
// Finding all pairs, an object and a pair; where it is done by several threads each gives so much.
constexpr double find_object_ns = 18, find_pair_ns = 14, thread_share = 0.7;
// Putting an object that changed into its cell, and telling what of it began and ended; searching
// around it, and for each pair it has; a cache line of cells that this looks at.
constexpr double settle_ns = 70, search_ns = 80, had_pair_ns = 45, line_ns = 15;
// An update that finds all pairs anew as searches compared too many forgets so much of that.
constexpr double forgotten = 0.01;
// Making cells, and linking a pair.
constexpr double cell_ns = 35, link_ns = 30;
// Where searches compare twice as many boxes as in new cells, and more than this, so much is lost.
constexpr double fair_comparisons = 64;
// How many searches it takes to forget half of what those before them showed.
constexpr double memory_of_searches = 256;
// Memory is asked for so many objects ahead.
constexpr std::size_t settle_ahead = 32;
// Below so many objects that changed a second thread does not pay; each takes some at once.
constexpr std::size_t threads_search_from = 400, search_step = 64;

// Finding the overlaps of many boxes with all objects as those of two sets, an object; a question
// that has cells.
constexpr double search_object_ns = 8, question_ns = 1500;
constexpr double no_limit = 1e300;
// Where more than one in so many objects has changed since columns were made, they are no help.
constexpr std::size_t most_listed = 32;

// Below so many objects a second thread does not pay for moving them.
constexpr std::size_t threads_move_from = 20000;

unsigned task_count(const Options& options) noexcept {
  const Executor& executor = options.executor ? *options.executor : cpu::default_executor();
  return std::clamp(options.threads ? options.threads : executor.concurrency, 1u, cpu::max_workers);
}
const Executor& executor_of(const Options& options) noexcept {
  return options.executor ? *options.executor : cpu::default_executor();
}

// Room in a list for what the engine finds.
Pair* grow_list(void* list, std::size_t count) {
  try {
    auto& found = *static_cast<List<Pair>*>(list);
    found.renew(cpu::with_spare(count, found.capacity()));
    return found.data();
  } catch (const cpu::NoMemory&) {
    return nullptr;
  }
}

// What so many questions cost, by what some of them do: cost(i).
template <class Cost>
double cost_of(std::size_t count, const Cost& cost) noexcept {
  const std::size_t priced = std::min<std::size_t>(count, 16);
  double sum = 0;
  for (std::size_t k = 0; k < priced; ++k) sum += cost(count * k / priced);
  return priced == 0 ? 0 : sum / static_cast<double>(priced) * static_cast<double>(count);
}

unsigned tasks_to_move(std::size_t objects, const Options& options) noexcept {
  return objects < threads_move_from ? 1 : task_count(options);
}

}  // namespace

Tracker::Tracker(std::pmr::memory_resource* memory, float margin, std::size_t already_held) noexcept
    : engine_(memory, already_held),
      objects_(engine_.memory(), margin),
      pairs_(engine_.memory()),
      cells_(engine_.memory()),
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
  cpu::run_tasks(executor_of(options), tasks, task);
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
  cpu::run_tasks(executor_of(options), tasks, task);
  objects_.marked(dirty, inactive);
}

void Tracker::update(const Options& options, Result& r) {
  THRONG_RANGE("update");
  using Clock = std::chrono::steady_clock;
  const auto start = options.measure_stages ? Clock::now() : Clock::time_point{};
  const unsigned tasks = task_count(options);
  r.plan.threads = tasks;
  r.plan.algorithm = Algorithm::grid;
  r.plan.reason = "nothing changed";
  const std::size_t changed = objects_.dirty_count();
  if (changed == 0) {
    pairs_.commit_nothing();
  } else {
    const unsigned team = changed < threads_search_from ? 1 : tasks;
    cpu::Team::lead(executor_of(options), team, [&](const Executor& executor) {
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
  if (few_changed(options, tasks)) {
    columned_ = false;
    r.plan.reason = "few objects changed: only around them was searched";
    search_around(options, tasks, r);
  } else {
    find_all(options, tasks, r);
  }
}

// Which way is cheaper. This decides nothing but the cost.
bool Tracker::few_changed(const Options& options, unsigned tasks) {
  const auto objects = static_cast<double>(objects_.count());
  const auto pairs = static_cast<double>(pairs_.count());
  const auto changed = static_cast<double>(objects_.dirty_count());
  const double threads = 1 + thread_share * (tasks - 1);
  const double all = (objects * find_object_ns + pairs * find_pair_ns) / threads;
  const double search =
      search_ns + comparison_ns * comparisons_ + had_pair_ns * 2 * pairs / std::max(objects, 1.0);
  const double few = changed * (settle_ns + search / threads);
  if (few >= all) {
    comparisons_ += forgotten * (first_comparisons - comparisons_);
    return false;
  }
  if (!linked_) {
    regret_ += all - few;
    if (regret_ < objects * cell_ns + pairs * link_ns) return false;
    if (!placed_) make_cells(options);
    pairs_.link_all(objects_);
    linked_ = true;
    regret_ = 0;
  } else if (regret_ > objects * cell_ns) {
    make_cells(options);
  }
  if (settle_cells(options, all / line_ns)) return true;
  // What changed is too wide, and will probably be so again.
  regret_ = -4 * (objects * cell_ns + pairs * link_ns);
  return false;
}

void Tracker::make_cells(const Options& options) {
  THRONG_RANGE("make cells");
  placed_ = false;
  cells_.make(objects_, executor_of(options), tasks_to_move(objects_.limit(), options));
  if (linked_) regret_ = 0;
  usual_comparisons_ = 0;
  placed_ = true;
}

// Puts what changed where it belongs. False, with some of it undone, where searching would look at
// too many lines.
bool Tracker::settle_cells(const Options& options, double most_lines) {
  if (!placed_ || !cells_.takes(objects_.count() + objects_.removed_count())) make_cells(options);
  const List<ObjectId>& dirty = objects_.dirty_list();
  double lines = 0;
  Cells::Place places[settle_ahead];
  for (std::size_t i = 0; i + 1 < dirty.size() + settle_ahead; ++i) {
    if (i < dirty.size()) {
      if (i + settle_ahead < dirty.size()) objects_.prefetch(dirty[i + settle_ahead]);
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
    if (constexpr std::size_t half = settle_ahead / 2; i >= half && i - half < dirty.size()) {
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

void Tracker::search_around(const Options& options, unsigned tasks, Result& r) {
  THRONG_RANGE("search around");
  const List<ObjectId>& dirty = objects_.dirty_list();
  tasks = dirty.size() < threads_search_from ? 1 : tasks;
  r.plan.threads = tasks;
  around_.make(tasks);
  for (unsigned t = 0; t < tasks; ++t) around_[t].start();
  const Around::Scene scene{objects_, pairs_, cells_};
  cpu::Stop stop(options.stop);
  cpu::Shares shares(dirty.size(), tasks, tasks == 1 ? dirty.size() : search_step);
  cpu::run_tasks_or_throw(executor_of(options), tasks, [&](unsigned t) {
    for (std::size_t begin, end; shares.take(t, begin, end);)
      around_[t].search(scene, dirty.data() + begin, end - begin, stop);
  });
  if (stop()) {
    r.status = Status::stopped;
    return;
  }
  std::size_t begun = 0, ended = 0;
  for (unsigned t = 0; t < tasks; ++t) {
    begun += around_[t].begun().size();
    ended += around_[t].ended().size();
    r.comparisons += around_[t].compared();
  }
  pairs_.make_room(begun, ended);
  for (unsigned t = 0; t < tasks; ++t) {
    pairs_.next_begun().push(around_[t].begun());
    pairs_.next_ended().push(around_[t].ended());
  }
  around_.match(tasks);
  pairs_.commit_linked(objects_);
  learn(static_cast<double>(r.comparisons));
}

// What searches compared is what the next will be expected to.
void Tracker::learn(double compared) noexcept {
  const auto searches = static_cast<double>(objects_.dirty_count());
  comparisons_ += (compared / searches - comparisons_) * searches / (searches + memory_of_searches);
  const double fair = std::max(fair_comparisons, 2 * usual_comparisons_) * searches;
  if (usual_comparisons_ == 0) {
    usual_comparisons_ = compared / searches + 1;
  } else {
    regret_ += comparison_ns * std::max(0.0, compared - fair);
  }
}

// Pairs in canonical order, as a Finder finds them.
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
  placed_ = linked_ = false;
  columned_ = false;
  asked_before_ = asked_.exchange(0);
  r = find_into(engine_, found_, objects_.view(), nullptr, objects_.margin(), options);
  if (!r.ok()) return;
  pairs_.commit_sorted(found_.data(), found_.size(), objects_.limit(), executor_of(options), tasks);
  columned_ = engine_.whole_plan() != nullptr;
}

// Who asks beside others holds a lock meanwhile: no other thread's task may be waited for, as a
// thread that waits may be given one that wants the lock, too.
Options Tracker::to_prepare(const Queries& by, const Options& options) const noexcept {
  Options mine = options;
  if (&by != &queries_) mine.threads = 1;
  return mine;
}

// Puts what changed where questions look for it; the first of several does.
void Tracker::get_ready(const Queries& by, const Options& options) {
  if (ready_.load(std::memory_order_acquire)) return;
  const std::lock_guard<std::mutex> lock(preparing_);
  if (ready_.load(std::memory_order_relaxed)) return;
  objects_.dirty_list();
  if (placed_) settle_cells(to_prepare(by, options), no_limit);
  ready_.store(true, std::memory_order_release);
}

// Questions come one at a time, too: once cells would have saved those that went without what they
// cost, cells are made; and at once where they would have saved as much of those before all pairs
// were last found anew. So less than three times is paid what the better choices would have cost.
void Tracker::asked(const Queries& by, std::size_t count, double ns, const Options& options) {
  const double saved = std::max(0.0, ns - question_ns * static_cast<double>(count));
  const double cells = cell_ns * static_cast<double>(objects_.count());
  double sum = asked_.load(std::memory_order_relaxed);
  if (sum <= cells) sum = asked_.fetch_add(saved, std::memory_order_relaxed) + saved;
  if (placed_ || std::max(sum, asked_before_) <= cells) return;
  // While another one makes them there is the ground of before, for who has not much to ask.
  std::unique_lock<std::mutex> lock(preparing_, std::defer_lock);
  if (saved > cells)
    lock.lock();
  else if (!lock.try_lock())
    return;
  if (!placed_) make_cells(to_prepare(by, options));
}

std::optional<Columns> Tracker::columns() noexcept {
  if (!columned_ || objects_.dirty_count() > objects_.count() / most_listed) return std::nullopt;
  return Columns{{engine_.grid(), *engine_.whole_plan()}, objects_.dirty_list()};
}
Ground Tracker::ground() noexcept {
  if (placed_) return {&cells_, std::nullopt};
  return {nullptr, columns()};
}

void Tracker::find_overlaps(Queries& by, const Boxes& boxes, const Options& options, Result& r) {
  THRONG_RANGE("find overlaps");
  const double all = search_object_ns * static_cast<double>(objects_.count());
  const bool few = search_ns * static_cast<double>(boxes.size()) < all;
  bool one_by_one = false;
  if (few) {
    get_ready(by, options);
    const Ground now{nullptr, columns()};
    const double cost =
        cost_of(boxes.size(), [&](std::size_t i) { return now.cost(objects_, boxes[i]); });
    asked(by, boxes.size(), std::min(cost, all), options);
    one_by_one = placed_ || cost < all;
  }
  cpu::Stop stop(options.stop);
  if (one_by_one) {
    by.find_overlaps(objects_, ground(), boxes, executor_of(options), task_count(options), stop);
  } else {
    if (&by == &queries_) columned_ = false;  // the engine is that of updates
    const Boxes view = objects_.view();
    r = find_into(by.engine(), by.overlaps(), boxes, &view, 0, options);
    r.inactive = 0;
  }
  by.forget_hits();  // it may have been found there
  r.found = r.written = by.overlaps().size();
  if (stop()) r.status = Status::stopped;
}

void Tracker::find_hits(Queries& by, const Sweeps& sweeps, const Options& options, Result& r) {
  THRONG_RANGE("find hits");
  get_ready(by, options);
  const Ground now{nullptr, columns()};
  const double cost =
      cost_of(sweeps.count, [&](std::size_t i) { return now.cost(objects_, sweeps.data[i]); });
  asked(by, sweeps.count, cost, options);
  cpu::Stop stop(options.stop);
  by.find_hits(objects_, ground(), sweeps, executor_of(options), task_count(options), stop);
  r.found = r.written = by.hits().size();
  if (stop()) r.status = Status::stopped;
}

void Tracker::reserve_for(const Tracker& other) {
  objects_.reserve_for(other.objects_);
  pairs_.reserve_for(other.pairs_);
  cells_.reserve_for(other.cells_);
}

void Tracker::copy(const Tracker& other) noexcept {
  objects_.copy(other.objects_);
  pairs_.copy(other.pairs_);
  cells_.copy(other.cells_);
  ready_ = false;
  columned_ = false;
  placed_ = other.placed_.load();
  linked_ = other.linked_;
  regret_ = other.regret_;
  asked_ = other.asked_.load();
  asked_before_ = other.asked_before_;
  usual_comparisons_ = other.usual_comparisons_;
  comparisons_ = other.comparisons_;
}

}  // namespace throng::live
