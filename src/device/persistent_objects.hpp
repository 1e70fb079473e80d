// Persistent objects in device memory: boxes, filters, ids. Each call synchronizes with the device
// once to learn whether its arguments are valid. A call that is refused or runs out of memory
// changes nothing.
//
// In addition to what pipeline.hpp lists, a Device provides
//   allocate, release, held(), copy(to, from, bytes), read(value)
//   sort_bytes(n), sort(...)             as in engine.hpp
//   scan_bytes(n), scan(values, n)       exclusive sums in place, in the scratch memory of
//                                        use_scratch(); their scratch size
//   gather(bound, test, tiles)           test(i, pair, compared) for each i below test.count() <=
//                                        bound: the changes, sorted, see pair_event_stages.hpp
//   take(value, bytes)                   reads it and zeroes its first bytes
//   launch_and_read(count, f, value, t)  launches, reads the value and zeroes it. *t is zero before
//                                        and after
#pragma once

#include <algorithm>
#include <cstdint>

#include <throng/broad_phase.hpp>
#include <throng/options.hpp>

#include "device/device_buffer.hpp"
#include "device/failure.hpp"
#include "device/object_stages.hpp"
#include "device/pipeline.hpp"

namespace throng::device {

// The reports of a call, in device memory.
struct UpdateReport {
  CheckReport checked;  // zero between calls
  EventCounts changed;  // pairs
  Report escaped,
      outliers;  // objects that left their fat boxes: in this update; since the grid was made
  Report fresh;  // their candidates
  std::uint64_t outlier_pairs;  // pairs of outliers
  std::uint32_t kept;           // candidates that stay
  std::uint32_t tickets;        // zero outside a launch
};

template <class Device>
class PersistentObjects {
 public:
  PersistentObjects(Device& device, float margin, float fat_margin)
      : device_(device), margin_(margin), fat_margin_(fat_margin) {}

  std::uint32_t limit() const noexcept { return limit_; }
  std::uint32_t count() const noexcept { return count_; }
  // Whether a box differs from the one at the last update; whether one left its fat box; whether
  // all candidates must be found again for another reason.
  bool moved() const noexcept { return moved_; }
  bool left() const noexcept { return left_; }
  bool stale() const noexcept { return stale_; }
  // Whether an object became inactive, was removed or became active again since the last update.
  bool activity_changed() const noexcept { return activity_changed_; }
  // Whether filters changed since the last update.
  bool filters_changed() const noexcept { return filters_changed_; }
  // Changes whenever boxes or filters may have changed.
  std::uint64_t version() const noexcept { return version_; }
  Boxes boxes() const noexcept { return with_filters(array<Box>(box_array)); }
  // Until the next finish_update(): fat boxes are new, and the candidates are of the old ones.
  void set_stale() noexcept { stale_ = true; }

  void add(const Boxes& boxes, ObjectId* ids, bool nan_allowed, Result& r) {
    const std::size_t n = boxes.size();
    const std::uint64_t limit = std::uint64_t{limit_} + n - std::min<std::size_t>(n, free_count_);
    if (limit > max_pipeline_boxes) throw Failure{Status::too_many_boxes, limit};
    if (n != 0) {
      const Set given = make_set(boxes);
      const CheckReport report = check([&](CheckReport* t) {
        device_.launch(n, CheckNew{given, t});
      });
      if (!accept(report, nan_allowed, r)) return;
      clear_moved_bits();
      ensure_filters(boxes.filters);
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
      clear_moved_bits();
      ensure_array(free_array), ensure_array(removed_array);
      device_.launch(n, RemoveList{view(), ids, array<ObjectId>(removed_array) + removed_count_});
      removed_count_ += static_cast<std::uint32_t>(n);
      count_ -= static_cast<std::uint32_t>(n);
      moved_ = activity_changed_ = true;
      ++version_;
    }
    r.found = count_;
  }

  void move(const ObjectId* ids, const Boxes& boxes, bool nan_allowed, Result& r) {
    const Set given = make_set(boxes);
    const bool moved_before = moved_;
    if (!check_list(ids, boxes.size(), given, true, nan_allowed, r)) return;
    if (!moved_before) clear_moved_bits();
    ++version_;
    device_.launch(boxes.size(), MoveList{view(), ids, given});
    r.found = count_;
  }

  // boxes.size() is limit().
  void move_all(const Boxes& boxes, bool nan_allowed, Result& r) {
    UpdateReport* at = report();
    launch_check_all(boxes, at);
    launch_move_all(boxes, nan_allowed, at);
    if (accept(take(at).checked, nan_allowed, r)) r.found = count_;
  }
  // The same without synchronization: take() and accept() follow.
  void launch_check_all(const Boxes& boxes, UpdateReport* at) {
    report_is_clear_ = false;
    stale_moved_bits_ = true;
    device_.launch(limit_, CheckAll{view(), make_set(boxes), &at->checked, moved_});
  }
  // Requires that at->changed is zero.
  void launch_move_all(const Boxes& boxes, bool nan_allowed, UpdateReport* at) {
    const Set given = make_set(boxes);
    ++version_;
    device_.launch(limit_, MoveAll{view(), given, &at->checked, nan_allowed, &at->changed});
  }
  // Whether an object that is alive has a different box; checks nothing else.
  bool differ(const Boxes& boxes, UpdateReport* at) {
    const FindMoved find_moved{view(), make_set(boxes), &at->checked.moved};
    return device_.launch_and_read(find_moved.count(), find_moved, at->checked.moved,
                                   &at->tickets) != 0;
  }

  void set_filters(const ObjectId* ids, std::size_t n, const Filters& filters, Result& r) {
    Boxes bare;
    bare.filters = filters;
    const Set given = make_set(bare);
    if (!check_list(ids, n, given, false, true, r)) return;
    if (n != 0) {
      clear_moved_bits();
      ensure_filters(filters);
      device_.launch(n, SetListFilters{view(), ids, given});
      moved_ = stale_ = filters_changed_ = true;
      ++version_;
    }
    r.found = count_;
  }

  void shift_origin(const Vec3& by, Result& r) {
    clear_moved_bits();
    device_.launch(limit_, ShiftOrigin{view(), by});
    moved_ = stale_ = true;  // rounding can bring fat boxes into contact
    ++version_;
    r.found = count_;
  }

  // Sets result and state after a check; returns false if it refuses.
  bool accept(const CheckReport& report, bool nan_allowed, Result& r) noexcept {
    const auto refuse = [&](Status status, std::uint64_t count, std::uint32_t mark) {
      r.status = status;
      r.invalid_count = count;
      r.first_invalid = ~mark;
      return false;
    };
    if (report.bad_ids) return refuse(Status::bad_id, report.bad_ids, report.bad_id_mark);
    if (report.bad_worlds)
      return refuse(Status::bad_filter, report.bad_worlds, report.bad_world_mark);
    if (report.nan_count && !nan_allowed)
      return refuse(Status::nan_box, report.nan_count, report.nan_mark);
    moved_ = moved_ || report.moved;
    left_ = left_ || report.left;
    activity_changed_ = activity_changed_ || report.activity_changed;
    return true;
  }

  // ---- for an update ----------------------------------------------------------------------------

  ObjectView view() const noexcept {
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
  UpdateReport* report() {
    report_.ensure(sizeof(UpdateReport));
    if (!report_is_clear_) device_.clear(report_.template as<char>(), sizeof(UpdateReport));
    report_is_clear_ = true;
    return report_.template as<UpdateReport>();
  }
  UpdateReport take(UpdateReport* at) {
    const UpdateReport seen = device_.take(*at, sizeof at->checked);
    report_is_clear_ = true;
    return seen;
  }
  // Makes the fat boxes again and returns them with the filters: the input of the candidate search.
  Boxes fatten() {
    set_stale();
    device_.launch(limit_, Fatten{view()});
    return with_filters(array<Box>(fat_array));
  }
  // The pairs now match the present boxes. Ids of removed objects become free.
  void finish_update() {
    if (removed_count_ != 0)
      device_.copy(array<ObjectId>(free_array) + free_count_, array<ObjectId>(removed_array),
                   removed_count_ * sizeof(ObjectId));
    free_count_ += removed_count_;
    removed_count_ = 0;
    stale_moved_bits_ = stale_moved_bits_ || moved_;
    moved_ = false;
    if (stale_) clear_moved_bits();  // an escaped_bit must not outlast the update
    left_ = stale_ = activity_changed_ = filters_changed_ = false;
  }

  // For copy() of `other`, on the same device. On a Failure nothing changes.
  void reserve_for(const PersistentObjects& other) {
    for (int k = 0; k < array_count; ++k)
      if (other.allocated_[k])
        blocks_[k].grow(other.limit_ * sizes[k], allocated_[k] ? limit_ * sizes[k] : 0);
  }
  void copy(const PersistentObjects& other) {
    for (int k = 0; k < array_count; ++k) {
      allocated_[k] = other.allocated_[k];
      if (allocated_[k] && other.limit_)
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
    stale_moved_bits_ = other.stale_moved_bits_;
    left_ = other.left_;
    stale_ = other.stale_;
    activity_changed_ = other.activity_changed_;
    filters_changed_ = other.filters_changed_;
  }

  std::size_t held() const noexcept {
    std::size_t sum = report_.bytes();
    for (const DeviceBuffer<Device>& block : blocks_) sum += block.bytes();
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
    return allocated_[k] ? blocks_[k].template as<T>() : nullptr;
  }

  // Boxes of all ids, with the objects' filters.
  Boxes with_filters(const Box* boxes) const noexcept {
    Boxes all(boxes, limit_);
    const auto give = [&](auto& column, const auto* values) {
      if (values) column = {values, limit_};
    };
    const ObjectView v = view();
    give(all.filters.group, v.group);
    give(all.filters.mask, v.mask);
    give(all.filters.owner, v.owner);
    give(all.filters.world, v.world);
    give(all.filters.is_static, v.is_static);
    return all;
  }

  template <class F>
  CheckReport check(const F& launch) {
    UpdateReport* at = report();
    report_is_clear_ = false;
    launch(&at->checked);
    return take(at).checked;
  }
  // Runs before the first call after an update that moves objects by a list; CheckAll does it
  // itself.
  void clear_moved_bits() {
    if (stale_moved_bits_ && !moved_) device_.launch(limit_, ClearMoved{view()});
    if (!moved_) stale_moved_bits_ = false;
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
    ensure_array(mark_array);
    if (++token_ == 0) {
      device_.clear(array<char>(mark_array), limit_ * sizes[mark_array]);
      token_ = 1;
    }
    CheckReport report = check([&](CheckReport* t) {
      device_.launch(n, ClaimIds{view(), ids, token_});
      device_.launch(n, CheckList{view(), ids, token_, given, has_boxes, t});
    });
    report.moved = has_boxes;
    return accept(report, nan_allowed, r);
  }

  // Optional arrays are allocated by the first call that needs them.
  void ensure_array(Array k) {
    if (allocated_[k]) return;
    blocks_[k].grow(std::max<std::size_t>(limit_, 1) * sizes[k], 0);
    allocated_[k] = true;
    fill(k, 0, limit_);
  }
  void ensure_filters(const Filters& f) {
    if (f.group) ensure_array(group_array);
    if (f.mask) ensure_array(mask_array);
    if (f.owner) ensure_array(owner_array);
    if (f.world) ensure_array(world_array);
    if (f.is_static) ensure_array(static_array);
  }
  void reserve(std::size_t limit) {
    for (const Array k : {box_array, fat_array, state_array}) allocated_[k] = true;
    for (int k = 0; k < array_count; ++k)
      if (allocated_[k]) blocks_[k].grow(limit * sizes[k], limit_ * sizes[k]);
    if (allocated_[mark_array]) fill(mark_array, limit_, limit);
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
  DeviceBuffer<Device> blocks_[array_count] = {
      DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_),
      DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_),
      DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_),
      DeviceBuffer<Device>(device_), DeviceBuffer<Device>(device_)};
  DeviceBuffer<Device> report_{device_};
  bool allocated_[array_count] = {};
  float margin_, fat_margin_;
  std::uint32_t limit_ = 0, count_ = 0, free_count_ = 0, removed_count_ = 0;
  std::uint32_t token_ = 0;
  bool moved_ = false, left_ = false, stale_ = false, activity_changed_ = false,
       filters_changed_ = false;
  // Moved bits may be set for objects that did not move since the last update.
  bool stale_moved_bits_ = false;
  bool report_is_clear_ = false;
  std::uint64_t version_ = 0;
};

}  // namespace throng::device
