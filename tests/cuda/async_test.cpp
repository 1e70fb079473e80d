// Asynchronous calls: they do not synchronize or allocate, and can be captured and replayed with
// other boxes.
#include <atomic>
#include <chrono>
#include <thread>

#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class GpuAsync : public OnGpu {};

// The Report must equal this answer.
void expect_report(const cuda::Report& report, const BoxList& boxes, const Answer& answer) {
  EXPECT_EQ(report.found, answer.pairs.size());
  EXPECT_EQ(report.inactive, answer.inactive);
  std::uint64_t nan_count = 0, first = ~0ull;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    bool nan = false;
    for (int k = 0; k < 6; ++k) nan = nan || std::isnan((&boxes[i].lower.x)[k]);
    if (nan && nan_count++ == 0) first = i;
  }
  EXPECT_EQ(report.nan_count, nan_count);
  if (nan_count) {
    EXPECT_EQ(report.first_nan(), first);
  }
  EXPECT_EQ(report.bad_worlds, 0u);
  EXPECT_GE(report.comparisons, report.found);
}

TEST_P(GpuAsync, NotReservedIsReported) {
  const BoxList list = uniform_boxes(1000, 1);
  const OnDevice<Box> boxes(list);
  const OnDevice<cuda::Report> report(1);
  const PairBuffer buffer(10000);
  cuda::Finder finder(options());
  const auto call = [&](std::size_t count, std::size_t capacity) {
    return finder.find_async(Boxes(boxes.data(), count), buffer.out(), capacity, report.data(),
                             stream());
  };
  Result r = call(1000, 10000);
  EXPECT_EQ(r.status, Status::not_reserved);
  EXPECT_NE(std::string(r.message).find("reserve()"), std::string::npos) << r.message;
  EXPECT_EQ(finder.memory_bytes(), 0u);
  ASSERT_TRUE(finder.reserve(900, 5000, stream()).ok());
  EXPECT_EQ(call(1000, 5000).status, Status::not_reserved);
  EXPECT_EQ(call(900, 5001).status, canonical() ? Status::not_reserved : Status::ok);
  EXPECT_EQ(call(900, 5000).status, Status::ok);
  ASSERT_TRUE(finder.reserve(1000, 10000, stream()).ok());
  check_cuda(cudaDeviceSynchronize());
  r = call(1000, 10000);
  ASSERT_TRUE(r.ok()) << r.message;
  const Answer answer = reference_pairs(list);
  expect_report(report.get()[0], list, answer);
  EXPECT_TRUE(same_pairs(buffer.take(answer.pairs.size()), answer.pairs));
}

TEST_P(GpuAsync, TakesNoMemoryAfterReserve) {
  CountingDeviceMemory memory;
  const BoxList list = uniform_boxes(20000, 1);
  const std::size_t capacity = 100000;
  const OnDevice<Box> boxes(list);
  const OnDevice<cuda::Report> report(1);
  const PairBuffer buffer(capacity);
  cuda::Finder finder(options(), memory.resource());
  ASSERT_TRUE(finder.reserve(list.size(), capacity, stream()).ok());
  EXPECT_GT(memory.held(), 0u);
  EXPECT_EQ(finder.memory_bytes(), memory.held());
  // As documented in cuda.hpp: 49 bytes per box and, with sorted order, 16 per pair; plus a few
  // KiB.
  EXPECT_LE(memory.held(), 49 * list.size() + 16 * capacity + (std::size_t{2} << 20));
  const std::size_t before = memory.allocations();
  memory.limit(memory.held());
  std::size_t free_before = 0, free_after = 0, total = 0;
  const auto call = [&] {
    return finder.find_async(view(boxes), buffer.out(), capacity, report.data(), stream());
  };
  // Loads the kernels and creates the events of find().
  ASSERT_TRUE(call().ok());
  ASSERT_TRUE(finder.find(view(boxes), buffer.out(), capacity, stream()).ok());
  check_cuda(cudaDeviceSynchronize());
  check_cuda(cudaMemGetInfo(&free_before, &total));
  for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(call().ok());
  ASSERT_TRUE(finder.find(view(boxes), buffer.out(), capacity, stream()).ok());
  check_cuda(cudaDeviceSynchronize());
  check_cuda(cudaMemGetInfo(&free_after, &total));
  EXPECT_EQ(memory.allocations(), before);
  EXPECT_EQ(memory.refusals(), 0u);
  EXPECT_EQ(free_before, free_after) << "memory was allocated outside the resource";
}

// A host function blocks the stream: a call that synchronizes would time out.
TEST_P(GpuAsync, WaitsForNothing) {
  struct Gate {
    std::atomic<bool> open{false}, gave_up{false};
  } gate;
  const BoxList list = uniform_boxes(10000, 2);
  const Answer answer = reference_pairs(list);
  const OnDevice<Box> boxes(list);
  const OnDevice<cuda::Report> report(1);
  PairBuffer buffer(answer.pairs.size());
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(list.size(), buffer.capacity(), stream()).ok());
  const auto call = [&] {
    return finder.find_async(view(boxes), buffer.out(), buffer.capacity(), report.data(), stream());
  };
  ASSERT_TRUE(call().ok());  // loads the kernels, which may synchronize
  check_cuda(cudaDeviceSynchronize());
  buffer.clear();
  check_cuda(cudaDeviceSynchronize());
  check_cuda(cudaLaunchHostFunc(
      stream(),
      [](void* p) {
        auto& g = *static_cast<Gate*>(p);
        const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
        while (!g.open.load()) {
          if (std::chrono::steady_clock::now() > until) {
            g.gave_up = true;
            return;
          }
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      },
      &gate));
  const Result r = call();
  const bool waited = gate.gave_up;
  gate.open = true;
  check_cuda(cudaDeviceSynchronize());
  EXPECT_FALSE(waited) << "find_async waited for the stream";
  ASSERT_TRUE(r.ok()) << r.message;
  expect_report(report.get()[0], list, answer);
  EXPECT_TRUE(same_pairs(buffer.take(answer.pairs.size()), answer.pairs));
}

TEST_P(GpuAsync, NoBoxes) {
  const OnDevice<cuda::Report> report(1);
  check_cuda(cudaMemset(report.data(), 0x77, sizeof(cuda::Report)));
  check_cuda(cudaDeviceSynchronize());
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(0, 0, stream()).ok());
  ASSERT_TRUE(finder.find_async(Boxes(), nullptr, 0, report.data(), stream()).ok());
  const cuda::Report r = report.get()[0];
  EXPECT_EQ(r.found, 0u);
  EXPECT_EQ(r.inactive, 0u);
  EXPECT_EQ(r.nan_count, 0u);
}

// Two Finders on two streams, calls interleaved, a hundred frames in flight.
TEST_P(GpuAsync, TwoFindersAtOnce) {
  const Stream streams[2];
  const BoxList lists[2] = {uniform_boxes(6000, 1), clusters_and_outliers(5000, 2)};
  for (const BoxList& list : lists) ASSERT_GT(list.size(), 4200u);
  const Answer answers[2] = {reference_pairs(lists[0]), reference_pairs(lists[1])};
  const OnDevice<Box> boxes[2] = {OnDevice<Box>(lists[0]), OnDevice<Box>(lists[1])};
  const OnDevice<cuda::Report> reports(2);
  const PairBuffer buffers[2] = {PairBuffer(answers[0].pairs.size()),
                                 PairBuffer(answers[1].pairs.size())};
  check_cuda(cudaDeviceSynchronize());
  cuda::Finder finders[2] = {cuda::Finder(options()), cuda::Finder(options())};
  for (int k : {0, 1})
    ASSERT_TRUE(finders[k].reserve(lists[k].size(), buffers[k].capacity(), streams[k]).ok());
  for (int frame = 0; frame < 100; ++frame)
    for (int k : {0, 1})
      ASSERT_TRUE(finders[k]
                      .find_async(view(boxes[k]), buffers[k].out(), buffers[k].capacity(),
                                  reports.data() + k, streams[k])
                      .ok());
  const std::vector<cuda::Report> result = reports.get();
  for (int k : {0, 1}) {
    expect_report(result[static_cast<std::size_t>(k)], lists[k], answers[k]);
    EXPECT_TRUE(same_pairs(buffers[k].take(answers[k].pairs.size()), answers[k].pairs));
  }
}

// Calls of one Finder in succession on a stream, each with its own pairs and report.
TEST_P(GpuAsync, CallsInARow) {
  const std::vector<HardScene> scenes = hard_scenes(700);
  std::vector<OnDevice<Box>> boxes;
  std::vector<Answer> answers;
  std::vector<std::unique_ptr<PairBuffer>> buffers;
  const OnDevice<cuda::Report> reports(scenes.size());
  std::size_t most = 0, most_pairs = 0;
  for (const HardScene& scene : scenes) {
    boxes.emplace_back(scene.boxes);
    answers.push_back(reference_pairs(scene.boxes));
    buffers.push_back(std::make_unique<PairBuffer>(answers.back().pairs.size()));
    most = std::max(most, scene.boxes.size());
    most_pairs = std::max(most_pairs, answers.back().pairs.size());
  }
  check_cuda(cudaDeviceSynchronize());
  cuda::Finder finder(options());
  ASSERT_TRUE(finder.reserve(most, most_pairs, stream()).ok());
  for (std::size_t s = 0; s < scenes.size(); ++s)
    ASSERT_TRUE(finder
                    .find_async(view(boxes[s]), buffers[s]->out(), buffers[s]->capacity(),
                                reports.data() + s, stream())
                    .ok());
  const std::vector<cuda::Report> result = reports.get();
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    SCOPED_TRACE(scenes[s].name);
    expect_report(result[s], scenes[s].boxes, answers[s]);
    EXPECT_TRUE(same_pairs(buffers[s]->take(answers[s].pairs.size()), answers[s].pairs));
  }
}

THRONG_INSTANTIATE_GPU(GpuAsync);

}  // namespace
}  // namespace throng::tests
