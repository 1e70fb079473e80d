#include "device/update_bodies.hpp"

#include "cuda/argument_checks.hpp"
#include "cuda/backend.hpp"
#include "cuda/launch.cuh"

namespace throng::cuda {
namespace {

void check_arrays(const base::UpdateBoxes& job, std::size_t count, const BodyReport* report,
                  int device) {
  const AccessCheck access(device, Status::bad_bodies);
  if (report) access.require(report, alignof(BodyReport), "the report");
  if (count == 0) return;
  access.require(job.position, "the array 'position'");
  access.require(job.rotation, "the array 'rotation'");
  access.require(job.displacement, "the array 'displacement'");
  access.require(job.shape, "the array 'shape'");
  access.require(job.shapes, "the array 'shapes'");
  access.require(job.points, "the array 'points'");
  access.require(job.out, alignof(Box), "the array of boxes");
}

}  // namespace

void update_boxes_async(const base::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream stream) {
  const int device = device_of(stream);
  const CurrentDevice current(device);
  check_arrays(job, count, report, device);
  (void)cudaGetLastError();  // an earlier error of the caller is not an error of this call
  if (report) check(cudaMemsetAsync(report, 0, sizeof(BodyReport), stream));
  if (count == 0) return;
  int sm_count = 1;
  check(cudaDeviceGetAttribute(&sm_count, cudaDevAttrMultiProcessorCount, device));
  run_each<<<blocks_for(count, 8, sm_count), block_threads, 0, stream>>>(
      count, device::UpdateBodies{job, report});
  check(cudaGetLastError());
}

BodyReport update_boxes(const base::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream stream) {
  if (!report) throw device::Failure{Status::bad_bodies, 0, "is null", "the report"};
  update_boxes_async(job, count, report, stream);
  const CurrentDevice current(device_of(stream));
  BodyReport host_report;
  check(cudaMemcpyAsync(&host_report, report, sizeof host_report, cudaMemcpyDeviceToHost, stream));
  check(cudaStreamSynchronize(stream));
  return host_report;
}

}  // namespace throng::cuda
