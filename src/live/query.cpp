#include "live/query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu/packed_box.hpp"
#include "cpu/sink.hpp"
#include "cpu/threads.hpp"
#include "live/sieve.hpp"
#include "live/sort.hpp"

namespace throng::live {
namespace {

// A sweep is cut into pieces of about so many units of the cells, two cells of the first class: of
// shorter ones each looks at nearly as many cells, of longer ones a slanted one at more.
constexpr double piece_units = 64;
constexpr double first_piece = 0.25;
// Below so many questions a second thread does not pay.
constexpr std::size_t threads_ask_from = 64;
// Cells are asked for so many questions ahead.
constexpr std::size_t ahead = 8;

struct Axis {
  float lower, upper, by;
};
void axes_of(const Sweep& s, Axis (&axes)[3]) noexcept {
  axes[0] = {s.box.lower.x, s.box.upper.x, s.by.x};
  axes[1] = {s.box.lower.y, s.box.upper.y, s.by.y};
  axes[2] = {s.box.lower.z, s.box.upper.z, s.by.z};
}

float below(double x) noexcept {
  const auto f = static_cast<float>(x);
  return std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float above(double x) noexcept { return -below(-x); }

// What it takes to look at an object, in ns, as tracker.cpp tells what things cost: where all are
// gone through, and of a list.
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
// A sweep is cut into as many pieces as it crosses columns.
double pieces(const Columns& columns, const Sweep& s) noexcept {
  const Vec3& at = s.box.lower;
  return columns.look.columns_between(at, {at.x + s.by.x, at.y + s.by.y, at.z + s.by.z}) + 1.0;
}
double cost_of(const Columns& columns, const Sweep& sweep) noexcept {
  const double count = pieces(columns, sweep);
  const Box piece = cover(sweep, 0, 1 / count);
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

// Which objects questions may find.
class Allowed {
 public:
  Allowed(const Objects& objects, const Filters& filters) noexcept
      : objects_(objects), filters_(filters) {}

  Filter filter(std::size_t question) const noexcept {
    Filter f;
    set(f, filters_, question);
    return f;
  }
  // Where no object has a filter, theirs need not be brought from memory.
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

// Divisions and differences of floats in doubles neither overflow nor make a NaN, but where an
// infinite bound meets an infinite one: those are at the same place from the start.
Touch touch(const Sweep& sweep, const Box& b) noexcept {
  Axis axes[3];
  axes_of(sweep, axes);
  const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
  const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
  Touch t{0, 1};
  for (int k = 0; k < 3; ++k) {
    const double by = axes[k].by;
    if (by == 0) {
      if (lower[k] <= axes[k].upper && axes[k].lower <= upper[k]) continue;
      return {1, 0};
    }
    double first = (double{lower[k]} - double{axes[k].upper}) / by;
    double last = (double{upper[k]} - double{axes[k].lower}) / by;
    if (by < 0) std::swap(first, last);
    if (first > t.enter) t.enter = first;  // a NaN is no bound
    if (last < t.leave) t.leave = last;
  }
  return t;
}

// By more than double arithmetic may have rounded: touch() is off by some 2^-51 of the numbers that
// meet in it. So whatever touch() says is met between a and b overlaps this box.
Box cover(const Sweep& sweep, double a, double b) noexcept {
  Axis axes[3];
  axes_of(sweep, axes);
  float lower[3], upper[3];
  for (int k = 0; k < 3; ++k) {
    const double by = axes[k].by, from = by * (by < 0 ? b : a), to = by * (by < 0 ? a : b);
    const auto slack = [&](double x) {
      return std::isfinite(x) ? (std::fabs(x) + std::fabs(by)) * 0x1p-40 : 0.0;
    };
    lower[k] = below(axes[k].lower + from - slack(axes[k].lower));
    upper[k] = above(axes[k].upper + to + slack(axes[k].upper));
  }
  return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
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

// Where a question looks first: its cells are asked for before it is its turn.
struct Queries::Look {
  Box around;
  Cells::Worlds worlds;
  Cells::Reach reach;

  void at(const Cells& cells, const Box& box) noexcept {
    around = box;
    cells.reach(around, worlds, reach);
  }
};

// Calls prepare(i, its look) and later ask(i, that, list) for every question, in order within a
// task, and puts the lists together in hits_. What one question finds is sorted by id, each object
// once.
template <class Prepare, class Ask>
void Queries::run(std::size_t count, std::size_t limit, const Executor& executor, unsigned tasks,
                  cpu::Stop& stop, Prepare&& prepare, Ask&& ask) {
  hits_.clear();
  tasks = count < threads_ask_from ? 1 : tasks;
  found_.make(tasks);
  cpu::run_tasks_or_throw(executor, tasks, [&](unsigned t) {
    List<SweepHit>& found = found_[t];
    found.clear();
    Look looks[ahead];
    const std::size_t first = count * t / tasks, end = count * (t + 1) / tasks;
    for (std::size_t i = first; i < std::min(first + ahead, end); ++i) prepare(i, looks[i % ahead]);
    for (std::size_t i = first; i < end; ++i) {
      if (stop()) break;
      const std::size_t before = found.size();
      ask(i, looks[i % ahead], found);
      if (i + ahead < end) prepare(i + ahead, looks[i % ahead]);
      const std::size_t more = found.size() - before;
      if (more >= few_to_sort) found.reserve(found.size() + more);  // room to sort
      SweepHit* const begin = found.begin() + before;
      sort_hits(begin, found.end(), more, limit);
      const auto same = [](const SweepHit& a, const SweepHit& b) { return a.object == b.object; };
      SweepHit* const last = std::unique(begin, found.end(), same);
      found.resize(static_cast<std::size_t>(last - found.begin()));
    }
  });
  std::size_t total = 0;
  for (unsigned t = 0; t < tasks; ++t) total += found_[t].size();
  hits_.reserve(total);
  for (unsigned t = 0; t < tasks; ++t) hits_.push(found_[t]);
}

void Queries::find_overlaps(const Objects& objects, const Ground& ground, const Boxes& boxes,
                            const Executor& executor, unsigned tasks, cpu::Stop& stop) {
  // What is found goes through hits_, which tells of nothing else then, even if memory runs out.
  struct Forget {
    List<SweepHit>& hits;
    ~Forget() { hits.clear(); }
  } const forget{hits_};
  const Cells* const cells = ground.cells;
  const Allowed allowed(objects, boxes.filters);
  const auto prepare = [&](std::size_t i, Look& look) {
    const Box box = boxes[i];
    if (!cells || !core::is_active(box)) return;
    look.worlds = worlds_of(objects, allowed.filter(i));
    look.at(*cells, box);
  };
  const auto ask = [&](std::size_t i, Look& look, List<SweepHit>& found) {
    const Box box = boxes[i];
    if (!core::is_active(box)) return;
    const Filter filter = allowed.filter(i);
    const auto meet = [&](ObjectId id) {  // cells hold the boxes with their margin
      const bool overlaps =
          cpu::overlap_in_memory(reinterpret_cast<const char*>(&box),
                                 reinterpret_cast<const char*>(&objects.body(id).box));
      if (overlaps && objects.is_active(id) && allowed(filter, id))
        found.append({static_cast<std::uint32_t>(i), id, 0});
    };
    if (cells) {
      cells->search(box, look.worlds, look.reach, meet);
    } else if (columns_pay(ground, objects, box)) {
      ground.columns->look.each(box, meet);
      for (const ObjectId id : ground.columns->changed) meet(id);
    } else {
      for (std::size_t id = 0; id < objects.limit(); ++id) meet(static_cast<ObjectId>(id));
    }
  };
  run(boxes.size(), objects.limit(), executor, tasks, stop, prepare, ask);
  overlaps_.clear();
  overlaps_.reserve(hits_.size());
  for (const SweepHit& hit : hits_) overlaps_.push({hit.sweep, hit.object});
}

void Queries::find_hits(const Objects& objects, const Ground& ground, const Sweeps& sweeps,
                        const Executor& executor, unsigned tasks, cpu::Stop& stop) {
  const Cells* const cells = ground.cells;
  const Allowed allowed(objects, sweeps.filters);
  const SweepTest& test = sweeps.test;
  // How much of its time a piece of a sweep is; 0: all objects are gone through.
  const auto piece_of = [&](const Sweep& s) {
    if (!cells) return columns_pay(ground, objects, s) ? 1 / pieces(*ground.columns, s) : 0.0;
    const double length =
        std::max({std::fabs(double{s.by.x}), std::fabs(double{s.by.y}), std::fabs(double{s.by.z})});
    const double pieces = cells->units(length) / piece_units;
    return pieces <= static_cast<double>(cells->line_count()) / 32 ? 1 / pieces : 0.0;
  };
  // Where only the first is asked for, what is near is looked at first.
  const bool only_first = sweeps.which == SweepHits::first;
  const double start = cells && only_first ? first_piece : 1;
  const auto prepare = [&](std::size_t i, Look& look) {
    if (!cells) return;
    const Sweep& sweep = sweeps.data[i];
    const double piece = piece_of(sweep);
    if (piece == 0 || !core::is_active(sweep.box)) return;
    look.worlds = worlds_of(objects, allowed.filter(i));
    look.at(*cells, cover(sweep, 0, std::min(start * piece, 1.0)));
  };
  const auto ask = [&](std::size_t i, Look& look, List<SweepHit>& found) {
    const Sweep& sweep = sweeps.data[i];
    if (!core::is_active(sweep.box)) return;
    const Filter filter = allowed.filter(i);
    const auto number = static_cast<std::uint32_t>(i);
    SweepHit best{number, none, 2};
    const auto is_better = [&](double time, ObjectId id) {
      return time < best.time || (time == best.time && id < best.object);
    };
    double begin = 0;  // whatever is met until then has been looked at, but for a start at 0
    const auto meet = [&](ObjectId id) {
      if (!objects.is_active(id) || !allowed(filter, id)) return;
      const Touch t = touch(sweep, objects.body(id).box);
      if (t.enter > t.leave || (begin != 0 && t.enter <= begin)) return;
      if (only_first && !is_better(t.enter, id)) return;
      double time = t.enter;
      if (test.when) {
        const double told = test.when(test.context, number, id, time);
        if (!(told <= 1)) return;
        time = std::max(time, told);
      }
      if (!only_first)
        found.append({number, id, time});
      else if (is_better(time, id))
        best = {number, id, time};
    };
    const double piece = piece_of(sweep);
    if (piece == 0) Sieve(sweep, cover(sweep, 0, 1)).each(objects, meet);
    if (piece != 0 && !cells) {
      for (const ObjectId id : ground.columns->changed) meet(id);
    }
    for (double part = start * piece; piece != 0; part = std::min(2 * part, piece)) {
      const double end = std::min(begin + part, 1.0);
      if (cells) {
        if (begin != 0) look.at(*cells, cover(sweep, begin, end));
        cells->search(look.around, look.worlds, look.reach, meet);
      } else {
        ground.columns->look.each(cover(sweep, begin, end), meet);
      }
      // What is first met later than this piece cannot be the first.
      if (end == 1 || best.time <= end) break;
      begin = end;
    }
    if (only_first && best.object != none) found.append(best);
  };
  run(sweeps.count, objects.limit(), executor, tasks, stop, prepare, ask);
}

}  // namespace throng::live
