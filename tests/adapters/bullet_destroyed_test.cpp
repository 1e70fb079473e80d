// Destroyed proxies: their pairs leave the cache at once, even after other code has changed it.
// Compiled for Bullet of floats and of doubles.
#include <iterator>
#include <vector>

#include <gtest/gtest.h>

#include <throng/bullet.hpp>

#include "adapters/bullet_proxies.hpp"

namespace throng::tests {
namespace {

// At once, and only its own.
TEST(BulletDestroyed, destroying_removes_its_pairs) {
  for (const int others : {5, 63, 64, 65, 200}) {
    BulletBroadphase phase;
    btBroadphaseProxy* const middle = add(phase, 0, btScalar(others));
    std::vector<btBroadphaseProxy*> around;
    for (int i = 0; i < others; ++i) around.push_back(add(phase, btScalar(i), btScalar(i + 1)));
    phase.calculateOverlappingPairs(nullptr);
    Uids want = held(phase);
    ASSERT_EQ(want.size(), static_cast<std::size_t>(2 * others - 1));
    const auto drop = [&](btBroadphaseProxy* proxy) {
      const int uid = proxy->m_uniqueId;
      for (auto it = want.begin(); it != want.end();)
        it = it->first == uid || it->second == uid ? want.erase(it) : std::next(it);
      phase.destroyProxy(proxy, nullptr);
      return held(phase) == want;
    };
    EXPECT_TRUE(drop(around[1]));
    EXPECT_TRUE(drop(around[2]));  // one of whose pairs ended with the last
    EXPECT_TRUE(drop(middle));
    EXPECT_EQ(want.size(), static_cast<std::size_t>(others - 4));
    phase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(held(phase), want);
  }
}

TEST(BulletDestroyed, destroying_removes_foreign_pairs) {
  BulletBroadphase phase;
  btBroadphaseProxy *a = add(phase, 0, 1), *b = add(phase, 5, 6), *c = add(phase, 5, 7);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{2, 3}}));
  phase.getOverlappingPairCache()->addOverlappingPair(a, b);
  phase.destroyProxy(a, nullptr);
  EXPECT_EQ(held(phase), (Uids{{2, 3}}));
  phase.getOverlappingPairCache()->removeOverlappingPair(b, c, nullptr);
  phase.destroyProxy(c, nullptr);
  EXPECT_TRUE(held(phase).empty());
}

// As at program end: without them a world's destructor scans all pairs for each object. The cache's
// hash table keeps its size, so no lookup is possible.
TEST(BulletDestroyed, pairs_removed_by_the_caller) {
  BulletBroadphase phase;
  std::vector<btBroadphaseProxy*> all;
  for (int i = 0; i < 40; ++i) all.push_back(add(phase, btScalar(i), btScalar(i + 1)));
  phase.calculateOverlappingPairs(nullptr);
  ASSERT_EQ(held(phase).size(), 39u);
  btOverlappingPairCache& cache = *phase.getOverlappingPairCache();
  cache.getOverlappingPairArray().clear();
  for (btBroadphaseProxy* proxy : all) {
    cache.cleanProxyFromPairs(proxy, nullptr);
    phase.destroyProxy(proxy, nullptr);
  }
  EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
}

}  // namespace
}  // namespace throng::tests
