// What BulletBroadphase does. Include throng/bullet.hpp.
#pragma once

#include <throng/bullet.hpp>

namespace throng {

inline Filter BulletBroadphase::filter_of(const Proxy& proxy) const {
  Filter filter;
  if (asks_) return filter;
  filter.group = static_cast<std::uint32_t>(proxy.m_collisionFilterGroup);
  filter.mask = static_cast<std::uint32_t>(proxy.m_collisionFilterMask);
  return filter;
}

inline btBroadphaseProxy* BulletBroadphase::createProxy(const btVector3& lower,
                                                        const btVector3& upper, int, void* object,
                                                        int group, int mask, btDispatcher*) {
  auto proxy = std::make_unique<Proxy>(lower, upper, object, group, mask);
  proxy->group = group;
  proxy->mask = mask;
  // Whatever can fail comes before what changes anything. Later calls need no memory of their own.
  const std::size_t limit = static_cast<std::size_t>(phase_.id_limit()) + 1;
  if (limit > proxies_.capacity()) {
    const std::size_t room = std::max(2 * proxies_.capacity(), limit);
    moved_.reserve(room);
    moved_boxes_.reserve(room);
    mute_.reserve(room);
    proxies_.reserve(room);
  }
  require(phase_.add(candidate(lower, upper), filter_of(*proxy), proxy->id),
          "a proxy was not added: out of memory, or another thread is in a call");
  if (proxy->id >= proxies_.size()) proxies_.resize(std::size_t{proxy->id} + 1);
  unsure_ += is_unsure(lower, upper);
  proxy->m_uniqueId = ++last_uid_;
  if (proxy->is_mute()) list_mute(*proxy);
  Proxy*& place = proxies_[proxy->id];
  return place = proxy.release();
}

inline void BulletBroadphase::destroyProxy(btBroadphaseProxy* base, btDispatcher* dispatcher) {
  auto* proxy = static_cast<Proxy*>(base);
  require(phase_.remove(proxy->id),
          "a proxy was not destroyed: out of memory, or another thread is in a call");
  if (proxy->moved_in == round_) {
    moved_[proxy->place] = moved_.back();
    moved_boxes_[proxy->place] = moved_boxes_.back();
    proxies_[moved_.back()]->place = proxy->place;
    moved_.pop_back();
    moved_boxes_.pop_back();
  }
  if (proxy->is_mute()) unlist_mute(*proxy);
  unsure_ -= is_unsure(proxy->m_aabbMin, proxy->m_aabbMax);
  proxies_[proxy->id] = nullptr;
  cache_->removeOverlappingPairsContainingProxy(proxy, dispatcher);
  delete proxy;
}

inline void BulletBroadphase::list_mute(Proxy& proxy) {
  proxy.mute_place = mute_.size();
  mute_.push_back(proxy.id);
}
inline void BulletBroadphase::unlist_mute(Proxy& proxy) {
  mute_[proxy.mute_place] = mute_.back();
  proxies_[mute_.back()]->mute_place = proxy.mute_place;
  mute_.pop_back();
}

inline void BulletBroadphase::note_moved(Proxy& proxy) {
  handed_over_ = false;
  const Box box = candidate(proxy.m_aabbMin, proxy.m_aabbMax);
  if (proxy.moved_in == round_) {
    moved_boxes_[proxy.place] = box;
    return;
  }
  proxy.moved_in = round_;
  proxy.place = moved_.size();
  moved_.push_back(proxy.id);
  moved_boxes_.push_back(box);
}

inline void BulletBroadphase::setAabb(btBroadphaseProxy* base, const btVector3& lower,
                                      const btVector3& upper, btDispatcher*) {
  auto& proxy = *static_cast<Proxy*>(base);
  if (proxy.group != proxy.m_collisionFilterGroup || proxy.mask != proxy.m_collisionFilterMask) {
    require(phase_.set_filter(proxy.id, filter_of(proxy)),
            "a filter was not set: out of memory, or another thread is in a call");
    if (proxy.is_mute()) unlist_mute(proxy);
    proxy.group = proxy.m_collisionFilterGroup;
    proxy.mask = proxy.m_collisionFilterMask;
    if (proxy.is_mute()) list_mute(proxy);
    note_moved(proxy);
  }
  // Bullet's worlds tell of all objects in every step, of those at rest as well.
  if (same(lower, proxy.m_aabbMin) && same(upper, proxy.m_aabbMax)) return;
  unsure_ -= is_unsure(proxy.m_aabbMin, proxy.m_aabbMax);
  unsure_ += is_unsure(lower, upper);
  proxy.m_aabbMin = lower;
  proxy.m_aabbMax = upper;
  note_moved(proxy);
}

// A filter callback came or went.
inline void BulletBroadphase::refilter() {
  asks_ = !asks_;
  for (Proxy* proxy : proxies_) {
    if (!proxy) continue;
    require(phase_.set_filter(proxy->id, filter_of(*proxy)),
            "a filter was not set: out of memory, or another thread is in a call");
    note_moved(*proxy);
  }
}

inline void BulletBroadphase::hand_over_moves() {
  if (handed_over_) return;
  require(phase_.move(moved_.data(), Boxes(moved_boxes_)));
  handed_over_ = true;
}

inline void BulletBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher) {
  if (asks_ != (cache_->getOverlapFilterCallback() != nullptr)) refilter();
  hand_over_moves();
  require(phase_.update());
  for (const LivePair& pair : phase_.ended()) {
    Proxy *a = proxies_[pair.first], *b = proxies_[pair.second];
    // Those of a proxy that is no more ended with it.
    if (a && b) cache_->removeOverlappingPair(a, b, dispatcher);
  }
  if (!waiting_.empty()) drop_ended(phase_.ended());
  if (!waiting_.empty() && !moved_.empty()) {
    const auto wants = [this](Pair pair) {
      const Proxy *a = proxies_[pair.first], *b = proxies_[pair.second];
      return !a || !b || ((a->moved_in == round_ || b->moved_in == round_) && offer(pair));
    };
    waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), wants), waiting_.end());
  }
  const std::size_t old = waiting_.size();
  for (const LivePair& pair : phase_.begun()) {
    if (!offer({pair.first, pair.second})) waiting_.push_back({pair.first, pair.second});
  }
  merge_waiting(old);
  if (unsure_ != 0 && !moved_.empty()) part_unsure(dispatcher);
  if (static_cast<std::size_t>(cache_->getNumOverlappingPairs()) + waiting_.size() <
      phase_.pair_count()) {
    restore();
  }
  moved_.clear();
  moved_boxes_.clear();
  ++round_;
}

// To the cache; false where the pair is none of Bullet's, or is refused.
inline bool BulletBroadphase::offer(Pair pair) {
  Proxy &a = *proxies_[pair.first], &b = *proxies_[pair.second];
  if (unsure_ != 0 && !touch(a, b)) return false;
  return cache_->addOverlappingPair(&a, &b) != nullptr;
}

// Both lists are in canonical order.
inline void BulletBroadphase::drop_ended(LivePairs ended) {
  const LivePair* next = ended.begin();
  const auto has_ended = [&](Pair pair) {
    while (next != ended.end() && Pair{next->first, next->second} < pair) ++next;
    return next != ended.end() && Pair{next->first, next->second} == pair;
  };
  std::size_t kept = 0;
  for (const Pair& pair : waiting_) {
    if (!has_ended(pair)) waiting_[kept++] = pair;
  }
  waiting_.resize(kept);
}

// Pairs whose boxes Throng sees touch, as it sees them rounded, and Bullet sees apart.
inline void BulletBroadphase::part_unsure(btDispatcher* dispatcher) {
  const std::size_t old = waiting_.size();
  // From the end: the last pair takes the place of one that is removed.
  for (int i = cache_->getNumOverlappingPairs(); i-- > 0;) {
    const btBroadphasePair& pair = cache_->getOverlappingPairArrayPtr()[i];
    auto *a = static_cast<Proxy*>(pair.m_pProxy0), *b = static_cast<Proxy*>(pair.m_pProxy1);
    if (touch(*a, *b)) continue;
    cache_->removeOverlappingPair(a, b, dispatcher);
    waiting_.push_back({std::min(a->id, b->id), std::max(a->id, b->id)});
  }
  std::sort(waiting_.begin() + static_cast<std::ptrdiff_t>(old), waiting_.end());
  merge_waiting(old);
}

// Pairs that somebody took out of the cache while their boxes overlap.
inline void BulletBroadphase::restore() {
  std::size_t next = 0;
  const std::size_t old = waiting_.size();
  for (const LivePair& live : phase_.pairs()) {
    const Pair pair = {live.first, live.second};
    while (next < old && waiting_[next] < pair) ++next;
    if (next < old && waiting_[next] == pair) continue;
    if (cache_->findPair(proxies_[pair.first], proxies_[pair.second])) continue;
    if (!offer(pair)) waiting_.push_back(pair);
  }
  merge_waiting(old);
}

// Tells of what find(ids) leaves in ids, and of the mute; where it says false, of all.
template <class Ask, class Tell>
void BulletBroadphase::ask(Ask&& find, Tell&& tell) {
  std::vector<ObjectId> ids;
  bool found = false;
  {
    // One question at a time; callbacks may ask others.
    const std::lock_guard<std::mutex> lock(asking_);
    hand_over_moves();
    found = find(ids);
  }
  // A callback may do what it likes with proxies that it was told of.
  for (std::size_t i = 0; found && i < ids.size(); ++i) {
    if (proxies_[ids[i]]) tell(*proxies_[ids[i]]);
  }
  // While a callback filters, Throng knows of no groups.
  for (std::size_t i = 0; found && !asks_ && i < mute_.size(); ++i) tell(*proxies_[mute_[i]]);
  for (std::size_t id = 0; !found && id < proxies_.size(); ++id) {
    if (proxies_[id]) tell(*proxies_[id]);
  }
}

// A sweep that meets all boxes that btRayAabb2 may say are hit: as far as the ray goes by what the
// callback holds, and wider than what that rounds. The numbers that it divides are off by some ulps
// of the coordinates, its quotients by some ulps of themselves, that is of the ray's length.
inline bool BulletBroadphase::sweep_around(const btVector3& from,
                                           const btBroadphaseRayCallback& ray,
                                           const btVector3& lower, const btVector3& upper,
                                           Sweep& out) {
  if (!(ray.m_lambda_max >= 0)) return false;
  btScalar by[3], size = 0;
  for (int k = 0; k < 3; ++k) {
    if (!(lower[k] <= upper[k]) || (ray.m_rayDirectionInverse[k] < 0) != (ray.m_signs[k] == 1)) {
      return false;
    }
    by[k] = ray.m_lambda_max / ray.m_rayDirectionInverse[k];
    size = std::max({size, btFabs(from[k]), btFabs(by[k]), btFabs(lower[k]), btFabs(upper[k])});
  }
  const btScalar pad = 64 * btScalar(std::numeric_limits<float>::epsilon()) * size;
  const btVector3 around(pad, pad, pad);
  out.box = candidate(from + lower - around, from + upper + around);
  out.by = {static_cast<float>(by[0]), static_cast<float>(by[1]), static_cast<float>(by[2])};
  return true;
}

inline void BulletBroadphase::rayTest(const btVector3& from, const btVector3&,
                                      btBroadphaseRayCallback& callback, const btVector3& lower,
                                      const btVector3& upper) {
  const btScalar longest = callback.m_lambda_max;
  ask(
      [&](std::vector<ObjectId>& ids) {
        Sweep sweep;
        if (!sweep_around(from, callback, lower, upper, sweep)) return false;
        if (!phase_.find_hits(&sweep, 1).ok()) return false;
        for (const SweepHit& hit : phase_.hits()) ids.push_back(hit.object);
        return true;
      },
      [&](const Proxy& proxy) {
        const btVector3 corners[2] = {proxy.m_aabbMin - upper, proxy.m_aabbMax - lower};
        btScalar at = 1;
        if (btRayAabb2(from, callback.m_rayDirectionInverse, callback.m_signs, corners, at, 0,
                       longest))
          callback.process(&proxy);
      });
}

inline void BulletBroadphase::aabbTest(const btVector3& lower, const btVector3& upper,
                                       btBroadphaseAabbCallback& callback) {
  ask(
      [&](std::vector<ObjectId>& ids) {
        const Box box = candidate(lower, upper);
        if (!phase_.find_overlaps(Boxes(&box, 1)).ok()) return false;
        for (const Pair& pair : phase_.overlaps()) ids.push_back(pair.second);
        return true;
      },
      [&](const Proxy& proxy) {
        if (TestAabbAgainstAabb2(lower, upper, proxy.m_aabbMin, proxy.m_aabbMax))
          callback.process(&proxy);
      });
}

inline void BulletBroadphase::getBroadphaseAabb(btVector3& lower, btVector3& upper) const {
  lower = upper = btVector3(0, 0, 0);
  bool first = true;
  for (const Proxy* proxy : proxies_) {
    if (!proxy) continue;
    if (first) {
      lower = proxy->m_aabbMin;
      upper = proxy->m_aabbMax;
      first = false;
    }
    lower.setMin(proxy->m_aabbMin);
    upper.setMax(proxy->m_aabbMax);
  }
}

inline void BulletBroadphase::resetPool(btDispatcher*) {
  if (phase_.object_count() != 0) return;
  phase_ = BroadPhase(phase_.options());
  proxies_.clear();
  waiting_.clear();
  last_uid_ = 0;
}

}  // namespace throng
