// Throng as an FCL broad-phase manager.
#include <throng/fcl.hpp>

#include <memory>
#include <vector>

#include <fcl/broadphase/default_broadphase_callbacks.h>
#include <fcl/geometry/shape/sphere.h>

#include "check.hpp"

int main() {
  const auto ball = std::make_shared<fcl::Sphered>(1);
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> balls;
  std::vector<fcl::CollisionObjectd*> objects;
  for (int i = 0; i < 100; ++i) {
    balls.push_back(std::make_unique<fcl::CollisionObjectd>(ball));
    balls.back()->setTranslation(fcl::Vector3d(3 * i, 0, 0));
    balls.back()->computeAABB();
    objects.push_back(balls.back().get());
  }
  // snippet-begin: manager
  throng::FclManager<double> manager;  // was: fcl::DynamicAABBTreeCollisionManagerd manager;
  manager.registerObjects(objects);
  manager.setup();
  // snippet-end: manager
  fcl::DefaultCollisionData<double> apart;
  manager.collide(&apart, fcl::DefaultCollisionFunction<double>);
  CHECK(!apart.result.isCollision());

  balls[7]->setTranslation(fcl::Vector3d(25.5, 0, 0));
  balls[7]->computeAABB();
  manager.update(balls[7].get());
  fcl::DefaultCollisionData<double> found;
  manager.collide(&found, fcl::DefaultCollisionFunction<double>);
  CHECK(found.result.isCollision());

  fcl::DefaultDistanceData<double> nearest;
  manager.distance(objects[0], &nearest, fcl::DefaultDistanceFunction<double>);
  CHECK(nearest.result.min_distance <= 1.001);
}
