// Boxes of bodies on a device: same bits as the CPU, wrong shapes reported, captured in a graph
// with the search.
#include <cstring>

#include "cuda/gpu_fixture.hpp"
#include "support/body_scenes.hpp"

namespace throng::tests {
namespace {

class GpuBodies : public testing::TestWithParam<bool> {  // parameter: on its own stream
 protected:
  void SetUp() override {
    THRONG_NEEDS_GPU();
    if (GetParam()) own_ = std::make_unique<Stream>();
  }
  cudaStream_t stream() const { return own_ ? static_cast<cudaStream_t>(*own_) : nullptr; }

 private:
  std::unique_ptr<Stream> own_;
};

// A scene's arrays in device memory, and a view of them.
struct BodiesOnDevice {
  explicit BodiesOnDevice(const BodyScene& scene)
      : transforms(scene.transforms),
        displacements(scene.displacements),
        shape(scene.shape),
        shapes(scene.shapes),
        points(scene.points) {}
  Bodies view() const {
    Bodies b(transforms.data(), transforms.size(), shapes.data(), shapes.size());
    b.displacement = {displacements.data(), displacements.size()};
    b.shape = {shape.data(), shape.size()};
    b.points = {points.data(), points.size()};
    return b;
  }
  OnDevice<Transform> transforms;
  OnDevice<Vec3> displacements;
  OnDevice<std::uint32_t> shape;
  OnDevice<Shape> shapes;
  OnDevice<Vec3> points;
};

// The same bits, or both NaN: NaN payloads depend on the processor.
void expect_same(const std::vector<Box>& got, const std::vector<Box>& want) {
  ASSERT_EQ(got.size(), want.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    for (int k = 0; k < 6; ++k) {
      const float g = (&got[i].lower.x)[k], w = (&want[i].lower.x)[k];
      const bool same = std::isnan(w) ? std::isnan(g) : std::memcmp(&g, &w, sizeof g) == 0;
      if (!same && differ++ == 0) ADD_FAILURE() << "box " << i << ", side " << k << ": " << g;
    }
  }
  EXPECT_EQ(differ, 0u);
}

TEST_P(GpuBodies, SameBitsAsTheHost) {
  const OnDevice<cuda::BodyReport> report(1);
  for (const std::size_t count : {1, 31, 255, 257, 20011, 600000}) {
    const BodyScene scene = body_scene(count, 5 + count);
    const BodiesOnDevice there(scene);
    for (int form = 0; form < 8; ++form) {
      SCOPED_TRACE(std::to_string(count) + " bodies, form " + std::to_string(form));
      if (count > 100000 && form > 0) continue;
      const auto formed = [&](Bodies b, const Shape* shapes) {
        if (form & 1) b.rotation = {};
        if (form & 2) b.displacement = {};
        if (form & 4) b.shape = {}, b.shapes = {shapes + (form == 4 ? 1 : 4), 1};
        return b;
      };
      UpdateOptions options;
      options.margin = form == 3 ? 0.125f : 0;
      const std::vector<Box> want = boxes_of(formed(scene.view(), scene.shapes.data()), options);
      const OnDevice<Box> boxes(count);
      const Result r = cuda::update_boxes(formed(there.view(), there.shapes.data()), boxes.data(),
                                          report.data(), stream(), options);
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(r.written, count);
      EXPECT_EQ(r.plan.backend, Backend::cuda);
      expect_same(boxes.get(), want);
      EXPECT_EQ(report.get()[0].bad_shapes, 0u);
    }
  }
}

// Boxes inside structures: the bytes between them stay unchanged.
TEST_P(GpuBodies, AnyLayout) {
  struct Thing {
    std::uint32_t before;
    Box box;
    std::uint32_t after;
  };
  const BodyScene scene = body_scene(5000, 3);
  const BodiesOnDevice there(scene);
  OnDevice<Thing> things(std::vector<Thing>(5000, Thing{7, {}, 8}));
  const OnDevice<cuda::BodyReport> report(1);
  const Result r = cuda::update_boxes(there.view(), &things.data()->box, report.data(), stream(),
                                      {}, sizeof(Thing));
  ASSERT_TRUE(r.ok()) << r.message;
  std::vector<Box> got;
  for (const Thing& t : things.get()) {
    EXPECT_EQ(t.before, 7u);
    EXPECT_EQ(t.after, 8u);
    got.push_back(t.box);
  }
  expect_same(got, boxes_of(scene.view()));
}

TEST_P(GpuBodies, WrongShapesAreReported) {
  BodyScene scene = body_scene(20000, 7);
  scene.shapes.push_back(Shape::sphere(-1));
  for (const std::size_t i : {19999, 12345, 4100})
    scene.shape[i] = static_cast<std::uint32_t>(scene.shapes.size() - 1);
  std::vector<Box> want(20000);
  ASSERT_EQ(update_boxes(scene.view(), want.data()).status, Status::bad_shape);
  const BodiesOnDevice there(scene);
  const OnDevice<Box> boxes(20000);
  const OnDevice<cuda::BodyReport> report(1);
  Result r = cuda::update_boxes(there.view(), boxes.data(), report.data(), stream());
  EXPECT_EQ(r.status, Status::bad_shape);
  EXPECT_EQ(r.invalid_count, 3u);
  EXPECT_EQ(r.first_invalid, 4100u);
  EXPECT_NE(std::strstr(r.message, "body 4100"), nullptr) << r.message;
  expect_same(boxes.get(), want);
  // The asynchronous form reports in device memory, and resets the report each time.
  for (int again = 0; again < 2; ++again) {
    r = cuda::update_boxes_async(there.view(), boxes.data(), report.data(), stream());
    ASSERT_TRUE(r.ok()) << r.message;
    const cuda::BodyReport result = report.get()[0];
    EXPECT_EQ(result.bad_shapes, 3u);
    EXPECT_EQ(result.first_bad_shape(), 4100u);
  }
  check_cuda(cudaMemset(boxes.data(), 0, 20000 * sizeof(Box)));
  check_cuda(cudaDeviceSynchronize());
  r = cuda::update_boxes_async(there.view(), boxes.data(), nullptr, stream());
  ASSERT_TRUE(r.ok()) << r.message;
  expect_same(boxes.get(), want);
}

TEST_P(GpuBodies, BadPointersAreRefused) {
  const BodyScene scene = body_scene(1000, 8);
  const BodiesOnDevice there(scene);
  const OnDevice<Box> boxes(1001);
  const OnDevice<cuda::BodyReport> report(2);
  std::vector<Box> host_boxes(1000);
  cuda::BodyReport host_report;
  const auto expect_refused = [&](const Bodies& b, Box* out, cuda::BodyReport* result,
                                  const char* words) {
    for (const bool waiting : {true, false}) {
      const Result r = waiting ? cuda::update_boxes(b, out, result, stream())
                               : cuda::update_boxes_async(b, out, result, stream());
      EXPECT_EQ(r.status, Status::bad_bodies) << r.message;
      EXPECT_NE(std::strstr(r.message, words), nullptr) << r.message;
      EXPECT_EQ(r.written, 0u);
    }
  };
  const auto misaligned = [](auto* p, std::size_t bytes) {
    return reinterpret_cast<decltype(p)>(reinterpret_cast<std::uintptr_t>(p) + bytes);
  };
  const Bodies good = there.view(), host = scene.view();
  const auto changed = [&](const auto& change) {
    Bodies b = good;
    change(b);
    return b;
  };
  Box* const out = boxes.data();
  cuda::BodyReport* const result = report.data();
  expect_refused(changed([&](Bodies& b) { b.position = host.position; }), out, result,
                 "'position' lies in host memory");
  expect_refused(changed([&](Bodies& b) { b.rotation = host.rotation; }), out, result,
                 "'rotation'");
  expect_refused(changed([&](Bodies& b) { b.displacement = host.displacement; }), out, result,
                 "'displacement'");
  expect_refused(changed([&](Bodies& b) { b.shape = host.shape; }), out, result, "'shape'");
  expect_refused(changed([&](Bodies& b) { b.shapes = host.shapes; }), out, result, "'shapes'");
  expect_refused(changed([&](Bodies& b) { b.points = host.points; }), out, result, "'points'");
  expect_refused(changed([&](Bodies& b) { b.position.data = misaligned(b.position.data, 2); }), out,
                 result, "'position' is not aligned");
  expect_refused(good, host_boxes.data(), result, "the array of boxes lies in host memory");
  expect_refused(good, misaligned(out, 1), result, "the array of boxes is not aligned");
  expect_refused(good, out, &host_report, "the report lies in host memory");
  expect_refused(good, out, misaligned(result, 4), "the report is not aligned");
  const Result r = cuda::update_boxes(good, out, nullptr, stream());
  EXPECT_EQ(r.status, Status::bad_bodies);
  EXPECT_NE(std::strstr(r.message, "the report is null"), nullptr) << r.message;
  // The device still works.
  ASSERT_TRUE(cuda::update_boxes(good, out, result, stream()).ok());
  std::vector<Box> got = boxes.get();
  got.resize(1000);
  expect_same(got, boxes_of(host));
  EXPECT_EQ(cudaGetLastError(), cudaSuccess);
}

TEST_P(GpuBodies, NoBodies) {
  const OnDevice<cuda::BodyReport> report(1);
  check_cuda(cudaMemset(report.data(), 0x77, sizeof(cuda::BodyReport)));
  check_cuda(cudaDeviceSynchronize());
  const Result r = cuda::update_boxes(Bodies(), nullptr, report.data(), stream());
  EXPECT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(report.get()[0].bad_shapes, 0u);
}

// A whole frame is captured once, from bodies to pairs, and replayed with bodies that have moved.
TEST_P(GpuBodies, AFrameInAGraph) {
  if (!GetParam()) GTEST_SKIP() << "the default stream cannot be captured";
  constexpr std::size_t count = 3000;  // some of which overlap nearly all others
  std::vector<BodyScene> scenes;
  std::vector<Answer> answers;
  std::size_t capacity = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    scenes.push_back(body_scene(count, seed));
    answers.push_back(reference_pairs(boxes_of(scenes.back().view())));
    capacity = std::max(capacity, answers.back().pairs.size());
  }
  BodiesOnDevice there(scenes[0]);
  const OnDevice<Box> boxes(count);
  const OnDevice<cuda::BodyReport> bodies_report(1);
  const OnDevice<cuda::Report> report(1);
  PairBuffer buffer(capacity);
  check_cuda(cudaDeviceSynchronize());
  Options options;
  options.algorithm = Algorithm::grid;
  options.order = Order::canonical;
  cuda::Finder finder(options);
  ASSERT_TRUE(finder.reserve(count, capacity, stream()).ok());
  check_cuda(cudaStreamBeginCapture(stream(), cudaStreamCaptureModeGlobal));
  const Result made =
      cuda::update_boxes_async(there.view(), boxes.data(), bodies_report.data(), stream());
  const Result found =
      finder.find_async(view(boxes), buffer.out(), capacity, report.data(), stream());
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t frame = nullptr;
  check_cuda(cudaStreamEndCapture(stream(), &graph));
  check_cuda(cudaGraphInstantiate(&frame, graph, 0));
  EXPECT_TRUE(made.ok()) << made.message;
  EXPECT_TRUE(found.ok()) << found.message;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    SCOPED_TRACE(s);
    there.transforms.put(scenes[s].transforms);
    there.displacements.put(scenes[s].displacements);
    there.shape.put(scenes[s].shape);
    there.shapes.put(scenes[s].shapes);
    there.points.put(scenes[s].points);
    buffer.clear();
    check_cuda(cudaGraphLaunch(frame, stream()));
    check_cuda(cudaStreamSynchronize(stream()));
    EXPECT_EQ(bodies_report.get()[0].bad_shapes, 0u);
    EXPECT_EQ(report.get()[0].found, answers[s].pairs.size());
    EXPECT_TRUE(buffer.take(answers[s].pairs.size()) == answers[s].pairs);
  }
  check_cuda(cudaGraphExecDestroy(frame));
  check_cuda(cudaGraphDestroy(graph));
}

INSTANTIATE_TEST_SUITE_P(All, GpuBodies, testing::Bool(), [](const auto& setting) {
  return std::string(setting.param ? "own_stream" : "default_stream");
});

}  // namespace
}  // namespace throng::tests
