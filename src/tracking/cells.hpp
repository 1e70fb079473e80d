// A hierarchical grid by size class, for objects that mostly stay in place. Each box is stored
// once, in the cell of its lower corner; a search reads a handful of cache lines.
//
// Mapping of boxes to cells, and the proof that no pair is lost: cell_map.hpp.
//
// Cells that share a bucket only cost box comparisons. A search may then report a box twice; the
// caller removes duplicates.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include <throng/types.hpp>

#include "tracking/block_occupancy.hpp"
#include "tracking/bounds.hpp"
#include "tracking/cell_line.hpp"
#include "tracking/cell_map.hpp"
#include "tracking/cell_plan.hpp"
#include "tracking/objects.hpp"
#include "tracking/pod_vector.hpp"
#include "tracking/work_counters.hpp"

namespace throng::tracking {

// One bit per class of boxes.
class ClassSet {
 public:
  void add(int c) noexcept { bits_[c >> CellMap::thin_shift] |= bit(c); }
  void add(const ClassSet& other) noexcept {
    for (int axes = 0; axes < CellMap::thin_sets; ++axes) bits_[axes] |= other.bits_[axes];
  }
  bool has(int c) const noexcept { return (bits_[c >> CellMap::thin_shift] & bit(c)) != 0; }

 private:
  static std::uint32_t bit(int c) noexcept { return 1u << (c & ((1 << CellMap::thin_shift) - 1)); }

  std::uint32_t bits_[CellMap::thin_sets] = {};
};

class Cells {
 public:
  // Two boxes; the further boxes of a bucket are in a chain of full lines behind it. An empty place
  // is all NaN, which overlaps nothing. `next`: the next line of the chain, or 0, which is in no
  // chain; `used`: boxes in this line.
  using Line = CellLine;

  explicit Cells(base::Memory& memory) noexcept
      : lines_(memory), sample_(memory), blocks_(memory) {}

  // Builds cells that hold all active objects, and sets their buckets. Returns false if cells do
  // not work well, because a search is expected to compare more than `max_compared` boxes. Then,
  // or when it throws base::AllocationFailed, there are no cells.
  bool make(const Objects& objects, double max_compared, const Executor& executor, unsigned tasks);
  // Whether make() would succeed. Throws base::AllocationFailed.
  bool is_suitable(const Objects& objects, double max_compared);
  // Whether that many objects fit and not too many are too wide for the present classes.
  bool has_capacity_for(std::size_t objects) const noexcept {
    return objects <= max_objects_ && wide_count() <= max_wide_;
  }

  // The worlds that a search visits.
  struct Worlds {
    std::int32_t own = -1;
    bool everywhere = false;         // world -1, too: it is in use, and `own` is another one
    bool all = false;                // every world: `own` is -1, and many others are in use
    const WorldSet* each = nullptr;  // these, too: `own` is -1, and all others are listed
  };
  // Moves these changed objects in the index, and sets their buckets; ids may occur
  // twice. Returns false, with only some of them placed, if searches around them would visit more
  // lines.
  bool place_all(const Objects& objects, const ObjectId* ids, std::size_t count,
                 double max_lines) noexcept;

  // Calls f(id) for every box that overlaps this one, possibly several times. Exceptions of f
  // propagate.
  template <class F>
  void search(const Box& box, Worlds worlds, Work& work, F&& f) const;
  // The same in three steps, for prefetching: candidates() lists and prefetches the buckets;
  // prefetch_chains() prefetches the lines behind them; search_few() writes all overlapping ids but
  // `self` to hits, which has max_hits + 1 elements, and returns how many. Above max_hits the list
  // is incomplete, and search_many() calls f(id) for each.
  struct CandidateBuckets {
    static constexpr std::uint32_t most = 224, capacity = 256;
    std::uint32_t count;  // above `most`: too many to list
    std::uint32_t buckets[capacity];
  };
  static constexpr std::uint32_t max_hits = 2 * CandidateBuckets::capacity;
  void candidates(const Box& box, Worlds worlds, CandidateBuckets& candidates) const noexcept;
  void prefetch_chains(const CandidateBuckets& candidates) const noexcept {
    if (candidates.count > CandidateBuckets::most) return;
    for (std::uint32_t k = 0; k < candidates.count; ++k) prefetch_chain(candidates.buckets[k]);
  }
  std::uint32_t search_few(const Box& box, ObjectId self, CandidateBuckets& candidates,
                           ObjectId* hits, Work& work) const noexcept;
  template <class F>
  void search_many(const Box& box, Worlds worlds, Work& work, F&& f) const;
  // The line behind the first, or line 0 if there is none: a branch would be mispredicted.
  void prefetch_chain(std::uint32_t bucket) const noexcept { prefetch(lines_[bucket].next); }
  void prefetch(std::uint32_t bucket) const noexcept { base::prefetch(&lines_[bucket]); }

  std::size_t line_count() const noexcept { return lines_.size(); }

  // For traversal (grid_traversal.hpp): the map; bounds of all boxes in cells, which only grow as
  // boxes move; f(class) for each class in use; f(bucket) for each of the cells, in all worlds to
  // visit.
  const CellMap& map() const noexcept { return map_; }
  Box bounds() const noexcept { return bounds_.box(); }
  template <class F>
  void each_class(F&& f) const {
    for (int axes = 0; axes < (map_.thin() ? CellMap::thin_sets : 1); ++axes) {
      for (std::uint32_t used = used_[axes]; used != 0; used &= used - 1)
        f(std::countr_zero(used) | axes << CellMap::thin_shift);
    }
  }
  template <class F>
  void each_bucket(const CellMap::Range& cells, int c, Worlds worlds, F&& f) const {
    if (worlds.own == -1 || may_contain(c, worlds.own)) map_.each_bucket(cells, c, worlds.own, f);
    if (worlds.everywhere && may_contain(c, -1)) map_.each_bucket(cells, c, -1, f);
    if (!worlds.each || !may_contain(c, 0)) return;
    for (const std::int32_t world : *worlds.each) map_.each_bucket(cells, c, world, f);
  }
  // Number of these buckets; per world limited to `most`.
  std::uint64_t bucket_count(const CellMap::Range& cells, int c, Worlds worlds,
                             std::uint64_t most) const noexcept {
    const std::uint64_t count = CellMap::count(cells, most);
    if (worlds.own == -1) {
      const auto others =
          worlds.each && may_contain(c, 0) ? worlds.each->end() - worlds.each->begin() : 0;
      return count * static_cast<std::uint64_t>(1 + others);
    }
    return (may_contain(c, worlds.own) ? count : 0) +
           (worlds.everywhere && may_contain(c, -1) ? count : 0);
  }
  const Line& line(std::uint32_t number) const noexcept { return lines_[number]; }
  // Occupancy of blocks of cells, for long sweeps. Exists after make_blocks() until the cells are
  // rebuilt or copied, or the bits are too dense. Throws base::AllocationFailed.
  const BlockOccupancy& blocks() const noexcept { return blocks_; }
  void make_blocks(const Objects& objects);
  void clear_blocks() noexcept { blocks_.clear(); }
  // The bucket of boxes too wide for any class.
  bool has_wide() const noexcept { return wide_count() != 0; }
  std::uint32_t wide_bucket() const noexcept { return map_.buckets(); }

  void reserve_for(const Cells& other) {
    lines_.reserve(lines_for(other.map_.buckets(), other.max_objects_));
  }
  void copy(const Cells& other) noexcept;

 private:
  // The bucket of a box, and how many lines a search around it visits, chains excluded; at most all
  // lines.
  struct Place {
    std::uint32_t bucket;
    int size_class;
    std::uint64_t lines;
    std::int32_t world;
  };
  Place place(const Box& box, Worlds worlds) const noexcept;
  void insert(ObjectId id, const Box& box, const Place& place) noexcept;
  void erase(ObjectId id, std::uint32_t bucket) noexcept;
  // Stores the new box of an object that stays in its bucket.
  void replace(ObjectId id, const Box& box, const Place& place) noexcept;
  // Lines in chains are full, so there are at most half as many as boxes.
  static std::size_t lines_for(std::size_t buckets, std::size_t objects) noexcept {
    return buckets + 1 + objects / 2 + 1;
  }
  // Whether there may be boxes of a class in a world; distinguishes only -1 from all others.
  bool may_contain(int c, std::int32_t world) const noexcept {
    return classes_ever_used_[world == -1].has(c);
  }
  std::size_t wide_count() const noexcept { return class_count_[0][CellMap::classes]; }
  std::uint64_t wide_lines() const noexcept { return wide_count() / 2; }
  void assign_storage(const CellPlan& plan, std::size_t objects);
  // Per level (the class without its thin axes): the number of boxes, and the ids of the first.
  struct LevelCounts {
    static constexpr std::size_t most = 8;
    std::size_t count[CellMap::classes + 1] = {};
    ObjectId id[CellMap::classes + 1][most] = {};

    void add(int level, ObjectId one) noexcept {
      if (count[level] < most) id[level][count[level]] = one;
      ++count[level];
    }
    void add(const LevelCounts& other) noexcept;
  };
  // Totals of a range of objects: boxes per class, and their largest spans.
  struct Tally {
    std::size_t count[CellMap::class_numbers] = {};
    ClassSet classes_used[2];
    CellMap::Spans spans;
    LevelCounts level_counts;
  };
  void find_buckets(const Objects& objects, const Executor& executor, unsigned tasks);
  void exclude_largest(const Objects& objects, const LevelCounts& level_counts) noexcept;
  void find_buckets(const Objects& objects, std::size_t begin, std::size_t end,
                    Tally& tally) const noexcept;
  void fill(const Objects& objects) noexcept;
  // Without its `lines`.
  Place place_of(const CellMap::Range& r, std::int32_t world) const noexcept;
  void extend(const Box& box, const Place& place) noexcept {
    map_.extend(box, place.size_class);
    if (place.size_class != CellMap::classes) bounds_.extend(box);
    classes_ever_used_[place.world == -1].add(place.size_class);
    if (blocks_.made()) add_to_blocks(map_.quantize(box), place.size_class);
  }
  // Boxes too wide for cells are added, too, but never looked up.
  void add_to_blocks(const CellMap::Range& r, int size_class) noexcept {
    blocks_.add(map_.storage_cell(r, size_class), size_class);
  }
  void insert_into(ObjectId id, const Box& box, std::uint32_t bucket) noexcept;
  std::uint64_t lines_of(const CellMap::Range& r, Worlds worlds) const noexcept;
  // Place of an object in the chain of this bucket.
  struct Entry {
    Line* line;
    std::uint32_t k;
  };
  Entry find(ObjectId id, std::uint32_t bucket) const noexcept;
  void count_class(int size_class, std::size_t more) noexcept {
    const int axes = size_class >> CellMap::thin_shift, c = map_.level(size_class, 3);
    class_count_[axes][c] += more;
    const std::uint32_t bit = 1u << c;
    std::uint32_t& used = used_[axes];
    used = class_count_[axes][c] != 0 ? used | bit : used & ~bit;
    used &= (1u << CellMap::classes) - 1;
  }
  // Class of a box in the chain of this bucket.
  int class_in(std::uint32_t bucket, const Line& line, std::uint32_t k) const noexcept {
    const bool one_class = !map_.thin() && (used_[0] & (used_[0] - 1)) == 0;
    return one_class && bucket != wide_bucket() ? std::countr_zero(used_[0])
                                                : map_.class_of(map_.quantize(line.box(k)));
  }
  template <class F>
  void visit_chain(const CellQuery& query, std::uint32_t bucket, Work& work, F&& f) const;

  PodVector<Line> lines_;
  PodVector<CellPlan::Sampled> sample_;  // scratch of the last plan
  CellMap map_;
  Bounds bounds_;
  BlockOccupancy blocks_;
  std::uint32_t free_ = 0;       // head of the list of free lines
  std::size_t max_objects_ = 0;  // capacity
  std::size_t max_wide_ = 0;     // rebuild when more are too wide
  // By thin axes; [0][classes]: boxes too wide for any class. `used_`: one bit per class in use.
  std::size_t class_count_[CellMap::thin_sets][CellMap::classes + 1] = {};
  std::uint32_t used_[CellMap::thin_sets] = {};
  ClassSet classes_ever_used_[2];  // classes that have, or had, boxes of a world, and of world -1
};

// For an object or a query with this filter.
inline Cells::Worlds worlds_of(const Objects& objects, const Filter& filter) noexcept {
  if (objects.in_worlds() == 0) return {};
  if (filter.world == -1) {
    const bool level_counts = objects.worlds().all_listed();
    return {-1, false, !level_counts, level_counts ? &objects.worlds() : nullptr};
  }
  return {filter.world, objects.in_worlds() != objects.count()};
}

template <class F>
void Cells::visit_chain(const CellQuery& query, std::uint32_t bucket, Work& work, F&& f) const {
  std::uint32_t i = bucket;
  ++work.visited;
  do {
    const Line& line = lines_[i];
    i = line.next;
    work.compared += 2;
    const std::uint32_t hit = query.overlaps(line);
    if (hit & 1) f(line.id[0]);
    if (hit & 2) f(line.id[1]);
  } while (i != 0);
}

template <class F>
void Cells::search(const Box& box, Worlds worlds, Work& work, F&& f) const {
  CandidateBuckets listed;
  candidates(box, worlds, listed);
  ObjectId hits[max_hits + 1];
  const std::uint32_t count = search_few(box, none, listed, hits, work);
  if (count <= max_hits) {
    for (std::uint32_t k = 0; k < count; ++k) f(hits[k]);
  } else {
    search_many(box, worlds, work, f);
  }
}

template <class F>
void Cells::search_many(const Box& box, Worlds worlds, Work& work, F&& f) const {
  const CellQuery query(box);
  const CellMap::Range range = map_.quantize(box);
  if (lines_of(range, worlds) < lines_.size()) {
    // Prefetched in groups, then visited.
    constexpr std::uint32_t group_size = 64;
    std::uint32_t buckets[group_size], count = 0;
    const auto visit_pending = [&] {
      for (std::uint32_t k = 0; k < count; ++k) visit_chain(query, buckets[k], work, f);
      count = 0;
    };
    const auto visit_later = [&](std::uint32_t bucket) {
      prefetch(bucket);
      buckets[count++] = bucket;
      if (count == group_size) visit_pending();
    };
    each_class([&](int c) { each_bucket(map_.cells_of(range, c), c, worlds, visit_later); });
    visit_pending();
    if (has_wide()) visit_chain(query, wide_bucket(), work, f);
  } else {
    for (const Line& line : lines_) {
      const std::uint32_t hit = query.overlaps(line);
      if (hit & 1) f(line.id[0]);
      if (hit & 2) f(line.id[1]);
    }
    work.compared += 2 * lines_.size();
  }
}

}  // namespace throng::tracking
