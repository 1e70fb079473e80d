// A call is captured once into a CUDA graph and replayed with other boxes in the same memory. The
// plan is made on the device, so each replay must be correct.
#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class CapturedGraph {
 public:
  // Captures what `put` launches on the stream.
  template <class F>
  CapturedGraph(cudaStream_t stream, const F& put) {
    check_cuda(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
    result = put();
    check_cuda(cudaStreamEndCapture(stream, &graph_));
    check_cuda(cudaGraphInstantiate(&ready_, graph_, 0));
  }
  ~CapturedGraph() {
    if (ready_) (void)cudaGraphExecDestroy(ready_);
    if (graph_) (void)cudaGraphDestroy(graph_);
  }
  CapturedGraph(const CapturedGraph&) = delete;
  CapturedGraph& operator=(const CapturedGraph&) = delete;
  void replay(cudaStream_t stream) const { check_cuda(cudaGraphLaunch(ready_, stream)); }

  Result result;

 private:
  cudaGraph_t graph_ = nullptr;
  cudaGraphExec_t ready_ = nullptr;
};

class Graph : public OnGpu {};

constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

// Scenes to replay, each padded to `n` boxes with empty slots at random places.
std::vector<HardScene> replayed_scenes(std::size_t n) {
  std::vector<HardScene> scenes = hard_scenes(static_cast<int>(n) * 9 / 10);
  scenes.push_back({"all inactive", BoxList(n, Box{{1, 1, 1}, {0, 0, 0}})});
  scenes.push_back({"all NaN", BoxList(n, Box{{quiet, 0, 0}, {1, 1, 1}})});
  BoxList some = uniform_boxes(static_cast<int>(n), 77);
  for (std::size_t i = 5; i < some.size(); i += 7) (&some[i].lower.x)[i % 6] = quiet;
  scenes.push_back({"some NaN", some});
  scenes.push_back({"one box", BoxList{cube(1, 2, 3, 4)}});
  scenes.push_back({"uniform again", uniform_boxes(static_cast<int>(n), 78)});
  for (HardScene& scene : scenes) {
    Random r(5);
    if (scene.boxes.size() > n) scene.boxes.resize(n);
    while (scene.boxes.size() < n) {
      const std::size_t at = r.below(static_cast<std::uint32_t>(scene.boxes.size() + 1));
      scene.boxes.insert(scene.boxes.begin() + static_cast<std::ptrdiff_t>(at),
                         Box{{0, 0, 1}, {9, 9, -1}});
    }
  }
  return scenes;
}

// When this test runs alone, this is the first GPU work of the process.
TEST_P(Graph, ReplaysAreRightForAnyBoxes) {
  const Stream own;
  const std::size_t n = 2000;
  const std::vector<HardScene> scenes = replayed_scenes(n);
  std::vector<Answer> answers;
  std::size_t capacity = 0;
  for (const HardScene& scene : scenes) {
    answers.push_back(reference_pairs(scene.boxes));
    capacity = std::max(capacity, answers.back().pairs.size());
  }
  OnDevice<Box> boxes(n);
  const OnDevice<cuda::Report> report(1);
  PairBuffer buffer(capacity);
  check_cuda(cudaDeviceSynchronize());
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(n, capacity, own).ok());
  const CapturedGraph recorded(own, [&] {
    return finder.find_async(view(boxes), buffer.out(), capacity, report.data(), own);
  });
  ASSERT_TRUE(recorded.result.ok()) << recorded.result.message;
  for (int round = 0; round < 2; ++round) {
    for (std::size_t s = 0; s < scenes.size(); ++s) {
      SCOPED_TRACE(scenes[s].name);
      boxes.put(scenes[s].boxes);
      buffer.clear();
      check_cuda(cudaDeviceSynchronize());
      recorded.replay(own);
      own.wait();
      const cuda::Report replayed = report.get()[0];
      EXPECT_EQ(replayed.found, answers[s].pairs.size());
      EXPECT_EQ(replayed.inactive, answers[s].inactive);
      const std::vector<Pair> got = buffer.take(answers[s].pairs.size());
      if (canonical()) {
        EXPECT_TRUE(got == answers[s].pairs);
      }
      EXPECT_TRUE(same_pairs(got, answers[s].pairs));
      std::uint64_t nans = 0;
      for (const Box& b : scenes[s].boxes) {
        bool nan = false;
        for (int k = 0; k < 6; ++k) nan = nan || std::isnan((&b.lower.x)[k]);
        nans += nan;
      }
      EXPECT_EQ(replayed.nan_count, nans);
    }
  }
}

// Worlds and the second set change between replays.
TEST_P(Graph, ReplaysUseCurrentFilters) {
  const Stream own;
  const std::size_t n = 3000, m = 1500;
  OnDevice<Box> first(n), second(m);
  OnDevice<std::int32_t> worlds(n), owners(m);
  const OnDevice<cuda::Report> report(1);
  PairBuffer buffer(400000);
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(n + m, buffer.capacity(), own).ok());
  Boxes a = view(first), b = view(second);
  a.filters.world = {worlds.data(), n};
  b.filters.owner = {owners.data(), m};
  const CapturedGraph recorded(own, [&] {
    return finder.find_async(a, b, buffer.out(), buffer.capacity(), report.data(), own);
  });
  ASSERT_TRUE(recorded.result.ok()) << recorded.result.message;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const BoxList left = uniform_boxes(static_cast<int>(n), seed),
                  right = huge_among_small(static_cast<int>(m), seed + 100);
    std::vector<std::int32_t> w(n), o(m);
    Random r(seed);
    for (auto& v : w) v = r.between(-1, static_cast<int>(seed) * 10);
    for (auto& v : o) v = r.between(-1, 3);
    first.put(left);
    second.put(right);
    worlds.put(w);
    owners.put(o);
    buffer.clear();
    check_cuda(cudaDeviceSynchronize());
    recorded.replay(own);
    own.wait();
    Boxes host_a(left), host_b(right);
    host_a.filters.world = {w.data(), n};
    host_b.filters.owner = {o.data(), m};
    const Answer answer = reference_pairs(host_a, host_b);
    ASSERT_LE(answer.pairs.size(), buffer.capacity());
    EXPECT_EQ(report.get()[0].found, answer.pairs.size());
    EXPECT_TRUE(same_pairs(buffer.take(answer.pairs.size()), answer.pairs));
  }
}

// Many replays in flight: each leaves the workspace ready for the next.
TEST_P(Graph, ReplaysInARow) {
  const Stream own;
  const BoxList list = uniform_boxes(30000, 4);
  const Answer answer = swept_pairs(list);
  const OnDevice<Box> boxes(list);
  const OnDevice<cuda::Report> report(1);
  const PairBuffer buffer(answer.pairs.size());
  check_cuda(cudaDeviceSynchronize());
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(list.size(), buffer.capacity(), own).ok());
  const CapturedGraph recorded(own, [&] {
    return finder.find_async(view(boxes), buffer.out(), buffer.capacity(), report.data(), own);
  });
  ASSERT_TRUE(recorded.result.ok()) << recorded.result.message;
  for (int k = 0; k < 200; ++k) recorded.replay(own);
  own.wait();
  EXPECT_EQ(report.get()[0].found, answer.pairs.size());
  EXPECT_TRUE(same_pairs(buffer.take(answer.pairs.size()), answer.pairs));
}

std::vector<Setting> own_stream_settings() {  // the default stream cannot be captured
  std::vector<Setting> settings;
  for (const Setting& s : all_settings())
    if (s.own_stream) settings.push_back(s);
  return settings;
}
INSTANTIATE_TEST_SUITE_P(All, Graph, testing::ValuesIn(own_stream_settings()), setting_name);

}  // namespace
}  // namespace throng::tests
