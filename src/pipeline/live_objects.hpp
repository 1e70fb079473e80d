// Persistent objects in device memory: boxes, filters, ids. Each call synchronizes with the device
// once to learn whether its arguments are valid. A call that is refused or runs out of memory
// changes nothing.
//
// In addition to what pipeline.hpp lists, a Device provides
//   allocate, release, copy(to, from, bytes), read(value)
//   gather(bound, look, tiles)           look(i, pair, compared) for each i below look.count() <=
//                                        bound: the changes, sorted, see live_change_stages.hpp
//   take(value, bytes)                   reads it and zeroes its first bytes
//   launch_and_take(count, f, value, t)  launches, reads the value and zeroes it. *t is zero before
//                                        and after
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/broad_phase.hpp>
#include <throng/options.hpp>

#include "pipeline/block.hpp"
#include "pipeline/failure.hpp"
#include "pipeline/live_object_stages.hpp"
#include "pipeline/pipeline.hpp"

namespace throng::pipeline {

// The reports of a call, in device memory.
struct LiveTold {
  Checked checked;  // zero between calls
  Changed changed;  // pairs
  Report leavers,
      strays;    // objects that left their fat boxes: in this update; since the grid was made
  Report fresh;  // their candidates
  std::uint64_t among;    // pairs of outliers
  std::uint32_t kept;     // candidates that stay
  std::uint32_t tickets;  // zero outside a launch
};

template <class Device>
class LiveObjects {
 public:
  LiveObjects(Device& device, float margin, float fat_margin)
      : device_(device), margin_(margin), fat_margin_(fat_margin) {}

  std::uint32_t limit() const noexcept { return limit_; }
  std::uint32_t count() const noexcept { return count_; }
  // Whether a box differs from the one at the last update; whether one left its fat box; whether
  // all candidates must be found again for another reason.
  bool moved() const noexcept { return moved_; }
  bool left() const noexcept { return left_; }
  bool stale() const noexcept { return stale_; }
  // Whether an object became inactive, was removed or became active again since the last update.
  bool gone() const noexcept { return gone_; }
  bool refiltered() const noexcept {
    return refiltered_;
  }  // whether filters changed since the last update
  // Changes whenever boxes or filters may have changed.
  std::uint64_t version() const noexcept { return version_; }
  Boxes boxes() const noexcept { return with_filters(array<Box>(box_array)); }
  // Until the next settle(): fat boxes are new, and the candidates are of the old ones.
  void set_stale() noexcept { stale_ = true; }

  void add(const Boxes& boxes, ObjectId* ids, bool nan_allowed, Result& r) {
    const std::size_t n = boxes.size();
    const std::uint64_t limit = std::uint64_t{limit_} + n - std::min<std::size_t>(n, free_count_);
    if (limit > max_pipeline_boxes) throw Failure{Status::too_many_boxes, limit};
    if (n != 0) {
      const Set given = make_set(boxes);
      const Checked told = check([&](Checked* t) { device_.launch(n, CheckNew{given, t}); });
      if (!accept(told, nan_allowed, r)) return;
      settle_states();
      want_filters(boxes.filters);
      reserve(static_cast<std::size_t>(limit));
      const auto count = static_cast<std::uint32_t>(n);
      device_.launch(n, AddBoxes{view(), given, array<ObjectId>(free_array), free_count_, ids});
      limit_ = static_cast<std::uint32_t>(limit);
      free_count_ -= std::min(count, free_count_);
      count_ += count;
      moved_ = stale_ = true;
      ++version_;
    }
    r.found = count_;
  }

  void remove(const ObjectId* ids, std::size_t n, Result& r) {
    if (!check_list(ids, n, {}, false, true, r)) return;
    if (n != 0) {
      settle_states();
      want(free_array), want(removed_array);
      device_.launch(n, RemoveList{view(), ids, array<ObjectId>(removed_array) + removed_count_});
      removed_count_ += static_cast<std::uint32_t>(n);
      count_ -= static_cast<std::uint32_t>(n);
      moved_ = gone_ = true;
      ++version_;
    }
    r.found = count_;
  }

  void move(const ObjectId* ids, const Boxes& boxes, bool nan_allowed, Result& r) {
    const Set given = make_set(boxes);
    const bool moved_before = moved_;
    if (!check_list(ids, boxes.size(), given, true, nan_allowed, r)) return;
    if (!moved_before) settle_states();
    ++version_;
    device_.launch(boxes.size(), MoveList{view(), ids, given});
    r.found = count_;
  }

  // boxes.size() is limit().
  void move_all(const Boxes& boxes, bool nan_allowed, Result& r) {
    LiveTold* at = told();
    put_check_all(boxes, at);
    put_move_all(boxes, nan_allowed, at);
    if (accept(take(at).checked, nan_allowed, r)) r.found = count_;
  }
  // The same without synchronization: take() and accept() follow.
  void put_check_all(const Boxes& boxes, LiveTold* at) {
    told_is_clear_ = false;
    unsettled_ = true;
    device_.launch(limit_, CheckAll{view(), make_set(boxes), &at->checked, moved_});
  }
  // Requires that at->changed is zero.
  void put_move_all(const Boxes& boxes, bool nan_allowed, LiveTold* at) {
    const Set given = make_set(boxes);
    ++version_;
    device_.launch(limit_, MoveAll{view(), given, &at->checked, nan_allowed, &at->changed});
  }
  // Whether an object that is alive has a different box; checks nothing else.
  bool differ(const Boxes& boxes, LiveTold* at) {
    const LookForMoves look{view(), make_set(boxes), &at->checked.moved};
    return device_.launch_and_take(look.count(), look, at->checked.moved, &at->tickets) != 0;
  }

  void set_filters(const ObjectId* ids, std::size_t n, const Filters& filters, Result& r) {
    Boxes bare;
    bare.filters = filters;
    const Set given = make_set(bare);
    if (!check_list(ids, n, given, false, true, r)) return;
    if (n != 0) {
      settle_states();
      want_filters(filters);
      device_.launch(n, SetFiltersOfList{view(), ids, given});
      moved_ = stale_ = refiltered_ = true;
      ++version_;
    }
    r.found = count_;
  }

  void shift_origin(const Vec3& by, Result& r) {
    settle_states();
    device_.launch(limit_, ShiftOrigin{view(), by});
    moved_ = stale_ = true;  // rounding can bring fat boxes into contact
    ++version_;
    r.found = count_;
  }

  // Sets result and state after a check; returns false if it refuses.
  bool accept(const Checked& told, bool nan_allowed, Result& r) noexcept {
    const auto refuse = [&](Status status, std::uint64_t count, std::uint32_t mark) {
      r.status = status;
      r.invalid_count = count;
      r.first_invalid = ~mark;
      return false;
    };
    if (told.bad_ids) return refuse(Status::bad_id, told.bad_ids, told.bad_id_mark);
    if (told.bad_worlds) return refuse(Status::bad_filter, told.bad_worlds, told.bad_world_mark);
    if (told.nan_count && !nan_allowed)
      return refuse(Status::nan_box, told.nan_count, told.nan_mark);
    moved_ = moved_ || told.moved;
    left_ = left_ || told.left;
    gone_ = gone_ || told.gone;
    return true;
  }

  // ---- for an update ----------------------------------------------------------------------------

  LiveView view() const noexcept {
    return {array<Box>(box_array),
            array<Box>(fat_array),
            array<std::uint8_t>(state_array),
            array<std::uint32_t>(group_array),
            array<std::uint32_t>(mask_array),
            array<std::int32_t>(owner_array),
            array<std::int32_t>(world_array),
            array<std::uint8_t>(static_array),
            array<std::uint64_t>(mark_array),
            limit_,
            margin_,
            fat_margin_};
  }
  // The zeroed report; take() reads it once the launches have been issued.
  LiveTold* told() {
    told_.room(sizeof(LiveTold));
    if (!told_is_clear_) device_.clear(told_.template as<char>(), sizeof(LiveTold));
    told_is_clear_ = true;
    return told_.template as<LiveTold>();
  }
  LiveTold take(LiveTold* at) {
    const LiveTold seen = device_.take(*at, sizeof at->checked);
    told_is_clear_ = true;
    return seen;
  }
  // Makes the fat boxes again and returns them with the filters: the input of the candidate search.
  Boxes fatten() {
    set_stale();
    device_.launch(limit_, Fatten{view()});
    return with_filters(array<Box>(fat_array));
  }
  // The pairs now match the present boxes. Ids of removed objects become free.
  void settle() {
    if (removed_count_ != 0)
      device_.copy(array<ObjectId>(free_array) + free_count_, array<ObjectId>(removed_array),
                   removed_count_ * sizeof(ObjectId));
    free_count_ += removed_count_;
    removed_count_ = 0;
    unsettled_ = unsettled_ || moved_;
    moved_ = false;
    if (stale_) settle_states();  // a leaving bit must not outlast the update
    left_ = stale_ = gone_ = refiltered_ = false;
  }

  // Copies everything of `other`, on the same device. On a Failure nothing changes.
  void reserve_for(const LiveObjects& other) {
    for (int k = 0; k < array_count; ++k)
      if (other.wanted_[k])
        blocks_[k].grow(other.limit_ * sizes[k], wanted_[k] ? limit_ * sizes[k] : 0);
  }
  void copy(const LiveObjects& other) {
    for (int k = 0; k < array_count; ++k) {
      wanted_[k] = other.wanted_[k];
      if (wanted_[k] && other.limit_)
        device_.copy(blocks_[k].template as<char>(), other.blocks_[k].template as<char>(),
                     other.limit_ * sizes[k]);
    }
    ++version_;
    margin_ = other.margin_;
    fat_margin_ = other.fat_margin_;
    limit_ = other.limit_;
    count_ = other.count_;
    free_count_ = other.free_count_;
    removed_count_ = other.removed_count_;
    token_ = other.token_;
    moved_ = other.moved_;
    unsettled_ = other.unsettled_;
    left_ = other.left_;
    stale_ = other.stale_;
    gone_ = other.gone_;
    refiltered_ = other.refiltered_;
  }

  std::size_t held() const noexcept {
    std::size_t sum = told_.bytes();
    for (const Block<Device>& block : blocks_) sum += block.bytes();
    return sum;
  }

 private:
  enum Array {
    box_array,
    fat_array,
    state_array,
    group_array,
    mask_array,
    owner_array,
    world_array,
    static_array,
    mark_array,
    free_array,
    removed_array
  };
  static constexpr int array_count = removed_array + 1;
  static constexpr std::size_t sizes[array_count] = {
      sizeof(Box), sizeof(Box), 1, 4, 4, 4, 4, 1, sizeof(std::uint64_t), 4, 4};

  template <class T>
  T* array(Array k) const noexcept {
    return wanted_[k] ? blocks_[k].template as<T>() : nullptr;
  }

  // Boxes of all ids, with the objects' filters.
  Boxes with_filters(const Box* boxes) const noexcept {
    Boxes all(boxes, limit_);
    const auto give = [&](auto& column, const auto* values) {
      if (values) column = {values, limit_};
    };
    const LiveView v = view();
    give(all.filters.group, v.group);
    give(all.filters.mask, v.mask);
    give(all.filters.owner, v.owner);
    give(all.filters.world, v.world);
    give(all.filters.is_static, v.is_static);
    return all;
  }

  template <class F>
  Checked check(const F& put) {
    LiveTold* at = told();
    told_is_clear_ = false;
    put(&at->checked);
    return take(at).checked;
  }
  // Runs before the first call after an update that moves objects by a list; CheckAll does it
  // itself.
  void settle_states() {
    if (unsettled_ && !moved_) device_.launch(limit_, Settle{view()});
    if (!moved_) unsettled_ = false;
  }
  // Returns false, with the status, if an id, world or box is invalid; flags moves.
  bool check_list(const ObjectId* ids, std::size_t n, const Set& given, bool has_boxes,
                  bool nan_allowed, Result& r) {
    if (n > count_) {  // some id is repeated or not alive
      r.status = Status::bad_id;
      r.invalid_count = n;
      return false;
    }
    if (n == 0) return true;
    want(mark_array);
    if (++token_ == 0) {
      device_.clear(array<char>(mark_array), limit_ * sizes[mark_array]);
      token_ = 1;
    }
    Checked told = check([&](Checked* t) {
      device_.launch(n, ClaimIds{view(), ids, token_});
      device_.launch(n, CheckList{view(), ids, token_, given, has_boxes, t});
    });
    told.moved = has_boxes;
    return accept(told, nan_allowed, r);
  }

  // Optional arrays are allocated by the first call that needs them.
  void want(Array k) {
    if (wanted_[k]) return;
    blocks_[k].grow(std::max<std::size_t>(limit_, 1) * sizes[k], 0);
    wanted_[k] = true;
    fill(k, 0, limit_);
  }
  void want_filters(const Filters& f) {
    if (f.group) want(group_array);
    if (f.mask) want(mask_array);
    if (f.owner) want(owner_array);
    if (f.world) want(world_array);
    if (f.is_static) want(static_array);
  }
  void reserve(std::size_t limit) {
    for (const Array k : {box_array, fat_array, state_array}) wanted_[k] = true;
    for (int k = 0; k < array_count; ++k)
      if (wanted_[k]) blocks_[k].grow(limit * sizes[k], limit_ * sizes[k]);
    if (wanted_[mark_array]) fill(mark_array, limit_, limit);
  }
  // Sets the values of ids that are older than the array.
  void fill(Array k, std::size_t begin, std::size_t end) {
    if (begin == end) return;
    const bool ones = k == group_array || k == mask_array || k == owner_array || k == world_array;
    if (ones)
      device_.launch(end - begin, Fill<std::uint32_t>{array<std::uint32_t>(k) + begin, ~0u});
    else
      device_.clear(array<char>(k) + begin * sizes[k], (end - begin) * sizes[k]);
  }

  Device& device_;
  Block<Device> blocks_[array_count] = {
      Block<Device>(device_), Block<Device>(device_), Block<Device>(device_),
      Block<Device>(device_), Block<Device>(device_), Block<Device>(device_),
      Block<Device>(device_), Block<Device>(device_), Block<Device>(device_),
      Block<Device>(device_), Block<Device>(device_)};
  Block<Device> told_{device_};
  bool wanted_[array_count] = {};
  float margin_, fat_margin_;
  std::uint32_t limit_ = 0, count_ = 0, free_count_ = 0, removed_count_ = 0;
  std::uint32_t token_ = 0;
  bool moved_ = false, left_ = false, stale_ = false, gone_ = false, refiltered_ = false;
  // Moved bits may be set for objects that did not move since the last update.
  bool unsettled_ = false;
  bool told_is_clear_ = false;
  std::uint64_t version_ = 0;
};

}  // namespace throng::pipeline
