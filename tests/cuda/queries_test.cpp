// Queries of persistent objects on a GPU: against a loop over all objects, and byte for byte
// against throng::BroadPhase.
#include <cmath>
#include <string>

#include "cuda/gpu_broad_phase.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {
namespace {

using GpuActor = ActorOf<GpuBroadPhase>;

class GpuQueries : public testing::Test {
 protected:
  void SetUp() override { THRONG_NEEDS_GPU(); }
};

void run_calls(std::uint64_t seed, std::size_t objects, float side, bool filtered, int steps) {
  GpuActor actor({}, seed, side, 0.5f);
  ASSERT_TRUE(actor.add(objects, filtered));
  for (int step = 0; step < steps; ++step) {
    ASSERT_TRUE(actor.some_calls(step % 3 != 2, objects, filtered, true));
    if (step % 3 == 0) {
      ASSERT_TRUE(actor.update());
    }
    const RandomQueries queries(actor, 1 + actor.random.below(60), filtered);
    ASSERT_TRUE(same_answers(actor.broad_phase, actor.model, queries)) << step;
  }
}

TEST_F(GpuQueries, Plain) { run_calls(1, 2000, 22, false, 12); }
TEST_F(GpuQueries, Filtered) { run_calls(2, 700, 14, true, 20); }
// For the sanitizers, which slow everything down.
TEST_F(GpuQueries, Small) { run_calls(3, 150, 8, true, 4); }

// Several blocks of everything, and more results than the capacity reserved.
TEST_F(GpuQueries, Many) {
  GpuBroadPhase gpu({}, 0);
  BroadPhase cpu;
  Random random(1);
  const BoxList boxes = uniform_boxes(60000, 5);
  ASSERT_TRUE(gpu.add(boxes, nullptr).ok());
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(cpu.add(boxes, ids.data()).ok());
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 30000; ++k) {
    const Box& from = boxes[random.below(60000)];
    sweeps.push_back({{from.lower, k % 3 ? from.lower : from.upper}, random.point(-30, 30)});
  }
  ASSERT_TRUE(gpu.find_overlaps(boxes).ok());
  ASSERT_TRUE(cpu.find_overlaps(boxes).ok());
  EXPECT_TRUE(same_bytes(gpu.overlaps(), cpu.overlaps()));
  for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
    const Result r = gpu.find_hits(sweeps.data(), sweeps.size(), which, {});
    ASSERT_TRUE(r.ok()) << r.message;
    ASSERT_TRUE(cpu.find_hits(sweeps.data(), sweeps.size(), which).ok());
    EXPECT_TRUE(same_bytes(gpu.hits(), cpu.hits()));
    EXPECT_EQ(r.found, cpu.hits().size());
  }
  std::vector<SweepHit> out(sweeps.size());
  const Result r = gpu.find_first_hits(sweeps.data(), sweeps.size(), {}, out.data());
  EXPECT_EQ(r.found, cpu.hits().size());
  EXPECT_TRUE(same_bytes(out, gpu_layout(cpu.hits(), out.size())));
}

// The bitmap of occupied blocks is used from the second query on.
TEST_F(GpuQueries, ClustersInAnEmptyWorld) {
  GpuBroadPhase gpu({}, 0);
  BroadPhase cpu;
  Random random(9);
  std::vector<Vec3> middles;
  for (int k = 0; k < 30; ++k) middles.push_back(random.point(0, 4000));
  BoxList boxes;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 m = middles[random.below(30)], at = random.point(0, 9);
    boxes.push_back(cube({m.x + at.x, m.y + at.y, m.z + at.z}, 1));
  }
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 from = boxes[random.below(5000)].lower, to = boxes[random.below(5000)].upper;
    sweeps.push_back({{from, from}, {2 * (to.x - from.x), 2 * (to.y - from.y), to.z - from.z}});
  }
  ASSERT_TRUE(gpu.add(boxes, nullptr).ok());
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(cpu.add(boxes, ids.data()).ok());
  std::size_t held = 0;
  for (int again = 0; again < 3; ++again) {
    for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
      ASSERT_TRUE(gpu.find_hits(sweeps.data(), sweeps.size(), which, {}).ok());
      ASSERT_TRUE(cpu.find_hits(sweeps.data(), sweeps.size(), which).ok());
      EXPECT_TRUE(same_bytes(gpu.hits(), cpu.hits()));
      if (held == 0) held = gpu.scene().memory_bytes();
    }
  }
  EXPECT_GE(gpu.scene().memory_bytes(), held + 2 * boxes.size());
}

TEST_F(GpuQueries, Refuses) {
  GpuBroadPhase m({}, 0);
  const BoxList boxes = uniform_boxes(300, 1);
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  std::vector<Sweep> sweeps(5, Sweep{boxes[0], {1, 1, 1}});
  sweeps[3].by.z = std::nanf("");
  Result r = m.find_hits(sweeps.data(), 5, SweepHits::all, {});
  EXPECT_EQ(r.status, Status::nan_box);
  EXPECT_EQ(r.first_invalid, 3u);
  EXPECT_NE(std::string(r.message).find("1 sweeps have a NaN"), std::string::npos) << r.message;
  cuda::BroadPhase& scene = m.scene();
  const OnDevice<Sweep> there(5);
  SweepHit here[5];
  EXPECT_EQ(scene.find_hits(sweeps.data(), 5, SweepHits::all, {}, nullptr).status,
            Status::bad_boxes)
      << "host memory";
  r = scene.find_first_hits(there.data(), 5, {}, here, nullptr);
  EXPECT_EQ(r.status, Status::bad_boxes);
  EXPECT_NE(std::string(r.message).find("the array of hits"), std::string::npos) << r.message;
  EXPECT_EQ(scene.find_first_hits(there.data(), 5, {}, nullptr, nullptr).status, Status::bad_boxes);
}

}  // namespace
}  // namespace throng::tests
