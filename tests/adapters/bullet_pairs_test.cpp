// BulletBroadphase alone: its pair cache matches Bullet's own comparison and filters over all
// proxies. Compiled for Bullet of floats and of doubles.
#include <atomic>
#include <cmath>
#include <limits>
#include <set>
#include <thread>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <gtest/gtest.h>

#include <throng/bullet.hpp>

#include "adapters/bullet_proxies.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

bool touch(const btBroadphaseProxy& a, const btBroadphaseProxy& b) {
  return TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax);
}

// Refuses pairs by its own rule; counts the calls.
struct RefusingFilter : btOverlapFilterCallback {
  int modulus = 3;
  mutable int calls = 0;
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    ++calls;
    return modulus == 0 || (a->m_uniqueId + b->m_uniqueId) % modulus != 0;
  }
};

struct Listener : btBroadphaseAabbCallback {
  std::set<int> uids;
  bool process(const btBroadphaseProxy* proxy) override {
    EXPECT_TRUE(uids.insert(proxy->m_uniqueId).second);
    return false;  // never read
  }
};
struct RayListener : btBroadphaseRayCallback {
  std::set<int> uids;
  RayListener(const btVector3& from, const btVector3& to) {
    btVector3 direction = to - from;
    direction.normalize();
    for (int k = 0; k < 3; ++k) {
      m_rayDirectionInverse[k] =
          direction[k] == 0 ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[k];
      m_signs[k] = m_rayDirectionInverse[k] < 0;
    }
    m_lambda_max = direction.dot(to - from);
  }
  bool process(const btBroadphaseProxy* proxy) override {
    EXPECT_TRUE(uids.insert(proxy->m_uniqueId).second);
    return false;
  }
};

// Of all proxies the pairs that Bullet's own comparisons find.
std::set<int> in_region(const std::vector<btBroadphaseProxy*>& proxies, const btVector3& lower,
                        const btVector3& upper) {
  std::set<int> uids;
  for (const btBroadphaseProxy* p : proxies)
    if (TestAabbAgainstAabb2(lower, upper, p->m_aabbMin, p->m_aabbMax)) uids.insert(p->m_uniqueId);
  return uids;
}
std::set<int> on_ray(const std::vector<btBroadphaseProxy*>& proxies, const btVector3& from,
                     const btBroadphaseRayCallback& ray, const btVector3& grown) {
  std::set<int> uids;
  for (const btBroadphaseProxy* p : proxies) {
    const btVector3 corners[2] = {p->m_aabbMin - grown, p->m_aabbMax + grown};
    btScalar at = 1;
    if (btRayAabb2(from, ray.m_rayDirectionInverse, ray.m_signs, corners, at, 0, ray.m_lambda_max))
      uids.insert(p->m_uniqueId);
  }
  return uids;
}

class RandomCalls {
 public:
  explicit RandomCalls(std::uint64_t seed) : random_(seed) {}

  void step() {
    for (int i = random_.between(0, 12); i > 0; --i) act();
    if (random_.one_in(8)) swap_filter();
    if (random_.one_in(3)) run_queries();  // with an update since, or without
    const Uids before = held(phase_);
    phase_.calculateOverlappingPairs(nullptr);
    Uids wanted;
    for (std::size_t i = 0; i < proxies_.size(); ++i) {
      for (std::size_t j = i + 1; j < proxies_.size(); ++j) {
        btBroadphaseProxy *a = proxies_[i], *b = proxies_[j];
        if (a->m_uniqueId > b->m_uniqueId) std::swap(a, b);
        const std::pair<int, int> uids(a->m_uniqueId, b->m_uniqueId);
        const bool allowed = phase_.getOverlappingPairCache()->needsBroadphaseCollision(a, b);
        // A filter callback is called only for pairs that begin.
        const bool stays = filtered_ && before.count(uids) != 0;
        if (touch(*a, *b) && (allowed || stays)) wanted.insert(uids);
      }
    }
    ASSERT_EQ(held(phase_), wanted);
    total_ += wanted.size();
    run_queries();
  }
  std::size_t total() const { return total_; }

 private:
  // Corners often touch, or are apart by less than float resolution, which doubles resolve.
  btScalar corner() {
    return btScalar(random_.between(-16, 16)) * btScalar(0.25) +
           btScalar(random_.between(-1, 1)) * btScalar(1e-12);
  }
  void place(btVector3& lower, btVector3& upper) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = corner();
      upper[k] = lower[k] + btScalar(random_.between(0, 8)) * btScalar(0.25);
    }
    if (random_.one_in(20)) std::swap(lower[0], upper[0]);
  }
  btBroadphaseProxy* any() {
    return proxies_[random_.below(static_cast<std::uint32_t>(proxies_.size()))];
  }

  void act() {
    btVector3 lower, upper;
    place(lower, upper);
    if (proxies_.empty() || (proxies_.size() < 60 && random_.one_in(4))) {
      const int group = 1 << random_.between(0, 2), mask = random_.one_in(2) ? -1 : 5;
      proxies_.push_back(phase_.createProxy(lower, upper, 0, nullptr, group, mask, nullptr));
      return;
    }
    switch (random_.below(8)) {
      case 0: {
        const std::size_t i = random_.below(static_cast<std::uint32_t>(proxies_.size()));
        const int uid = proxies_[i]->m_uniqueId;
        phase_.destroyProxy(proxies_[i], nullptr);
        proxies_[i] = proxies_.back();
        proxies_.pop_back();
        for (const auto& pair : held(phase_)) ASSERT_TRUE(pair.first != uid && pair.second != uid);
        return;
      }
      case 1: {  // changes need a setAabb, even with the same box
        btBroadphaseProxy* proxy = any();
        proxy->m_collisionFilterMask = random_.between(0, 7);
        const btVector3 low = proxy->m_aabbMin, high = proxy->m_aabbMax;
        phase_.setAabb(proxy, low, high, nullptr);
        return;
      }
      case 2:  // without its knowledge
        phase_.getOverlappingPairCache()->removeOverlappingPairsContainingProxy(any(), nullptr);
        return;
      case 3: {  // by less than float resolution
        btBroadphaseProxy* proxy = any();
        const btVector3 by(btScalar(1e-12), 0, btScalar(-1e-12));
        phase_.setAabb(proxy, proxy->m_aabbMin + by, proxy->m_aabbMax + by, nullptr);
        return;
      }
      default:
        phase_.setAabb(any(), lower, upper, nullptr);
    }
  }

  void swap_filter() {
    filtered_ = !filtered_;
    phase_.getOverlappingPairCache()->setOverlapFilterCallback(filtered_ ? &refusing_filter_
                                                                         : nullptr);
  }

  void run_queries() {
    btVector3 lower, upper;
    place(lower, upper);
    Listener listener;
    phase_.aabbTest(lower, upper, listener);
    EXPECT_EQ(listener.uids, in_region(proxies_, lower, upper));

    const btVector3 from = lower * 3;
    btVector3 to(corner(), corner(), corner());
    if (random_.one_in(3)) to[1] = from[1];  // along faces
    if (random_.one_in(3)) to[2] = from[2];
    if ((to - from).length2() == 0) return;
    const btVector3 grown(btScalar(0.25) * static_cast<btScalar>(random_.below(2)), 0, 0);
    RayListener ray(from, to);
    phase_.rayTest(from, to, ray, -grown, grown);
    EXPECT_EQ(ray.uids, on_ray(proxies_, from, ray, grown));
  }

  Random random_;
  BulletBroadphase phase_;
  RefusingFilter refusing_filter_;
  bool filtered_ = false;
  std::vector<btBroadphaseProxy*> proxies_;
  std::size_t total_ = 0;
};

TEST(BulletPairs, any_sequence_of_calls) {
  std::size_t total = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    RandomCalls calls(seed);
    for (int step = 0; step < 120; ++step) {
      calls.step();
      if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << ", step " << step;
    }
    total += calls.total();
  }
  EXPECT_GT(total, 10000u);  // the test had pairs
}

TEST(BulletPairs, touching_to_the_last_bit) {
  BulletBroadphase phase;
  btBroadphaseProxy *a = add(phase, 0, 1), *b = add(phase, 1, 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  const btScalar next =
      std::nextafter(btScalar(1), btScalar(2));  // of btScalar; not a float in doubles
  put(phase, b, next, 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_TRUE(held(phase).empty());
  put(phase, a, 0, next);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  btVector3 lower, upper;
  phase.getAabb(a, lower, upper);
  EXPECT_EQ(upper.x(), next);
  phase.getBroadphaseAabb(lower, upper);
  EXPECT_EQ(lower.x(), 0);
  EXPECT_EQ(upper.x(), 2);
}

// Ray and region queries from several threads at once; the first one finds moved boxes.
TEST(BulletPairs, concurrent_queries) {
  Random random(5);
  const auto corner = [](Random& r, int limit) {
    const auto c = [&] { return btScalar(r.between(-limit, limit)) * btScalar(0.25); };
    return btVector3(c(), c(), c());
  };
  BulletBroadphase phase;
  std::vector<btBroadphaseProxy*> proxies;
  const btVector3 one(1, 1, 1);
  for (int k = 0; k < 400; ++k) {
    const btVector3 lower = corner(random, 40);
    proxies.push_back(phase.createProxy(lower, lower + one, 0, nullptr, 1, -1, nullptr));
  }
  phase.calculateOverlappingPairs(nullptr);
  for (int round = 0; round < 20; ++round) {
    for (btBroadphaseProxy* p : proxies) {
      const btVector3 lower = corner(random, 40);
      if (random.one_in(1 + round)) phase.setAabb(p, lower, lower + one, nullptr);
    }
    std::atomic<int> wrong{0}, met{0};
    const auto run_queries = [&](std::uint64_t seed) {
      Random mine(seed);
      for (int k = 0; k < 30; ++k) {
        const btVector3 lower = corner(mine, 40), upper = lower + btVector3(3, 2, 4);
        Listener region;
        phase.aabbTest(lower, upper, region);
        wrong += region.uids != in_region(proxies, lower, upper);
        const btVector3 to = lower + corner(mine, 30) + btVector3(btScalar(0.1), 0, 0);
        RayListener ray(lower, to);
        phase.rayTest(lower, to, ray);
        const std::set<int> wanted = on_ray(proxies, lower, ray, btVector3(0, 0, 0));
        wrong += ray.uids != wanted;
        met += static_cast<int>(wanted.size());
      }
    };
    std::vector<std::thread> threads;
    for (std::uint64_t t = 1; t < 4; ++t) threads.emplace_back(run_queries, 10 * t);
    run_queries(0);
    for (std::thread& thread : threads) thread.join();
    ASSERT_EQ(wrong, 0) << "round " << round;
    ASSERT_GT(met, 10);
  }
}

TEST(BulletPairs, a_callback_with_changing_results) {
  BulletBroadphase phase;
  RefusingFilter refusing_filter;
  phase.getOverlappingPairCache()->setOverlapFilterCallback(&refusing_filter);
  btBroadphaseProxy *a = add(phase, 0, 2), *b = add(phase, 1, 3);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_TRUE(held(phase).empty());  // 1 + 2 is a multiple of 3
  EXPECT_EQ(refusing_filter.calls, 1);
  refusing_filter.modulus = 0;
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(refusing_filter.calls, 1);  // neither has moved
  put(phase, a, 0, btScalar(2.5));
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  refusing_filter.modulus = 3;  // begun pairs stay until the boxes separate
  put(phase, a, 0, 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  put(phase, b, 5, 6);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_TRUE(held(phase).empty());
}

TEST(BulletPairs, the_callers_cache) {
  btHashedOverlappingPairCache cache;
  {
    BulletBroadphase phase({}, &cache);
    EXPECT_EQ(phase.getOverlappingPairCache(), &cache);
    add(phase, 0, 2);
    btBroadphaseProxy* b = add(phase, 1, 3);
    phase.calculateOverlappingPairs(nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 1);
    phase.destroyProxy(b, nullptr);
    EXPECT_EQ(cache.getNumOverlappingPairs(), 0);
  }
  btSortedOverlappingPairCache deferred_cache;
  EXPECT_THROW(BulletBroadphase({}, &deferred_cache), Error);
}

TEST(BulletPairs, reset_restores_the_initial_state) {
  BulletBroadphase phase;
  btBroadphaseProxy *a = add(phase, 0, 2), *b = add(phase, 1, 3);
  phase.calculateOverlappingPairs(nullptr);
  phase.resetPool(nullptr);  // no effect while there are proxies
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  phase.destroyProxy(a, nullptr);
  phase.destroyProxy(b, nullptr);
  phase.resetPool(nullptr);
  EXPECT_EQ(phase.phase().id_limit(), 0u);
  btVector3 lower(1, 1, 1), upper(1, 1, 1);
  phase.getBroadphaseAabb(lower, upper);
  EXPECT_EQ(lower.length2() + upper.length2(), 0);
  add(phase, 0, 2);
  add(phase, 1, 3);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
}

TEST(BulletPairs, planes_and_nan) {
  BulletBroadphase phase;
  const btVector3 far(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  phase.createProxy(-far, far, 0, nullptr, 1, -1, nullptr);
  btBroadphaseProxy* b = add(phase, 1, 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
  put(phase, b, std::numeric_limits<btScalar>::quiet_NaN(), 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_TRUE(held(phase).empty());
  put(phase, b, 1, 2);
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase), (Uids{{1, 2}}));
}

TEST(BulletPairs, out_of_memory_loses_no_pair) {
  // Allows `left` more bytes.
  struct LimitedResource : std::pmr::memory_resource {
    std::size_t left = std::size_t{1} << 30;
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
      if (bytes > left) throw std::bad_alloc();
      return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* p, std::size_t bytes, std::size_t alignment) override {
      std::pmr::new_delete_resource()->deallocate(p, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override {
      return this == &other;
    }
  } memory;
  Options options;
  options.memory = &memory;
  BulletBroadphase phase(options);
  std::vector<btBroadphaseProxy*> proxies;
  for (int i = 0; i < 300; ++i) proxies.push_back(add(phase, btScalar(3 * i), btScalar(3 * i + 1)));
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_TRUE(held(phase).empty());
  for (btBroadphaseProxy* proxy : proxies) put(phase, proxy, 0, 1);
  memory.left = 0;
  EXPECT_THROW(phase.calculateOverlappingPairs(nullptr), Error);
  EXPECT_TRUE(held(phase).empty());
  memory.left = std::size_t{1} << 30;
  phase.calculateOverlappingPairs(nullptr);
  EXPECT_EQ(held(phase).size(), 300u * 299u / 2);
}

}  // namespace
}  // namespace throng::tests
