// Device pointers in and out, a stream, and a frame that is recorded once and replayed.
#include <throng/cuda.hpp>
#include <throng/cuda_broad_phase.hpp>
#include <throng/throng.hpp>

#include <cuda_runtime_api.h>

#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

// Two rows of boxes. Each box touches its neighbours.
std::vector<throng::Box> make_boxes(int count, float pitch) {
  std::vector<throng::Box> boxes;
  for (int i = 0; i < count; ++i) {
    const float x = static_cast<float>(i / 2) * pitch, y = static_cast<float>(i % 2) * 5;
    boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
  }
  return boxes;
}

template <class T>
T* on_device(std::size_t count) {
  void* p = nullptr;
  CHECK(cudaMalloc(&p, count * sizeof(T)) == cudaSuccess);
  return static_cast<T*>(p);
}

}  // namespace

int main() {
  const throng::Result gpu = throng::cuda::available();
  if (!gpu.ok()) {
    std::printf("skipped: %s\n", gpu.message);
    return 0;
  }
  constexpr std::size_t count = 20000, capacity = 4 * count;
  const std::vector<throng::Box> apart = make_boxes(count, 1.5f), close = make_boxes(count, 1.0f);
  auto* boxes = on_device<throng::Box>(count);
  auto* pairs = on_device<throng::Pair>(capacity);
  auto* report = on_device<throng::cuda::Report>(1);
  cudaStream_t stream = nullptr;
  CHECK(cudaStreamCreate(&stream) == cudaSuccess);
  const auto simulate = [&](throng::Box* there, cudaStream_t on) {
    cudaMemcpyAsync(there, apart.data(), count * sizeof(throng::Box), cudaMemcpyHostToDevice, on);
  };
  cudaMemcpy(boxes, close.data(), count * sizeof(throng::Box), cudaMemcpyHostToDevice);

  {
    // snippet-begin: device
    throng::cuda::Finder finder;
    const throng::Result result =
        finder.find(throng::Boxes(boxes, count), pairs, capacity, stream);  // device pointers
    if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
    // snippet-end: device
    CHECK(result.ok() && result.found == count - 2);
  }

  {
    // snippet-begin: persistent
    throng::cuda::BroadPhase broad_phase(0.2f);  // fat margin, world units
    throng::Result result = broad_phase.add({boxes, count}, nullptr, stream);  // ids 0, 1, 2, ...
    if (result.ok()) result = broad_phase.update(stream);
    simulate(boxes, stream);  // kernels that move the boxes
    if (result.ok())
      result = broad_phase.update({boxes, count}, stream);  // finds the movers and the events
    if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
    const throng::LivePairs begun = broad_phase.begun();  // in device memory
    // snippet-end: persistent
    CHECK(result.ok() && result.found == 0 && broad_phase.ended().size() == count - 2);
    CHECK(begun.empty());
  }

  {
    auto* rays = on_device<throng::Sweep>(2);
    auto* hits = on_device<throng::SweepHit>(2);
    const throng::Sweep two[2] = {{{{-9, 0.5f, 0.5f}, {-9, 0.5f, 0.5f}}, {100, 0, 0}},
                                  {{{-9, 0.5f, 0.5f}, {-9, 0.5f, 0.5f}}, {-100, 0, 0}}};
    cudaMemcpy(rays, two, sizeof two, cudaMemcpyHostToDevice);
    throng::cuda::BroadPhase broad_phase;
    CHECK(broad_phase.add({boxes, count}, nullptr, stream).ok());
    // snippet-begin: rays
    // rays: throng::Sweep[2], hits: throng::SweepHit[2], both in device memory
    const throng::Result hit = broad_phase.find_first_hits(rays, 2, {}, hits, stream);
    if (!hit.ok()) std::fprintf(stderr, "%s\n", hit.message);
    // snippet-end: rays
    throng::SweepHit first[2];
    cudaMemcpyAsync(first, hits, sizeof first, cudaMemcpyDeviceToHost, stream);
    cudaStreamSynchronize(stream);
    CHECK(hit.ok() && hit.found == 1 && first[0].object == 0);
    CHECK(first[1].object == throng::cuda::no_object);
    cudaFree(rays);
    cudaFree(hits);
  }
  cudaMemcpy(boxes, close.data(), count * sizeof(throng::Box), cudaMemcpyHostToDevice);

  // snippet-begin: graph
  throng::cuda::Finder finder;
  throng::Result ready = finder.reserve(count, 0, stream);  // later calls allocate nothing

  cudaGraph_t graph;
  cudaGraphExec_t frame;
  cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal);
  if (ready.ok())
    ready = finder.find_async(throng::Boxes(boxes, count), pairs, capacity, report, stream);
  cudaStreamEndCapture(stream, &graph);
  if (!ready.ok()) std::fprintf(stderr, "%s\n", ready.message);
  cudaGraphInstantiate(&frame, graph, 0);

  cudaGraphLaunch(frame, stream);  // each frame, for the current boxes
  // snippet-end: graph
  throng::cuda::Report copied;
  cudaMemcpyAsync(&copied, report, sizeof copied, cudaMemcpyDeviceToHost, stream);
  cudaStreamSynchronize(stream);
  CHECK(copied.found == count - 2);
  cudaMemcpyAsync(boxes, apart.data(), count * sizeof(throng::Box), cudaMemcpyHostToDevice, stream);
  cudaGraphLaunch(frame, stream);
  cudaMemcpyAsync(&copied, report, sizeof copied, cudaMemcpyDeviceToHost, stream);
  cudaStreamSynchronize(stream);
  CHECK(copied.found == 0);
  std::printf("found %llu pairs, then %llu\n", static_cast<unsigned long long>(count - 2),
              static_cast<unsigned long long>(copied.found));
  cudaGraphExecDestroy(frame);
  cudaGraphDestroy(graph);
  cudaStreamDestroy(stream);
  cudaFree(boxes);
  cudaFree(pairs);
  cudaFree(report);
}
