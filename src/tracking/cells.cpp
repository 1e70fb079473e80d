#include "tracking/cells.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace throng::tracking {
namespace {

constexpr auto minus_one = static_cast<std::size_t>(-1);

}  // namespace

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
    grid::prefetch(all + bucket);
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
