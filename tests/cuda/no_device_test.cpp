// Without a GPU every API call returns no_device with the advice, and allocates nothing.
#include <cstdint>

#include <throng/cuda_broad_phase.hpp>

#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class NoDevice : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda::available().ok()) GTEST_SKIP() << "there is a GPU";
  }
  // Stand-ins for device memory; never dereferenced.
  Box* const boxes_ = reinterpret_cast<Box*>(std::uintptr_t{0x1000});
  Pair* const pairs_ = reinterpret_cast<Pair*>(std::uintptr_t{0x2000});
  cuda::Report* const report_ = reinterpret_cast<cuda::Report*>(std::uintptr_t{0x3000});

  static void expect_no_device(const Result& r) {
    EXPECT_EQ(r.status, Status::no_device) << to_string(r.status);
    EXPECT_NE(std::string(r.message).find("use Backend::cpu"), std::string::npos) << r.message;
    EXPECT_EQ(r.found, 0u);
    EXPECT_EQ(r.written, 0u);
  }
};

TEST_F(NoDevice, AvailableSaysWhy) { expect_no_device(cuda::available()); }

TEST_F(NoDevice, EveryCallSaysWhy) {
  for (const Algorithm algorithm : {Algorithm::automatic, Algorithm::all_pairs, Algorithm::grid}) {
    Options options;
    options.algorithm = algorithm;
    cuda::Finder finder(options);
    const Boxes a(boxes_, 100), b(boxes_, 7);
    for (int again = 0; again < 2; ++again) {
      expect_no_device(finder.reserve(100, 1000, nullptr));
      expect_no_device(finder.find(a, pairs_, 10, nullptr));
      expect_no_device(finder.find(a, b, pairs_, 10, nullptr));
      expect_no_device(finder.find_async(a, pairs_, 10, report_, nullptr));
      expect_no_device(finder.find_async(a, b, pairs_, 10, report_, nullptr));
      expect_no_device(finder.find(a, nullptr));
      expect_no_device(finder.find(a, b, nullptr));
      EXPECT_EQ(finder.pairs().size(), 0u);
      EXPECT_EQ(finder.memory_bytes(), 0u);
    }
  }
}

// Nothing is allocated, so the resource is not called.
TEST_F(NoDevice, TheMemoryResourceIsLeftAlone) {
  CountingDeviceMemory memory;
  cuda::Finder finder({}, memory.resource());
  expect_no_device(finder.reserve(1000, 1000, nullptr));
  expect_no_device(finder.find(Boxes(boxes_, 100), pairs_, 10, nullptr));
  EXPECT_EQ(memory.allocations() + memory.refusals(), 0u);
}

TEST_F(NoDevice, BoxesOfBodies) {
  const auto* transforms = reinterpret_cast<const Transform*>(boxes_);
  const auto* shapes = reinterpret_cast<const Shape*>(boxes_);
  auto* report = reinterpret_cast<cuda::BodyReport*>(report_);
  Bodies bodies(transforms, 100, shapes, 1);
  expect_no_device(cuda::update_boxes(bodies, boxes_, report, nullptr));
  expect_no_device(cuda::update_boxes_async(bodies, boxes_, report, nullptr));
  expect_no_device(cuda::update_boxes_async(bodies, boxes_, nullptr, nullptr));
  bodies.points = {nullptr, 7};
  for (const Result& r : {cuda::update_boxes(bodies, boxes_, report, nullptr),
                          cuda::update_boxes_async(bodies, boxes_, report, nullptr)}) {
    EXPECT_EQ(r.status, Status::bad_bodies);
    EXPECT_NE(std::string(r.message).find("'points'"), std::string::npos) << r.message;
  }
}

TEST_F(NoDevice, PersistentObjects) {
  auto* ids = reinterpret_cast<ObjectId*>(pairs_);
  const Boxes boxes(boxes_, 100);
  cuda::BroadPhase scene(0.1f);
  for (int again = 0; again < 2; ++again) {
    expect_no_device(scene.add(boxes, ids, nullptr));
    expect_no_device(scene.remove(ids, 3, nullptr));
    expect_no_device(scene.move(ids, boxes, nullptr));
    expect_no_device(scene.move_all(boxes, nullptr));
    expect_no_device(scene.set_filters(ids, 3, {}, nullptr));
    expect_no_device(scene.shift_origin({1, 2, 3}, nullptr));
    expect_no_device(scene.update(nullptr));
    expect_no_device(scene.update(boxes, nullptr));
    LivePairs pairs;
    expect_no_device(scene.pairs(pairs, nullptr));
    const Sweep sweep{};
    SweepHit hit;
    expect_no_device(scene.find_overlaps(boxes, nullptr));
    expect_no_device(scene.find_hits(&sweep, 1, SweepHits::all, {}, nullptr));
    expect_no_device(scene.find_first_hits(&sweep, 1, {}, &hit, nullptr));
    EXPECT_TRUE(scene.overlaps().empty());
    EXPECT_TRUE(scene.hits().empty());
    expect_no_device(scene.copy_from(cuda::BroadPhase(), nullptr));
    EXPECT_TRUE(scene.begun().empty() && scene.ended().empty() && scene.candidates().empty());
    EXPECT_EQ(scene.object_count() + scene.pair_count() + scene.id_limit() + scene.slot_limit(),
              0u);
    EXPECT_EQ(scene.memory_bytes(), 0u);
  }
  cuda::BroadPhase other(std::move(scene)), third;
  third = std::move(other);
  expect_no_device(third.update(nullptr));
}

// Errors that can be detected without a GPU are reported first.
TEST_F(NoDevice, BadArgumentsAreReportedFirst) {
  Options options;
  options.margin = -1;
  cuda::Finder bad_margin(options);
  EXPECT_EQ(bad_margin.find(Boxes(boxes_, 5), pairs_, 10, nullptr).status, Status::bad_option);
  cuda::Finder finder;
  EXPECT_EQ(finder.find(Boxes(nullptr, 5), pairs_, 10, nullptr).status, Status::bad_boxes);
  Boxes bad_view(boxes_, 5);
  bad_view.filters.owner = {reinterpret_cast<const std::int32_t*>(boxes_), 4};
  EXPECT_EQ(finder.find(bad_view, pairs_, 10, nullptr).status, Status::bad_filter);
  cuda::BroadPhase live;
  EXPECT_EQ(live.add(bad_view, nullptr, nullptr).status, Status::bad_filter);
  EXPECT_EQ(live.update(Boxes(nullptr, 5), nullptr).status, Status::bad_boxes);
  EXPECT_EQ(live.find_overlaps(bad_view, nullptr).status, Status::bad_filter);
  const Result none = live.find_hits(nullptr, 5, SweepHits::all, {}, nullptr);
  EXPECT_EQ(none.status, Status::bad_boxes);
  EXPECT_NE(std::string(none.message).find("array of sweeps is null"), std::string::npos);
  const Sweep sweep{};
  EXPECT_EQ(live.find_hits(&sweep, 1, static_cast<SweepHits>(7), {}, nullptr).status,
            Status::bad_option);
  EXPECT_EQ(live.find_first_hits(nullptr, 5, {}, nullptr, nullptr).status, Status::bad_boxes);
  for (const float margin : {-1.0f, INFINITY, std::nanf("")}) {
    const Result r = cuda::BroadPhase(margin).update(nullptr);
    EXPECT_EQ(r.status, Status::bad_option);
    EXPECT_NE(std::string(r.message).find("fat boxes"), std::string::npos) << r.message;
  }
  EXPECT_EQ(cuda::BroadPhase(0, options).update(nullptr).status, Status::bad_option);
}

TEST_F(NoDevice, MovesAndDestroysSafely) {
  cuda::Finder one, two;
  expect_no_device(one.find(Boxes(boxes_, 5), pairs_, 10, nullptr));
  cuda::Finder three(std::move(one));
  two = std::move(three);
  expect_no_device(two.find(Boxes(boxes_, 5), pairs_, 10, nullptr));
}

// The host Finder with Backend::cuda, too.
TEST_F(NoDevice, HostFinderSaysWhy) {
  Options options;
  options.backend = Backend::cuda;
  Finder finder(options);
  const BoxList boxes = uniform_boxes(10, 1);
  expect_no_device(finder.find(boxes));
}

}  // namespace
}  // namespace throng::tests
