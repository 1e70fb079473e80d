#include "tracking/objects.hpp"

#include <cstring>
#include <type_traits>

#include "base/packed_box.hpp"

namespace throng::tracking {
namespace {

constexpr Box dead_box = {{1, 1, 1}, {-1, -1, -1}};
// Prefetch distance in loops over all objects and their new boxes.
constexpr std::size_t all_ahead = 64;

}  // namespace

Objects::Objects(base::Memory& memory, float margin) noexcept
    : bodies_(memory),
      flags_(memory),
      filters_(memory),
      dirty_(memory),
      removed_(memory),
      free_(memory),
      changed_again_(memory),
      alive_(memory),
      packed_(memory),
      packed_filters_(memory),
      margin_(margin) {}

void Objects::reserve_more(std::size_t count) {
  const std::size_t fresh = count > free_.size() ? count - free_.size() : 0;
  const std::size_t wanted = limit() + fresh;
  bodies_.reserve(wanted);
  flags_.reserve(wanted);
  filters_.reserve(wanted);
  dirty_.reserve(wanted);
  changed_again_.reserve(wanted);
  removed_.reserve(wanted);
  free_.reserve(wanted);
}

ObjectId Objects::add(const Box& box, const Filter& filter) noexcept {
  ObjectId id;
  if (free_.empty()) {
    id = static_cast<ObjectId>(limit());
    bodies_.push({});
    flags_.push(0);
    filters_.push({});
  } else {
    id = free_.pop();
  }
  bodies_[id] = {box, 0, none};
  flags_[id] |= alive;
  alive_listed_ = false;
  assign_filter(id, filter);
  ++count_;
  if (!is_active(id)) ++inactive_;
  mark_dirty(id);
  return id;
}

void Objects::remove(ObjectId id) noexcept {
  move(id, dead_box);
  --inactive_;
  --count_;
  release_filter(id);
  alive_listed_ = false;
  flags_[id] = static_cast<std::uint8_t>(flags_[id] & ~alive);
  removed_.push(id);
}

// Calls f with a function that returns the memory of box i.
template <class F>
auto with_boxes(const Boxes& boxes, F&& f) {
  const char* packed = boxes.packed_data();
  const std::size_t stride = boxes.stride_bytes();
  if (packed) return f([=](std::size_t i) -> const char& { return packed[i * stride]; });
  return f([&](std::size_t i) { return boxes[i]; });
}

// Returns false if the object, which is alive, already has this box.
inline bool Objects::replace(ObjectId id, const char* box, bool were_all_active,
                             std::int64_t& inactive) noexcept {
  char* const stored = reinterpret_cast<char*>(&bodies_[id].box);
  // Bitwise: values that compare equal, such as -0 and 0, may count as moved.
  if (base::same_in_memory(box, stored)) return false;
  inactive +=
      int{were_all_active || base::active_in_memory(stored)} - int{base::active_in_memory(box)};
  std::memcpy(stored, box, sizeof(Box));
  return true;
}

std::size_t Objects::move_range(const Boxes& boxes, std::size_t begin, std::size_t end,
                                std::int64_t& inactive) noexcept {
  return with_boxes(boxes, [&](auto at) {
    std::size_t fresh = 0;
    std::int64_t more = 0;
    const bool were_all_active = inactive_ == 0;
    for (std::size_t i = begin; i < end; ++i) {
      if constexpr (std::is_reference_v<decltype(at(i))>) base::prefetch_l1(&at(i + all_ahead));
      base::prefetch(bodies_.data() + i + all_ahead);
      const auto& box = at(i);
      const std::uint8_t flags = flags_[i];
      if (!(flags & alive) || !replace(static_cast<ObjectId>(i),
                                       reinterpret_cast<const char*>(&box), were_all_active, more))
        continue;
      fresh += (flags & dirty) == 0;
      flags_[i] = flags | dirty;
    }
    inactive = more;
    return fresh;
  });
}

void Objects::move_listed(const ObjectId* ids, const Boxes& boxes) noexcept {
  with_boxes(boxes, [&](auto at) {
    std::int64_t more = 0;
    const bool were_all_active = inactive_ == 0;
    const std::size_t count = boxes.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (i + ids_ahead < count) prefetch(ids[i + ids_ahead]);
      const auto& box = at(i);
      if (replace(ids[i], reinterpret_cast<const char*>(&box), were_all_active, more))
        mark_dirty(ids[i]);
    }
    inactive_ = static_cast<std::size_t>(static_cast<std::int64_t>(inactive_) + more);
  });
}

bool Objects::has_nan(const Boxes& boxes, std::size_t begin, std::size_t end) noexcept {
  const std::size_t stride = boxes.stride_bytes();
  if (const char* packed = boxes.packed_data())
    return base::nan_in_memory(packed + begin * stride, end - begin, stride);
  bool any = false;
  for (std::size_t i = begin; i < end && !any; ++i) any = base::has_nan(boxes[i]);
  return any;
}

void Objects::count_marked(std::size_t count, std::int64_t inactive) noexcept {
  dirty_count_ += count;
  inactive_ = static_cast<std::size_t>(static_cast<std::int64_t>(inactive_) + inactive);
  if (count != 0) dirty_listed_ = false;
  clear_placed();
}

void Objects::count_filter(const Filter& f, std::size_t one) noexcept {
  if (f.group != 0xffffffffu || f.mask != 0xffffffffu) grouped_ += one;
  if (f.owner != -1) owned_ += one;
  if (f.is_static) static_ += one;
}

void Objects::assign_filter(ObjectId id, const Filter& filter) noexcept {
  filters_[id] = filter;
  count_filter(filter, 1);
  if (filter.world != -1) worlds_.add(filter.world);
  const unsigned below = flags_[id] & ((1u << filter_class_shift) - 1);
  flags_[id] = static_cast<std::uint8_t>(
      unsigned{filter_classes_.add(filter)} << filter_class_shift | below);
}

void Objects::release_filter(ObjectId id) noexcept {
  count_filter(filters_[id], static_cast<std::size_t>(-1));
  if (filters_[id].world != -1) worlds_.remove(filters_[id].world);
  filter_classes_.remove(filter_class(id));
}

void Objects::set_filter(ObjectId id, const Filter& filter) noexcept {
  release_filter(id);
  assign_filter(id, filter);
  mark_dirty(id);
}

void Objects::list_alive() {
  if (alive_listed_) return;
  alive_.clear();
  alive_.reserve(count_);
  for (std::size_t id = 0; id < limit(); ++id) {
    if (flags_[id] & alive) alive_.push(static_cast<ObjectId>(id));
  }
  alive_listed_ = true;
}

Boxes Objects::packed_view() {
  list_alive();
  packed_.reserve_discard(count_);
  packed_filters_.reserve_discard(count_);
  for (const ObjectId id : alive_) {
    packed_.push(bodies_[id]);
    packed_filters_.push(filters_[id]);
  }
  return view_of(packed_.data(), packed_filters_.data(), count_);
}

Boxes Objects::view_of(const Body* bodies, const Filter* f, std::size_t n) const noexcept {
  if (n == 0) return {};
  Boxes v(&bodies->box, n, sizeof(Body));
  if (grouped_) {
    v.filters.group = {&f->group, n, sizeof(Filter)};
    v.filters.mask = {&f->mask, n, sizeof(Filter)};
  }
  if (owned_) v.filters.owner = {&f->owner, n, sizeof(Filter)};
  if (in_worlds()) v.filters.world = {&f->world, n, sizeof(Filter)};
  if (static_) v.filters.is_static = {&f->is_static, n, sizeof(Filter)};
  return v;
}

const PodVector<ObjectId>& Objects::dirty_list() noexcept {
  if (!dirty_listed_) {
    dirty_.clear();
    for (std::size_t id = 0; id < limit(); ++id) {
      if (flags_[id] & dirty) dirty_.push(static_cast<ObjectId>(id));
    }
    dirty_listed_ = true;
  }
  return dirty_;
}

void Objects::clear_dirty() noexcept {
  if (dirty_listed_) {
    for (const ObjectId id : dirty_) flags_[id] = static_cast<std::uint8_t>(flags_[id] & ~dirty);
  } else {
    for (std::uint8_t& f : flags_) f = static_cast<std::uint8_t>(f & ~dirty);
  }
  dirty_.clear();
  clear_placed();
  dirty_count_ = 0;
  dirty_listed_ = true;
  for (const ObjectId id : removed_) free_.push(id);
  removed_.clear();
}

void Objects::reserve_for(const Objects& other) {
  bodies_.reserve(other.limit());
  flags_.reserve(other.limit());
  filters_.reserve(other.limit());
  dirty_.reserve(other.limit());
  changed_again_.reserve(other.limit());
  removed_.reserve(other.limit());
  free_.reserve(other.limit());
}

void Objects::copy(const Objects& other) noexcept {
  bodies_.copy(other.bodies_);
  flags_.copy(other.flags_);
  filters_.copy(other.filters_);
  filter_classes_ = other.filter_classes_;
  dirty_.copy(other.dirty_);
  removed_.copy(other.removed_);
  free_.copy(other.free_);
  count_ = other.count_;
  inactive_ = other.inactive_;
  dirty_count_ = other.dirty_count_;
  dirty_listed_ = other.dirty_listed_;
  alive_listed_ = false;
  clear_placed();
  grouped_ = other.grouped_;
  owned_ = other.owned_;
  worlds_ = other.worlds_;
  static_ = other.static_;
  margin_ = other.margin_;
}

}  // namespace throng::tracking
