// Throng in Bullet: the line that changes, options, and a filter callback.
#include <throng/bullet.hpp>

#include <btBulletDynamicsCommon.h>

#include "check.hpp"

namespace {

// Only objects whose ids have the same parity touch.
struct Parity : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    return (a->m_uniqueId + b->m_uniqueId) % 2 == 0;
  }
};

}  // namespace

int main() {
  // snippet-begin: world
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  throng::BulletBroadphase broad_phase;  // was: btDbvtBroadphase broad_phase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broad_phase, &solver, &configuration);
  // snippet-end: world

  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  btBoxShape cube(btVector3(0.5, 0.5, 0.5));
  btRigidBody ground(0, nullptr, &plane);
  world.addRigidBody(&ground);
  btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, &cube, btVector3(1, 1, 1) / 6);
  info.m_startWorldTransform.setOrigin(btVector3(0, 0, 3));
  btRigidBody body(info);
  world.addRigidBody(&body);
  world.setGravity(btVector3(0, 0, -10));
  for (int step = 0; step < 120; ++step) world.stepSimulation(1.0f / 60, 0);
  CHECK(btFabs(body.getWorldTransform().getOrigin().z() - btScalar(0.5)) < btScalar(0.1));

  {
    throng::Options options;
    options.threads = 1;  // or your executor and memory resource
    throng::BulletBroadphase quiet(options);
    CHECK(quiet.phase().options().threads == 1);
  }

  // snippet-begin: filter
  Parity parity;  // called when boxes begin to overlap, and when a refused one moves
  broad_phase.getOverlappingPairCache()->setOverlapFilterCallback(&parity);
  // snippet-end: filter
  world.stepSimulation(1.0f / 60, 0);
  broad_phase.getOverlappingPairCache()->setOverlapFilterCallback(nullptr);

  world.removeRigidBody(&body);
  world.removeRigidBody(&ground);
  CHECK(broad_phase.phase().object_count() == 0);
}
