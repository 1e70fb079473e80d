#include <memory>
#include <new>

#include "base/profile.hpp"
#include "cuda/argument_checks.hpp"
#include "cuda/backend.hpp"
#include "cuda/device.cuh"
#include "cuda/pair_memory.cuh"
#include "device/engine.hpp"
#include "device/mesh_job.hpp"

namespace throng::cuda {
namespace {

using device::Failure;
using device::Input;
using device::MeshLayout;
using device::MeshPipeline;
using device::MeshWorkspace;
using device::Pipeline;
using device::Workspace;

class GpuMeshEngine final : public MeshEngine {
 public:
  explicit GpuMeshEngine(const MemoryResource& resource) : memory_(resource), engine_(memory_) {}
  ~GpuMeshEngine() override {
    if (!own_) return;
    (void)cudaStreamSynchronize(own_);  // after a stop by the consumer, a copy may still run
    device().begin(nullptr, false);     // memory is released on a stream that still exists
    (void)cudaStreamDestroy(own_);
  }

  void find(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
            std::size_t already_held, base::Output* output, const Consumer* consumer,
            MeshResult& r) override {
    const CurrentDevice current(device().ordinal());
    if (!own_) check(cudaStreamCreateWithFlags(&own_, cudaStreamNonBlocking));
    device().begin(own_, options.measure_stages, options.stop);
    device::MeshJob<Device> job(a, b, options, r);
    engine_.find(job, options, already_held, output, consumer, r);
    defects_ = job.defects();
    defects_in_second_ = job.defects_in_second();
  }
  const mesh::MeshDefects& defects() const noexcept override { return defects_; }
  bool defects_in_second() const noexcept override { return defects_in_second_; }

  void reserve(std::size_t triangles, std::size_t pairs, std::size_t converted_vertices,
               Stream stream) override {
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    device().begin(stream, false);
    if (triangles > device::max_pipeline_boxes) throw Failure{Status::too_many_boxes, triangles};
    // If memory runs out midway, nothing counts as reserved.
    const std::size_t boxes = std::max<std::size_t>(triangles, reserved_.boxes);
    const std::size_t points = std::max(converted_vertices, points_reserved_);
    if (boxes > reserved_.boxes || points > points_reserved_) {
      reserved_ = {};
      points_reserved_ = 0;
      const auto count = static_cast<std::uint32_t>(boxes);
      MeshWorkspace sizes;
      mesh_memory_.ensure(sizes.carve(boxes, points, nullptr));
      Workspace w;
      w.carve<Device>(count, workspace_.ensure(w.carve<Device>(count, nullptr)));
      reserved_ = w;
      points_reserved_ = points;
    }
    pairs_.reserve(pairs);
    check(cudaStreamSynchronize(stream));
  }

  void find_on_device(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
                      Pair* out, std::size_t capacity, Stream stream, MeshResult& r) override {
    THRONG_RANGE("search of triangles on the GPU");
    const std::size_t count = a.size() + (b ? b->size() : 0);
    r.plan.backend = Backend::cuda;
    r.plan.reason = "";
    check_stream(stream);
    if (count == 0) return;
    if (!is_reserved(a, b, options, capacity))
      reserve(count, options.order == Order::canonical ? capacity : 0,
              MeshLayout(a, b).converted_vertices, stream);
    const CurrentDevice current(device().ordinal());
    device().begin(stream, options.measure_stages);
    MeshWorkspace w = workspace();
    const MeshPipeline<Device> pipeline(device(), a, b, w);
    const Input in = enqueue(pipeline, w, a, b, options, out, capacity);
    const MeshReport report = device().read(*w.report);
    device::set_plan(Pipeline<Device>::brute_force(in, options.algorithm), r);
    r.times = device().times();
    r.comparisons = report.search.comparisons;
    r.candidates = report.candidates;
    r.exact_tests = report.exact_tests;
    if (report.search.bad_worlds) {
      r.invalid_count = report.search.bad_worlds;
      r.first_invalid = in.local(report.search.first_bad_world());
      r.status = Status::bad_filter;
    } else if (report.bad_triangles) {
      defects_ = pipeline.defects(report, defects_in_second_);
      r.first_invalid = defects_.first;
      r.invalid_count = defects_.count;
      r.status = Status::bad_mesh;
    } else {
      set_counts(report.search, options.order, capacity, r);
    }
  }

  Pairs find_growing(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
                     Stream stream, MeshResult& r) override {
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    const std::size_t count = a.size() + (b ? b->size() : 0);
    if (count > device::max_pipeline_boxes) throw Failure{Status::too_many_boxes, count};
    device().begin(stream, false);
    return pairs_.grow(count, r, [&](Pair* out, std::size_t capacity) {
      find_on_device(a, b, options, out, capacity, stream, r);
    });
  }

  void find_async(const TriangleMesh& a, const TriangleMesh* b, const Options& options, Pair* out,
                  std::size_t capacity, MeshReport* report, Stream stream) override {
    const std::size_t count = a.size() + (b ? b->size() : 0);
    if (!is_reserved(a, b, options, capacity)) throw Failure{Status::not_reserved, count};
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    AccessCheck(device().ordinal(), Status::bad_option)
        .require(report, alignof(MeshReport), "the report");
    device().begin(stream, false);
    if (count == 0) return device().clear(report, sizeof(MeshReport));
    MeshWorkspace w = workspace();
    w.report = report;
    enqueue(MeshPipeline<Device>(device(), a, b, w), w, a, b, options, out, capacity);
  }

  std::size_t held() const noexcept override {
    return engine_.held() + workspace_.bytes() + mesh_memory_.bytes() + pairs_.bytes();
  }

 private:
  Device& device() noexcept { return engine_.device(); }

  // Work on a stream of another device could not reach this device's memory.
  void check_stream(Stream stream) const {
    if (stream && device_of(stream) != engine_.device().ordinal())
      throw Failure{Status::bad_option, 0, "is of another device than this MeshFinder",
                    "the stream"};
  }
  bool is_reserved(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
                   std::size_t capacity) const noexcept {
    return a.size() + (b ? b->size() : 0) <= reserved_.boxes &&
           pairs_.suffices(options.order, capacity) &&
           MeshLayout(a, b).converted_vertices <= points_reserved_;
  }
  MeshWorkspace workspace() const noexcept {
    MeshWorkspace w;
    w.carve(reserved_.boxes, points_reserved_, mesh_memory_.as<char>());
    return w;
  }

  void require_mesh(const TriangleMesh& mesh) const {
    if (mesh.size() == 0) return;
    const int ordinal = engine_.device().ordinal();
    const AccessCheck arrays(ordinal, Status::bad_mesh);
    arrays.require(mesh.triangles.data, alignof(Triangle), "the array of triangles");
    if (mesh.vertices.size() != 0)
      arrays.require(mesh.vertices.data(),
                     mesh.vertices.is_float() ? alignof(Vec3) : alignof(DoubleVec3),
                     "the array of vertices");
    Boxes filters;
    filters.filters = mesh.filters;
    require_filters(device::make_set(filters), ordinal);
  }

  // Launches a whole search on the stream.
  Input enqueue(const MeshPipeline<Device>& pipeline, const MeshWorkspace& w, const TriangleMesh& a,
                const TriangleMesh* b, const Options& options, Pair* out, std::size_t capacity) {
    THRONG_RANGE("enqueue");
    require_mesh(a);
    if (b) require_mesh(*b);
    if (capacity != 0)
      AccessCheck(device().ordinal(), Status::bad_option).require(out, alignof(Pair), "the output");
    pipeline.write_boxes();
    const Input in = pipeline.make_input(options);
    Workspace of_boxes = reserved_;
    of_boxes.report = &w.report->search;
    const bool brute = Pipeline<Device>::brute_force(in, options.algorithm);
    const Pipeline<Device> search(device());
    search.build(in, brute, of_boxes);
    const device::PairSink sink{pairs_.target(options.order, out), capacity, of_boxes.report};
    search.find(in, brute, of_boxes, sink, {}, pipeline.check());
    pipeline.end_search(sink);
    if (options.order == Order::canonical)
      pairs_.sort(device(), out, capacity, of_boxes.report, in);
    return in;
  }

  Memory memory_;
  device::Engine<Device> engine_;  // for meshes in host memory; owns the device
  cudaStream_t own_ = nullptr;     // stream of engine_
  device::DeviceBuffer<Device> workspace_{engine_.device()}, mesh_memory_{engine_.device()};
  PairMemory pairs_{engine_.device()};
  Workspace reserved_;  // in workspace_, for reserved_.boxes triangles
  std::size_t points_reserved_ = 0;
  mesh::MeshDefects defects_;
  bool defects_in_second_ = false;
};

}  // namespace

MeshEngine* create_mesh_engine(const MemoryResource& resource) {
  check_available();
  MeshEngine* engine = new (std::nothrow) GpuMeshEngine(resource);
  if (!engine) throw Failure{Status::out_of_memory, sizeof(GpuMeshEngine)};
  return engine;
}

}  // namespace throng::cuda
