// Builds cells for all objects: several tasks compute the buckets, then one thread inserts. Two
// threads, each inserting into its own part of the buckets, are no faster: half of the objects that
// each reads are in the cache of the other's core.
#include <algorithm>
#include <mutex>

#include "base/parallel_region.hpp"
#include "base/threads.hpp"
#include "tracking/cells.hpp"

namespace throng::tracking {
namespace {

// Prefetch distance, in objects.
constexpr std::size_t fill_ahead = 64;

}  // namespace

bool Cells::make(const Objects& objects, double max_compared, const Executor& executor,
                 unsigned tasks) {
  const CellPlan plan = CellPlan::of(objects, sample_);
  if (plan.expected_comparisons > max_compared) return false;
  assign_storage(plan, objects.count());
  grid::ParallelRegion::run(executor, tasks,
                            [&](const Executor& team) { find_buckets(objects, team, tasks); });
  if (static_cast<double>(wide_count()) > max_compared) return false;
  fill(objects);
  return true;
}

bool Cells::is_suitable(const Objects& objects, double max_compared) {
  return CellPlan::of(objects, sample_).expected_comparisons <= max_compared;
}

void Cells::assign_storage(const CellPlan& plan, std::size_t count) {
  map_.assign_storage(plan, count);
  const std::size_t most = count + count / 4 + 64;
  max_objects_ = 0;
  lines_.reserve_discard(lines_for(map_.buckets(), most));
  max_objects_ = most;
  free_ = 0;
  bounds_ = {};
  blocks_.clear();
  std::fill(classes_ever_used_, classes_ever_used_ + 2, ClassSet());
  for (auto& counts : class_count_) std::fill(counts, counts + CellMap::classes + 1, 0);
  std::fill(used_, used_ + CellMap::thin_sets, 0);
}

void Cells::find_buckets(const Objects& objects, const Executor& executor, unsigned tasks) {
  grid::ChunkQueue shares(objects.limit(), tasks, 1024);
  std::mutex merge_mutex;
  LevelCounts level_counts;
  auto find = [&](unsigned t) {
    Tally tally;
    for (std::size_t begin, end; shares.take(t, begin, end);)
      find_buckets(objects, begin, end, tally);
    const std::lock_guard lock(merge_mutex);
    for (int c = 0; c < CellMap::class_numbers; ++c) {
      if (tally.count[c] != 0) count_class(c, tally.count[c]);
    }
    if (map_.thin()) map_.extend(tally.spans);
    level_counts.add(tally.level_counts);
    for (int k = 0; k < 2; ++k) classes_ever_used_[k].add(tally.classes_used[k]);
  };
  grid::run_tasks(executor, tasks, find);
  exclude_largest(objects, level_counts);
}

void Cells::LevelCounts::add(const LevelCounts& other) noexcept {
  for (int level = 0; level <= CellMap::classes; ++level) {
    for (std::size_t k = 0; k < std::min(other.count[level], most); ++k)
      add(level, other.id[level][k]);
    count[level] += other.count[level] - std::min(other.count[level], most);
  }
}

// A small number of the largest boxes, such as a ground and walls, join those too wide for any
// class: comparing them in each search costs less than visiting their classes.
void Cells::exclude_largest(const Objects& objects, const LevelCounts& level_counts) noexcept {
  int top = CellMap::classes - 1;
  std::size_t moved = 0;
  for (; top > 0 && moved + level_counts.count[top] <= LevelCounts::most; --top) {
    moved += level_counts.count[top];
    for (std::size_t k = 0; k < level_counts.count[top]; ++k) {
      Body& body = objects.body(level_counts.id[top][k]);
      Box storage;
      const Box& box = objects.expanded(level_counts.id[top][k], storage);
      count_class(map_.class_of(map_.quantize(box)), static_cast<std::size_t>(-1));
      count_class(CellMap::classes, 1);
      body.bucket = wide_bucket();
    }
  }
  if (moved != 0) map_.set_top(top);
  max_wide_ = 2 * wide_count() + 64;
}

void Cells::find_buckets(const Objects& objects, std::size_t begin, std::size_t end,
                         Tally& tally) const noexcept {
  const bool in_worlds = objects.in_worlds() != 0;
  for (std::size_t i = begin; i < end; ++i) {
    const auto id = static_cast<ObjectId>(i);
    Body& body = objects.body(id);
    body.bucket = none;
    if (!objects.is_active(id)) continue;
    Box storage;
    const CellMap::Range r = map_.quantize(objects.expanded(id, storage));
    const Place place = place_of(r, in_worlds ? objects.filter(id).world : -1);
    body.bucket = place.bucket;
    ++tally.count[place.size_class];
    tally.level_counts.add(map_.level(place.size_class, 3), id);
    tally.classes_used[place.world == -1].add(place.size_class);
    if (map_.thin()) tally.spans.extend(r, place.size_class);
  }
}

void Cells::make_blocks(const Objects& objects) {
  blocks_.make(objects.count());
  for (std::size_t i = 0; i < objects.limit(); ++i) {
    const auto id = static_cast<ObjectId>(i);
    if (!objects.is_active(id)) continue;
    Box storage;
    const CellMap::Range r = map_.quantize(objects.expanded(id, storage));
    add_to_blocks(r, map_.class_of(r));
  }
}

void Cells::fill(const Objects& objects) noexcept {
  const std::size_t limit = objects.limit();
  lines_.resize(map_.buckets() + std::size_t{1});
  std::fill(lines_.begin(), lines_.end(), Line::empty());
  for (std::size_t i = 0; i < limit; ++i) {
    if (i + fill_ahead < limit) {
      const std::uint32_t soon = objects.body(static_cast<ObjectId>(i + fill_ahead)).bucket;
      if (soon != none) prefetch(soon);
    }
    const auto id = static_cast<ObjectId>(i);
    const std::uint32_t bucket = objects.body(id).bucket;
    Box storage;
    if (bucket == none) continue;
    const Box& box = objects.expanded(id, storage);
    if (bucket != wide_bucket()) bounds_.extend(box);
    insert_into(id, box, bucket);
  }
}

}  // namespace throng::tracking
