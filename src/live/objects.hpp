// The objects: their boxes, filters and ids, and which of them changed since the last update.
#pragma once

#include <cstdint>

#include <throng/broad_phase.hpp>

#include "core/bounds.hpp"
#include "cpu/prefetch.hpp"
#include "live/filter_kinds.hpp"
#include "live/list.hpp"
#include "live/world_set.hpp"

namespace throng::live {

constexpr std::uint32_t none = 0xffffffffu;
// Objects of a list of ids are asked for so many places ahead.
constexpr std::size_t ids_ahead = 32;

// Two to a cache line: what a search touches of an object.
struct Body {
  Box box;                   // as given; of an id that is not alive an inactive one
  std::uint32_t first_edge;  // of its list; 0: it has none
  std::uint32_t home;        // where Cells keep it
};
static_assert(sizeof(Body) == 32);

class Objects {
 public:
  Objects(cpu::Memory& memory, float margin) noexcept;

  // Room for `count` more; after that add() cannot fail.
  void reserve_more(std::size_t count);
  ObjectId add(const Box& box, const Filter& filter) noexcept;
  void remove(ObjectId id) noexcept;
  void move(ObjectId id, const Box& box) noexcept {
    if (!is_active(id)) --inactive_;
    bodies_[id].box = box;
    if (!is_active(id)) ++inactive_;
    touch(id);
  }
  // Gives each of a list of ids, all alive and none twice, its box.
  void move_listed(const ObjectId* ids, const Boxes& boxes) noexcept;
  // Of ids begin .. end-1: those whose box differs get the new one and are marked, but neither
  // counted nor listed; `inactive` becomes how many more are inactive. Returns how many are marked
  // that were not. Threads may do ranges of their own at once.
  std::size_t move_range(const Boxes& boxes, std::size_t begin, std::size_t end,
                         std::int64_t& inactive) noexcept;
  // Whether one of boxes begin .. end-1 has a NaN.
  static bool has_nan(const Boxes& boxes, std::size_t begin, std::size_t end) noexcept;
  void marked(std::size_t count, std::int64_t inactive) noexcept;
  void set_filter(ObjectId id, const Filter& filter) noexcept;

  bool is_alive(std::uint64_t id) const noexcept { return id < limit() && (flags_[id] & alive); }
  bool is_dirty(ObjectId id) const noexcept { return (flags_[id] & dirty) != 0; }
  bool is_active(ObjectId id) const noexcept { return core::is_active(bodies_[id].box); }
  std::size_t limit() const noexcept { return bodies_.size(); }
  std::size_t count() const noexcept { return count_; }
  std::size_t inactive() const noexcept { return inactive_; }
  std::size_t removed_count() const noexcept { return removed_.size(); }
  std::size_t dirty_count() const noexcept { return dirty_count_; }
  float margin() const noexcept { return margin_; }

  Body& body(ObjectId id) const noexcept { return bodies_[id]; }
  const Filter& filter(ObjectId id) const noexcept { return filters_[id]; }
  // The box as it is compared; of an active object. `room` is for one that has to be made: a copy
  // of each costs more than looking at it.
  const Box& grown(ObjectId id, Box& room) const noexcept {
    if (margin_ == 0) return bodies_[id].box;
    return room = core::expand(bodies_[id].box, margin_);
  }
  Box grown(ObjectId id) const noexcept {
    Box room;
    return grown(id, room);
  }
  bool has_filters() const noexcept { return grouped_ + owned_ + in_worlds() + static_ != 0; }
  const WorldSet& worlds() const noexcept { return worlds_; }
  std::size_t in_worlds() const noexcept { return worlds_.objects(); }  // of another than -1
  bool may_pair(ObjectId a, ObjectId b) const noexcept {
    if (!has_filters()) return true;
    if (!kinds_.allow(kind(a), kind(b))) return false;
    return !asks_filters() || allows(filters_[a], filters_[b]);
  }
  // The same number for objects that may pair with the same others, by all but owners, and mostly
  // another one for others.
  std::uint32_t pairing_class(ObjectId id) const noexcept {
    return (kinds_.allowed(kind(id)) * 0x9e3779b1u ^
            static_cast<std::uint32_t>(filters_[id].world)) *
           0x85ebca6bu;
  }
  // All ids, those that are not alive as inactive boxes; with the filters that are in use.
  Boxes view() const noexcept { return view_of(bodies_.data(), filters_.data(), limit()); }
  // Whether few ids are left alive of many that were: what goes through all has less to do by a
  // list of those. It is there after list_alive(), which throws cpu::NoMemory.
  bool sparse() const noexcept { return limit() > 4 * count_ + 1024; }
  void list_alive();
  const List<ObjectId>& alive_ids() const noexcept { return alive_; }
  // A view of the listed ones alone, in their order; lists them. Throws cpu::NoMemory.
  Boxes packed_view();

  // Those that changed: added, removed, moved, or with other filters. Each once; in the order of
  // the calls, or by id after move_range().
  const List<ObjectId>& dirty_list() noexcept;
  // For who keeps them in their places between updates: f(list, count) for lists of those that
  // changed since they were all put there, an object once or several times; then they are.
  template <class F>
  void place_changed(F&& f) {
    const List<ObjectId>& all = dirty_list();
    f(all.data() + placed_, all.size() - placed_);
    f(again_.data(), again_.size());
    placed_ = all.size();
    again_.clear();
  }
  // The changes are told: nothing is dirty, and ids of removed objects are free.
  void settle() noexcept;
  void touch(ObjectId id) noexcept {
    if (flags_[id] & dirty) {
      if (placed_ != 0) touch_again(id);
      return;
    }
    flags_[id] |= dirty;
    dirty_.push(id);
    ++dirty_count_;
  }

  // Whether a list of ids may have this one: it is alive, and was not listed yet. Then it is.
  bool list(std::uint64_t id) noexcept {
    if (id >= limit() || (flags_[id] & (alive | listed)) != alive) return false;
    flags_[id] |= listed;
    return true;
  }
  void unlist(std::uint64_t id) noexcept {
    if (id < limit()) flags_[id] = static_cast<std::uint8_t>(flags_[id] & ~listed);
  }

  // Bring nearer what is known of an object, or no more than whether it is.
  void prefetch(ObjectId id) const noexcept {
    cpu::prefetch(&bodies_[id]);
    cpu::prefetch(&flags_[id]);
    if (in_worlds() != 0 || asks_filters()) cpu::prefetch(&filters_[id]);
  }
  void prefetch_flags(std::uint64_t id) const noexcept {
    if (id < limit()) cpu::prefetch(&flags_[id]);
  }

  void reserve_for(const Objects& other);
  void copy(const Objects& other) noexcept;

 private:
  // The bits above are the kind of its filter.
  enum : std::uint8_t { alive = 1, dirty = 2, listed = 4 };
  static constexpr unsigned kind_shift = 3;
  std::uint8_t kind(ObjectId id) const noexcept {
    return static_cast<std::uint8_t>(flags_[id] >> kind_shift);
  }
  // Whether kinds do not tell all.
  bool asks_filters() const noexcept { return owned_ != 0 || kinds_.has_others(); }
  // Where it happens more often than there are dirty ones, these may as well all be placed anew.
  void touch_again(ObjectId id) noexcept {
    if (again_.size() < placed_)
      again_.push(id);
    else
      forget_placed();
  }
  void forget_placed() noexcept {
    placed_ = 0;
    again_.clear();
  }
  Boxes view_of(const Body* bodies, const Filter* filters, std::size_t count) const noexcept;
  void use_filter(ObjectId id, const Filter& filter) noexcept;
  void drop_filter(ObjectId id) noexcept;
  void count_filter(const Filter& filter, std::size_t one) noexcept;
  bool replace(ObjectId id, const char* box, bool were_all_active, std::int64_t& inactive) noexcept;

  List<Body> bodies_;
  List<std::uint8_t> flags_;
  List<Filter> filters_;
  FilterKinds kinds_;
  List<ObjectId> dirty_, removed_, free_, again_;
  // See sparse().
  List<ObjectId> alive_;
  List<Body> packed_;
  List<Filter> packed_filters_;
  bool alive_listed_ = false;
  std::size_t count_ = 0, inactive_ = 0, dirty_count_ = 0;
  bool dirty_listed_ = true;
  // See place_changed(): so many of the dirty ones were placed; `again_` have changed since.
  std::size_t placed_ = 0;
  // How many objects have a group or mask, an owner, are static.
  std::size_t grouped_ = 0, owned_ = 0, static_ = 0;
  WorldSet worlds_;
  float margin_;
};

}  // namespace throng::live
