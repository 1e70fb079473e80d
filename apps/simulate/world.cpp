#include "apps/simulate/world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <throng/bullet.hpp>

#include "apps/simulate/timed_world.hpp"

namespace throng::simulate {
namespace {

std::unique_ptr<btBroadphaseInterface> make_phase(Phase phase, const Spec& spec,
                                                  const std::vector<Placement>& placements) {
  if (phase == Phase::throng) return std::make_unique<BulletBroadphase>(spec.options);
  if (phase == Phase::dbvt) return std::make_unique<btDbvtBroadphase>();
  // Quantized between bounds; beyond them all boxes would overlap: space for a heap to spread.
  double side = 0, top = 0;
  for (const Placement& p : placements) {
    side = std::max({side, std::abs(p.at[0]), std::abs(p.at[1])});
    top = std::max(top, p.at[2]);
  }
  const auto wide = static_cast<btScalar>(2 * (side + top) + 10);
  return std::make_unique<bt32BitAxisSweep3>(
      btVector3(-wide, -wide, -10), btVector3(wide, wide, static_cast<btScalar>(top + 10)),
      static_cast<unsigned>(spec.objects) + 2, nullptr, true);
}

std::unique_ptr<btCollisionShape> make_shape(Shape shape) {
  const Extent e = extent(shape);
  if (shape == Shape::sphere) return std::make_unique<btSphereShape>(btScalar(e.x / 2));
  return std::make_unique<btBoxShape>(
      btVector3(btScalar(e.x / 2), btScalar(e.y / 2), btScalar(e.z / 2)));
}

btDefaultCollisionConstructionInfo pools(std::size_t objects) {
  btDefaultCollisionConstructionInfo info;
  // What does not fit is allocated singly.
  const std::size_t pairs = std::clamp<std::size_t>(4 * objects, 4096, std::size_t{1} << 18);
  info.m_defaultMaxPersistentManifoldPoolSize = static_cast<int>(pairs);
  info.m_defaultMaxCollisionAlgorithmPoolSize = static_cast<int>(pairs);
  return info;
}

Vec3 point(const btVector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

const std::vector<std::string>& phase_names() {
  static const std::vector<std::string> names = {"throng", "dbvt", "axis-sweep"};
  return names;
}
const char* to_string(Phase phase) {
  return phase_names()[static_cast<std::size_t>(phase)].c_str();
}

struct World::Engine {
  Engine(const Spec& spec, const std::vector<Placement>& placements)
      : phase(spec.phase),
        configuration(pools(spec.objects)),
        dispatcher(&configuration),
        shape(make_shape(spec.shape)),
        broad_phase(make_phase(spec.phase, spec, placements)),
        world(&dispatcher, broad_phase.get(), &solver, &configuration),
        boxes(spec.objects) {
    world.setGravity(btVector3(0, 0, -10));
    add(ground, 0, {{0, 0, 0}, {0, 0, 0, 1}}, -1);
    for (std::size_t i = 0; i < placements.size(); ++i) {
      add(*shape, 1, placements[i], static_cast<int>(i));
    }
    if (spec.compare) {
      const Phase other = spec.phase == Phase::throng ? Phase::dbvt : Phase::throng;
      world.shadow_compare = std::make_unique<ShadowCompare>(
          make_phase(other, spec, placements), other, spec.phase == Phase::throng, world);
    }
  }

  // Destruction removes the objects one by one and scans all pairs for each: so clear the pairs
  // first.
  ~Engine() {
    btOverlappingPairCache& cache = *broad_phase->getOverlappingPairCache();
    for (int i = 0; i < cache.getNumOverlappingPairs(); ++i) {
      cache.cleanOverlappingPair(cache.getOverlappingPairArray()[i], &dispatcher);
    }
    cache.getOverlappingPairArray().clear();
    // The handles of an axis sweep are in one array; each removal moves past all others.
    for (auto& body : bodies) {
      if (phase == Phase::axis_sweep) body->setBroadphaseHandle(nullptr);
    }
  }

  void add(btCollisionShape& of, btScalar mass, const Placement& p, int index) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) of.calculateLocalInertia(mass, inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &of, inertia);
    const auto s = [](double x) { return static_cast<btScalar>(x); };
    info.m_startWorldTransform.setRotation(
        btQuaternion(s(p.turn[0]), s(p.turn[1]), s(p.turn[2]), s(p.turn[3])));
    info.m_startWorldTransform.setOrigin(btVector3(s(p.at[0]), s(p.at[1]), s(p.at[2])));
    bodies.push_back(std::make_unique<btRigidBody>(info));
    bodies.back()->setUserIndex(index);
    world.addRigidBody(bodies.back().get());
  }

  const btRigidBody& object(std::size_t i) const { return *bodies[i + 1]; }

  Phase phase;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btSequentialImpulseConstraintSolver solver;
  btStaticPlaneShape ground{btVector3(0, 0, 1), 0};
  std::unique_ptr<btCollisionShape> shape;
  std::vector<std::unique_ptr<btRigidBody>> bodies;  // the plane, then the objects
  std::unique_ptr<btBroadphaseInterface> broad_phase;
  TimedWorld world;
  std::vector<Box> boxes;
};

World::World(const Spec& spec)
    : engine_(
          std::make_unique<Engine>(spec, place(spec.scene, spec.shape, spec.objects, spec.seed))) {}
World::~World() = default;

StepReport World::step() {
  Engine& e = *engine_;
  StepReport report;
  e.world.other_ms = 0;
  const auto start = Clock::now();
  e.world.stepSimulation(btScalar(1) / 60, 0);
  report.step_ms = ms_since(start) - e.world.other_ms;
  report.broad_phase_ms = e.world.broad_phase_ms;
  for (std::size_t i = 0; i < e.boxes.size(); ++i) {
    const btBroadphaseProxy& proxy = *e.object(i).getBroadphaseProxy();
    e.boxes[i] = {point(proxy.m_aabbMin), point(proxy.m_aabbMax)};
  }
  return report;
}

std::size_t World::objects() const noexcept { return engine_->boxes.size(); }
const std::vector<Box>& World::boxes() const noexcept { return engine_->boxes; }
const Comparison& World::comparison() const noexcept { return engine_->world.comparison; }
std::size_t World::pairs() const noexcept {
  return static_cast<std::size_t>(
      engine_->broad_phase->getOverlappingPairCache()->getNumOverlappingPairs());
}
Vec3 World::position(std::size_t i) const {
  return point(engine_->object(i).getWorldTransform().getOrigin());
}

Contacts World::contacts() const {
  Contacts all;
  all.of_objects.assign(objects(), 0);
  for (int i = 0; i < engine_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *engine_->dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    all.points += static_cast<std::size_t>(manifold.getNumContacts());
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      all.deepest = std::max(all.deepest, -double{manifold.getContactPoint(k).getDistance()});
    }
    for (const btCollisionObject* body : {manifold.getBody0(), manifold.getBody1()}) {
      const int index = body->getUserIndex();
      if (index >= 0) all.of_objects[static_cast<std::size_t>(index)] += 1;
    }
  }
  return all;
}

}  // namespace throng::simulate
