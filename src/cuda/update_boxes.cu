#include "core/update_boxes.hpp"

#include "cuda/backend.hpp"
#include "cuda/launch.cuh"
#include "pipeline/atomic.hpp"

namespace throng::cuda {
namespace {

struct UpdateBodies {
  core::UpdateBoxes job;
  BodyReport* report;

  __device__ void operator()(std::uint64_t i) const {
    if (job(i) == core::ShapeFault::none || !report) return;
    pipeline::fetch_add(&report->bad_shapes, std::uint64_t{1});
    pipeline::fetch_max(&report->bad_shape_mark, ~static_cast<std::uint32_t>(i));
  }
};

}  // namespace

void update_boxes(const core::UpdateBoxes& job, std::size_t count, BodyReport* report,
                  Stream stream) {
  int device = 0, processors = 1;
  if (stream)
    check(cudaStreamGetDevice(stream, &device));
  else
    check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
  if (report) check(cudaMemsetAsync(report, 0, sizeof(BodyReport), stream));
  if (count == 0) return;
  run_each<<<blocks_for(count, 8, processors), block_threads, 0, stream>>>(
      count, UpdateBodies{job, report});
  check(cudaGetLastError());
}

}  // namespace throng::cuda
