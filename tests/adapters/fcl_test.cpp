// The same assertions of FclManager and of FCL's own DynamicAABBTreeCollisionManager, in doubles
// and in floats.
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/plane.h>
#include <gtest/gtest.h>

#include <throng/fcl.hpp>

#include "support/random.hpp"

namespace throng::tests {
namespace {

template <class S>
class Thing : public fcl::CollisionObject<S> {
 public:
  Thing(int n, const fcl::AABB<S>& bounds)
      : fcl::CollisionObject<S>(std::make_shared<fcl::Box<S>>(1, 1, 1)), number(n) {
    this->aabb = bounds;
  }
  void set(const fcl::AABB<S>& bounds) { this->aabb = bounds; }
  int number;
};

using Numbers = std::multiset<std::pair<int, int>>;

template <class M>
struct Scalar;
template <template <class> class M, class T>
struct Scalar<M<T>> {
  using type = T;
};

template <class M>
class Manager : public ::testing::Test {
 protected:
  using S = typename Scalar<M>::type;
  using Object = fcl::CollisionObject<S>;
  using Bounds = fcl::AABB<S>;
  using V = fcl::Vector3<S>;

  struct Heard {
    Numbers pairs;
    std::size_t most = std::numeric_limits<std::size_t>::max();
  };
  static int number(const Object* o) { return static_cast<const Thing<S>*>(o)->number; }
  // Pairs are unordered, but of two managers or an object: there the manager's own is the first.
  static bool hear(Object* a, Object* b, void* data) {
    Heard& heard = *static_cast<Heard*>(data);
    heard.pairs.insert(std::minmax(number(a), number(b)));
    return heard.pairs.size() >= heard.most;
  }
  static bool hear_in_order(Object* a, Object* b, void* data) {
    static_cast<Heard*>(data)->pairs.emplace(number(a), number(b));
    return false;
  }

  static Bounds box(double x, double y, double z, double size = 1) {
    const V low(static_cast<S>(x), static_cast<S>(y), static_cast<S>(z));
    const V far(static_cast<S>(x + size), static_cast<S>(y + size), static_cast<S>(z + size));
    return Bounds(low, far);
  }
  Thing<S>* make(const Bounds& bounds) {
    things_.push_back(std::make_unique<Thing<S>>(static_cast<int>(things_.size()), bounds));
    return things_.back().get();
  }
  // Corners meet often, and miss each other by less than a float tells.
  Bounds any() {
    V low, far;
    for (int k = 0; k < 3; ++k) {
      low[k] = static_cast<S>(random_.between(-12, 12) * 0.5 + random_.between(-1, 1) * 1e-12);
      far[k] = low[k] + static_cast<S>(random_.between(0, 4)) * S(0.5);
    }
    return Bounds(low, far);
  }
  static Numbers self(const M& manager) {
    Heard heard;
    manager.collide(&heard, hear);
    return heard.pairs;
  }
  static Numbers brute(const std::vector<Object*>& here) {
    Numbers pairs;
    for (std::size_t i = 0; i < here.size(); ++i)
      for (std::size_t j = i + 1; j < here.size(); ++j)
        if (here[i]->getAABB().overlap(here[j]->getAABB()))
          pairs.insert(std::minmax(number(here[i]), number(here[j])));
    return pairs;
  }

  // What lies between the centres, less a half: never less than between the boxes of size 1.
  struct Nearest {
    S distance = std::numeric_limits<S>::max();
    std::pair<int, int> pair{-1, -1};
    int calls = 0;
  };
  static S true_distance(const Object* a, const Object* b) {
    return a->getAABB().distance(b->getAABB()) + S(0.25);
  }
  static bool measure(Object* a, Object* b, void* data, S& distance) {
    Nearest& nearest = *static_cast<Nearest*>(data);
    ++nearest.calls;
    const S d = true_distance(a, b);
    if (d < nearest.distance) {
      nearest.distance = d;
      nearest.pair = {number(a), number(b)};
    }
    distance = nearest.distance;
    return false;
  }

  Random random_{5};
  std::vector<std::unique_ptr<Thing<S>>> things_;
};

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
  typename TestFixture::Heard heard;
  manager.collide(this->make(this->box(0, 0, 0)), &heard, this->hear);
  EXPECT_TRUE(heard.pairs.empty());
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
  EXPECT_EQ(this->self(manager), (Numbers{{0, 1}, {2, 3}}));  // it was not told
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

TYPED_TEST(Manager, a_callback_that_has_enough) {
  TypeParam manager;
  std::vector<typename TestFixture::Object*> all;
  for (int i = 0; i < 10; ++i) all.push_back(this->make(this->box(0, 0, 0.01 * i)));
  manager.registerObjects(all);
  manager.setup();
  for (std::size_t most : {1u, 3u, 45u}) {
    typename TestFixture::Heard heard;
    heard.most = most;
    manager.collide(&heard, this->hear);
    EXPECT_EQ(heard.pairs.size(), most);
  }
  typename TestFixture::Heard heard;
  heard.most = 2;
  manager.collide(this->make(this->box(0, 0, 0)), &heard, this->hear);
  EXPECT_EQ(heard.pairs.size(), 2u);
}

TYPED_TEST(Manager, one_object_against_all) {
  TypeParam manager;
  std::vector<typename TestFixture::Object*> all;
  for (int i = 0; i < 80; ++i) all.push_back(this->make(this->any()));
  manager.registerObjects(all);
  manager.setup();
  for (int i = 0; i < 40; ++i) {
    // One of its own meets itself, too.
    auto* object =
        i % 4 ? this->make(this->any()) : this->things_[static_cast<std::size_t>(i)].get();
    typename TestFixture::Heard heard;
    manager.collide(object, &heard, this->hear_in_order);
    Numbers wanted;
    for (auto* o : all)
      if (o->getAABB().overlap(object->getAABB())) wanted.emplace(this->number(o), object->number);
    EXPECT_EQ(heard.pairs, wanted);
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
    typename TestFixture::Heard heard;
    one.collide(&two, &heard, this->hear_in_order);
    Numbers wanted;
    for (auto* a : ours)
      for (auto* b : theirs)
        if (a->getAABB().overlap(b->getAABB())) wanted.emplace(this->number(a), this->number(b));
    EXPECT_EQ(heard.pairs, wanted);
    EXPECT_GT(wanted.size(), 10u);
  };
  check();
  for (auto& thing : this->things_) thing->set(this->any());
  one.update();
  two.update();
  check();
  TypeParam none;
  typename TestFixture::Heard heard;
  one.collide(&none, &heard, this->hear);
  none.collide(&one, &heard, this->hear);
  EXPECT_TRUE(heard.pairs.empty());
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
  EXPECT_LT(nearest.calls, 50 * 49 / 2);  // not all of them
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
  // Geometry's own boxes: a plane's is without end.
  Thing<Real> plane(0, {}), cube(1, {}), far_cube(2, {});
  fcl::CollisionObject<Real> half(std::make_shared<fcl::Plane<Real>>(0, 0, 1, 0));
  half.computeAABB();
  plane.set(half.getAABB());
  cube.setTranslation(fcl::Vector3<Real>(0, 0, Real(0.5)));
  cube.computeAABB();
  far_cube.setTranslation(fcl::Vector3<Real>(1000, 0, 500));
  far_cube.computeAABB();
  manager.registerObjects({&plane, &cube, &far_cube});
  manager.setup();
  const bool flat = half.getAABB().max_[2] < 100;  // FCL fits the box of a level plane
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
          static_cast<Thing<typename TestFixture::S>*>(here.back())->set(this->any());
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
            static_cast<Thing<typename TestFixture::S>*>(object)->set(this->any());
          manager.update();
          break;
        default: {
          if (here.empty()) break;
          auto* object = here[this->random_.below(static_cast<std::uint32_t>(here.size()))];
          static_cast<Thing<typename TestFixture::S>*>(object)->set(this->any());
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

// What FCL's own leaves open.

using Throng = Manager<FclManager<double>>;

TEST_F(Throng, strangers_and_objects_given_twice) {
  FclManager<double> manager;
  auto *a = make(box(0, 0, 0)), *b = make(box(0.5, 0, 0));
  manager.unregisterObject(a);
  manager.update(a);
  EXPECT_TRUE(manager.empty());
  manager.registerObjects({a, b, a});
  manager.registerObject(b);
  EXPECT_EQ(manager.size(), 2u);
  EXPECT_EQ(self(manager), (Numbers{{0, 1}}));
  b->set(box(9, 9, 9));
  manager.registerObject(b);  // an update
  EXPECT_TRUE(self(manager).empty());
  EXPECT_EQ(manager.size(), 2u);
}

TEST_F(Throng, a_manager_of_another_class) {
  FclManager<double> manager;
  fcl::DynamicAABBTreeCollisionManager<double> tree;
  std::vector<Object*> ours, theirs;
  for (int i = 0; i < 30; ++i) ours.push_back(make(any()));
  for (int i = 0; i < 30; ++i) theirs.push_back(make(any()));
  manager.registerObjects(ours);
  tree.registerObjects(theirs);
  Heard heard;
  manager.collide(&tree, &heard, hear_in_order);
  Numbers wanted;
  Nearest nearest;
  manager.distance(&tree, &nearest, measure);
  double least = std::numeric_limits<double>::max();
  for (auto* a : ours) {
    for (auto* b : theirs) {
      if (a->getAABB().overlap(b->getAABB())) wanted.emplace(number(a), number(b));
      least = std::min(least, true_distance(a, b));
    }
  }
  EXPECT_EQ(heard.pairs, wanted);
  EXPECT_EQ(nearest.distance, least);
}

// As of FCL's sweep and prune; its trees tell each pair twice then, and each object with itself.
TEST_F(Throng, a_manager_and_itself) {
  FclManager<double> manager;
  std::vector<Object*> all;
  for (int i = 0; i < 60; ++i) all.push_back(make(any()));
  manager.registerObjects(all);
  Heard heard;
  manager.collide(&manager, &heard, hear);
  EXPECT_EQ(heard.pairs, brute(all));
  Nearest nearest, other;
  manager.distance(&manager, &nearest, measure);
  manager.distance(&other, measure);
  EXPECT_EQ(nearest.pair, other.pair);
}

TEST_F(Throng, nan_meets_nothing) {
  FclManager<double> manager;
  auto *a = make(box(0, 0, 0)), *b = make(box(0.5, 0, 0));
  Bounds bad = b->getAABB();
  bad.min_[1] = bad.max_[1] = bad.min_[0] = std::numeric_limits<double>::quiet_NaN();
  b->set(bad);
  manager.registerObjects({a, b});
  EXPECT_TRUE(self(manager).empty());
  Nearest nearest;
  manager.distance(&nearest, measure);
  EXPECT_EQ(nearest.calls, 0);
  b->set(box(0.5, 0, 0));
  manager.update(b);
  EXPECT_EQ(self(manager), (Numbers{{0, 1}}));
}

TEST_F(Throng, several_threads_ask_at_once) {
  FclManager<double> manager;
  std::vector<Object*> all;
  for (int i = 0; i < 200; ++i) all.push_back(make(any()));
  manager.registerObjects(all);
  const Numbers wanted = brute(all);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) {
        EXPECT_EQ(self(manager), wanted);
        Heard heard;
        manager.collide(all[static_cast<std::size_t>(i)], &heard, hear);
        EXPECT_GE(heard.pairs.size(), 1u);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Throng, memory_that_runs_out_changes_nothing) {
  struct Scarce : std::pmr::memory_resource {
    bool none = false;
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
      if (none) throw std::bad_alloc();
      return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* p, std::size_t bytes, std::size_t alignment) override {
      std::pmr::new_delete_resource()->deallocate(p, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override {
      return this == &other;
    }
  } memory;
  Options options;
  options.memory = &memory;
  FclManager<double> manager(options);
  std::vector<Object*> few = {make(box(0, 0, 0)), make(box(0.5, 0, 0))}, many;
  manager.registerObjects(few);
  EXPECT_EQ(self(manager), (Numbers{{0, 1}}));
  for (int i = 0; i < 3000; ++i) many.push_back(make(box(0.1, 0, 0)));
  memory.none = true;
  EXPECT_THROW(manager.registerObjects(many), Error);
  EXPECT_EQ(manager.size(), 2u);
  EXPECT_EQ(self(manager), (Numbers{{0, 1}}));
  memory.none = false;
  many.resize(100);
  manager.registerObjects(many);
  EXPECT_EQ(self(manager).size(), 102u * 101u / 2);
}

}  // namespace
}  // namespace throng::tests
