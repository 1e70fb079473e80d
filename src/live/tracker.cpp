#include "live/tracker.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include "core/profile.hpp"
#include "cpu/threads.hpp"

namespace throng::live {
namespace {

// What things cost, in ns, measured on the machine of docs/benchmarks.md; only the ratios matter.
// Finding all pairs, an object and a pair; where it is done by several threads each gives so much.
constexpr double find_object_ns = 18, find_pair_ns = 14, thread_share = 0.7;
// Searching around an object that changed; a cache line of cells that this looks at.
constexpr double search_ns = 300, line_ns = 15;
// Making cells, and linking a pair.
constexpr double cell_ns = 60, link_ns = 30;
// Where searches compare twice as many boxes as in new cells, and more than this, so much is lost.
constexpr double fair_comparisons = 64, comparison_ns = 1;
// Memory is asked for so many objects ahead. Of 4, 8, 16: no difference between the latter two.
constexpr std::size_t ahead = 8, settle_ahead = 32;
// So many hits of a search are compared with each pair the object has; more are marked.
constexpr std::uint32_t few_hits = 16;

// Of questions: finding the overlaps of many boxes with all objects, an object; comparing a sweep
// with one.
constexpr double search_object_ns = 8, touch_ns = 4;
constexpr double no_limit = 1e300;

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
    found.renew(count + count / 64 + 512);
    return found.data();
  } catch (const cpu::NoMemory&) {
    return nullptr;
  }
}

unsigned tasks_to_move(std::size_t objects, const Options& options) noexcept {
  return objects < threads_move_from ? 1 : task_count(options);
}

}  // namespace

Tracker::Tracker(const Options& options, std::size_t already_held) noexcept
    : engine_(options.memory, already_held),
      objects_(engine_.memory(), options.margin),
      pairs_(engine_.memory()),
      cells_(engine_.memory()),
      queries_(engine_.memory()),
      found_(engine_.memory()) {}

bool Tracker::has_nan(const Boxes& boxes, const Options& options) noexcept {
  const std::size_t n = boxes.size();
  const unsigned tasks = tasks_to_move(n, options);
  std::atomic<bool> found{false};
  cpu::Shares shares(n, tasks, 1024);
  auto task = [&](unsigned) {
    for (std::size_t begin, end; shares.take(begin, end);) {
      if (Objects::has_nan(boxes, begin, end)) found = true;
    }
  };
  cpu::run_tasks(executor_of(options), tasks, task);
  return found;
}

void Tracker::move_all(const Boxes& boxes, const Options& options) noexcept {
  THRONG_RANGE("move all");
  const std::size_t n = objects_.limit();
  const unsigned tasks = tasks_to_move(n, options);
  std::atomic<std::size_t> dirty{0};
  std::atomic<std::int64_t> inactive{0};
  cpu::Shares shares(n, tasks, 1024);
  auto task = [&](unsigned) {
    for (std::size_t begin, end; shares.take(begin, end);) {
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
  if (objects_.dirty_count() == 0) {
    pairs_.commit_nothing();
  } else if (few_changed(tasks)) {
    r.plan.threads = 1;
    r.plan.reason = "few objects changed: only around them was searched";
    search_around(options, r);
    if (!r.ok()) return;
    objects_.settle();
  } else {
    find_all(options, tasks, r);
    if (!r.ok()) return;
    objects_.settle();
  }
  r.found = r.written = pairs_.count();
  r.inactive = objects_.inactive();
  if (options.measure_stages) {
    r.times.total_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }
}

// Which way is cheaper. This decides nothing but the cost.
bool Tracker::few_changed(unsigned tasks) {
  const auto objects = static_cast<double>(objects_.count());
  const auto pairs = static_cast<double>(pairs_.count());
  const double all =
      (objects * find_object_ns + pairs * find_pair_ns) / (1 + thread_share * (tasks - 1));
  const double few = static_cast<double>(objects_.dirty_count()) * search_ns;
  if (few >= all) return false;
  if (!linked_) {
    regret_ += all - few;
    if (regret_ < objects * cell_ns + pairs * link_ns) return false;
    if (!placed_) make_cells();
    pairs_.link_all(objects_);
    linked_ = true;
    regret_ = 0;
  } else if (regret_ > objects * cell_ns) {
    make_cells();
  }
  if (settle_cells(all / line_ns)) return true;
  // What changed is too wide, and will probably be so again.
  regret_ = -4 * (objects * cell_ns + pairs * link_ns);
  return false;
}

void Tracker::make_cells() {
  placed_ = false;
  cells_.plan(objects_);
  if (linked_) regret_ = 0;
  usual_comparisons_ = 0;
  // Where they go is computed some steps ahead.
  constexpr std::size_t steps = 16;
  Cells::Place places[steps];
  const std::size_t n = objects_.limit();
  for (std::size_t i = 0; i + 1 < n + steps; ++i) {
    if (i < n) {
      const auto id = static_cast<ObjectId>(i);
      Body& body = objects_.body(id);
      body.home = none;
      if (objects_.is_active(id)) {
        places[i % steps] = cells_.place(objects_.grown(id), {objects_.filter(id).world});
        body.home = places[i % steps].home;
        cells_.prefetch(body.home);
      }
    }
    if (i + 1 < steps) continue;
    const auto id = static_cast<ObjectId>(i + 1 - steps);
    if (objects_.body(id).home != none) cells_.insert(id, objects_.grown(id), places[id % steps]);
  }
  placed_ = true;
}

// Puts what changed where it belongs. False, with some of it undone, where searching would look at
// too many lines.
bool Tracker::settle_cells(double most_lines) {
  if (!placed_ || !cells_.takes(objects_.count() + objects_.removed_count())) make_cells();
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
        place = cells_.place(objects_.grown(id, room), worlds_of(id));
        lines += static_cast<double>(place.lines);
        if (lines > most_lines) return false;
        cells_.prefetch(place.home);
      }
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

Cells::Worlds Tracker::worlds_of(ObjectId id) const noexcept {
  if (objects_.in_worlds() == 0) return {};
  const std::int32_t own = objects_.filter(id).world;
  if (own == -1) return {-1, false, true};
  return {own, objects_.in_worlds() != objects_.count(), false};
}

// Of two objects that both changed, the one with the lower id tells of their pair.
void Tracker::search_around(const Options& options, Result& r) {
  THRONG_RANGE("search around");
  pairs_.next_begun().clear();
  pairs_.next_ended().clear();
  const List<ObjectId>& dirty = objects_.dirty_list();
  std::uint64_t compared = 0;
  Cells::Reach reaches[ahead];
  PairSet::Walk walks[ahead];
  const auto reach_ahead = [&](std::size_t i) {
    if (i >= dirty.size()) return;
    const Body& body = objects_.body(dirty[i]);
    pairs_.start(walks[i % ahead], objects_, dirty[i]);
    if (body.home == none) return;
    Box room;
    cells_.reach(objects_.grown(dirty[i], room), worlds_of(dirty[i]), reaches[i % ahead]);
  };
  for (std::size_t i = 0; i < ahead; ++i) reach_ahead(i);
  ObjectId hits[Cells::most_hits];
  for (std::size_t i = 0; i < dirty.size(); ++i) {
    if (options.stop && options.stop->load(std::memory_order_relaxed)) {
      r.status = Status::stopped;
      return;
    }
    if (const std::size_t soon = i + ahead / 2; soon < dirty.size()) {
      if (objects_.body(dirty[soon]).home != none) cells_.prefetch_chains(reaches[soon % ahead]);
    }
    for (std::size_t soon = i + 1; soon < std::min(i + ahead, dirty.size()); ++soon)
      pairs_.step(walks[soon % ahead]);
    const ObjectId id = dirty[i];
    std::uint32_t count = 0;
    Box room;
    if (objects_.body(id).home != none)
      count = cells_.search_few(objects_.grown(id, room), id, reaches[i % ahead], hits, compared);
    if (count <= few_hits)
      tell_few(walks[i % ahead], hits, count);
    else
      compared += tell_many(walks[i % ahead], hits, count);
    reach_ahead(i + ahead);
  }
  pairs_.commit_linked(objects_);
  r.comparisons = compared;
  const auto searches = static_cast<double>(dirty.size());
  const double fair = std::max(fair_comparisons, 2 * usual_comparisons_) * searches;
  if (usual_comparisons_ == 0) {
    usual_comparisons_ = static_cast<double>(compared) / searches + 1;
  } else {
    regret_ += comparison_ns * std::max(0.0, static_cast<double>(compared) - fair);
  }
}

bool Tracker::tells(ObjectId id, ObjectId other) const noexcept {
  return id < other || !objects_.is_dirty(other);
}
void Tracker::tell_begun(ObjectId id, ObjectId other) {
  if (!tells(id, other)) return;
  cpu::prefetch(&objects_.body(other));
  pairs_.next_begun().append({std::min(id, other), std::max(id, other), none});
}
void Tracker::tell_ended(ObjectId id, ObjectId other, std::uint32_t slot) {
  if (!tells(id, other)) return;
  cpu::prefetch(&objects_.body(other));
  pairs_.next_ended().append({std::min(id, other), std::max(id, other), slot});
}

// Takes those that the object already had from the hits; what is left has begun.
void Tracker::tell_few(const PairSet::Walk& had, ObjectId* hits, std::uint32_t count) {
  const ObjectId id = had.id;
  if (objects_.has_filters()) {
    const std::uint32_t all = std::exchange(count, 0);
    for (std::uint32_t k = 0; k < all; ++k) {
      hits[count] = hits[k];
      count += objects_.may_pair(id, hits[k]);
    }
  }
  const auto take = [&](ObjectId other, std::uint32_t from) {  // wherever it is: it may be twice
    const std::uint32_t all = std::exchange(count, from);
    for (std::uint32_t k = from; k < all; ++k) {
      hits[count] = hits[k];
      count += hits[k] != other;
    }
    return count != all;
  };
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (!take(other, 0)) tell_ended(id, other, slot);
  });
  for (std::uint32_t k = 0; k < count; ++k) {
    tell_begun(id, hits[k]);
    take(hits[k], k + 1);
  }
}

// The same by marks; above most_hits they are yet to be found. Returns how many boxes that
// compared.
std::uint64_t Tracker::tell_many(const PairSet::Walk& had, const ObjectId* hits,
                                 std::uint32_t count) {
  const ObjectId id = had.id;
  const std::uint32_t before = objects_.next_tokens(2), now = before + 1;
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t) { objects_.mark(other) = before; });
  objects_.mark(id) = now;
  const auto see = [&](ObjectId other) {
    std::uint32_t& mark = objects_.mark(other);
    if (mark == now || !objects_.may_pair(id, other)) return;
    if (mark != before) tell_begun(id, other);
    mark = now;
  };
  std::uint64_t compared = 0;
  if (count <= Cells::most_hits)
    std::for_each(hits, hits + count, see);
  else
    compared = cells_.search_many(objects_.grown(id), worlds_of(id), see);
  pairs_.each_pair(had, [&](ObjectId other, std::uint32_t slot) {
    if (objects_.mark(other) == before) tell_ended(id, other, slot);
  });
  return compared;
}

void Tracker::find_all(const Options& options, unsigned tasks, Result& r) {
  Options all = options;
  all.order = Order::canonical;
  all.nan = NanPolicy::inactive;
  all.algorithm = Algorithm::automatic;
  all.margin = objects_.margin();
  all.memory_cap_bytes = 0;
  cpu::Output output{found_.data(), found_.capacity(), grow_list, &found_};
  linked_ = placed_ = false;
  r = engine_.find(objects_.view(), nullptr, all, &output, nullptr);
  if (!r.ok()) return;
  pairs_.commit_sorted(output.data, static_cast<std::size_t>(r.found), objects_.limit(),
                       executor_of(options), tasks);
}

// Questions come one at a time, too: once those that went without cells have cost what cells do,
// cells are made. So at most twice is paid what the better choice would have cost.
void Tracker::want_cells(double ns_an_object) {
  asked_ += ns_an_object;
  if (asked_ <= cell_ns) return;
  make_cells();
  asked_ = 0;
}

void Tracker::find_overlaps(const Boxes& boxes, const Options& options, Result& r) {
  THRONG_RANGE("find overlaps");
  const auto asked = static_cast<double>(boxes.size());
  const auto objects = static_cast<double>(objects_.count());
  const bool few = asked * search_ns < objects * search_object_ns;
  if (few && !placed_) want_cells(search_object_ns);
  if (few && placed_) {
    settle_cells(no_limit);
    queries_.find_overlaps(objects_, cells_, boxes, executor_of(options), task_count(options),
                           options.stop);
  } else {
    Options all = options;
    all.order = Order::canonical;
    all.nan = NanPolicy::inactive;
    all.algorithm = Algorithm::automatic;
    all.margin = 0;
    all.memory_cap_bytes = 0;
    List<Pair>& found = queries_.overlaps();
    found.clear();
    cpu::Output output{found.data(), found.capacity(), grow_list, &found};
    const Boxes view = objects_.view();
    r = engine_.find(boxes, &view, all, &output, nullptr);
    if (r.ok()) found.resize(static_cast<std::size_t>(r.found));
    r.inactive = 0;
  }
  queries_.forget_hits();  // it may have been found there
  r.found = r.written = queries_.overlaps().size();
}

void Tracker::find_hits(const Sweep* sweeps, std::size_t count, SweepHits which,
                        const Filters& filters, const Options& options) {
  THRONG_RANGE("find hits");
  if (!placed_) want_cells(static_cast<double>(count) * touch_ns);
  if (placed_) settle_cells(no_limit);
  queries_.find_hits(objects_, placed_ ? &cells_ : nullptr, sweeps, count, which, filters,
                     executor_of(options), task_count(options), options.stop);
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
  placed_ = other.placed_;
  linked_ = other.linked_;
  regret_ = other.regret_;
  usual_comparisons_ = other.usual_comparisons_;
}

}  // namespace throng::live
