#include "device/emulated.hpp"

#include "base/threads.hpp"
#include "device/mesh_job.hpp"

namespace throng::device {
namespace {

void begin(EmulatedEngine& engine, const Options& options) {
  engine.device().begin(base::executor_of(options), base::threads_of(options), options.stop);
}

}  // namespace

void find_emulated(EmulatedEngine& engine, const Boxes& a, const Boxes* b, const Options& options,
                   std::size_t already_held, base::Output* output, const Consumer* consumer,
                   Result& r) {
  begin(engine, options);
  engine.find(a, b, options, already_held, output, consumer, r);
}

EmulatedDefects find_emulated(EmulatedEngine& engine, const TriangleMesh& a, const TriangleMesh* b,
                              const Options& options, std::size_t already_held,
                              base::Output* output, const Consumer* consumer, MeshResult& r) {
  begin(engine, options);
  MeshJob<HostDevice> job(a, b, options, r);
  engine.find(job, options, already_held, output, consumer, r);
  return {job.defects(), job.defects_in_second()};
}

}  // namespace throng::device
