// Builds cells for all objects: several tasks compute the buckets, then one thread inserts. Two
// threads, each inserting into its own part of the buckets, are no faster: half of the objects that
// each reads are in the cache of the other's core.
#include <algorithm>
#include <mutex>

#include "cpu/team.hpp"
#include "cpu/threads.hpp"
#include "live/cells.hpp"

namespace throng::live {
namespace {

// Prefetch distance, in objects.
constexpr std::size_t fill_ahead = 64;

}  // namespace

bool Cells::make(const Objects& objects, double most_compared, const Executor& executor,
                 unsigned tasks) {
  const CellPlan plan = CellPlan::of(objects, sample_);
  if (plan.expected_comparisons > most_compared) return false;
  lay_out(plan, objects.count());
  cpu::Team::lead(executor, tasks, [&](const Executor& team) { find_homes(objects, team, tasks); });
  if (static_cast<double>(wide_count()) > most_compared) return false;
  fill(objects);
  return true;
}

bool Cells::suit(const Objects& objects, double most_compared) {
  return CellPlan::of(objects, sample_).expected_comparisons <= most_compared;
}

void Cells::lay_out(const CellPlan& plan, std::size_t count) {
  map_.lay_out(plan, count);
  const std::size_t most = count + count / 4 + 64;
  most_objects_ = 0;
  lines_.renew(lines_for(map_.homes(), most));
  most_objects_ = most;
  free_ = 0;
  bounds_ = {};
  blocks_.forget();
  std::fill(kept_, kept_ + 2, ClassSet());
  for (auto& counts : class_count_) std::fill(counts, counts + CellMap::classes + 1, 0);
  std::fill(used_, used_ + CellMap::thin_sets, 0);
}

void Cells::find_homes(const Objects& objects, const Executor& executor, unsigned tasks) {
  cpu::Shares shares(objects.limit(), tasks, 1024);
  std::mutex one_by_one;
  Few few;
  auto find = [&](unsigned t) {
    Tally tally;
    for (std::size_t begin, end; shares.take(t, begin, end);)
      find_homes(objects, begin, end, tally);
    const std::lock_guard lock(one_by_one);
    for (int c = 0; c < CellMap::class_numbers; ++c) {
      if (tally.count[c] != 0) count_class(c, tally.count[c]);
    }
    if (map_.thin()) map_.hold(tally.spans);
    few.add(tally.few);
    for (int k = 0; k < 2; ++k) kept_[k].add(tally.kept[k]);
  };
  cpu::run_tasks(executor, tasks, find);
  widen(objects, few);
}

void Cells::Few::add(const Few& other) noexcept {
  for (int level = 0; level <= CellMap::classes; ++level) {
    for (std::size_t k = 0; k < std::min(other.count[level], most); ++k)
      add(level, other.id[level][k]);
    count[level] += other.count[level] - std::min(other.count[level], most);
  }
}

// A small number of the largest boxes, such as a ground and walls, join those too wide for any
// class: comparing them in each search costs less than visiting their classes.
void Cells::widen(const Objects& objects, const Few& few) noexcept {
  int top = CellMap::classes - 1;
  std::size_t moved = 0;
  for (; top > 0 && moved + few.count[top] <= Few::most; --top) {
    moved += few.count[top];
    for (std::size_t k = 0; k < few.count[top]; ++k) {
      Body& body = objects.body(few.id[top][k]);
      Box room;
      const Box& box = objects.grown(few.id[top][k], room);
      count_class(map_.class_of(map_.quantise(box)), static_cast<std::size_t>(-1));
      count_class(CellMap::classes, 1);
      body.home = wide_home();
    }
  }
  if (moved != 0) map_.set_top(top);
  most_wide_ = 2 * wide_count() + 64;
}

void Cells::find_homes(const Objects& objects, std::size_t begin, std::size_t end,
                       Tally& tally) const noexcept {
  const bool in_worlds = objects.in_worlds() != 0;
  for (std::size_t i = begin; i < end; ++i) {
    const auto id = static_cast<ObjectId>(i);
    Body& body = objects.body(id);
    body.home = none;
    if (!objects.is_active(id)) continue;
    Box room;
    const CellMap::Range r = map_.quantise(objects.grown(id, room));
    const Place place = place_of(r, in_worlds ? objects.filter(id).world : -1);
    body.home = place.home;
    ++tally.count[place.size_class];
    tally.few.add(map_.level(place.size_class, 3), id);
    tally.kept[place.world == -1].add(place.size_class);
    if (map_.thin()) tally.spans.hold(r, place.size_class);
  }
}

void Cells::make_blocks(const Objects& objects) {
  blocks_.make(objects.count());
  for (std::size_t i = 0; i < objects.limit(); ++i) {
    const auto id = static_cast<ObjectId>(i);
    if (!objects.is_active(id)) continue;
    Box room;
    const CellMap::Range r = map_.quantise(objects.grown(id, room));
    add_to_blocks(r, map_.class_of(r));
  }
}

void Cells::fill(const Objects& objects) noexcept {
  const std::size_t limit = objects.limit();
  lines_.resize(map_.homes() + std::size_t{1});
  std::fill(lines_.begin(), lines_.end(), Line::empty());
  for (std::size_t i = 0; i < limit; ++i) {
    if (i + fill_ahead < limit) {
      const std::uint32_t soon = objects.body(static_cast<ObjectId>(i + fill_ahead)).home;
      if (soon != none) prefetch(soon);
    }
    const auto id = static_cast<ObjectId>(i);
    const std::uint32_t home = objects.body(id).home;
    Box room;
    if (home == none) continue;
    const Box& box = objects.grown(id, room);
    if (home != wide_home()) bounds_.hold(box);
    enter(id, box, home);
  }
}

}  // namespace throng::live
