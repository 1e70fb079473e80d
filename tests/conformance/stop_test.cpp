// Options::stop: a cancelled search ends, leaves no thread behind and can search again.
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <throng/broad_phase.hpp>
#include <throng/update_boxes.hpp>

#include "support/configs.hpp"
#include "support/counting_resource.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Stop : public Conformance {
 protected:
  Options stoppable() const {
    Options o = options();
    o.stop = &stop_;
    return o;
  }
  std::atomic<bool> stop_{false};
};

void expect_stopped(const Result& r) {
  EXPECT_EQ(r.status, Status::stopped);
  EXPECT_EQ(r.found, 0u);
  EXPECT_EQ(r.written, 0u);
}

TEST_P(Stop, BeforeItBegins) {
  static const BoxList scenes[] = {uniform_boxes(7000, 1), identical_boxes(300, 2), BoxList{}};
  static const std::size_t wanted[] = {reference_pairs(scenes[0]).pairs.size(), 300 * 299 / 2, 0};
  Finder finder(stoppable());
  for (std::size_t i = 0; i < 3; ++i) {
    stop_ = true;
    expect_stopped(finder.find(scenes[i]));
    EXPECT_TRUE(finder.pairs().empty());
    stop_ = false;
    const Result r = finder.find(scenes[i]);
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, wanted[i]);
  }
}

// From the consumer, which runs in the middle of a search: more blocks would follow.
TEST_P(Stop, InTheMiddle) {
  if (config().order == Order::canonical) GTEST_SKIP() << "pairs are delivered at the end";
  const BoxList boxes = identical_boxes(3000, 2);
  Finder finder(stoppable());
  std::uint64_t seen = 0;
  const Result r = finder.consume(boxes, [&](const Pair*, std::size_t count) {
    seen += count;
    stop_ = true;
    return true;
  });
  // So few boxes per column are not checked: if all boxes are in one column, all pairs are found.
  expect_stopped(r);
  EXPECT_GT(seen, 0u);
  stop_ = false;
  EXPECT_EQ(finder.find(boxes).found, 3000u * 2999 / 2);
}

// Very many boxes in one place: 2e9 pairs, of which few are found.
TEST_P(Stop, InTheMiddleOfAColumn) {
  if (config().order == Order::canonical || config().threads != 1 ||
      config().backend != Backend::cpu)
    GTEST_SKIP() << "one configuration is enough";
  const BoxList boxes(sanitized ? 20000 : 60000, Box{{0, 0, 0}, {1, 1, 1}});
  const std::uint64_t all = boxes.size() * (boxes.size() - 1) / 2;
  Finder finder(stoppable());
  std::uint64_t seen = 0;
  Result r = finder.consume(boxes, [&](const Pair*, std::size_t count) {
    seen += count;
    stop_ = true;
    return true;
  });
  expect_stopped(r);
  EXPECT_GT(seen, 0u);
  EXPECT_LT(seen, all / 2);
  // Two sets, each searching the other's strip.
  stop_ = false;
  seen = 0;
  r = finder.consume(boxes, boxes, [&](const Pair*, std::size_t count) {
    seen += count;
    stop_ = true;
    return true;
  });
  expect_stopped(r);
  EXPECT_GT(seen, 0u);
  EXPECT_LT(seen, all);
}

// Brute force of 8e10 comparisons: after the stop each thread makes about 10^8 more, as
// Options::stop documents. The first boxes overlap all others, so pairs come immediately.
TEST_P(Stop, SoonAfterItIsSet) {
  Options o = stoppable();
  if (o.algorithm != Algorithm::all_pairs || o.order != Order::any || o.backend != Backend::cpu)
    GTEST_SKIP() << "a grid ends too soon; otherwise pairs are delivered at the end";
  BoxList boxes = uniform_boxes(400000, 1);
  std::fill_n(boxes.begin(), 4096, Box{{-9, -9, -9}, {999, 999, 999}});
  Finder finder(o);
  const Result r = finder.consume(boxes, [&](const Pair*, std::size_t) {
    stop_ = true;
    return true;
  });
  EXPECT_EQ(r.status, Status::stopped);
  EXPECT_GT(r.comparisons, 0u);
  EXPECT_LT(r.comparisons, r.plan.threads * 100'000'000ull);
}

// As in a user interface: 8e10 comparisons, with time for some hundred million; a device may make
// 10^9 more.
TEST_P(Stop, FromAnotherThread) {
  Options o = stoppable();
  if (o.algorithm != Algorithm::all_pairs) GTEST_SKIP() << "a grid would end too soon";
  const BoxList boxes = uniform_boxes(400000, 1);
  std::thread stopper([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    stop_ = true;
  });
  Finder finder(o);
  const Result r = finder.find(boxes);
  stopper.join();
  expect_stopped(r);
  EXPECT_LT(r.comparisons, 8'000'000'000u);
}

// Stops when space for all boxes is allocated, before the first box is binned: no box is visited.
TEST_P(Stop, WhileBoxesAreBinned) {
  Options o = stoppable();
  if (config().backend != Backend::cpu || o.algorithm != Algorithm::grid)
    GTEST_SKIP() << "has no grid, or another one";
  struct StoppingResource : CountingResource {
    explicit StoppingResource(std::atomic<bool>& s) : stop(s) {}
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
      if (bytes > 1600000) stop = true;
      return CountingResource::do_allocate(bytes, alignment);
    }
    std::atomic<bool>& stop;
  } resource{stop_};
  o.memory = &resource;
  const BoxList boxes(100000, Box{{1, 1, 1}, {-1, -1, -1}});
  const Result r = Finder(o).find(boxes);
  EXPECT_TRUE(stop_) << "not all boxes had space";
  expect_stopped(r);
  EXPECT_EQ(r.inactive, 0u);
}

THRONG_INSTANTIATE(Stop, suite_configs);

TEST(StopUpdateBoxes, LeavesTheRest) {
  const Transform here{{1, 2, 3}, {}};
  const Shape ball = Shape::sphere(1);
  const Bodies bodies(&here, 50000, &ball, 1, 0);
  std::vector<Box> boxes(50000);
  std::atomic<bool> stop{true};
  UpdateOptions o;
  o.stop = &stop;
  const Result r = update_boxes(bodies, boxes.data(), o);
  expect_stopped(r);
  EXPECT_EQ(boxes.back().upper.x, 0);
  stop = false;
  EXPECT_TRUE(update_boxes(bodies, boxes.data(), o).ok());
  EXPECT_GE(boxes.back().upper.x, 2);
}

TEST(StopBroadPhase, ChangesNothing) {
  const BoxList boxes = uniform_boxes(5000, 3);
  std::atomic<bool> stop{false};
  Options o;
  o.stop = &stop;
  BroadPhase live(o);
  ASSERT_TRUE(live.add(boxes, nullptr).ok());
  const auto update_after_a_stop = [&] {
    stop = true;
    const std::uint64_t pairs = live.pair_count();
    expect_stopped(live.update());
    EXPECT_EQ(live.pair_count(), pairs);
    stop = false;
    ASSERT_TRUE(live.update().ok());
  };
  update_after_a_stop();  // all are new
  EXPECT_EQ(live.pair_count(), reference_pairs(boxes).pairs.size());
  // Few updates: cells are built once they pay off.
  for (int k = 1; k < 300; ++k) {
    for (const ObjectId id : {7u, 8u, 9u}) ASSERT_EQ(live.move(id, boxes[id + k % 2]), Status::ok);
    update_after_a_stop();
  }
  EXPECT_STREQ(live.update().plan.reason, "nothing changed");
  BoxList moved = boxes;
  for (const std::size_t id : {7u, 8u, 9u}) moved[id] = boxes[id + 1];
  EXPECT_EQ(live.pair_count(), reference_pairs(moved).pairs.size());

  const Sweep all{{{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}}, {1, 0, 0}};
  stop = true;
  expect_stopped(live.find_hits(&all, 1));
  EXPECT_TRUE(live.hits().empty());
  expect_stopped(live.find_overlaps(Boxes(&all.box, 1)));
  EXPECT_TRUE(live.overlaps().empty());
  stop = false;
  EXPECT_EQ(live.find_hits(&all, 1).found, boxes.size());
  EXPECT_EQ(live.find_overlaps(Boxes(&all.box, 1)).found, boxes.size());
}

// The stop flag is set for the threads, then cleared.
struct StopCleared {
  std::atomic<bool> stop{false};
  bool sets_stop = false;
  const Executor executor{
      4,
      [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
        auto& my = *static_cast<StopCleared*>(self);
        my.stop = my.sets_stop;
        for (unsigned i = 0; i < count; ++i) task(context, i);
        my.stop = false;
      },
      this};

  Options options() const {
    Options o;
    o.stop = &stop;
    o.executor = &executor;
    o.threads = 4;
    return o;
  }
};

// An aborted result does not count as complete.
TEST(ClearedStop, UpdateAndQueries) {
  const BoxList boxes = uniform_boxes(8000, 3);
  BoxList away = boxes;
  for (std::size_t i = 0; i < 450; ++i) away[i].lower.x += 100, away[i].upper.x += 100;
  const std::uint64_t pairs[] = {reference_pairs(boxes).pairs.size(),
                                 reference_pairs(away).pairs.size()};
  StopCleared threads;
  BroadPhase live(threads.options());
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(live.add(boxes, ids.data()).ok());
  ASSERT_TRUE(live.update().ok());
  std::size_t stopped = 0;
  for (std::size_t frame = 1; frame < 60; ++frame) {
    const BoxList& now = frame % 2 ? away : boxes;
    ASSERT_TRUE(live.move(ids.data(), Boxes(now.data(), 450)).ok());
    threads.sets_stop = true;
    const Result r = live.update();
    threads.sets_stop = false;
    stopped += r.status == Status::stopped;
    if (r.status == Status::stopped) {
      ASSERT_TRUE(live.update().ok());
    }
    ASSERT_EQ(live.pair_count(), pairs[frame % 2]) << "frame " << frame;
  }
  EXPECT_EQ(stopped, 59u);

  std::vector<Sweep> sweeps;
  for (std::size_t i = 0; i < 600; ++i) sweeps.push_back({boxes[i], {1, 1, 1}});
  for (const std::size_t count : {100u, 600u}) {
    const Boxes query_boxes(boxes.data(), count);
    threads.sets_stop = false;
    ASSERT_TRUE(live.find_overlaps(query_boxes).ok());
    EXPECT_GT(live.overlaps().size(), count / 4);
    threads.sets_stop = true;
    expect_stopped(live.find_overlaps(query_boxes));
    EXPECT_TRUE(live.overlaps().empty());
    expect_stopped(live.find_hits(sweeps.data(), count));
    EXPECT_TRUE(live.hits().empty());
  }
}

TEST(ClearedStop, SearchAndBodies) {
  const BoxList boxes = uniform_boxes(20'000, 4);
  StopCleared threads;
  threads.sets_stop = true;
  Finder finder(threads.options());
  expect_stopped(finder.find(boxes));

  const std::vector<Transform> transforms(20'000, Transform{{1, 2, 3}, {0, 0, 0, 1}});
  const Shape ball = Shape::sphere(1);
  const Bodies bodies(transforms.data(), transforms.size(), &ball, 1);
  std::vector<Box> placed(bodies.size());
  UpdateOptions o;
  o.stop = &threads.stop;
  o.executor = &threads.executor;
  o.threads = 4;
  expect_stopped(update_boxes(bodies, placed.data(), o));
  threads.sets_stop = false;
  EXPECT_TRUE(update_boxes(bodies, placed.data(), o).ok());
}

}  // namespace
}  // namespace throng::tests
