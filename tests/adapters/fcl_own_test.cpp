// The behaviour of FclManager where FCL's own managers leave it open.
#include <cmath>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include "adapters/fcl_manager.hpp"

namespace throng::tests {
namespace {

using Throng = Manager<FclManager<double>>;

TEST_F(Throng, unknown_and_duplicate_objects) {
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
  manager.registerObject(b);  // counts as an update
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
  CallbackLog log;
  manager.collide(&tree, &log, log_ordered_pair);
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
  EXPECT_EQ(log.pairs, wanted);
  EXPECT_EQ(nearest.distance, least);
}

// As FCL's sweep and prune; its trees report each pair twice here, and each object with itself.
TEST_F(Throng, a_manager_and_itself) {
  FclManager<double> manager;
  std::vector<Object*> all;
  for (int i = 0; i < 60; ++i) all.push_back(make(any()));
  manager.registerObjects(all);
  CallbackLog log;
  manager.collide(&manager, &log, log_pair);
  EXPECT_EQ(log.pairs, brute(all));
  Nearest nearest, other;
  manager.distance(&manager, &nearest, measure);
  manager.distance(&other, measure);
  EXPECT_EQ(nearest.pair, other.pair);
}

TEST_F(Throng, nan_overlaps_nothing) {
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

TEST_F(Throng, concurrent_queries) {
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
        CallbackLog log;
        manager.collide(all[static_cast<std::size_t>(i)], &log, log_pair);
        EXPECT_GE(log.pairs.size(), 1u);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Throng, out_of_memory_changes_nothing) {
  struct LimitedResource : std::pmr::memory_resource {
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
