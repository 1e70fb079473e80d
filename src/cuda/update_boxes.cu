#include "pipeline/update_bodies.hpp"

#include "cuda/backend.hpp"
#include "cuda/guard.hpp"
#include "cuda/launch.cuh"

namespace throng::cuda {
namespace {

void check_arrays(const core::UpdateBoxes& job, std::size_t count, const BodyReport* report,
                  int device) {
  const Reach reach(device, Status::bad_bodies);
  if (report) reach.require(report, alignof(BodyReport), "the report");
  if (count == 0) return;
  reach.require(job.position, "the array 'position'");
  reach.require(job.rotation, "the array 'rotation'");
  reach.require(job.displacement, "the array 'displacement'");
  reach.require(job.shape, "the array 'shape'");
  reach.require(job.shapes, "the array 'shapes'");
  reach.require(job.points, "the array 'points'");
  reach.require(job.out, alignof(Box), "the array of boxes");
}

}  // namespace

void update_boxes_async(const core::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream stream) {
  const int device = device_of(stream);
  const Current current(device);
  check_arrays(job, count, report, device);
  (void)cudaGetLastError();  // an earlier error of the caller is not an error of this call
  if (report) check(cudaMemsetAsync(report, 0, sizeof(BodyReport), stream));
  if (count == 0) return;
  int processors = 1;
  check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
  run_each<<<blocks_for(count, 8, processors), block_threads, 0, stream>>>(
      count, pipeline::UpdateBodies{job, report});
  check(cudaGetLastError());
}

BodyReport update_boxes(const core::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream stream) {
  if (!report) throw pipeline::Failure{Status::bad_bodies, 0, "is null", "the report"};
  update_boxes_async(job, count, report, stream);
  const Current current(device_of(stream));
  BodyReport told;
  check(cudaMemcpyAsync(&told, report, sizeof told, cudaMemcpyDeviceToHost, stream));
  check(cudaStreamSynchronize(stream));
  return told;
}

}  // namespace throng::cuda
