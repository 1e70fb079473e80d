#include "live/query.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cpu/packed_box.hpp"
#include "cpu/sink.hpp"
#include "cpu/threads.hpp"
#include "live/sieve.hpp"

namespace throng::live {
namespace {

// A sweep is cut into pieces of about so many units of the cells, two cells of the first class: of
// shorter ones each looks at nearly as many cells, of longer ones a slanted one at more.
constexpr double piece_units = 64;
// Below so many questions a second thread does not pay.
constexpr std::size_t threads_ask_from = 64;

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

Filter filter_at(const Filters& filters, std::size_t i) noexcept {
  Filter f;
  set(f, filters, i);
  return f;
}

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

// Wider than what double arithmetic may have
// rounded there: touch() is off by some 2^-51 of the numbers that meet in it. So whatever touch()
// says is met between a and b overlaps this box.
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

Queries::Queries(cpu::Memory& memory) noexcept : found_(memory), overlaps_(memory), hits_(memory) {}

// Calls ask(i, list) for every question, in order within a task, and puts the lists together in
// hits_. What one question finds is sorted by id, each object once.
template <class Ask>
void Queries::run(std::size_t count, const Executor& executor, unsigned tasks,
                  const std::atomic<bool>* stop, Ask&& ask) {
  hits_.clear();
  tasks = count < threads_ask_from ? 1 : tasks;
  found_.make(tasks);
  cpu::run_tasks_or_throw(executor, tasks, [&](unsigned t) {
    List<SweepHit>& found = found_[t];
    found.clear();
    for (std::size_t i = count * t / tasks; i < count * (t + 1) / tasks; ++i) {
      if (stop && stop->load(std::memory_order_relaxed)) break;
      const std::size_t before = found.size();
      ask(i, found);
      const auto by_id = [](const SweepHit& a, const SweepHit& b) { return a.object < b.object; };
      const auto same = [](const SweepHit& a, const SweepHit& b) { return a.object == b.object; };
      SweepHit* const begin = found.begin() + before;
      std::sort(begin, found.end(), by_id);
      SweepHit* const end = std::unique(begin, found.end(), same);
      found.resize(static_cast<std::size_t>(end - found.begin()));
    }
  });
  std::size_t total = 0;
  for (unsigned t = 0; t < tasks; ++t) total += found_[t].size();
  hits_.reserve(total);
  for (unsigned t = 0; t < tasks; ++t) hits_.push(found_[t]);
}

void Queries::find_overlaps(const Objects& objects, const Cells* cells, const Boxes& boxes,
                            const Executor& executor, unsigned tasks,
                            const std::atomic<bool>* stop) {
  run(boxes.size(), executor, tasks, stop, [&](std::size_t i, List<SweepHit>& found) {
    const Box box = boxes[i];
    if (!core::is_active(box)) return;
    const Filter filter = filter_at(boxes.filters, i);
    const auto meet = [&](ObjectId id) {
      if (objects.is_active(id) && allows(filter, objects.filter(id)))
        found.append({static_cast<std::uint32_t>(i), id, 0});
    };
    const auto overlaps = [&](ObjectId id) {
      return cpu::overlap_in_memory(reinterpret_cast<const char*>(&box),
                                    reinterpret_cast<const char*>(&objects.body(id).box));
    };
    if (!cells) {
      for (std::size_t k = 0; k < objects.limit(); ++k) {
        const auto id = static_cast<ObjectId>(k);
        if (overlaps(id)) meet(id);
      }
      return;
    }
    const Cells::Worlds worlds = worlds_of(objects, filter);
    Cells::Reach reach;
    cells->reach(box, worlds, reach);
    cells->search(box, worlds, reach, [&](ObjectId id) {
      if (overlaps(id)) meet(id);  // cells hold the boxes with their margin
    });
  });
  overlaps_.clear();
  overlaps_.reserve(hits_.size());
  for (const SweepHit& hit : hits_) overlaps_.push({hit.sweep, hit.object});
}

void Queries::find_hits(const Objects& objects, const Cells* cells, const Sweep* sweeps,
                        std::size_t count, SweepHits which, const Filters& filters,
                        const Executor& executor, unsigned tasks, const std::atomic<bool>* stop) {
  run(count, executor, tasks, stop, [&](std::size_t i, List<SweepHit>& found) {
    const Sweep& sweep = sweeps[i];
    if (!core::is_active(sweep.box)) return;
    const Filter filter = filter_at(filters, i);
    const Cells::Worlds worlds = worlds_of(objects, filter);
    SweepHit best{static_cast<std::uint32_t>(i), none, 2};
    const auto meet = [&](ObjectId id) {
      if (!objects.is_active(id) || !allows(filter, objects.filter(id))) return;
      const Touch t = touch(sweep, objects.body(id).box);
      if (t.enter > t.leave) return;
      const SweepHit hit{static_cast<std::uint32_t>(i), id, t.enter};
      if (which == SweepHits::all)
        found.append(hit);
      else if (hit.time < best.time || (hit.time == best.time && id < best.object))
        best = hit;
    };
    const double length = std::max({std::fabs(double{sweep.by.x}), std::fabs(double{sweep.by.y}),
                                    std::fabs(double{sweep.by.z})});
    const double pieces = cells ? std::ceil(cells->units(length) / piece_units + 1e-9) : 0;
    if (cells && pieces <= cells->line_count() / 32) {
      const auto last = static_cast<std::size_t>(pieces);
      for (std::size_t p = 0; p < std::max<std::size_t>(last, 1); ++p) {
        const double begin = static_cast<double>(p) / std::max(pieces, 1.0);
        const double end = static_cast<double>(p + 1) / std::max(pieces, 1.0);
        const Box around = cover(sweep, begin, end);
        Cells::Reach reach;
        cells->reach(around, worlds, reach);
        cells->search(around, worlds, reach, meet);
        // What is first met later than this piece cannot be the first.
        if (best.time <= end) break;
      }
    } else {
      Sieve(sweep, cover(sweep, 0, 1)).each(objects, meet);
    }
    if (which == SweepHits::first && best.object != none) found.append(best);
  });
}

}  // namespace throng::live
