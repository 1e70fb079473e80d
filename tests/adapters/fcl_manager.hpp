// FCL objects that only have boxes, and the callbacks of their manager.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>
#include <gtest/gtest.h>

#include <throng/fcl.hpp>

#include "support/random.hpp"

namespace throng::tests {

template <class S>
class TestObject : public fcl::CollisionObject<S> {
 public:
  TestObject(int n, const fcl::AABB<S>& bounds)
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

  struct CallbackLog {
    Numbers pairs;
    std::size_t most = std::numeric_limits<std::size_t>::max();
  };
  static int number(const Object* o) { return static_cast<const TestObject<S>*>(o)->number; }
  // Pairs are unordered, except of two managers or an object: there the manager's own is first.
  static bool log_pair(Object* a, Object* b, void* data) {
    CallbackLog& log = *static_cast<CallbackLog*>(data);
    log.pairs.insert(std::minmax(number(a), number(b)));
    return log.pairs.size() >= log.most;
  }
  static bool log_ordered_pair(Object* a, Object* b, void* data) {
    static_cast<CallbackLog*>(data)->pairs.emplace(number(a), number(b));
    return false;
  }

  static Bounds box(double x, double y, double z, double size = 1) {
    const V low(static_cast<S>(x), static_cast<S>(y), static_cast<S>(z));
    const V far(static_cast<S>(x + size), static_cast<S>(y + size), static_cast<S>(z + size));
    return Bounds(low, far);
  }
  TestObject<S>* make(const Bounds& bounds) {
    things_.push_back(std::make_unique<TestObject<S>>(static_cast<int>(things_.size()), bounds));
    return things_.back().get();
  }
  // Corners often touch, or miss each other by less than float resolution.
  Bounds any() {
    V low, far;
    for (int k = 0; k < 3; ++k) {
      low[k] = static_cast<S>(random_.between(-12, 12) * 0.5 + random_.between(-1, 1) * 1e-12);
      far[k] = low[k] + static_cast<S>(random_.between(0, 4)) * S(0.5);
    }
    return Bounds(low, far);
  }
  static Numbers self(const M& manager) {
    CallbackLog log;
    manager.collide(&log, log_pair);
    return log.pairs;
  }
  static Numbers brute(const std::vector<Object*>& here) {
    Numbers pairs;
    for (std::size_t i = 0; i < here.size(); ++i)
      for (std::size_t j = i + 1; j < here.size(); ++j)
        if (here[i]->getAABB().overlap(here[j]->getAABB()))
          pairs.insert(std::minmax(number(here[i]), number(here[j])));
    return pairs;
  }

  // The distance of the centres minus a half: at least the distance of boxes of size 1.
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
  std::vector<std::unique_ptr<TestObject<S>>> things_;
};

}  // namespace throng::tests
