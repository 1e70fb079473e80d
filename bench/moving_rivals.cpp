// Rival: Bullet's btDbvt through its own incremental interface: setAabb for what moves, then its
// pairs. What began and ended it would tell by callbacks of its pair cache, for fat boxes; picking
// out exact changes is left out of its time, which favours Bullet.
#include "moving.hpp"

#if defined(THRONG_BULLET)
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include "bullet_tree.hpp"
#endif

namespace throng::bench {

#if defined(THRONG_BULLET)
namespace {

class Dbvt : public Mover {
 public:
  explicit Dbvt(bool deferred) : tree_(deferred) {}
  std::string name() const override {
    return tree_->m_deferedcollide ? "Bullet btDbvt deferred" : "Bullet btDbvt default";
  }
  void start(const std::vector<Box>& boxes) override { tree_.start(boxes); }
  void frame(const Moves& moves) override { tree_.frame(moves); }
  bool tells_changes() const override { return false; }
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

std::vector<std::unique_ptr<Mover>> moving_rivals() {
  std::vector<std::unique_ptr<Mover>> rivals;
#if defined(THRONG_BULLET)
  for (const bool deferred : {false, true}) rivals.push_back(std::make_unique<Dbvt>(deferred));
#endif
  return rivals;
}

}  // namespace throng::bench
