#include "cuda/backend.hpp"

#include <memory>
#include <new>

#include "base/profile.hpp"
#include "cuda/argument_checks.hpp"
#include "cuda/device.cuh"
#include "cuda/pair_memory.cuh"
#include "device/engine.hpp"

namespace throng::cuda {
namespace {

using device::Failure;
using device::Input;
using device::Pipeline;
using device::Workspace;

class GpuEngine final : public Engine {
 public:
  explicit GpuEngine(const MemoryResource& resource) : memory_(resource), engine_(memory_) {}
  ~GpuEngine() override {
    if (!own_) return;
    (void)cudaStreamSynchronize(own_);  // after a stop by the consumer, a copy may still run
    device().begin(nullptr, false);     // memory is released on a stream that still exists
    (void)cudaStreamDestroy(own_);
  }

  void find(const Boxes& a, const Boxes* b, const Options& options, std::size_t already_held,
            base::Output* output, const Consumer* consumer, Result& r) override {
    const CurrentDevice current(device().ordinal());
    if (!own_) check(cudaStreamCreateWithFlags(&own_, cudaStreamNonBlocking));
    device().begin(own_, options.measure_stages, options.stop);
    engine_.find(a, b, options, already_held, output, consumer, r);
    nan_in_second_ = engine_.nan_in_second_set();
  }
  bool nan_in_second_set() const noexcept override { return nan_in_second_; }

  void reserve(std::size_t boxes, std::size_t pairs, Stream stream) override {
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    device().begin(stream, false);
    check_box_count(boxes);
    // If memory runs out midway, nothing counts as reserved.
    if (boxes > reserved_.boxes) {
      reserved_ = {};
      const auto count = static_cast<std::uint32_t>(boxes);
      Workspace w;
      w.carve<Device>(count, workspace_.ensure(w.carve<Device>(count, nullptr)));
      reserved_ = w;
    }
    pairs_.reserve(pairs);
    check(cudaStreamSynchronize(stream));
  }

  void find_on_device(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                      std::size_t capacity, Stream stream, Result& r) override {
    THRONG_RANGE("search on the GPU");
    const std::size_t count = a.size() + (b ? b->size() : 0);
    r.plan.backend = Backend::cuda;
    r.plan.reason = "";
    check_stream(stream);
    if (count == 0) return;
    if (!is_reserved(count, options, capacity))
      reserve(count, options.order == Order::canonical ? capacity : 0, stream);
    const CurrentDevice current(device().ordinal());
    device().begin(stream, options.measure_stages);
    Workspace w;
    const Input in = enqueue(a, b, options, out, capacity, nullptr, w);
    const Report report = device().read(*w.report);
    const bool brute = Pipeline<Device>::brute_force(in, options.algorithm);
    device::set_plan(brute, r);
    device::set_worlds_reason(brute, report, in, r);
    r.times = device().times();
    r.comparisons = report.comparisons;
    const bool accepted = device::accept(report, in, options.nan, r, nan_in_second_);
    if (report.bad_worlds) {
      r.inactive = report.inactive;
      r.invalid_count = report.bad_worlds;
      r.first_invalid = in.local(report.first_bad_world());
      r.status = Status::bad_filter;
    } else if (accepted) {
      set_counts(report, options.order, capacity, r);
    }
  }

  Pairs find_growing(const Boxes& a, const Boxes* b, const Options& options, Stream stream,
                     Result& r) override {
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    const std::size_t count = a.size() + (b ? b->size() : 0);
    check_box_count(count);
    device().begin(stream, false);
    return pairs_.grow(4 * count, r, [&](Pair* out, std::size_t capacity) {
      find_on_device(a, b, options, out, capacity, stream, r);
    });
  }

  void find_async(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                  std::size_t capacity, Report* report, Stream stream) override {
    const std::size_t count = a.size() + (b ? b->size() : 0);
    if (!is_reserved(count, options, capacity)) throw Failure{Status::not_reserved, count};
    const CurrentDevice current(device().ordinal());
    check_stream(stream);
    AccessCheck(device().ordinal(), Status::bad_option)
        .require(report, alignof(Report), "the report");
    device().begin(stream, false);
    if (count == 0) return device().clear(report, sizeof(Report));
    Workspace w;
    enqueue(a, b, options, out, capacity, report, w);
  }

  std::size_t held() const noexcept override {
    return engine_.held() + workspace_.bytes() + pairs_.bytes();
  }

 private:
  Device& device() noexcept { return engine_.device(); }

  static void check_box_count(std::size_t boxes) {
    if (boxes > device::max_pipeline_boxes) throw Failure{Status::too_many_boxes, boxes};
  }
  bool is_reserved(std::size_t boxes, const Options& options, std::size_t capacity) const noexcept {
    return boxes <= reserved_.boxes && pairs_.suffices(options.order, capacity);
  }
  // Work on a stream of another device could not reach this device's memory.
  void check_stream(Stream stream) const {
    if (stream && device_of(stream) != engine_.device().ordinal())
      throw Failure{Status::bad_option, 0, "is of another device than this Finder", "the stream"};
  }

  // Launches a whole search on the stream. `report` null: the workspace's own.
  Input enqueue(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                std::size_t capacity, Report* report, Workspace& w) {
    THRONG_RANGE("enqueue");
    const Input in = device::make_input(a, b, options);
    require_set(in.sets[0], a.size(), device().ordinal());
    if (b) require_set(in.sets[1], b->size(), device().ordinal());
    if (capacity != 0)
      AccessCheck(device().ordinal(), Status::bad_option).require(out, alignof(Pair), "the output");
    w = reserved_;
    if (report) w.report = report;
    const bool brute = Pipeline<Device>::brute_force(in, options.algorithm);
    const Pipeline<Device> pipeline(device());
    pipeline.build_and_find(in, brute, w, {pairs_.target(options.order, out), capacity, w.report});
    if (options.order == Order::canonical) pairs_.sort(device(), out, capacity, w.report, in);
    return in;
  }

  Memory memory_;
  device::Engine<Device> engine_;  // for boxes in host memory; owns the device
  cudaStream_t own_ = nullptr;     // stream of engine_
  device::DeviceBuffer<Device> workspace_{engine_.device()};
  PairMemory pairs_{engine_.device()};
  Workspace reserved_;  // in workspace_, for reserved_.boxes boxes
  bool nan_in_second_ = false;
};

}  // namespace

bool is_built() noexcept { return true; }

void check_available() {
  int count = 0;
  check(cudaGetDeviceCount(&count));
  if (count == 0) check(cudaErrorNoDevice);
  cudaFuncAttributes attributes{};  // checks that this build has code for the device
  check(cudaFuncGetAttributes(&attributes, run_phases<device::PlanGrid>));
}

Engine* create(const MemoryResource& resource) {
  check_available();
  Engine* engine = new (std::nothrow) GpuEngine(resource);
  if (!engine) throw Failure{Status::out_of_memory, sizeof(GpuEngine)};
  return engine;
}

}  // namespace throng::cuda
