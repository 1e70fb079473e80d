// A second broad phase that gets the same boxes as a running world's in each step; both sets of
// pairs are compared. It does not influence the simulation.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include "apps/simulate/world.hpp"

namespace throng::simulate {

class ShadowCompare {
 public:
  // `world` holds all its objects already. `phase` is the kind of `other`; `first_is_throng`
  // describes the world's own.
  ShadowCompare(std::unique_ptr<btBroadphaseInterface> other, Phase phase, bool first_is_throng,
                const btCollisionWorld& world);
  ~ShadowCompare();
  ShadowCompare(const ShadowCompare&) = delete;
  ShadowCompare& operator=(const ShadowCompare&) = delete;

  // After the world's broad phase found its pairs.
  void step(const btBroadphaseInterface& first, Comparison& result);

 private:
  using Key = std::pair<int, int>;
  // Sorted; the cached pairs whose boxes overlap. `surplus` is set to the number of the others.
  static void exact_pairs(const btBroadphaseInterface& phase, std::vector<Key>& out,
                          std::size_t& surplus);

  std::unique_ptr<btBroadphaseInterface> other_;
  Phase phase_;
  bool first_is_throng_;
  const btCollisionWorld& world_;
  std::vector<btBroadphaseProxy*> proxies_;
  std::vector<Key> first_pairs_, other_pairs_, difference_;
};

}  // namespace throng::simulate
