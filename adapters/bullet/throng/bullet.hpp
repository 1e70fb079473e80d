// Throng as Bullet's broad phase: a BulletBroadphase replaces a btDbvtBroadphase.
//
// Its pairs are those of Bullet's own comparison, TestAabbAgainstAabb2, over the boxes of the
// proxies, in every build: in a Bullet of doubles (BT_USE_DOUBLE_PRECISION) the boxes are rounded
// outward, and the comparison of the doubles decides. Differences from btDbvtBroadphase:
// - Pairs begin and end only in calculateOverlappingPairs(), which every step calls (as in
//   btDbvtBroadphase with m_deferedcollide). A destroyed proxy's pairs end at once.
// - Boxes are not enlarged: a pair and its manifold end in the step in which the boxes separate.
// - Changed groups and masks of a proxy take effect at its next setAabb(); pairs that they exclude
//   end. A filter callback is called when two boxes begin to overlap and, while it refuses, again
//   when one of them moves; a pair that it allowed stays until the overlap ends.
// - A box with a NaN overlaps nothing.
// On failure, such as lack of memory, it throws throng::Error; compiled without exceptions it
// terminates the program.
#pragma once

#include <throng/cpp17.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <type_traits>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <LinearMath/btAabbUtil2.h>

#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>
#include <throng/find_pairs.hpp>

namespace throng {

class BulletBroadphase : public btBroadphaseInterface {
 public:
  // Of the options, isa, threads, executor and memory are used. Without a cache it creates one. A
  // caller's cache must outlive this. It must decide by its filter callback, or without one by
  // groups and masks; and must not defer removals, as btSortedOverlappingPairCache does.
  explicit BulletBroadphase(const Options& options = {}, btOverlappingPairCache* cache = nullptr)
      : phase_(supported_options(options)), cache_(cache) {
    if (!cache) {
      own_cache_ = std::make_unique<Cache>(*this);
      cache_ = own_cache_.get();
    } else if (cache->hasDeferredRemoval()) {
      Result r;
      r.status = Status::bad_option;
      explain(r, "the pair cache defers removals; pass a btHashedOverlappingPairCache, or none");
      fail(r);
    }
  }
  // Bullet's worlds remove their objects before; the remaining proxies are destroyed here.
  ~BulletBroadphase() override = default;
  BulletBroadphase(const BulletBroadphase&) = delete;
  BulletBroadphase& operator=(const BulletBroadphase&) = delete;

  btBroadphaseProxy* createProxy(const btVector3& lower, const btVector3& upper, int /*shape*/,
                                 void* object, int group, int mask, btDispatcher*) override;
  void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;

  void setAabb(btBroadphaseProxy* proxy, const btVector3& lower, const btVector3& upper,
               btDispatcher*) override;
  void getAabb(btBroadphaseProxy* proxy, btVector3& lower, btVector3& upper) const override {
    lower = proxy->m_aabbMin;
    upper = proxy->m_aabbMax;
  }

  void calculateOverlappingPairs(btDispatcher* dispatcher) override;

  // All proxies whose box, grown by a swept shape's box, is hit by btRayAabb2, or overlaps; in id
  // order. Ignores the callback's result, as btDbvtBroadphase does. Thread-safe, if the memory
  // resource of the options is.
  void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& callback,
               const btVector3& lower = btVector3(0, 0, 0),
               const btVector3& upper = btVector3(0, 0, 0)) override;
  void aabbTest(const btVector3& lower, const btVector3& upper,
                btBroadphaseAabbCallback& callback) override;

  btOverlappingPairCache* getOverlappingPairCache() override { return cache_; }
  const btOverlappingPairCache* getOverlappingPairCache() const override { return cache_; }

  // The bounds of all boxes; the origin if there are none.
  void getBroadphaseAabb(btVector3& lower, btVector3& upper) const override;
  // With no proxy left, resets the state: later results do not depend on earlier calls.
  void resetPool(btDispatcher*) override;
  void printStats() override {}

  // The underlying BroadPhase, to inspect: counts, memory, options.
  const BroadPhase& phase() const { return phase_; }

 private:
  // Bullet's class, but it finds the pairs of one proxy without a scan of all.
  class Cache : public btHashedOverlappingPairCache {
   public:
    explicit Cache(const BulletBroadphase& phase) : phase_(phase) {}
    void cleanProxyFromPairs(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override {
      const auto clean = [&](btBroadphaseProxy* other) {
        btBroadphasePair* const pair = findPair(proxy, other);
        if (pair) cleanOverlappingPair(*pair, dispatcher);
      };
      if (!phase_.for_each_partner(*proxy, clean))
        btHashedOverlappingPairCache::cleanProxyFromPairs(proxy, dispatcher);
    }

   private:
    const BulletBroadphase& phase_;
  };

  // Bullet's proxy fills a cache line, and setAabb() is called for every object in every step: so
  // further data is stored separately, by id.
  using Proxy = btBroadphaseProxy;
  struct State {
    int group, mask;                // as passed to Throng
    std::uint32_t place;            // in the list of moved proxies
    std::uint32_t excluded_index;   // in the list of excluded proxies
    std::uint64_t last_move_round;  // the round of its last move

    // No group, or an empty mask: Throng's queries skip it, too.
    bool is_excluded() const { return group == 0 || mask == 0; }
  };
  static ObjectId id_of(const Proxy& proxy) { return static_cast<ObjectId>(proxy.m_uniqueId) - 1; }

  static Options supported_options(Options options) {
    options.nan = NanPolicy::inactive;
    options.margin = 0;
    options.measure_stages = false;
    return options;
  }
  static void explain(Result& r, const char* text) {
    for (std::size_t i = 0; i + 1 < sizeof r.message && text[i]; ++i) r.message[i] = text[i];
  }
  [[noreturn]] static void fail(const Result& r) {
#if defined(__cpp_exceptions) || defined(_CPPUNWIND)
    throw Error(r);
#else
    (void)r;
    std::terminate();
#endif
  }
  static void require(const Result& r) {
    if (!r.ok()) fail(r);
  }
  static void require(Status status, const char* text) {
    if (status == Status::ok) return;
    Result r;
    r.status = status;
    explain(r, text);
    fail(r);
  }

  static bool same(const btVector3& a, const btVector3& b) {
    return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
  }
  static bool touch(const btBroadphaseProxy& a, const btBroadphaseProxy& b) {
    return TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax);
  }
  // Throng's box only yields candidates for Bullet's comparison: it was rounded or reordered.
  static bool is_approximate(const btVector3& lower, const btVector3& upper) {
    return !std::is_same<btScalar, float>::value ||
           !(lower.x() <= upper.x() && lower.y() <= upper.y() && lower.z() <= upper.z());
  }
  // Contains the region between the corners. By Bullet's comparison an inverted box overlaps the
  // boxes that contain its reordered form; a NaN stays, and makes the box inactive.
  static Box candidate(btVector3 lower, btVector3 upper) {
    for (int k = 0; k < 3; ++k) {
      if (lower[k] > upper[k]) std::swap(lower[k], upper[k]);
    }
    return rounded(&lower[0], &upper[0]);
  }
  static Box rounded(const float* lower, const float* upper) {
    return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
  }
  static Box rounded(const double* lower, const double* upper) {
    return round_outward(lower, upper);
  }

  struct alignas(64) ProxySlot {
    unsigned char bytes[sizeof(Proxy)];
  };
  static_assert(std::is_trivially_destructible<Proxy>::value, "");
  void reserve_for_one();

  Filter filter_of(const Proxy& proxy) const;
  void note_moved(Proxy& proxy);
  void add_excluded(ObjectId id);
  void remove_excluded(ObjectId id);
  void flush_moves();
  void refilter();
  template <class Report>
  bool for_each_partner(const Proxy& proxy, Report&& report) const;
  bool add_to_cache(Pair pair);
  void erase_ended(LivePairs ended);
  void remove_false_pairs(btDispatcher* dispatcher);
  void restore();
  template <class FindIds, class Report>
  void for_each_candidate(FindIds&& find, Report&& report);
  static bool sweep_around(const btVector3& from, const btBroadphaseRayCallback& ray,
                           const btVector3& lower, const btVector3& upper, Sweep& out);
  // The first `sorted` of refused_pairs_ are in order, and so are the others.
  void merge_refused(std::size_t sorted) {
    const auto middle = refused_pairs_.begin() + static_cast<std::ptrdiff_t>(sorted);
    std::inplace_merge(refused_pairs_.begin(), middle, refused_pairs_.end());
  }

  BroadPhase phase_;
  std::unique_ptr<Cache> own_cache_;
  btOverlappingPairCache* cache_;
  std::vector<Proxy*> proxies_;  // by id
  std::vector<State> states_;    // by id
  std::vector<std::unique_ptr<ProxySlot[]>> slot_blocks_;
  std::vector<void*> free_slots_;
  std::vector<ObjectId> moved_;
  std::vector<Box> moved_boxes_;
  bool moves_flushed_ = true;  // in Throng
  std::vector<ObjectId> excluded_;
  std::mutex query_mutex_;
  std::vector<std::unique_ptr<BroadPhaseQuery>> queries_;  // no query uses them
  std::uint64_t round_ = 1;
  std::size_t approximate_count_ = 0;  // proxies
  bool has_filter_callback_ =
      false;  // a filter callback decides; else groups and masks do, in Throng
  // Pairs of Throng that the cache does not hold: a filter refused them, or Bullet's comparison
  // rejects them. Sorted.
  std::vector<Pair> refused_pairs_;
  // The cache's pair count after this last changed it; -1 if other code has changed it since the
  // last step.
  int known_pair_count_ = 0;
};

}  // namespace throng

#include <throng/bullet_inl.hpp>
