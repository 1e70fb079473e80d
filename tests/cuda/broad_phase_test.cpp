// Persistent objects on a GPU, compared with the model as those of the CPU are.
#include <cmath>
#include <string>

#include "cuda/gpu_broad_phase.hpp"

namespace throng::tests {
namespace {

using GpuActor = ActorOf<GpuBroadPhase>;

class GpuPersistent : public testing::Test {
 protected:
  void SetUp() override { THRONG_NEEDS_GPU(); }
};

void run_calls(const Options& options, float fat_margin, std::uint64_t seed, std::size_t objects,
               float side, bool filtered, int steps = 40) {
  GpuActor actor(options, seed, side, fat_margin);
  actor.in_worlds =
      options.algorithm != Algorithm::grid;  // candidates are repaired only without worlds
  Random& random = actor.random;
  ASSERT_TRUE(actor.add(objects, filtered));
  ASSERT_TRUE(actor.update());
  for (int step = 0; step < steps; ++step) {
    const bool calm = step / 10 % 3 != 2;
    switch (random.below(6)) {
      case 0:
        ASSERT_TRUE(actor.add(random.below(calm ? 3 : 60), filtered));
        break;
      case 1:
        ASSERT_TRUE(actor.remove(random.below(calm ? 4 : 60)));
        break;
      case 2:
        ASSERT_TRUE(actor.set_filters(filtered ? 3 : 0));
        break;
      default:
        ASSERT_TRUE(actor.move(random.below(calm ? 5 : 300)));
        break;
    }
    actor.broad_phase.combine_with_update(random.one_in(2));
    if (random.one_in(2)) {
      ASSERT_TRUE(actor.move_all(calm ? 200 : 2));
    }
    ASSERT_TRUE(actor.update()) << "step " << step << " seed " << seed;
  }
}

TEST_F(GpuPersistent, Plain) { run_calls({}, 0.5f, 1, 300, 12, false); }
TEST_F(GpuPersistent, Filtered) { run_calls({}, 0.5f, 2, 250, 8, true); }
TEST_F(GpuPersistent, NoFatBoxes) { run_calls({}, 0, 3, 200, 8, true); }
TEST_F(GpuPersistent, MarginAndGrid) {
  Options options;
  options.margin = 0.1f;
  options.algorithm = Algorithm::grid;
  run_calls(options, 0.7f, 4, 300, 9, true);
}

// For the sanitizers, which slow everything down.
TEST_F(GpuPersistent, Small) {
  Options options;
  options.algorithm = Algorithm::grid;
  run_calls(options, 0.7f, 5, 100, 6, true, 8);
}

// Several blocks of everything, and more changes than the capacity reserved: against the CPU.
TEST_F(GpuPersistent, ManyObjects) {
  GpuBroadPhase gpu({}, 0.3f);
  BroadPhase cpu;
  BoxList boxes = uniform_boxes(60000, 5);
  ASSERT_TRUE(gpu.add(boxes, nullptr).ok());
  ASSERT_TRUE(cpu.add(boxes, nullptr).ok());
  Random random(1);
  for (int frame = 0; frame < 8; ++frame) {
    for (Box& b : boxes) {
      if (frame % 4 == 1 || (frame % 4 == 2 && !random.one_in(100))) continue;
      const float by = frame % 4 == 3 ? 0.8f : 0.1f * static_cast<float>(random.below(3));
      b.lower.x += by, b.upper.x += by;
    }
    gpu.combine_with_update(frame % 2);
    ASSERT_TRUE(gpu.move_all(boxes).ok());
    ASSERT_TRUE(cpu.move_all(boxes).ok());
    const Result r = gpu.update();
    ASSERT_TRUE(r.ok()) << r.message;
    ASSERT_TRUE(cpu.update().ok());
    const auto same = [](const LivePairs& a, const LivePairs& b) {
      return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                        [](const LivePair& x, const LivePair& y) {
                          return x.first == y.first && x.second == y.second && x.slot == y.slot;
                        });
    };
    EXPECT_TRUE(same(gpu.begun(), cpu.begun())) << frame;
    EXPECT_TRUE(same(gpu.ended(), cpu.ended())) << frame;
    EXPECT_TRUE(same(gpu.pairs(), cpu.pairs())) << frame;
  }
}

TEST_F(GpuPersistent, RefusedCallsChangeNothing) {
  CountingDeviceMemory memory;
  {
    GpuActor actor({}, 7, 6, 0.5f, memory.resource());
    GpuBroadPhase& m = actor.broad_phase;
    ASSERT_TRUE(actor.add(200, true));
    ASSERT_TRUE(actor.remove(3));
    ASSERT_TRUE(actor.update());
    const std::vector<ObjectId> alive = actor.model.ids();
    std::vector<ObjectId> ids = {alive[0], alive[1], alive[0]};
    BoxList boxes(3, Box{{0, 0, 0}, {1, 1, 1}});
    Result r = m.move(ids.data(), boxes);
    EXPECT_EQ(r.status, Status::bad_id);
    EXPECT_EQ(r.first_invalid, 2u);
    EXPECT_NE(std::string(r.message).find("stands at 2"), std::string::npos) << r.message;
    boxes[1].lower.x = std::nanf("");
    ids[2] = alive[2];
    r = m.move(ids.data(), boxes);
    EXPECT_EQ(r.status, Status::nan_box);
    EXPECT_EQ(r.first_invalid, 1u);
    EXPECT_EQ(m.move_all(boxes).status, Status::bad_boxes) << "not one box per id";
    cuda::BroadPhase& scene = m.scene();
    const OnDevice<Box> there(boxes);
    const ObjectId here = alive[0];
    EXPECT_EQ(scene.remove(&here, 1, nullptr).status, Status::bad_boxes) << "host memory";
    EXPECT_EQ(scene.update(Boxes(boxes.data(), 3), nullptr).status, Status::bad_boxes);
    EXPECT_EQ(scene.shift_origin({INFINITY, 0, 0}, nullptr).status, Status::bad_option);
    // An update that needs more memory fails; then memory is available again.
    memory.limit(memory.held());
    BoxList more(5000, Box{{0, 0, 0}, {1, 1, 1}});
    r = m.add(more, nullptr);
    EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
    EXPECT_GT(r.bytes_needed, 0u);
    memory.limit(~std::size_t{0});
    ASSERT_TRUE(actor.move(5));
    ASSERT_TRUE(actor.update());
    EXPECT_EQ(scene.memory_bytes(), memory.held());
  }
  EXPECT_EQ(memory.held(), 0u);
}

TEST_F(GpuPersistent, SnapshotAndRollback) {
  GpuActor actor({}, 4, 8, 0.5f);
  const Stream stream;
  cuda::BroadPhase& scene = actor.broad_phase.scene();
  ASSERT_TRUE(actor.add(200, true));
  ASSERT_TRUE(actor.update());
  ASSERT_TRUE(actor.move(9));
  ASSERT_TRUE(actor.remove(4));
  cuda::BroadPhase saved;
  ASSERT_TRUE(saved.copy_from(scene, stream).ok());
  const Model model = actor.model;
  const Random random = actor.random;
  for (int round = 0; round < 2; ++round) {
    for (int k = 0; k < 6; ++k) {
      ASSERT_TRUE(actor.update());
      ASSERT_TRUE(actor.move(k % 2 ? 3 : 100));
      ASSERT_TRUE(actor.add(2, true));
    }
    ASSERT_TRUE(scene.copy_from(saved, stream).ok());
    actor.model = model;
    actor.random = random;
  }
}

}  // namespace
}  // namespace throng::tests
