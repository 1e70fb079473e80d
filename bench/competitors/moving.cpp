// Bullet's btDbvt through its incremental interface: setAabb for each moved box, then its pairs. It
// would report begin and end events by callbacks of its pair cache, for enlarged boxes. Selecting
// the exact events is not timed, which favours Bullet.
#include "moving.hpp"

#if defined(THRONG_BULLET)
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include "bullet_tree.hpp"
#endif

namespace throng::bench {

#if defined(THRONG_BULLET)
namespace {

class Dbvt : public MovingMethod {
 public:
  explicit Dbvt(bool deferred) : tree_(deferred) {}
  std::string name() const override {
    return tree_->m_deferedcollide ? "Bullet btDbvt, deferred" : "Bullet btDbvt, default";
  }
  void start(const std::vector<Box>& boxes) override { tree_.start(boxes); }
  void update(const Moves& moves) override { tree_.update(moves); }
  bool reports_changes() const override { return false; }
  void changes(std::vector<Pair>& pairs, std::vector<Pair>&) override {
    const auto& cache = *tree_->getOverlappingPairCache();
    const btBroadphasePair* p = cache.getOverlappingPairArrayPtr();
    for (int k = 0; k < cache.getNumOverlappingPairs(); ++k) {
      const auto a = reinterpret_cast<std::size_t>(p[k].m_pProxy0->m_clientObject);
      const auto b = reinterpret_cast<std::size_t>(p[k].m_pProxy1->m_clientObject);
      pairs.push_back(ordered(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)));
    }
  }

 private:
  BulletTree tree_;
};

}  // namespace
#endif

std::vector<std::unique_ptr<MovingMethod>> moving_competitors() {
  std::vector<std::unique_ptr<MovingMethod>> all;
#if defined(THRONG_BULLET)
  for (const bool deferred : {false, true}) all.push_back(std::make_unique<Dbvt>(deferred));
#endif
  return all;
}

}  // namespace throng::bench
