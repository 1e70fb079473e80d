// Two broad phases get the same boxes in each step of one simulation and must report the same
// overlaps, whichever of them drives the simulation.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <throng/find_pairs.hpp>

#include "apps/simulate/world.hpp"

namespace throng::simulate {
namespace {

struct Case {
  Scene scene;
  Shape shape;
  Phase phase;
};
std::string name(const ::testing::TestParamInfo<Case>& info) {
  std::string phase = to_string(info.param.phase);
  if (info.param.phase == Phase::axis_sweep) phase = "axis_sweep";
  return std::string(to_string(info.param.scene)) + "_" + to_string(info.param.shape) + "_" + phase;
}
std::vector<Case> cases() {
  std::vector<Case> all;
  for (Phase phase : {Phase::throng, Phase::dbvt, Phase::axis_sweep}) {
    all.push_back({Scene::column, Shape::cube, phase});
    all.push_back({Scene::pile, Shape::sphere, phase});
    all.push_back({Scene::rain, Shape::rectangle, phase});
  }
  return all;
}

class ShadowCompareTest : public ::testing::TestWithParam<Case> {};

TEST_P(ShadowCompareTest, report_the_same_in_every_step) {
  Spec spec;
  spec.scene = GetParam().scene;
  spec.shape = GetParam().shape;
  spec.phase = GetParam().phase;
  spec.objects = 300;
  spec.options.threads = 2;
  spec.compare = true;
  World world(spec);
  std::size_t pairs = 0;
  for (int s = 0; s < 90; ++s) {
    const StepReport report = world.step();
    EXPECT_GE(report.step_ms, report.broad_phase_ms);
    const Comparison& c = world.comparison();
    ASSERT_EQ(c.missing, 0u) << "step " << s;
    ASSERT_EQ(c.extra, 0u) << "step " << s;
    // The reported boxes are those that were compared; the plane overlaps every object.
    ASSERT_EQ(find_pairs(world.boxes()).size() + spec.objects, c.pairs) << "step " << s;
    pairs += c.pairs;
  }
  EXPECT_GT(pairs, 90u * 300u);
  if (spec.phase == Phase::throng) {
    EXPECT_EQ(world.pairs(), world.comparison().pairs);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShadowCompareTest, ::testing::ValuesIn(cases()), name);

TEST(Simulation, objects_fall_and_rest_on_the_plane) {
  for (Phase phase : {Phase::throng, Phase::dbvt}) {
    Spec spec;
    spec.objects = 40;
    spec.phase = phase;
    World world(spec);
    const double before = world.position(39).z;
    for (int s = 0; s < 700; ++s) world.step();
    EXPECT_LT(world.position(39).z, before - 1);
    const Contacts contacts = world.contacts();
    EXPECT_GT(contacts.points, 100u);
    EXPECT_LT(contacts.deepest, 0.2);
    for (std::size_t i = 0; i < 40; ++i) {
      EXPECT_GT(world.position(i).z, 0.3) << to_string(phase) << " " << i;
      EXPECT_GT(contacts.of_objects[i], 0) << to_string(phase) << " " << i;
    }
  }
}

TEST(Simulation, the_same_every_time) {
  for (unsigned threads : {1u, 2u}) {
    std::vector<Box> first;
    for (int run = 0; run < 2; ++run) {
      Spec spec;
      spec.scene = Scene::pile;
      spec.objects = 500;
      spec.options.threads = threads;
      World world(spec);
      for (int s = 0; s < 40; ++s) world.step();
      if (run == 0) {
        first = world.boxes();
        continue;
      }
      for (std::size_t i = 0; i < first.size(); ++i) {
        ASSERT_EQ(first[i].lower.x, world.boxes()[i].lower.x) << i;
        ASSERT_EQ(first[i].upper.z, world.boxes()[i].upper.z) << i;
      }
    }
  }
}

TEST(Scenario, objects_stand_above_the_plane_and_apart) {
  for (Scene scene : {Scene::column, Scene::pile, Scene::rain}) {
    for (Shape shape : {Shape::cube, Shape::sphere, Shape::rectangle}) {
      for (std::size_t n : {1u, 2u, 7u, 500u}) {
        const std::vector<Placement> all = place(scene, shape, n, 3);
        ASSERT_EQ(all.size(), n);
        const Extent e = extent(shape);
        for (std::size_t i = 0; i < n; ++i) {
          const Placement& p = all[i];
          EXPECT_GT(p.at[2], e.z / 2) << to_string(scene);
          double norm = 0;
          for (double q : p.turn) norm += q * q;
          EXPECT_NEAR(norm, 1, 1e-9);
          for (std::size_t j = 0; j < i; ++j) {
            const double d =
                std::hypot(p.at[0] - all[j].at[0], p.at[1] - all[j].at[1], p.at[2] - all[j].at[2]);
            ASSERT_GT(d, std::min({e.x, e.y, e.z})) << to_string(scene) << i << " " << j;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace throng::simulate
