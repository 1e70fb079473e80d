// Implementation of FclManager. Include throng/fcl.hpp.
#pragma once

#include <throng/fcl.hpp>

namespace throng {

template <class S>
void FclManager<S>::registerObjects(const std::vector<Object*>& objects) {
  std::vector<Object*> added;
  std::vector<Box> boxes;
  std::vector<ObjectId> ids(objects.size());
  // Everything that can fail comes before any change.
  const std::size_t count = objects_.size() + objects.size();
  objects_.reserve(count);
  bounds_.reserve(count);
  added.reserve(objects.size());
  boxes.reserve(objects.size());
  try {
    for (Object* object : objects) {
      // Removes duplicates.
      if (!ids_.emplace(object, 0).second) continue;
      added.push_back(object);
      boxes.push_back(candidate(object->getAABB()));
    }
    require(phase_.add(boxes, ids.data()));
  } catch (...) {
    for (Object* object : added) ids_.erase(object);
    throw;
  }
  stale_ = true;
  objects_.resize(static_cast<std::size_t>(phase_.id_limit()), nullptr);
  bounds_.resize(objects_.size());
  for (std::size_t i = 0; i < added.size(); ++i) {
    ids_[added[i]] = ids[i];
    objects_[ids[i]] = added[i];
    bounds_[ids[i]] = added[i]->getAABB();
  }
  if (added.size() != objects.size()) update(objects);
}

template <class S>
void FclManager<S>::unregisterObject(Object* object) {
  const auto found = ids_.find(object);
  if (found == ids_.end()) return;
  const ObjectId id = found->second;
  require(phase_.remove(&id, 1));
  stale_ = true;
  objects_[id] = nullptr;
  ids_.erase(found);
}

template <class S>
void FclManager<S>::update() {
  update_boxes_.resize(objects_.size());
  for (std::size_t id = 0; id < objects_.size(); ++id) {
    if (objects_[id]) update_boxes_[id] = candidate(objects_[id]->getAABB());
  }
  require(phase_.move_all(update_boxes_));
  stale_ = true;
  for (std::size_t id = 0; id < objects_.size(); ++id) {
    if (objects_[id]) bounds_[id] = objects_[id]->getAABB();
  }
  find_pairs();
}

template <class S>
void FclManager<S>::update(const std::vector<Object*>& objects) {
  for (Object* object : objects) {
    const auto found = ids_.find(object);
    if (found == ids_.end()) continue;
    const ObjectId id = found->second;
    const Box box = candidate(object->getAABB());
    require(phase_.move(&id, Boxes(&box, 1)));
    stale_ = true;
    bounds_[id] = object->getAABB();
  }
}

template <class S>
void FclManager<S>::clear() {
  phase_ = BroadPhase(phase_.options());
  pairs_ = {};
  stale_ = false;
  ids_.clear();
  objects_.clear();
  bounds_.clear();
}

template <class S>
void FclManager<S>::getObjects(std::vector<Object*>& out) const {
  out.clear();
  out.reserve(size());
  for (Object* object : objects_) {
    if (object) out.push_back(object);
  }
}

// FCL's users may query after any change, with or without setup().
template <class S>
LivePairs FclManager<S>::find_pairs() const {
  const std::lock_guard<std::mutex> lock(query_mutex_);
  if (stale_) {
    require(phase_.update());
    pairs_ = phase_.pairs();
    stale_ = false;
  }
  return pairs_;
}

template <class S>
void FclManager<S>::find_touched(const std::vector<Box>& boxes, std::vector<Pair>& out) const {
  const std::lock_guard<std::mutex> lock(query_mutex_);
  require(phase_.find_overlaps(boxes));
  out.assign(phase_.overlaps().begin(), phase_.overlaps().end());
}

template <class S>
void FclManager<S>::collide(void* data, fcl::CollisionCallBack<S> callback) const {
  for (const LivePair& pair : find_pairs()) {
    if (!bounds_[pair.first].overlap(bounds_[pair.second])) continue;
    if (callback(objects_[pair.first], objects_[pair.second], data)) return;
  }
}

template <class S>
void FclManager<S>::collide(Object* object, void* data, fcl::CollisionCallBack<S> callback) const {
  const Bounds bounds = object->getAABB();
  std::vector<Pair> found;
  find_touched({candidate(bounds)}, found);
  for (const Pair& pair : found) {
    if (!bounds_[pair.second].overlap(bounds)) continue;
    if (callback(objects_[pair.second], object, data)) return;
  }
}

template <class S>
void FclManager<S>::collide(Base* other, void* data, fcl::CollisionCallBack<S> callback) const {
  if (other == this) return collide(data, callback);
  std::vector<SortedObject> theirs;
  list(other, theirs);
  std::vector<Box> boxes;
  boxes.reserve(theirs.size());
  for (const SortedObject& their : theirs) boxes.push_back(candidate(*their.bounds));
  std::vector<Pair> found;
  find_touched(boxes, found);
  for (const Pair& pair : found) {
    const SortedObject& their = theirs[pair.first];
    if (!bounds_[pair.second].overlap(*their.bounds)) continue;
    if (callback(objects_[pair.second], their.object, data)) return;
  }
}

// For a manager of this class, the boxes of its last update; for others, whose boxes are private,
// the objects' current ones.
template <class S>
void FclManager<S>::list(const Base* other, std::vector<SortedObject>& out) const {
  const bool second = other != this;
  if (const auto* same = dynamic_cast<const FclManager*>(other)) {
    for (std::size_t id = 0; id < same->objects_.size(); ++id) {
      if (same->objects_[id]) out.push_back({same->objects_[id], &same->bounds_[id], second});
    }
    return;
  }
  std::vector<Object*> objects;
  other->getObjects(objects);
  for (Object* object : objects) out.push_back({object, &object->getAABB(), second});
}

template <class S>
void FclManager<S>::distance(Object* object, void* data, fcl::DistanceCallBack<S> callback) const {
  const Bounds bounds = object->getAABB();
  std::vector<std::pair<S, ObjectId>> heap;
  for (std::size_t id = 0; id < objects_.size(); ++id) {
    if (!objects_[id]) continue;
    const S gap = bounds_[id].distance(bounds);
    if (gap >= 0) heap.emplace_back(gap, static_cast<ObjectId>(id));  // false for a NaN
  }
  const auto farther = [](const auto& a, const auto& b) { return a > b; };
  std::make_heap(heap.begin(), heap.end(), farther);
  S nearest = std::numeric_limits<S>::max();
  while (!heap.empty() && heap.front().first < nearest) {
    if (callback(objects_[heap.front().second], object, data, nearest)) return;
    std::pop_heap(heap.begin(), heap.end(), farther);
    heap.pop_back();
  }
}

// By their lower ends along x: after the first that is too far away, all others are, too.
template <class S>
void FclManager<S>::sweep(std::vector<SortedObject>& all, bool across, void* data,
                          fcl::DistanceCallBack<S> callback) {
  // A box with a NaN has no position along x, and no distance.
  const auto has_no_position = [](const SortedObject& n) {
    return !(n.bounds->min_[0] <= n.bounds->max_[0]);
  };
  all.erase(std::remove_if(all.begin(), all.end(), has_no_position), all.end());
  std::stable_sort(all.begin(), all.end(), [](const SortedObject& a, const SortedObject& b) {
    return a.bounds->min_[0] < b.bounds->min_[0];
  });
  S nearest = std::numeric_limits<S>::max();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      if (all[j].bounds->min_[0] - all[i].bounds->max_[0] >= nearest) break;
      if (across && all[i].second == all[j].second) continue;
      if (all[i].bounds->distance(*all[j].bounds) >= nearest) continue;
      const bool reversed = all[i].second;  // this manager's object comes first
      if (callback(all[reversed ? j : i].object, all[reversed ? i : j].object, data, nearest))
        return;
    }
  }
}

template <class S>
void FclManager<S>::distance(void* data, fcl::DistanceCallBack<S> callback) const {
  std::vector<SortedObject> all;
  list(this, all);
  sweep(all, false, data, callback);
}

template <class S>
void FclManager<S>::distance(Base* other, void* data, fcl::DistanceCallBack<S> callback) const {
  if (other == this) return distance(data, callback);
  std::vector<SortedObject> all;
  list(this, all);
  list(other, all);
  sweep(all, true, data, callback);
}

}  // namespace throng
