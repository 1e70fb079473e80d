// Reference model of BroadPhase: a list of objects, a double loop before and after each update, and
// sets. Shares no code with the library, only the public types.
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "support/reference.hpp"

namespace throng::tests {

// The result of shift_origin() for a box: both corners plus `by`; an inactive box stays inactive.
inline Box shifted_box(Box b, const Vec3& by) {
  const auto along = [](float& lower, float& upper, float d) {
    const bool inverted = lower > upper;
    lower += d;
    upper += d;
    if (inverted && lower <= upper) upper = std::nextafter(upper, -INFINITY);
  };
  along(b.lower.x, b.upper.x, by.x);
  along(b.lower.y, b.upper.y, by.y);
  along(b.lower.z, b.upper.z, by.z);
  return b;
}

class Model {
 public:
  explicit Model(float margin = 0) : margin_(margin) {}

  struct Object {
    Box box;
    Filter filter;
  };

  bool alive(ObjectId id) const { return id < objects_.size() && objects_[id].has_value(); }
  std::size_t count() const { return ids().size(); }
  std::vector<ObjectId> ids() const {
    std::vector<ObjectId> all;
    for (std::size_t id = 0; id < objects_.size(); ++id)
      if (objects_[id]) all.push_back(static_cast<ObjectId>(id));
    return all;
  }
  std::size_t limit() const { return objects_.size(); }
  Object& at(ObjectId id) { return *objects_[id]; }
  const Object& at(ObjectId id) const { return *objects_[id]; }

  // The id that the library assigns next: the most recently freed one, otherwise the next number.
  ObjectId free_id() const {
    return free_.empty() ? static_cast<ObjectId>(objects_.size()) : free_.back();
  }
  // The library chooses the id, but it must be free.
  testing::AssertionResult add(ObjectId id, const Box& box, const Filter& filter) {
    if (alive(id)) return testing::AssertionFailure() << "id " << id << " is in use";
    if (std::count(removed_.begin(), removed_.end(), id))
      return testing::AssertionFailure() << "id " << id << " is reused before its end was reported";
    if (id > objects_.size()) return testing::AssertionFailure() << "ids leave gaps at " << id;
    if (id == objects_.size()) objects_.emplace_back();
    objects_[id] = Object{box, filter};
    free_.erase(std::remove(free_.begin(), free_.end(), id), free_.end());
    return testing::AssertionSuccess();
  }
  void remove(ObjectId id) {
    objects_[id].reset();
    removed_.push_back(id);
  }
  void update() {
    const std::set<std::pair<ObjectId, ObjectId>> before = pairs_;
    pairs_.clear();
    free_.insert(free_.end(), removed_.begin(), removed_.end());
    removed_.clear();
    // Read with the model's own code.
    std::vector<ObjectId> id;
    std::vector<Item> items;
    inactive_ = 0;
    for (ObjectId i : ids()) {
      const Object& o = at(i);
      Boxes one(&o.box, 1);
      one.filters = {{&o.filter.group, 1},
                     {&o.filter.mask, 1},
                     {&o.filter.owner, 1},
                     {&o.filter.world, 1},
                     {&o.filter.is_static, 1}};
      const Item item = read_items(one, margin_)[0];
      inactive_ += !item.active;
      if (!item.active) continue;
      id.push_back(i);
      items.push_back(item);
    }
    const std::size_t n = items.size();
    for (std::uint32_t i = 0; i < n; ++i)
      for (std::uint32_t j = i; (j = next_overlap(items[i], items.data(), j + 1, n)) < n;)
        pairs_.insert({id[i], id[j]});
    begun_.clear();
    ended_.clear();
    for (const auto& p : pairs_)
      if (!before.count(p)) begun_.push_back({p.first, p.second});
    for (const auto& p : before)
      if (!pairs_.count(p)) ended_.push_back({p.first, p.second});
  }
  std::vector<Pair> pairs() const {
    std::vector<Pair> all;
    for (const auto& p : pairs_) all.push_back({p.first, p.second});
    return all;
  }

  // Checks the Result of a call that changed objects, or of the update after the model's: every
  // field but times, comparisons and plan, which the library may choose.
  testing::AssertionResult check_call(const Result& r) const { return check(r, count(), 0, 0); }
  testing::AssertionResult check_update(const Result& r) const {
    return check(r, pairs_.size(), pairs_.size(), inactive_);
  }
  // Of a query.
  static testing::AssertionResult check_query(const Result& r, std::uint64_t found) {
    return check(r, found, found, 0);
  }
  std::size_t inactive() const { return inactive_; }

  // Compares all results of the last update except slots. An Implementation is a BroadPhase or
  // a class with the same calls.
  template <class Implementation>
  testing::AssertionResult check_results(Implementation& b) const {
    if (testing::AssertionResult r = same(b.ended(), ended_, "ended"); !r) return r;
    if (testing::AssertionResult r = same(b.begun(), begun_, "begun"); !r) return r;
    if (b.pair_count() != pairs_.size())
      return testing::AssertionFailure() << b.pair_count() << " pairs counted";
    if (b.object_count() != count() || b.id_limit() != limit())
      return testing::AssertionFailure() << b.object_count() << " objects";
    return same(b.pairs(), pairs(), "pairs");
  }
  // The same, with pairs() only if wanted; and checks slots across updates.
  template <class Implementation>
  testing::AssertionResult check(Implementation& b, bool compare_pairs = true) {
    if (testing::AssertionResult r = same(b.ended(), ended_, "ended"); !r) return r;
    if (testing::AssertionResult r = same(b.begun(), begun_, "begun"); !r) return r;
    std::set<std::uint32_t> ended_now;
    for (const LivePair& p : b.ended()) {
      const auto it = slots_.find(p.slot);
      if (it == slots_.end() || it->second != Pair{p.first, p.second})
        return testing::AssertionFailure()
               << "ended reports slot " << p.slot << ", which belongs to another pair";
      slots_.erase(it);
      ended_now.insert(p.slot);
    }
    for (const LivePair& p : b.begun()) {
      if (ended_now.count(p.slot))
        return testing::AssertionFailure() << "slot " << p.slot << " ends and begins at once";
      if (p.slot >= b.slot_limit())
        return testing::AssertionFailure() << "slot " << p.slot << " is beyond the limit";
      if (!slots_.insert({p.slot, Pair{p.first, p.second}}).second)
        return testing::AssertionFailure() << "slot " << p.slot << " is taken";
    }
    max_slots_ = std::max(max_slots_, slots_.size() + ended_now.size());
    if (b.slot_limit() > max_slots_)
      return testing::AssertionFailure()
             << b.slot_limit() << " slots where " << max_slots_ << " suffice";
    if (!compare_pairs) return testing::AssertionSuccess();
    if (testing::AssertionResult r = check_results(b); !r) return r;
    for (const LivePair& p : b.pairs())
      if (const auto it = slots_.find(p.slot);
          it == slots_.end() || it->second != Pair{p.first, p.second})
        return testing::AssertionFailure()
               << "a pair has slot " << p.slot << ", which belongs to another pair";
    return testing::AssertionSuccess();
  }
  // Pairs of one object; requires check() after each update.
  testing::AssertionResult check_pairs_of(const BroadPhase& b, ObjectId id) const {
    std::vector<Pair> want;
    for (const auto& p : pairs_)
      if (p.first == id || p.second == id) want.push_back({p.first, p.second});
    std::vector<LivePair> got(want.size());
    const std::size_t count = b.pairs_of(id, got.data(), got.size());
    if (count != want.size())
      return testing::AssertionFailure() << count << " pairs of " << id << ", not " << want.size();
    for (const LivePair& p : got)
      if (const auto it = slots_.find(p.slot);
          it == slots_.end() || it->second != Pair{p.first, p.second})
        return testing::AssertionFailure() << "a pair of " << id << " at slot " << p.slot;
    return same({got.data(), got.size()}, want, "pairs of one object");
  }

 private:
  static testing::AssertionResult check(const Result& r, std::uint64_t found, std::uint64_t written,
                                        std::uint64_t inactive) {
    if (r.status != Status::ok)
      return testing::AssertionFailure() << to_string(r.status) << ": " << r.message;
    if (r.message[0] != 0) return testing::AssertionFailure() << "message: " << r.message;
    if (r.found != found || r.written != written)
      return testing::AssertionFailure() << "found " << r.found << " and wrote " << r.written
                                         << ", not " << found << " and " << written;
    if (r.inactive != inactive)
      return testing::AssertionFailure() << r.inactive << " inactive, not " << inactive;
    if (r.first_invalid != 0 || r.invalid_count != 0 || r.bytes_needed != 0)
      return testing::AssertionFailure()
             << r.invalid_count << " invalid, the first " << r.first_invalid << ", "
             << r.bytes_needed << " bytes needed, of a call that succeeded";
    if (!r.plan.reason) return testing::AssertionFailure() << "the plan has no reason";
    return testing::AssertionSuccess();
  }
  static testing::AssertionResult same(const LivePairs& got, const std::vector<Pair>& want,
                                       const char* what) {
    std::vector<Pair> pairs;
    for (const LivePair& p : got) pairs.push_back({p.first, p.second});
    if (pairs == want) return testing::AssertionSuccess();
    if (!std::is_sorted(pairs.begin(), pairs.end()))
      return testing::AssertionFailure() << what << " are not in order";
    return testing::AssertionFailure() << what << ": " << same_pairs(pairs, want).message();
  }

  float margin_;
  std::vector<std::optional<Object>> objects_;
  std::vector<ObjectId> removed_, free_;
  std::set<std::pair<ObjectId, ObjectId>> pairs_;
  std::vector<Pair> begun_, ended_;
  std::map<std::uint32_t, Pair> slots_;
  std::size_t max_slots_ = 0, inactive_ = 0;
};

}  // namespace throng::tests
