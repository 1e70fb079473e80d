// Public API of BroadPhase: validates all arguments before it changes anything.
#include <cmath>
#include <utility>

#include "broad_phase_state.hpp"

namespace throng {

using tracking::ids_ahead;
using tracking::load_filter;
using tracking::none;

namespace {

using Access = BroadPhaseAccess;
using capture::Operation;

LivePairs view(const tracking::PodVector<LivePair>& pairs) noexcept {
  return {pairs.data(), pairs.size()};
}

// Whether all ids are alive and unique.
bool valid_ids(tracking::Objects& objects, const ObjectId* ids, std::size_t count,
               Result& r) noexcept {
  if (count != 0 && !ids) {
    set_message(r, "the array of ids is null; pass the address of %llu ids", ull{count});
    r.invalid_count = count;
    return refuse(r, Status::bad_id);
  }
  bool dead = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (i + ids_ahead < count) objects.prefetch_flags(ids[i + ids_ahead]);
    if (objects.mark_listed(ids[i])) continue;
    if (r.invalid_count++ == 0) {
      r.first_invalid = i;
      dead = !objects.is_alive(ids[i]);
    }
  }
  for (std::size_t i = 0; i < count; ++i) objects.clear_listed(ids[i]);
  if (r.invalid_count == 0) return true;
  set_message(
      r, "%llu ids are invalid, the first is id %u at index %llu of the list: it %s",
      ull{r.invalid_count}, ids[r.first_invalid], ull{r.first_invalid},
      dead ? "is not alive; use ids that add() returned" : "occurs twice; give each id once");
  return refuse(r, Status::bad_id);
}

// Hash of reported pairs, stored in captures.
std::uint64_t hash_of(std::uint64_t sum, const LivePairs& pairs) noexcept {
  for (const LivePair& pair : pairs) {
    sum = capture::chain(sum, std::uint64_t{pair.first} << 32 | pair.second);
    sum = capture::chain(sum, pair.slot);
  }
  return capture::chain(sum, pairs.size());
}

// Each value repeated for all elements.
Filters filters_of(const Filter& f) noexcept {
  return {{&f.group, 1}, {&f.mask, 1}, {&f.owner, 1}, {&f.world, 1}, {&f.is_static, 1}};
}

}  // namespace

BroadPhase::~BroadPhase() { Access::destroy(*this); }
BroadPhase::BroadPhase(const BroadPhase& other) : options_(other.options_) {
  const Result r = copy_from(other);
  if (r.ok()) return;
  this->~BroadPhase();
  throw Error(r);
}
BroadPhase& BroadPhase::operator=(const BroadPhase& other) {
  if (this == &other) return *this;
  const Result r = copy_from(other);
  if (!r.ok()) throw Error(r);
  return *this;
}
BroadPhase::BroadPhase(BroadPhase&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)), options_(other.options_) {}
BroadPhase& BroadPhase::operator=(BroadPhase&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  return *this;
}

Result BroadPhase::copy_from(const BroadPhase& other) noexcept {
  if (this == &other) return {};
  return Access::call(*this, [&](tracking::Tracker& own, Result& r) {
    if (!other.state_) {
      own.copy(tracking::Tracker(state_->resource, other.options_.margin, 0));
    } else if (!other.state_->guard.try_lock()) {
      set_message(r, "another thread is in a call on the BroadPhase to be copied");
      r.status = Status::busy;
      return;
    } else {
      struct Leave {
        SharedGuard& guard;
        ~Leave() { guard.unlock(); }
      } const leave{other.state_->guard};
      own.reserve_for(other.state_->tracker);
      own.copy(other.state_->tracker);
    }
    options_.margin = other.options_.margin;
    r.found = own.objects().count();
    if (capture::Log& log = Access::log(*this)) {
      log.begin(Operation::restart, 1, 0, 0, {options_.margin, 0, 0});
      log.boxes(own.objects().view());
      log.list(own.objects().limit(), [&](std::size_t id) { return own.objects().is_alive(id); });
    }
  });
}

Result BroadPhase::add(const Boxes& boxes, ObjectId* ids) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    tracking::Objects& objects = tracker.mutable_objects();
    if (!valid(boxes, r)) return;
    if (!valid_floats(boxes, options_, all_boxes, r)) return;
    if (boxes.size() > max_box_count - objects.limit()) {
      set_message(r, "%llu boxes plus %llu existing ids exceed %llu; remove some first",
                  ull{boxes.size()}, ull{objects.limit()}, ull{max_box_count});
      r.status = Status::too_many_boxes;
      return;
    }
    capture::Log& log = Access::log(*this);
    log.begin(Operation::add, 1);
    log.boxes(boxes);
    objects.reserve_more(boxes.size());
    std::uint64_t checksum = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      Filter filter;
      load_filter(filter, boxes.filters, i);
      const ObjectId id = objects.add(boxes[i], filter);
      if (ids) ids[i] = id;
      if (log) checksum = capture::chain(checksum, id);
    }
    log.set_checksum(checksum);
    r.found = objects.count();
  });
}

Status BroadPhase::add(const Box& box, const Filter& filter, ObjectId& id) noexcept {
  Boxes boxes(&box, 1);
  boxes.filters = filters_of(filter);
  return add(boxes, &id).status;
}

ObjectId BroadPhase::add(const Box& box, const Filter& filter) {
  Boxes boxes(&box, 1);
  boxes.filters = filters_of(filter);
  ObjectId id = none;
  const Result r = add(boxes, &id);
  if (!r.ok()) throw Error(r);
  return id;
}

Result BroadPhase::remove(const ObjectId* ids, std::size_t count) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    tracking::Objects& objects = tracker.mutable_objects();
    if (!valid_ids(objects, ids, count, r)) return;
    Access::log(*this).begin(Operation::remove, 0);
    Access::log(*this).ids(ids, count);
    for (std::size_t i = 0; i < count; ++i) {
      if (i + ids_ahead < count) objects.prefetch(ids[i + ids_ahead]);
      objects.remove(ids[i]);
    }
    r.found = objects.count();
  });
}
Status BroadPhase::remove(ObjectId id) noexcept { return remove(&id, 1).status; }

Result BroadPhase::move(const ObjectId* ids, const Boxes& boxes) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    tracking::Objects& objects = tracker.mutable_objects();
    Boxes unfiltered = boxes;
    unfiltered.filters = {};
    if (!valid(unfiltered, r)) return;
    if (!valid_ids(objects, ids, boxes.size(), r)) return;
    if (!valid_floats(boxes, options_, all_boxes, r)) {
      if (r.status == Status::nan_box) {
        set_message(
            r,
            "%llu boxes have a NaN, the first is box %llu of the list, for id %u, and none was "
            "moved; fix them, or treat them as inactive by Options::nan",
            ull{r.invalid_count}, ull{r.first_invalid}, ids[r.first_invalid]);
      }
      return;
    }
    Access::log(*this).begin(Operation::move, 1);
    Access::log(*this).ids(ids, boxes.size());
    Access::log(*this).boxes(unfiltered);
    objects.move_listed(ids, unfiltered);
    r.found = objects.count();
  });
}
Status BroadPhase::move(ObjectId id, const Box& box) noexcept {
  return move(&id, Boxes(&box, 1)).status;
}

Result BroadPhase::move_all(const Boxes& boxes) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    const tracking::Objects& objects = tracker.objects();
    Boxes unfiltered = boxes;
    unfiltered.filters = {};
    if (!valid(unfiltered, r)) return;
    if (boxes.size() != objects.limit()) {
      set_message(r, "%llu boxes were given; give one for every id below id_limit(), which is %llu",
                  ull{boxes.size()}, ull{objects.limit()});
      r.status = Status::bad_boxes;
      return;
    }
    const auto alive = [&](std::size_t id) { return objects.is_alive(id); };
    if (!valid_floats(boxes, options_, alive, r)) return;
    Access::log(*this).begin(Operation::move_all, 1);
    Access::log(*this).boxes(unfiltered);
    tracker.move_all(boxes, options_);
    r.found = objects.count();
  });
}

Result BroadPhase::set_filters(const ObjectId* ids, std::size_t count,
                               const Filters& filters) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    tracking::Objects& objects = tracker.mutable_objects();
    if (!valid_ids(objects, ids, count, r)) return;
    constexpr Box some{};
    Boxes stand_in(&some, count, 0);  // one box, repeated; only the filters matter
    stand_in.filters = filters;
    if (!valid(stand_in, r)) return;
    Access::log(*this).begin(Operation::set_filters, 1);
    Access::log(*this).ids(ids, count);
    Access::log(*this).boxes(stand_in);
    for (std::size_t i = 0; i < count; ++i) {
      Filter filter = objects.filter(ids[i]);
      load_filter(filter, filters, i);
      objects.set_filter(ids[i], filter);
    }
    r.found = objects.count();
  });
}
Status BroadPhase::set_filter(ObjectId id, const Filter& filter) noexcept {
  return set_filters(&id, 1, filters_of(filter)).status;
}

Result BroadPhase::shift_origin(const Vec3& by) noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    if (!std::isfinite(by.x) || !std::isfinite(by.y) || !std::isfinite(by.z)) {
      set_message(r,
                  "the shift of origin (%g, %g, %g) is not finite; give at most 3.4e38 a component",
                  static_cast<double>(by.x), static_cast<double>(by.y), static_cast<double>(by.z));
      r.status = Status::bad_option;
      return;
    }
    Access::log(*this).begin(Operation::shift_origin, 0, 0, 0, by);
    tracking::Objects& objects = tracker.mutable_objects();
    for (std::size_t i = 0; i < objects.limit(); ++i) {
      if (!objects.is_alive(i)) continue;
      const auto id = static_cast<ObjectId>(i);
      objects.move(id, base::shifted(objects.body(id).box, by));
    }
    r.found = objects.count();
  });
}

Result BroadPhase::update() noexcept {
  return Access::call(*this, [&](tracking::Tracker& tracker, Result& r) {
    capture::Log& log = Access::log(*this);
    log.begin(Operation::update, 0);
    tracker.update(options_, r);
    if (log) log.set_checksum(hash_of(hash_of(0, begun()), ended()));
  });
}

LivePairs BroadPhase::begun() const noexcept {
  return state_ ? view(state_->tracker.pairs().begun()) : LivePairs{};
}
LivePairs BroadPhase::ended() const noexcept {
  return state_ ? view(state_->tracker.pairs().ended()) : LivePairs{};
}
LivePairs BroadPhase::pairs() noexcept {
  if (!state_) return {};
  return view(state_->tracker.pairs().sorted(state_->tracker.objects().limit()));
}

std::size_t BroadPhase::pairs_of(ObjectId id, LivePair* out, std::size_t capacity) const noexcept {
  return state_ ? state_->tracker.pairs_of(id, out, capacity) : 0;
}

bool BroadPhase::is_alive(ObjectId id) const noexcept {
  const tracking::Objects* objects = Access::objects(*this);
  return objects && objects->is_alive(id);
}
Box BroadPhase::box(ObjectId id) const noexcept { return Access::objects(*this)->body(id).box; }
Filter BroadPhase::filter(ObjectId id) const noexcept { return Access::objects(*this)->filter(id); }
std::uint64_t BroadPhase::object_count() const noexcept {
  return state_ ? Access::objects(*this)->count() : 0;
}
std::uint64_t BroadPhase::pair_count() const noexcept {
  return state_ ? Access::pairs(*this)->count() : 0;
}
std::uint64_t BroadPhase::id_limit() const noexcept {
  return state_ ? Access::objects(*this)->limit() : 0;
}
std::uint64_t BroadPhase::slot_limit() const noexcept {
  return state_ ? Access::pairs(*this)->slot_limit() : 0;
}
std::size_t BroadPhase::memory_bytes() const noexcept {
  return state_ ? state_->tracker.memory().held() : 0;
}

}  // namespace throng
