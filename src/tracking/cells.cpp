#include "tracking/cells.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/mutex.hpp"
#include "base/parallel_region.hpp"
#include "base/threads.hpp"

namespace throng::tracking {
namespace {

constexpr auto minus_one = static_cast<std::size_t>(-1);
// Prefetch distances while filling and placing, in objects.
constexpr std::size_t fill_ahead = 64, place_ahead = 32;

}  // namespace

// Building: several tasks compute the buckets, then one thread inserts. Two threads, each inserting
// into its own part of the buckets, are no faster: half of the objects that each reads are in the
// cache of the other's core.

bool Cells::make(const Objects& objects, double max_compared, const Executor& executor,
                 unsigned tasks) {
  const CellPlan plan = CellPlan::of(objects, sample_);
  if (plan.expected_comparisons > max_compared) return false;
  assign_storage(plan, objects.count());
  base::ParallelRegion::run(executor, tasks,
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
  base::ChunkQueue shares(objects.limit(), tasks, 1024);
  base::Mutex merge_mutex;
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
  base::run_tasks(executor, tasks, find);
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
      count_class(map_.class_of(map_.quantize(box)), minus_one);
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

// Changing.

bool Cells::place_all(const Objects& objects, const ObjectId* ids, std::size_t count,
                      double max_lines) noexcept {
  double lines = 0;
  Place places[place_ahead];
  for (std::size_t i = 0; i + 1 < count + place_ahead; ++i) {
    if (i < count) {
      if (i + place_ahead < count) objects.prefetch(ids[i + place_ahead]);
      const ObjectId id = ids[i];
      Place& to = places[i % place_ahead];
      to.bucket = none;
      if (objects.body(id).bucket != none) prefetch(objects.body(id).bucket);
      if (objects.is_active(id)) {
        Box storage;
        to = place(objects.expanded(id, storage), worlds_of(objects, objects.filter(id)));
        lines += static_cast<double>(to.lines);
        if (lines > max_lines) return false;
        prefetch(to.bucket);
      }
    }
    if (constexpr std::size_t half = place_ahead / 2; i >= half && i - half < count) {
      const std::uint32_t bucket = objects.body(ids[i - half]).bucket;
      if (bucket != none) prefetch_chain(bucket);
    }
    if (i + 1 < place_ahead) continue;
    const ObjectId id = ids[i + 1 - place_ahead];
    const Place& to = places[(i + 1) % place_ahead];
    Body& body = objects.body(id);
    Box storage;
    if (to.bucket != none && to.bucket == body.bucket) {
      replace(id, objects.expanded(id, storage), to);
      continue;
    }
    if (body.bucket != none) erase(id, body.bucket);
    if (to.bucket != none) insert(id, objects.expanded(id, storage), to);
    body.bucket = to.bucket;
  }
  return true;
}

Cells::Place Cells::place_of(const CellMap::Range& r, std::int32_t world) const noexcept {
  const int c = map_.class_of(r);
  return {c == CellMap::classes ? wide_bucket() : map_.bucket_of(r, c, world), c, 0, world};
}
Cells::Place Cells::place(const Box& box, Worlds worlds) const noexcept {
  const CellMap::Range r = map_.quantize(box);
  Place place = place_of(r, worlds.own);
  place.lines = lines_of(r, worlds);
  return place;
}

void Cells::insert(ObjectId id, const Box& box, const Place& place) noexcept {
  count_class(place.size_class, 1);
  extend(box, place);
  insert_into(id, box, place.bucket);
}

void Cells::insert_into(ObjectId id, const Box& box, std::uint32_t bucket) noexcept {
  Line& head = lines_[bucket];
  if (head.used == 2) {
    // The full line moves behind an empty one.
    std::uint32_t moved = free_;
    if (moved != 0) {
      free_ = lines_[moved].next;
    } else {
      moved = static_cast<std::uint32_t>(lines_.size());
      lines_.resize(lines_.size() + 1);
    }
    lines_[moved] = head;
    head = Line::empty();
    head.next = moved;
  }
  head.set(head.used, box);
  head.id[head.used++] = id;
}

void Cells::erase(ObjectId id, std::uint32_t bucket) noexcept {
  Line& head = lines_[bucket];
  const auto [line, k] = find(id, bucket);
  count_class(class_in(bucket, *line, k), minus_one);
  const std::uint32_t last = --head.used;
  for (int c = 0; c < 6; ++c) {
    line->corner[c][k] = head.corner[c][last];
    head.corner[c][last] = std::numeric_limits<float>::quiet_NaN();
  }
  line->id[k] = head.id[last];
  head.id[last] = none;
  const std::uint32_t next = head.next;
  if (head.used != 0 || next == 0) return;
  head = lines_[next];
  lines_[next] = Line::empty();
  lines_[next].next = free_;
  free_ = next;
}

void Cells::replace(ObjectId id, const Box& box, const Place& place) noexcept {
  const auto [line, k] = find(id, place.bucket);
  if (const int c = class_in(place.bucket, *line, k); c != place.size_class) {
    count_class(c, minus_one);
    count_class(place.size_class, 1);
  }
  extend(box, place);
  line->set(k, box);
}

Cells::Entry Cells::find(ObjectId id, std::uint32_t bucket) const noexcept {
  for (std::uint32_t i = bucket;; i = lines_[i].next) {
    Line& line = lines_[i];
    const std::uint32_t k = line.id[0] == id ? 0 : 1;
    if (line.id[k] == id) return {&line, k};
  }
}

std::uint64_t Cells::lines_of(const CellMap::Range& r, Worlds worlds) const noexcept {
  const std::uint64_t most = lines_.size();
  if (worlds.all) return most;
  std::uint64_t count = wide_lines();
  each_class([&](int c) { count += bucket_count(map_.cells_of(r, c), c, worlds, most); });
  return std::min(count, most);
}

void Cells::candidates(const Box& box, Worlds worlds, CandidateBuckets& candidates) const noexcept {
  candidates.count = CandidateBuckets::most + 1;
  if (worlds.all) return;
  const CellMap::Range range = map_.quantize(box);
  const std::uint64_t most = std::min<std::uint64_t>(CandidateBuckets::most, lines_.size());
  std::uint64_t left = most - std::min(most, wide_lines());
  std::uint32_t* to = candidates.buckets;
  const auto list = [&to, all = lines_.data()](std::uint32_t bucket) {
    base::prefetch(all + bucket);
    *to++ = bucket;
  };
  each_class([&](int c) {
    const CellMap::Range cells = map_.cells_of(range, c);
    left -= std::min(left, bucket_count(cells, c, worlds, most));
    if (left != 0) each_bucket(cells, c, worlds, list);
  });
  if (left == 0) return;
  if (has_wide()) list(wide_bucket());
  candidates.count = static_cast<std::uint32_t>(to - candidates.buckets);
}

// Appends chains and hits without branches, which would be mispredicted.
std::uint32_t Cells::search_few(const Box& box, ObjectId self, CandidateBuckets& candidates,
                                ObjectId* hits, Work& work) const noexcept {
  if (candidates.count > CandidateBuckets::most) return max_hits + 1;
  work.visited += candidates.count;
  const CellQuery query(box);
  const Line* const lines = lines_.data();
  std::uint32_t count = candidates.count, hit_count = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Line& line = lines[candidates.buckets[k]];
    if (count < CandidateBuckets::capacity) [[likely]] {
      prefetch(line.next);
      candidates.buckets[count] = line.next;
      count += line.next != 0;
    } else if (line.next != 0) {
      work.compared += 2 * std::uint64_t{count};
      return max_hits + 1;
    }
    const std::uint32_t hit = query.overlaps(line);
    hits[hit_count] = line.id[0];
    hit_count += hit & std::uint32_t{line.id[0] != self};
    hits[hit_count] = line.id[1];
    hit_count += hit >> 1 & std::uint32_t{line.id[1] != self};
  }
  work.compared += 2 * std::uint64_t{count};
  return hit_count;
}

void Cells::copy(const Cells& other) noexcept {
  lines_.copy(other.lines_);
  map_ = other.map_;
  bounds_ = other.bounds_;
  blocks_.clear();
  free_ = other.free_;
  max_objects_ = other.max_objects_;
  max_wide_ = other.max_wide_;
  std::memcpy(class_count_, other.class_count_, sizeof class_count_);
  std::memcpy(used_, other.used_, sizeof used_);
  std::copy(other.classes_ever_used_, other.classes_ever_used_ + 2, classes_ever_used_);
}

}  // namespace throng::tracking
