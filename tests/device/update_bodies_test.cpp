// The per-thread work of update_boxes, on host threads: the boxes and the report.
#include "device/update_bodies.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "base/threads.hpp"
#include "device/host_device.hpp"
#include "support/body_scenes.hpp"

namespace throng::device {
namespace {

using tests::BodyScene;

base::UpdateBoxes job_of(const BodyScene& scene, std::vector<Box>& out) {
  const Bodies bodies = scene.view();
  base::UpdateBoxes job;
  job.position = base::strided_array(bodies.position);
  job.rotation = base::strided_array(bodies.rotation);
  job.displacement = base::strided_array(bodies.displacement);
  job.shape = base::strided_array(bodies.shape);
  job.shapes = base::strided_array(bodies.shapes);
  job.points = base::strided_array(bodies.points);
  job.shape_count = bodies.shapes.count;
  job.point_count = bodies.points.count;
  job.out = reinterpret_cast<char*>(out.data());
  return job;
}

cuda::BodyReport run(const BodyScene& scene, std::vector<Box>& out, unsigned threads) {
  HostDevice device(std::pmr::new_delete_resource(), HostDevice::Run{base::run_tasks});
  device.begin(base::default_executor(), threads);
  cuda::BodyReport report;
  out.assign(scene.transforms.size(), Box{});
  device.launch(out.size(), UpdateBodies{job_of(scene, out), &report});
  return report;
}

TEST(UpdateBodies, SameBoxesAsPublicApi) {
  for (const std::size_t count : {1, 64, 30000}) {
    const BodyScene scene = tests::body_scene(count, 3);
    const std::vector<Box> want = tests::boxes_of(scene.view());
    for (const unsigned threads : {1u, 4u}) {
      std::vector<Box> got;
      const cuda::BodyReport report = run(scene, got, threads);
      EXPECT_EQ(report.bad_shapes, 0u);
      EXPECT_EQ(std::memcmp(got.data(), want.data(), count * sizeof(Box)), 0);
    }
  }
}

TEST(UpdateBodies, TheReportCountsAndNamesTheFirst) {
  BodyScene scene = tests::body_scene(30000, 4);
  scene.shapes.push_back(Shape::sphere(-1));
  const auto wrong = static_cast<std::uint32_t>(scene.shapes.size() - 1);
  for (const std::size_t i : {29999, 20001, 7777}) scene.shape[i] = wrong + (i & 1);
  for (const unsigned threads : {1u, 4u}) {
    std::vector<Box> got;
    const cuda::BodyReport report = run(scene, got, threads);
    EXPECT_EQ(report.bad_shapes, 3u);
    EXPECT_EQ(report.first_bad_shape(), 7777u);
    EXPECT_NE(got[7777].lower.x, got[7777].lower.x) << "a NaN";
  }
  std::vector<Box> got(scene.transforms.size());
  UpdateBodies{job_of(scene, got), nullptr}(7777);  // no report
  EXPECT_NE(got[7777].lower.x, got[7777].lower.x);
}

}  // namespace
}  // namespace throng::device
