// Implementation of BulletBroadphase. Include throng/bullet.hpp.
#pragma once

#include <throng/bullet.hpp>

namespace throng {

inline Filter BulletBroadphase::filter_of(const Proxy& proxy) const {
  Filter filter;
  if (has_filter_callback_) return filter;
  filter.group = static_cast<std::uint32_t>(proxy.m_collisionFilterGroup);
  filter.mask = static_cast<std::uint32_t>(proxy.m_collisionFilterMask);
  return filter;
}

// Reserves space for one more proxy, in all lists that may hold it: later calls do not allocate.
inline void BulletBroadphase::reserve_for_one() {
  constexpr std::size_t slots_per_block = 256;
  if (free_slots_.empty()) {
    free_slots_.reserve(slots_per_block * (slot_blocks_.size() + 1));
    slot_blocks_.push_back(std::make_unique<ProxySlot[]>(slots_per_block));
    for (std::size_t i = slots_per_block; i-- > 0;) free_slots_.push_back(&slot_blocks_.back()[i]);
  }
  const std::size_t limit = static_cast<std::size_t>(phase_.id_limit()) + 1;
  if (limit <= proxies_.capacity()) return;
  const std::size_t wanted = std::max(2 * proxies_.capacity(), limit);
  moved_.reserve(wanted);
  moved_boxes_.reserve(wanted);
  excluded_.reserve(wanted);
  states_.reserve(wanted);
  proxies_.reserve(wanted);
}

inline btBroadphaseProxy* BulletBroadphase::createProxy(const btVector3& lower,
                                                        const btVector3& upper, int, void* object,
                                                        int group, int mask, btDispatcher*) {
  reserve_for_one();
  Proxy made(lower, upper, object, group, mask);
  ObjectId id = 0;
  require(phase_.add(candidate(lower, upper), filter_of(made), id),
          "a proxy was not added: out of memory, or another thread is in a call");
  made.m_uniqueId = static_cast<int>(id + 1);
  if (id >= proxies_.size()) {
    proxies_.resize(std::size_t{id} + 1);
    states_.resize(std::size_t{id} + 1);
  }
  states_[id] = {group, mask, 0, 0, 0};
  if (states_[id].is_excluded()) add_excluded(id);
  approximate_count_ += is_approximate(lower, upper);
  proxies_[id] = ::new (free_slots_.back()) Proxy(made);
  free_slots_.pop_back();
  return proxies_[id];
}

inline void BulletBroadphase::destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) {
  const ObjectId id = id_of(*proxy);
  require(phase_.remove(id),
          "a proxy was not destroyed: out of memory, or another thread is in a call");
  const State& state = states_[id];
  if (state.last_move_round == round_) {
    moved_[state.place] = moved_.back();
    moved_boxes_[state.place] = moved_boxes_.back();
    states_[moved_.back()].place = state.place;
    moved_.pop_back();
    moved_boxes_.pop_back();
  }
  if (state.is_excluded()) remove_excluded(id);
  approximate_count_ -= is_approximate(proxy->m_aabbMin, proxy->m_aabbMax);
  const auto part = [&](Proxy* other) { cache_->removeOverlappingPair(proxy, other, dispatcher); };
  const bool cache_unchanged = cache_->getNumOverlappingPairs() == known_pair_count_;
  if (!for_each_partner(*proxy, part))
    cache_->removeOverlappingPairsContainingProxy(proxy, dispatcher);
  known_pair_count_ = cache_unchanged ? cache_->getNumOverlappingPairs() : -1;
  proxies_[id] = nullptr;
  free_slots_.push_back(proxy);  // it came from there, so the list has capacity
}

// Reports all proxies that have a pair with this one in the cache, and some more. Returns false
// without a report if other code has changed the cache, or there are many: then the cache must be
// searched.
template <class Report>
bool BulletBroadphase::for_each_partner(const Proxy& proxy, Report&& report) const {
  const ObjectId id = id_of(proxy);
  if (id >= proxies_.size() || proxies_[id] != &proxy) return false;
  if (cache_->getNumOverlappingPairs() != known_pair_count_) return false;
  if (known_pair_count_ == 0) return true;
  constexpr std::size_t most = 64;
  LivePair pairs[most];
  const std::size_t count = phase_.pairs_of(id, pairs, most);
  if (count > most) return false;
  for (std::size_t i = 0; i < count; ++i) {
    Proxy* const other = proxies_[pairs[i].first == id ? pairs[i].second : pairs[i].first];
    if (other) report(other);
  }
  return true;
}

inline void BulletBroadphase::add_excluded(ObjectId id) {
  states_[id].excluded_index = static_cast<std::uint32_t>(excluded_.size());
  excluded_.push_back(id);
}
inline void BulletBroadphase::remove_excluded(ObjectId id) {
  const std::uint32_t place = states_[id].excluded_index;
  excluded_[place] = excluded_.back();
  states_[excluded_.back()].excluded_index = place;
  excluded_.pop_back();
}

inline void BulletBroadphase::note_moved(Proxy& proxy) {
  moves_flushed_ = false;
  const Box box = candidate(proxy.m_aabbMin, proxy.m_aabbMax);
  const ObjectId id = id_of(proxy);
  State& state = states_[id];
  if (state.last_move_round == round_) {
    moved_boxes_[state.place] = box;
    return;
  }
  state.last_move_round = round_;
  state.place = static_cast<std::uint32_t>(moved_.size());
  moved_.push_back(id);
  moved_boxes_.push_back(box);
}

inline void BulletBroadphase::setAabb(btBroadphaseProxy* base, const btVector3& lower,
                                      const btVector3& upper, btDispatcher*) {
  Proxy& proxy = *base;
  const ObjectId id = id_of(proxy);
  State& state = states_[id];
  if (state.group != proxy.m_collisionFilterGroup || state.mask != proxy.m_collisionFilterMask) {
    require(phase_.set_filter(id, filter_of(proxy)),
            "a filter was not set: out of memory, or another thread is in a call");
    if (state.is_excluded()) remove_excluded(id);
    state.group = proxy.m_collisionFilterGroup;
    state.mask = proxy.m_collisionFilterMask;
    if (state.is_excluded()) add_excluded(id);
    note_moved(proxy);
  }
  // Bullet's worlds pass the boxes of all objects in every step, also of those at rest.
  if (same(lower, proxy.m_aabbMin) && same(upper, proxy.m_aabbMax)) return;
  approximate_count_ -= is_approximate(proxy.m_aabbMin, proxy.m_aabbMax);
  approximate_count_ += is_approximate(lower, upper);
  proxy.m_aabbMin = lower;
  proxy.m_aabbMax = upper;
  note_moved(proxy);
}

// A filter callback was set or removed.
inline void BulletBroadphase::refilter() {
  has_filter_callback_ = !has_filter_callback_;
  for (Proxy* proxy : proxies_) {
    if (!proxy) continue;
    require(phase_.set_filter(id_of(*proxy), filter_of(*proxy)),
            "a filter was not set: out of memory, or another thread is in a call");
    note_moved(*proxy);
  }
}

inline void BulletBroadphase::flush_moves() {
  if (moves_flushed_) return;
  require(phase_.move(moved_.data(), Boxes(moved_boxes_)));
  moves_flushed_ = true;
}

inline void BulletBroadphase::calculateOverlappingPairs(btDispatcher* dispatcher) {
  if (has_filter_callback_ != (cache_->getOverlapFilterCallback() != nullptr)) refilter();
  flush_moves();
  require(phase_.update());
  for (const LivePair& pair : phase_.ended()) {
    Proxy *a = proxies_[pair.first], *b = proxies_[pair.second];
    // Pairs of a destroyed proxy ended with it.
    if (a && b) cache_->removeOverlappingPair(a, b, dispatcher);
  }
  if (!refused_pairs_.empty()) erase_ended(phase_.ended());
  if (!refused_pairs_.empty() && !moved_.empty()) {
    const auto now_accepted = [this](Pair pair) {
      if (!proxies_[pair.first] || !proxies_[pair.second]) return true;
      const bool moved = states_[pair.first].last_move_round == round_ ||
                         states_[pair.second].last_move_round == round_;
      return moved && add_to_cache(pair);
    };
    refused_pairs_.erase(std::remove_if(refused_pairs_.begin(), refused_pairs_.end(), now_accepted),
                         refused_pairs_.end());
  }
  const std::size_t old = refused_pairs_.size();
  for (const LivePair& pair : phase_.begun()) {
    if (!add_to_cache({pair.first, pair.second}))
      refused_pairs_.push_back({pair.first, pair.second});
  }
  merge_refused(old);
  if (approximate_count_ != 0 && !moved_.empty()) remove_false_pairs(dispatcher);
  if (static_cast<std::size_t>(cache_->getNumOverlappingPairs()) + refused_pairs_.size() <
      phase_.pair_count()) {
    restore();
  }
  known_pair_count_ = cache_->getNumOverlappingPairs();
  moved_.clear();
  moved_boxes_.clear();
  ++round_;
}

// Adds to the cache; false if Bullet's comparison or a filter refuses the pair.
inline bool BulletBroadphase::add_to_cache(Pair pair) {
  Proxy &a = *proxies_[pair.first], &b = *proxies_[pair.second];
  if (approximate_count_ != 0 && !touch(a, b)) return false;
  return cache_->addOverlappingPair(&a, &b) != nullptr;
}

// Both lists are sorted.
inline void BulletBroadphase::erase_ended(LivePairs ended) {
  const LivePair* next = ended.begin();
  const auto has_ended = [&](Pair pair) {
    while (next != ended.end() && Pair{next->first, next->second} < pair) ++next;
    return next != ended.end() && Pair{next->first, next->second} == pair;
  };
  std::size_t kept = 0;
  for (const Pair& pair : refused_pairs_) {
    if (!has_ended(pair)) refused_pairs_[kept++] = pair;
  }
  refused_pairs_.resize(kept);
}

// Pairs that overlap as rounded in Throng, but not in Bullet.
inline void BulletBroadphase::remove_false_pairs(btDispatcher* dispatcher) {
  const std::size_t old = refused_pairs_.size();
  // From the end: the last pair replaces a removed one.
  for (int i = cache_->getNumOverlappingPairs(); i-- > 0;) {
    const btBroadphasePair& pair = cache_->getOverlappingPairArrayPtr()[i];
    Proxy *a = pair.m_pProxy0, *b = pair.m_pProxy1;
    if (touch(*a, *b)) continue;
    cache_->removeOverlappingPair(a, b, dispatcher);
    refused_pairs_.push_back({std::min(id_of(*a), id_of(*b)), std::max(id_of(*a), id_of(*b))});
  }
  std::sort(refused_pairs_.begin() + static_cast<std::ptrdiff_t>(old), refused_pairs_.end());
  merge_refused(old);
}

// Pairs that other code removed from the cache while their boxes overlap.
inline void BulletBroadphase::restore() {
  std::size_t next = 0;
  const std::size_t old = refused_pairs_.size();
  for (const LivePair& live : phase_.pairs()) {
    const Pair pair = {live.first, live.second};
    while (next < old && refused_pairs_[next] < pair) ++next;
    if (next < old && refused_pairs_[next] == pair) continue;
    if (cache_->findPair(proxies_[pair.first], proxies_[pair.second])) continue;
    if (!add_to_cache(pair)) refused_pairs_.push_back(pair);
  }
  merge_refused(old);
}

// Reports the ids that find(query, ids) returns, and the excluded proxies; all if it returns false.
template <class FindIds, class Report>
void BulletBroadphase::for_each_candidate(FindIds&& find, Report&& report) {
  std::unique_ptr<BroadPhaseQuery> query;
  {
    // Of several threads the first one passes on the moved boxes.
    const std::lock_guard<std::mutex> lock(query_mutex_);
    flush_moves();
    if (!queries_.empty()) {
      query = std::move(queries_.back());
      queries_.pop_back();
    }
  }
  if (!query) query = std::make_unique<BroadPhaseQuery>(phase_.options());
  std::vector<ObjectId> ids;
  const bool found = find(*query, ids);
  {
    const std::lock_guard<std::mutex> lock(query_mutex_);
    queries_.push_back(std::move(query));
  }
  // A callback may change or destroy proxies that were reported.
  for (std::size_t i = 0; found && i < ids.size(); ++i) {
    if (proxies_[ids[i]]) report(*proxies_[ids[i]]);
  }
  // While a callback filters, Throng has no groups.
  for (std::size_t i = 0; found && !has_filter_callback_ && i < excluded_.size(); ++i)
    report(*proxies_[excluded_[i]]);
  for (std::size_t id = 0; !found && id < proxies_.size(); ++id) {
    if (proxies_[id]) report(*proxies_[id]);
  }
}

// A sweep that hits all boxes that btRayAabb2 may report: as far as the callback's ray, and wider
// by its rounding errors. Its dividends have an error of a few ulps of the coordinates, its
// quotients one of a few ulps of themselves, that is of the ray's length.
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
  for_each_candidate(
      [&](BroadPhaseQuery& query, std::vector<ObjectId>& ids) {
        Sweep sweep;
        if (!sweep_around(from, callback, lower, upper, sweep)) return false;
        if (!query.find_hits(phase_, &sweep, 1).ok()) return false;
        for (const SweepHit& hit : query.hits()) ids.push_back(hit.object);
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
  for_each_candidate(
      [&](BroadPhaseQuery& query, std::vector<ObjectId>& ids) {
        const Box box = candidate(lower, upper);
        if (!query.find_overlaps(phase_, Boxes(&box, 1)).ok()) return false;
        for (const Pair& pair : query.overlaps()) ids.push_back(pair.second);
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
  states_.clear();
  refused_pairs_.clear();
}

}  // namespace throng
