#include "live/query.hpp"

#include <algorithm>
#include <atomic>

#include "cpu/packed_box.hpp"
#include "cpu/sink.hpp"
#include "cpu/threads.hpp"
#include "live/cell_walk.hpp"
#include "live/sieve.hpp"
#include "live/sort.hpp"

namespace throng::live {
namespace {

// Minimum queries for a second thread.
constexpr std::size_t threads_ask_from = 64;
// Prefetch distance, in queries.
constexpr std::size_t ahead = 8;

// Up to this many objects, a sweep loops over all instead of traversing cells.
constexpr std::size_t few_objects = 256;

// Cost model (see tracker.cpp), ns per object: in a loop over all, and in a list.
constexpr double look_ns = 1.6, listed_ns = 30;

double cost_of_all(const Objects& objects) noexcept {
  return look_ns * static_cast<double>(objects.limit());
}
double cost_of_changed(const Columns& columns) noexcept {
  return listed_ns * static_cast<double>(columns.changed.size());
}
double cost_of(const Columns& columns, const Box& box) noexcept {
  return columns.look.cost(columns.look.columns_in(box)) + cost_of_changed(columns);
}
// A sweep is divided into as many pieces as it crosses columns.
double pieces(const Columns& columns, const Sweep& s) noexcept {
  const Vec3& at = s.box.lower;
  return columns.look.columns_between(at, {at.x + s.by.x, at.y + s.by.y, at.z + s.by.z}) + 1.0;
}
double cost_of(const Columns& columns, const Sweep& sweep) noexcept {
  const double count = pieces(columns, sweep);
  const Box piece = core::Cover(sweep)(0, 1 / count);
  return count * columns.look.cost(columns.look.columns_in(piece)) + cost_of_changed(columns);
}
template <class Question>
double least_cost(const Objects& objects, const std::optional<Columns>& columns,
                  const Question& question) noexcept {
  const double all = cost_of_all(objects);
  return columns ? std::min(all, cost_of(*columns, question)) : all;
}
template <class Question>
bool columns_pay(const Ground& ground, const Objects& objects, const Question& question) noexcept {
  return ground.cost(objects, question) < cost_of_all(objects);
}

// Which objects a query may report.
class Allowed {
 public:
  Allowed(const Objects& objects, const Filters& filters) noexcept
      : objects_(objects), filters_(filters) {}

  Filter filter(std::size_t question) const noexcept {
    Filter f;
    set(f, filters_, question);
    return f;
  }
  // If no object has a filter, none is read.
  bool operator()(const Filter& question, ObjectId id) const noexcept {
    return allows(question, has_filters_ ? objects_.filter(id) : Filter{});
  }

 private:
  const Objects& objects_;
  const Filters& filters_;
  const bool has_filters_ = objects_.has_filters();
};

}  // namespace

void set(Filter& f, const Filters& from, std::size_t i) noexcept {
  if (from.group) f.group = from.group[i];
  if (from.mask) f.mask = from.mask[i];
  if (from.owner) f.owner = from.owner[i];
  if (from.world) f.world = from.world[i];
  if (from.is_static) f.is_static = from.is_static[i];
}

double Ground::cost(const Objects& objects, const Box& box) const noexcept {
  return least_cost(objects, columns, box);
}
double Ground::cost(const Objects& objects, const Sweep& sweep) const noexcept {
  return least_cost(objects, columns, sweep);
}

Queries::Queries(cpu::Engine& engine) noexcept
    : engine_(engine),
      found_(engine.memory()),
      overlaps_(engine.memory()),
      hits_(engine.memory()) {}

// State of an overlap query, prepared ahead to prefetch its cells.
struct Queries::Look {
  Cells::Worlds worlds;
  Cells::Reach reach;
};

// The same for a sweep.
struct Queries::Way {
  core::Cover cover;
  CellWalk walk;
};

// Calls prepare(i, state) and later ask(i, state, list, work) for every query, in order within a
// task. Concatenates the lists in hits_ and returns the total work. Results of one query are sorted
// by id, without duplicates.
template <class Look, class Prepare, class Ask>
Work Queries::run(std::size_t count, std::size_t limit, const Executor& executor, unsigned tasks,
                  cpu::Stop& stop, Prepare&& prepare, Ask&& ask) {
  hits_.clear();
  tasks = count < threads_ask_from ? 1 : tasks;
  found_.make(tasks);
  cpu::run_tasks_or_throw(executor, tasks, [&](unsigned t) {
    List<SweepHit>& found = found_[t].hits;
    Work work;
    found.clear();
    Look looks[ahead];
    const std::size_t first = count * t / tasks, end = count * (t + 1) / tasks;
    for (std::size_t i = first; i < std::min(first + ahead, end); ++i) prepare(i, looks[i % ahead]);
    for (std::size_t i = first; i < end; ++i) {
      if (stop()) break;
      const std::size_t before = found.size();
      ask(i, looks[i % ahead], found, work);
      if (i + ahead < end) prepare(i + ahead, looks[i % ahead]);
      const std::size_t more = found.size() - before;
      if (more >= few_to_sort) found.reserve(found.size() + more);  // scratch for the sort
      SweepHit* const begin = found.begin() + before;
      sort_hits(begin, found.end(), more, limit);
      const auto same = [](const SweepHit& a, const SweepHit& b) { return a.object == b.object; };
      SweepHit* const last = std::unique(begin, found.end(), same);
      found.resize(static_cast<std::size_t>(last - found.begin()));
    }
    found_[t].work = work;
  });
  std::size_t total = 0;
  for (unsigned t = 0; t < tasks; ++t) total += found_[t].hits.size();
  hits_.reserve(total);
  Work work;
  for (unsigned t = 0; t < tasks; ++t) {
    hits_.push(found_[t].hits);
    work += found_[t].work;
  }
  return work;
}

Work Queries::find_overlaps(const Objects& objects, const Ground& ground, const Boxes& boxes,
                            const Executor& executor, unsigned tasks, cpu::Stop& stop) {
  // Overlaps are collected in hits_, which is cleared on exit, also when memory runs out.
  struct Forget {
    List<SweepHit>& hits;
    ~Forget() { hits.clear(); }
  } const forget{hits_};
  const Cells* const cells = ground.cells;
  const Allowed allowed(objects, boxes.filters);
  const bool grown = objects.margin() != 0;
  const auto prepare = [&](std::size_t i, Look& look) {
    const Box box = boxes[i];
    if (!cells || !core::is_active(box)) return;
    look.worlds = worlds_of(objects, allowed.filter(i));
    cells->reach(box, look.worlds, look.reach);
  };
  const auto ask = [&](std::size_t i, Look& look, List<SweepHit>& found, Work& work) {
    const Box box = boxes[i];
    if (!core::is_active(box)) return;
    const Filter filter = allowed.filter(i);
    const auto take = [&](ObjectId id) {
      if (allowed(filter, id)) found.append({static_cast<std::uint32_t>(i), id, 0});
    };
    const auto meet = [&](ObjectId id) {
      ++work.compared;
      const bool overlaps =
          cpu::overlap_in_memory(reinterpret_cast<const char*>(&box),
                                 reinterpret_cast<const char*>(&objects.body(id).box));
      if (overlaps && objects.is_active(id)) take(id);
    };
    // Both indexes store the boxes with their margin.
    const auto find = [&](ObjectId id) { grown ? meet(id) : take(id); };
    if (cells) {
      cells->search(box, look.worlds, look.reach, work, find);
    } else if (ground.forest) {
      ground.forest->search(box, filter, work, find);
    } else if (columns_pay(ground, objects, box)) {
      work.visited += ground.columns->look.each(box, meet);
      for (const ObjectId id : ground.columns->changed) meet(id);
    } else {
      for (std::size_t id = 0; id < objects.limit(); ++id) meet(static_cast<ObjectId>(id));
    }
  };
  const Work work = run<Look>(boxes.size(), objects.limit(), executor, tasks, stop, prepare, ask);
  overlaps_.clear();
  overlaps_.reserve(hits_.size());
  for (const SweepHit& hit : hits_) overlaps_.push({hit.sweep, hit.object});
  return work;
}

namespace {

// Collects the hits of one sweep among candidate objects.
class Meetings {
 public:
  Meetings(const Objects& objects, const Sweeps& sweeps, const Allowed& allowed, std::size_t i,
           List<SweepHit>& found) noexcept
      : sweep(sweeps.data[i]),
        filter(allowed.filter(i)),
        objects_(objects),
        allowed_(allowed),
        test_(sweeps.test),
        only_first_(sweeps.which == SweepHits::first),
        grown_(objects.margin() != 0),
        number_(static_cast<std::uint32_t>(i)),
        best_{number_, none, 2},
        found_(found) {}

  // Time of the first hit so far, or 2.
  const double& first() const noexcept { return best_.time; }
  void meet(ObjectId id) {
    const Box& box = objects_.body(id).box;
    if (core::is_active(box)) meet_box(id, box);
  }
  // Box k of a line, which may include a margin.
  void meet(const CellLine& line, std::uint32_t k) {
    meet_box(line.id[k], grown_ ? objects_.body(line.id[k]).box : line.box(k));
  }
  // Tests all objects.
  void meet_all(const core::Cover& cover, Work& work) {
    work.visited += objects_.limit();
    Sieve(SieveTerms(sweep, cover, 1)).each(objects_, [this](ObjectId id) { meet(id); });
  }
  void finish() {
    if (only_first_ && best_.object != none) found_.append(best_);
  }

  const Sweep& sweep;
  const Filter filter;
  double begin = 0;  // hits up to this time were reported by earlier pieces; 0: the first piece

 private:
  bool is_better(double time, ObjectId id) const noexcept {
    return time < best_.time || (time == best_.time && id < best_.object);
  }
  void meet_box(ObjectId id, const Box& box) {
    if (!allowed_(filter, id)) return;
    const core::Touch t = core::touch(sweep, box);
    if (t.enter > t.leave || (begin != 0 && t.enter <= begin)) return;
    if (only_first_ && !is_better(t.enter, id)) return;
    double time = t.enter;
    if (test_.when) {
      const double told = test_.when(test_.context, number_, id, time);
      if (!(told <= 1)) return;
      time = std::max(time, told);
    }
    if (!only_first_)
      found_.append({number_, id, time});
    else if (is_better(time, id))
      best_ = {number_, id, time};
  }

  const Objects& objects_;
  const Allowed& allowed_;
  const SweepTest& test_;
  const bool only_first_, grown_;
  const std::uint32_t number_;
  SweepHit best_;
  List<SweepHit>& found_;
};

}  // namespace

Work Queries::find_hits(const Objects& objects, const Ground& ground, const Sweeps& sweeps,
                        const Executor& executor, unsigned tasks, cpu::Stop& stop,
                        std::uint64_t& far) {
  const Allowed allowed(objects, sweeps.filters);
  const bool only_first = sweeps.which == SweepHits::first;
  far = 0;
  if (ground.cells && objects.limit() > few_objects) {
    std::atomic<std::uint64_t> looked_far{0};
    const auto prepare = [&](std::size_t i, Way& way) {
      const Sweep& sweep = sweeps.data[i];
      if (!core::is_active(sweep.box)) return;
      way.cover = core::Cover(sweep);
      way.walk.start(*ground.cells, ground.blocks, worlds_of(objects, allowed.filter(i)), sweep,
                     way.cover, only_first);
    };
    const auto ask = [&](std::size_t i, Way& way, List<SweepHit>& found, Work& work) {
      if (!core::is_active(sweeps.data[i].box)) return;
      Meetings meetings(objects, sweeps, allowed, i, found);
      const auto look = [&](const CellLine& line, std::uint32_t k) { meetings.meet(line, k); };
      if (!way.walk.go(meetings.first(), work, look)) meetings.meet_all(way.cover, work);
      if (way.walk.looked_far() != 0)
        looked_far.fetch_add(way.walk.looked_far(), std::memory_order_relaxed);
      meetings.finish();
    };
    const Work work = run<Way>(sweeps.count, objects.limit(), executor, tasks, stop, prepare, ask);
    far = looked_far;
    return work;
  }
  struct Nothing {};
  const auto prepare = [](std::size_t, Nothing&) {};
  const auto ask = [&](std::size_t i, Nothing&, List<SweepHit>& found, Work& work) {
    const Sweep& sweep = sweeps.data[i];
    if (!core::is_active(sweep.box)) return;
    const core::Cover cover(sweep);
    Meetings meetings(objects, sweeps, allowed, i, found);
    if (ground.forest) {
      ground.forest->cast(sweep, cover, meetings.filter, only_first, meetings.first(), work,
                          [&](const CellLine& line, std::uint32_t k) { meetings.meet(line, k); });
    } else if (!ground.cells && columns_pay(ground, objects, sweep)) {
      const auto meet = [&](ObjectId id) {
        ++work.compared;
        meetings.meet(id);
      };
      for (const ObjectId id : ground.columns->changed) meet(id);
      const double piece = 1 / pieces(*ground.columns, sweep);
      for (double end; meetings.begin != 1; meetings.begin = end) {
        end = std::min(meetings.begin + piece, 1.0);
        work.visited += ground.columns->look.each(cover(meetings.begin, end), meet);
        if (meetings.first() <= end) break;  // later hits are not the first
      }
    } else {
      meetings.meet_all(cover, work);
    }
    meetings.finish();
  };
  return run<Nothing>(sweeps.count, objects.limit(), executor, tasks, stop, prepare, ask);
}

}  // namespace throng::live
