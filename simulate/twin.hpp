// A second broad phase beside that of a running world: it is given the same boxes in each step, and
// both sets of pairs are compared. It moves nothing.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

#include "simulate/world.hpp"

namespace throng::simulate {

class Twin {
 public:
  // `world` is whole: all its objects are added. `phase` is what `other` is; `first_is_throng`
  // tells of the world's own.
  Twin(std::unique_ptr<btBroadphaseInterface> other, Phase phase, bool first_is_throng,
       const btCollisionWorld& world);
  ~Twin();
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  // After the first one has found its pairs.
  void step(const btBroadphaseInterface& first, Comparison& told);

 private:
  using Key = std::pair<int, int>;
  // Sorted; those of the cache whose boxes overlap. `surplus` becomes how many others there are.
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
