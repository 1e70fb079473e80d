// Bullet's btDbvt through its incremental interface: setAabb for each moved box, then its pairs.
#pragma once

#include <cstddef>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include "moving.hpp"

namespace throng::bench {

inline btVector3 to_bullet(const Vec3& v) { return btVector3(v.x, v.y, v.z); }

class BulletTree {
 public:
  explicit BulletTree(bool deferred) { tree_.m_deferedcollide = deferred; }

  // The client object of a proxy is the index of its box.
  void start(const std::vector<Box>& boxes) {
    for (std::size_t i = 0; i < boxes.size(); ++i)
      proxies_.push_back(tree_.createProxy(
          to_bullet(boxes[i].lower), to_bullet(boxes[i].upper), 0, reinterpret_cast<void*>(i),
          btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter, nullptr));
    tree_.calculateOverlappingPairs(nullptr);
  }
  void update(const Moves& moves) {
    for (std::size_t i = 0; i < moves.ids.size(); ++i)
      tree_.setAabb(proxies_[moves.ids[i]], to_bullet(moves.boxes[i].lower),
                    to_bullet(moves.boxes[i].upper), nullptr);
    tree_.calculateOverlappingPairs(nullptr);
  }
  btDbvtBroadphase* operator->() { return &tree_; }
  const btDbvtBroadphase* operator->() const { return &tree_; }

 private:
  btDbvtBroadphase tree_;
  std::vector<btBroadphaseProxy*> proxies_;
};

}  // namespace throng::bench
