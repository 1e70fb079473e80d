#include "apps/simulate/shadow_compare.hpp"

#include <algorithm>
#include <iterator>

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btAabbUtil2.h>

namespace throng::simulate {

ShadowCompare::ShadowCompare(std::unique_ptr<btBroadphaseInterface> other, Phase phase,
                             bool first_is_throng, const btCollisionWorld& world)
    : other_(std::move(other)), phase_(phase), first_is_throng_(first_is_throng), world_(world) {
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const btBroadphaseProxy& p = *objects[i]->getBroadphaseHandle();
    proxies_.push_back(other_->createProxy(
        p.m_aabbMin, p.m_aabbMax, objects[i]->getCollisionShape()->getShapeType(), objects[i],
        p.m_collisionFilterGroup, p.m_collisionFilterMask, nullptr));
  }
}

// btDbvtBroadphase does not destroy the remaining proxies.
ShadowCompare::~ShadowCompare() {
  other_->getOverlappingPairCache()->getOverlappingPairArray().clear();
  if (phase_ == Phase::axis_sweep) return;
  for (btBroadphaseProxy* proxy : proxies_) other_->destroyProxy(proxy, nullptr);
}

void ShadowCompare::exact_pairs(const btBroadphaseInterface& phase, std::vector<Key>& out,
                                std::size_t& surplus) {
  out.clear();
  surplus = 0;
  const btOverlappingPairCache& cache = *phase.getOverlappingPairCache();
  const auto index = [](const btBroadphaseProxy& proxy) {
    return static_cast<const btCollisionObject*>(proxy.m_clientObject)->getUserIndex();
  };
  for (int i = 0; i < cache.getNumOverlappingPairs(); ++i) {
    const btBroadphasePair& pair = cache.getOverlappingPairArrayPtr()[i];
    const btBroadphaseProxy &a = *pair.m_pProxy0, &b = *pair.m_pProxy1;
    if (TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax)) {
      const int first = index(a), second = index(b);
      out.emplace_back(std::min(first, second), std::max(first, second));
    } else {
      ++surplus;
    }
  }
  std::sort(out.begin(), out.end());
}

void ShadowCompare::step(const btBroadphaseInterface& first, Comparison& result) {
  const btCollisionObjectArray& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const btBroadphaseProxy& p = *objects[i]->getBroadphaseHandle();
    other_->setAabb(proxies_[static_cast<std::size_t>(i)], p.m_aabbMin, p.m_aabbMax, nullptr);
  }
  other_->calculateOverlappingPairs(nullptr);
  std::size_t first_surplus = 0, other_surplus = 0;
  exact_pairs(first, first_pairs_, first_surplus);
  exact_pairs(*other_, other_pairs_, other_surplus);
  const auto count_missing = [this](const std::vector<Key>& from, const std::vector<Key>& in) {
    difference_.clear();
    std::set_difference(from.begin(), from.end(), in.begin(), in.end(),
                        std::back_inserter(difference_));
    return difference_.size();
  };
  result.pairs = first_pairs_.size();
  result.missing = count_missing(first_pairs_, other_pairs_);
  result.extra = count_missing(other_pairs_, first_pairs_);
  // Throng does not enlarge boxes: all its pairs overlap.
  if (first_is_throng_) result.extra += first_surplus;
  if (phase_ == Phase::throng) result.extra += other_surplus;
}

}  // namespace throng::simulate
