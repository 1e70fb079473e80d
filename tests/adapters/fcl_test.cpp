// The same assertions for FclManager and for FCL's own DynamicAABBTreeCollisionManager, in doubles
// and in floats.
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fcl/geometry/shape/plane.h>

#include "adapters/fcl_manager.hpp"

namespace throng::tests {
namespace {

using Managers = ::testing::Types<FclManager<double>, FclManager<float>,
                                  fcl::DynamicAABBTreeCollisionManager<double>,
                                  fcl::DynamicAABBTreeCollisionManager<float>>;
TYPED_TEST_SUITE(Manager, Managers);

TYPED_TEST(Manager, starts_empty) {
  TypeParam manager;
  EXPECT_TRUE(manager.empty());
  EXPECT_EQ(manager.size(), 0u);
  manager.setup();
  manager.update();
  EXPECT_TRUE(this->self(manager).empty());
  typename TestFixture::CallbackLog log;
  manager.collide(this->make(this->box(0, 0, 0)), &log, this->log_pair);
  EXPECT_TRUE(log.pairs.empty());
  std::vector<typename TestFixture::Object*> objects(3);
  manager.getObjects(objects);
  EXPECT_TRUE(objects.empty());
}

TYPED_TEST(Manager, finds_moves_removes_and_clears) {
  TypeParam manager;
  std::vector<typename TestFixture::Object*> all = {this->make(this->box(0, 0, 0)),
                                                    this->make(this->box(1, 0, 0)),  // touches
                                                    this->make(this->box(5, 5, 5))};
  manager.registerObjects(all);
  manager.setup();
  EXPECT_EQ(manager.size(), 3u);
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}}));

  auto* late = this->make(this->box(5, 5.5, 5));
  manager.registerObject(late);
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {2, 3}}));  // without setup()

  this->things_[1]->set(this->box(5, 5, 4));
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {2, 3}}));  // not updated
  manager.update();
  EXPECT_EQ(this->self(manager), (Numbers{{1, 2}, {1, 3}, {2, 3}}));

  this->things_[0]->set(this->box(5, 5, 3));
  this->things_[2]->set(this->box(9, 9, 9));
  manager.update(all[0]);
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {1, 2}, {1, 3}, {2, 3}}));
  manager.update(std::vector<typename TestFixture::Object*>{all[2], all[0]});
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {1, 3}}));

  manager.unregisterObject(all[1]);
  EXPECT_EQ(manager.size(), 3u);
  EXPECT_TRUE(this->self(manager).empty());
  manager.registerObject(all[1]);
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {1, 3}}));

  std::vector<typename TestFixture::Object*> here;
  manager.getObjects(here);
  EXPECT_EQ(std::set<typename TestFixture::Object*>(here.begin(), here.end()),
            (std::set<typename TestFixture::Object*>{all[0], all[1], all[2], late}));

  manager.clear();
  EXPECT_TRUE(manager.empty());
  EXPECT_TRUE(this->self(manager).empty());
  manager.registerObjects(all);
  manager.setup();
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}}));
}

TYPED_TEST(Manager, touching_to_the_last_bit) {
  using Real = typename TestFixture::S;
  TypeParam manager;
  auto *a = this->make(this->box(0, 0, 0)), *b = this->make(this->box(1, 0, 0));
  manager.registerObjects({a, b});
  manager.setup();
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}}));
  auto bounds = b->getAABB();
  bounds.min_[0] = std::nextafter(Real(1), Real(2));
  b->set(bounds);
  manager.update();
  EXPECT_TRUE(this->self(manager).empty());
}

TYPED_TEST(Manager, a_callback_that_stops) {
  TypeParam manager;
  std::vector<typename TestFixture::Object*> all;
  for (int i = 0; i < 10; ++i) all.push_back(this->make(this->box(0, 0, 0.01 * i)));
  manager.registerObjects(all);
  manager.setup();
  for (std::size_t most : {1u, 3u, 45u}) {
    typename TestFixture::CallbackLog log;
    log.most = most;
    manager.collide(&log, this->log_pair);
    EXPECT_EQ(log.pairs.size(), most);
  }
  typename TestFixture::CallbackLog log;
  log.most = 2;
  manager.collide(this->make(this->box(0, 0, 0)), &log, this->log_pair);
  EXPECT_EQ(log.pairs.size(), 2u);
}

TYPED_TEST(Manager, one_object_against_all) {
  TypeParam manager;
  std::vector<typename TestFixture::Object*> all;
  for (int i = 0; i < 80; ++i) all.push_back(this->make(this->any()));
  manager.registerObjects(all);
  manager.setup();
  for (int i = 0; i < 40; ++i) {
    // An object of its own overlaps itself, too.
    auto* object =
        i % 4 ? this->make(this->any()) : this->things_[static_cast<std::size_t>(i)].get();
    typename TestFixture::CallbackLog log;
    manager.collide(object, &log, this->log_ordered_pair);
    Numbers wanted;
    for (auto* o : all)
      if (o->getAABB().overlap(object->getAABB())) wanted.emplace(this->number(o), object->number);
    EXPECT_EQ(log.pairs, wanted);
  }
}

TYPED_TEST(Manager, two_managers) {
  TypeParam one, two;
  std::vector<typename TestFixture::Object*> ours, theirs;
  for (int i = 0; i < 60; ++i) ours.push_back(this->make(this->any()));
  for (int i = 0; i < 90; ++i) theirs.push_back(this->make(this->any()));
  one.registerObjects(ours);
  two.registerObjects(theirs);
  one.setup();
  two.setup();
  const auto check = [&] {
    typename TestFixture::CallbackLog log;
    one.collide(&two, &log, this->log_ordered_pair);
    Numbers wanted;
    for (auto* a : ours)
      for (auto* b : theirs)
        if (a->getAABB().overlap(b->getAABB())) wanted.emplace(this->number(a), this->number(b));
    EXPECT_EQ(log.pairs, wanted);
    EXPECT_GT(wanted.size(), 10u);
  };
  check();
  for (auto& entry : this->things_) entry->set(this->any());
  one.update();
  two.update();
  check();
  TypeParam none;
  typename TestFixture::CallbackLog log;
  one.collide(&none, &log, this->log_pair);
  none.collide(&one, &log, this->log_pair);
  EXPECT_TRUE(log.pairs.empty());
}

TYPED_TEST(Manager, distances) {
  TypeParam one, two;
  std::vector<typename TestFixture::Object*> ours, theirs;
  const auto far_apart = [&](double x) {
    return this->make(
        this->box(x + this->random_.in(0, 60), this->random_.in(0, 60), this->random_.in(0, 60)));
  };
  for (int i = 0; i < 50; ++i) ours.push_back(far_apart(0));
  for (int i = 0; i < 40; ++i) theirs.push_back(far_apart(40));
  one.registerObjects(ours);
  two.registerObjects(theirs);
  one.setup();
  two.setup();
  using Real = typename TestFixture::S;
  const Real most = std::numeric_limits<Real>::max();
  const auto least = [&](const auto& as, const auto& bs) {
    Real d = most;
    for (auto* a : as)
      for (auto* b : bs)
        if (a != b) d = std::min(d, this->true_distance(a, b));
    return d;
  };
  typename TestFixture::Nearest nearest;
  one.distance(&nearest, this->measure);
  EXPECT_EQ(nearest.distance, least(ours, ours));
  EXPECT_LT(nearest.calls, 50 * 49 / 2);  // a subset
  EXPECT_NE(nearest.pair.first, nearest.pair.second);

  nearest = {};
  one.distance(&two, &nearest, this->measure);
  EXPECT_EQ(nearest.distance, least(ours, theirs));
  EXPECT_LT(nearest.pair.first, 50);
  EXPECT_GE(nearest.pair.second, 50);

  for (int i = 0; i < 10; ++i) {
    auto* object = far_apart(20);
    nearest = {};
    one.distance(object, &nearest, this->measure);
    EXPECT_EQ(nearest.distance, least(ours, std::vector{object}));
    EXPECT_EQ(nearest.pair.second, object->number);
  }
  TypeParam none;
  nearest = {};
  none.distance(&nearest, this->measure);
  none.distance(ours[0], &nearest, this->measure);
  none.distance(&one, &nearest, this->measure);
  EXPECT_EQ(nearest.calls, 0);
}

TYPED_TEST(Manager, infinite_and_real_objects) {
  using Real = typename TestFixture::S;
  TypeParam manager;
  // Geometry's own boxes: that of a plane is infinite.
  TestObject<Real> plane(0, {}), cube(1, {}), far_cube(2, {});
  fcl::CollisionObject<Real> half(std::make_shared<fcl::Plane<Real>>(0, 0, 1, 0));
  half.computeAABB();
  plane.set(half.getAABB());
  cube.setTranslation(fcl::Vector3<Real>(0, 0, Real(0.5)));
  cube.computeAABB();
  far_cube.setTranslation(fcl::Vector3<Real>(1000, 0, 500));
  far_cube.computeAABB();
  manager.registerObjects({&plane, &cube, &far_cube});
  manager.setup();
  const bool flat = half.getAABB().max_[2] < 100;  // FCL computes a tight box of a level plane
  EXPECT_EQ(this->self(manager), flat ? (Numbers{{0, 1}}) : (Numbers{{0, 1}, {0, 2}}));
}

TYPED_TEST(Manager, any_sequence_of_calls) {
  std::size_t total = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    this->random_ = Random(seed);
    TypeParam manager;
    std::vector<typename TestFixture::Object*> here, away;
    for (int i = 0; i < 50; ++i) away.push_back(this->make(this->any()));
    for (int step = 0; step < 150; ++step) {
      const auto pick = [&](auto& from) {
        const std::size_t i = this->random_.below(static_cast<std::uint32_t>(from.size()));
        auto* object = from[i];
        from[i] = from.back();
        from.pop_back();
        return object;
      };
      switch (this->random_.below(5)) {
        case 0:
          if (away.empty()) break;
          here.push_back(pick(away));
          static_cast<TestObject<typename TestFixture::S>*>(here.back())->set(this->any());
          manager.registerObject(here.back());
          break;
        case 1: {
          if (here.size() < 5 || this->random_.one_in(2)) break;
          away.push_back(pick(here));
          manager.unregisterObject(away.back());
          break;
        }
        case 2:
          for (auto* object : here)
            static_cast<TestObject<typename TestFixture::S>*>(object)->set(this->any());
          manager.update();
          break;
        default: {
          if (here.empty()) break;
          auto* object = here[this->random_.below(static_cast<std::uint32_t>(here.size()))];
          static_cast<TestObject<typename TestFixture::S>*>(object)->set(this->any());
          manager.update(object);
        }
      }
      ASSERT_EQ(this->self(manager), this->brute(here)) << "seed " << seed << ", step " << step;
      ASSERT_EQ(manager.size(), here.size());
      total += here.size();
    }
  }
  EXPECT_GT(total, 1000u);
}

}  // namespace
}  // namespace throng::tests
