// Proxies along a line, and the pairs that a broad phase holds in its cache.
#pragma once

#include <set>
#include <utility>

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <gtest/gtest.h>

namespace throng::tests {

using Uids = std::set<std::pair<int, int>>;

inline Uids held(btBroadphaseInterface& phase) {
  Uids pairs;
  const btOverlappingPairCache& cache = *phase.getOverlappingPairCache();
  for (int i = 0; i < cache.getNumOverlappingPairs(); ++i) {
    const btBroadphasePair& p = cache.getOverlappingPairArrayPtr()[i];
    EXPECT_TRUE(pairs.emplace(p.m_pProxy0->m_uniqueId, p.m_pProxy1->m_uniqueId).second);
  }
  return pairs;
}

inline btBroadphaseProxy* add(btBroadphaseInterface& phase, btScalar low, btScalar high) {
  return phase.createProxy(btVector3(low, 0, 0), btVector3(high, 1, 1), 0, nullptr, 1, -1, nullptr);
}
inline void put(btBroadphaseInterface& phase, btBroadphaseProxy* proxy, btScalar low,
                btScalar high) {
  phase.setAabb(proxy, btVector3(low, 0, 0), btVector3(high, 1, 1), nullptr);
}

}  // namespace throng::tests
