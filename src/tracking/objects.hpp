// The objects: boxes, filters, ids, and the set of those that changed since the last update.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "base/bounds.hpp"
#include "base/prefetch.hpp"
#include "tracking/filter_class_table.hpp"
#include "tracking/pod_vector.hpp"
#include "tracking/world_set.hpp"

namespace throng::tracking {

constexpr std::uint32_t none = 0xffffffffu;
// Prefetch distance in lists of ids.
constexpr std::size_t ids_ahead = 32;

// What a search reads of an object; two per cache line.
struct Body {
  Box box;                   // as given; inactive for an unused id
  std::uint32_t first_edge;  // head of its list of pairs; 0: no pairs
  std::uint32_t bucket;      // its bucket in Cells or its place in BvhForest; `none`: in no index
};
static_assert(sizeof(Body) == 32);

class Objects {
 public:
  Objects(base::Memory& memory, float margin) noexcept;

  // Reserves memory for `count` more objects; add() cannot fail then.
  void reserve_more(std::size_t count);
  ObjectId add(const Box& box, const Filter& filter) noexcept;
  void remove(ObjectId id) noexcept;
  void move(ObjectId id, const Box& box) noexcept {
    if (!is_active(id)) --inactive_;
    bodies_[id].box = box;
    if (!is_active(id)) ++inactive_;
    mark_dirty(id);
  }
  // Stores the box of each listed id; ids are alive and unique.
  void move_listed(const ObjectId* ids, const Boxes& boxes) noexcept;
  // Stores the boxes of ids begin .. end-1 that differ and marks these objects dirty, but neither
  // counts nor lists them: pass both numbers to count_marked(). `inactive`: change in the number of
  // inactive objects. Returns how many were newly marked. Thread-safe for disjoint ranges.
  std::size_t move_range(const Boxes& boxes, std::size_t begin, std::size_t end,
                         std::int64_t& inactive) noexcept;
  // Whether any of boxes begin .. end-1 contains a NaN.
  static bool has_nan(const Boxes& boxes, std::size_t begin, std::size_t end) noexcept;
  void count_marked(std::size_t count, std::int64_t inactive) noexcept;
  void set_filter(ObjectId id, const Filter& filter) noexcept;

  bool is_alive(std::uint64_t id) const noexcept { return id < limit() && (flags_[id] & alive); }
  bool is_dirty(ObjectId id) const noexcept { return (flags_[id] & dirty) != 0; }
  bool is_active(ObjectId id) const noexcept { return base::is_active(bodies_[id].box); }
  std::size_t limit() const noexcept { return bodies_.size(); }
  std::size_t count() const noexcept { return count_; }
  std::size_t inactive() const noexcept { return inactive_; }
  std::size_t removed_count() const noexcept { return removed_.size(); }
  std::size_t dirty_count() const noexcept { return dirty_count_; }
  float margin() const noexcept { return margin_; }

  Body& body(ObjectId id) const noexcept { return bodies_[id]; }
  const Filter& filter(ObjectId id) const noexcept { return filters_[id]; }
  // The box plus the margin, of an active object. `storage` holds the result where there is a
  // margin; without one no copy is made, as a copy costs more than the read.
  const Box& expanded(ObjectId id, Box& storage) const noexcept {
    if (margin_ == 0) return bodies_[id].box;
    return storage = base::expand(bodies_[id].box, margin_);
  }
  Box expanded(ObjectId id) const noexcept {
    Box storage;
    return expanded(id, storage);
  }
  bool has_filters() const noexcept { return grouped_ + owned_ + in_worlds() + static_ != 0; }
  const WorldSet& worlds() const noexcept { return worlds_; }
  // with a world other than -1
  std::size_t in_worlds() const noexcept { return worlds_.objects(); }
  bool may_pair(ObjectId a, ObjectId b) const noexcept {
    if (!has_filters()) return true;
    if (!filter_classes_.allow(filter_class(a), filter_class(b))) return false;
    return !needs_filters() || allows(filters_[a], filters_[b]);
  }
  // A hash of what the object may pair with, apart from owners.
  std::uint32_t pairing_class(ObjectId id) const noexcept {
    return (filter_classes_.allowed(filter_class(id)) * 0x9e3779b1u ^
            static_cast<std::uint32_t>(filters_[id].world)) *
           0x85ebca6bu;
  }
  // All ids, unused ones as inactive boxes, with the filters in use.
  Boxes view() const noexcept { return view_of(bodies_.data(), filters_.data(), limit()); }
  // Whether most ids are unused. Loops over all objects then use alive_ids(), valid after
  // list_alive(), which throws base::AllocationFailed.
  bool sparse() const noexcept { return limit() > 4 * count_ + 1024; }
  void list_alive();
  const PodVector<ObjectId>& alive_ids() const noexcept { return alive_; }
  // A view of the objects in use, in the order of alive_ids(), which it makes. Throws
  // base::AllocationFailed.
  Boxes packed_view();

  // Objects added, removed, moved or given other filters; each once; in call order, or by id after
  // move_range().
  const PodVector<ObjectId>& dirty_list() noexcept;
  // For an index that is updated between updates: calls f(list, count) with the objects that
  // changed since the previous call; an object may occur several times.
  template <class F>
  void place_changed(F&& f) {
    const PodVector<ObjectId>& all = dirty_list();
    f(all.data() + placed_count_, all.size() - placed_count_);
    f(changed_again_.data(), changed_again_.size());
    placed_count_ = all.size();
    changed_again_.clear();
  }
  // Clears the dirty set; ids of removed objects become free.
  void clear_dirty() noexcept;
  void mark_dirty(ObjectId id) noexcept {
    if (flags_[id] & dirty) {
      if (placed_count_ != 0) mark_changed_again(id);
      return;
    }
    flags_[id] |= dirty;
    dirty_.push(id);
    ++dirty_count_;
  }

  // Marks an id as listed; false if it is not alive or is already listed.
  bool mark_listed(std::uint64_t id) noexcept {
    if (id >= limit() || (flags_[id] & (alive | listed)) != alive) return false;
    flags_[id] |= listed;
    return true;
  }
  void clear_listed(std::uint64_t id) noexcept {
    if (id < limit()) flags_[id] = static_cast<std::uint8_t>(flags_[id] & ~listed);
  }

  // Prefetch the data of an object, or its flags only.
  void prefetch(ObjectId id) const noexcept {
    base::prefetch(&bodies_[id]);
    base::prefetch(&flags_[id]);
    if (in_worlds() != 0 || needs_filters()) base::prefetch(&filters_[id]);
  }
  void prefetch_flags(std::uint64_t id) const noexcept {
    if (id < limit()) base::prefetch(&flags_[id]);
  }

  void reserve_for(const Objects& other);
  void copy(const Objects& other) noexcept;

 private:
  // The higher bits hold the filter class.
  enum : std::uint8_t { alive = 1, dirty = 2, listed = 4 };
  static constexpr unsigned filter_class_shift = 3;
  std::uint8_t filter_class(ObjectId id) const noexcept {
    return static_cast<std::uint8_t>(flags_[id] >> filter_class_shift);
  }
  // Whether the filter classes alone do not decide.
  bool needs_filters() const noexcept { return owned_ != 0 || filter_classes_.has_overflow(); }
  // If objects change again more often than there are dirty ones, placing all again costs no more.
  void mark_changed_again(ObjectId id) noexcept {
    if (changed_again_.size() < placed_count_)
      changed_again_.push(id);
    else
      clear_placed();
  }
  void clear_placed() noexcept {
    placed_count_ = 0;
    changed_again_.clear();
  }
  Boxes view_of(const Body* bodies, const Filter* filters, std::size_t count) const noexcept;
  void assign_filter(ObjectId id, const Filter& filter) noexcept;
  void release_filter(ObjectId id) noexcept;
  void count_filter(const Filter& filter, std::size_t one) noexcept;
  bool replace(ObjectId id, const char* box, bool were_all_active, std::int64_t& inactive) noexcept;

  PodVector<Body> bodies_;
  PodVector<std::uint8_t> flags_;
  PodVector<Filter> filters_;
  FilterClassTable filter_classes_;
  PodVector<ObjectId> dirty_, removed_, free_, changed_again_;
  // See sparse().
  PodVector<ObjectId> alive_;
  PodVector<Body> packed_;
  PodVector<Filter> packed_filters_;
  bool alive_listed_ = false;
  std::size_t count_ = 0, inactive_ = 0, dirty_count_ = 0;
  bool dirty_listed_ = true;
  // See place_changed(): the first `placed_count_` dirty objects are placed; those in
  // `changed_again_` changed since.
  std::size_t placed_count_ = 0;
  // Number of objects with a group or mask, with an owner, and static.
  std::size_t grouped_ = 0, owned_ = 0, static_ = 0;
  WorldSet worlds_;
  float margin_;
};

}  // namespace throng::tracking
