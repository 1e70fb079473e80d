// The engine's world, except that all boxes are computed before the first is passed on: so few
// clock readings time the broad phase's share.
#pragma once

#include <chrono>
#include <memory>

#include <btBulletDynamicsCommon.h>

#include "apps/simulate/shadow_compare.hpp"

namespace throng::simulate {

using Clock = std::chrono::steady_clock;
inline double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class TimedWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

  void updateAabbs() override {
    corners_.resize(m_collisionObjects.size());
    for (int i = 0; i < corners_.size(); ++i) corners_[i] = box_of(*m_collisionObjects[i]);
    const auto start = Clock::now();
    for (int i = 0; i < corners_.size(); ++i) {
      getBroadphase()->setAabb(m_collisionObjects[i]->getBroadphaseHandle(), corners_[i].lower,
                               corners_[i].upper, m_dispatcher1);
    }
    broad_phase_ms = ms_since(start);
  }

  void computeOverlappingPairs() override {
    const auto start = Clock::now();
    getBroadphase()->calculateOverlappingPairs(m_dispatcher1);
    broad_phase_ms += ms_since(start);
    if (!shadow_compare) return;
    const auto other = Clock::now();
    shadow_compare->step(*getBroadphase(), comparison);
    other_ms = ms_since(other);
  }

  double broad_phase_ms = 0;
  double other_ms = 0;  // outside the broad phase's steps
  std::unique_ptr<ShadowCompare> shadow_compare;
  Comparison comparison;

 private:
  struct Corners {
    btVector3 lower, upper;
  };
  // What btCollisionWorld::updateSingleAabb passes on.
  Corners box_of(const btCollisionObject& object) const {
    Corners c;
    const btVector3 threshold(gContactBreakingThreshold, gContactBreakingThreshold,
                              gContactBreakingThreshold);
    object.getCollisionShape()->getAabb(object.getWorldTransform(), c.lower, c.upper);
    c.lower -= threshold;
    c.upper += threshold;
    if (getDispatchInfo().m_useContinuous && !object.isStaticOrKinematicObject()) {
      Corners ahead;
      object.getCollisionShape()->getAabb(object.getInterpolationWorldTransform(), ahead.lower,
                                          ahead.upper);
      c.lower.setMin(ahead.lower - threshold);
      c.upper.setMax(ahead.upper + threshold);
    }
    return c;
  }
  btAlignedObjectArray<Corners> corners_;
};

}  // namespace throng::simulate
