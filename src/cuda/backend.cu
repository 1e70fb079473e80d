#include "cuda/backend.hpp"

#include <memory>
#include <new>

#include "cuda/device.cuh"
#include "cuda/upload.hpp"
#include "pipeline/engine.hpp"

namespace throng::cuda {
namespace {

using pipeline::Failure;
using pipeline::Input;
using pipeline::Pipeline;
using pipeline::Workspace;

// Throws `status` with the words for what the GPU could not read.
void require_on_device(const void* p, std::size_t alignment, Status status,
                       const char* in_host_memory, const char* misaligned) {
  cudaPointerAttributes attributes{};
  check(cudaPointerGetAttributes(&attributes, p));
  if (attributes.type == cudaMemoryTypeUnregistered) throw Failure{status, 0, in_host_memory};
  if (reinterpret_cast<std::uintptr_t>(p) % alignment != 0) throw Failure{status, 0, misaligned};
}

class Gpu final : public Engine {
 public:
  explicit Gpu(const MemoryResource& resource) : memory_(resource), engine_(memory_) {}
  ~Gpu() override {
    if (!own_) return;
    device().begin(nullptr, false);  // memory is given back on a stream that still is
    (void)cudaStreamDestroy(own_);
  }

  void find(const Boxes& a, const Boxes* b, const Options& options, core::Output* output,
            const Consumer* consumer, Result& r) override {
    const Current current(device().ordinal());
    if (!own_) check(cudaStreamCreateWithFlags(&own_, cudaStreamNonBlocking));
    device().begin(own_, options.measure_stages);
    const std::size_t bytes = Upload::bytes(a) + (b ? Upload::bytes(*b) : 0);
    char* to = boxes_.room(bytes + 256);
    const Boxes first = upload_.send(a, to, own_);
    const Boxes second = b ? upload_.send(*b, to, own_) : Boxes();
    engine_.find(first, b ? &second : nullptr, options, boxes_.bytes(), output, consumer, r);
    second_ = engine_.nan_in_second_set();
  }
  bool nan_in_second_set() const noexcept override { return second_; }

  void reserve(std::size_t boxes, std::size_t pairs, Stream stream) override {
    const Current current(device().ordinal());
    require_own(stream);
    device().begin(stream, false);
    if (boxes > pipeline::max_pipeline_boxes) throw Failure{Status::too_many_boxes, boxes};
    // Where memory runs short in between, nothing counts as reserved.
    if (boxes > reserved_.boxes) {
      reserved_ = {};
      const auto count = static_cast<std::uint32_t>(boxes);
      Workspace w;
      w.carve(count, workspace_.room(w.carve(count, nullptr, Device::scan_bytes)),
              Device::scan_bytes);
      reserved_ = w;
    }
    if (pairs > pairs_reserved_) {
      pairs_reserved_ = 0;
      unordered_.room(pairs * sizeof(Pair));
      sorting_.room(Device::sort_bytes(pairs));
      pairs_reserved_ = pairs;
    }
    check(cudaStreamSynchronize(stream));
  }

  void find_on_device(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                      std::size_t capacity, Stream stream, Result& r) override {
    const bool in_order = options.order == Order::canonical;
    const std::size_t count = a.size() + (b ? b->size() : 0);
    r.plan.backend = Backend::cuda;
    r.plan.reason = "";
    require_own(stream);
    if (count == 0) return;
    if (count > reserved_.boxes || (in_order && capacity > pairs_reserved_))
      reserve(count, in_order ? capacity : 0, stream);
    const Current current(device().ordinal());
    device().begin(stream, options.measure_stages);
    Workspace w;
    const Input in = enqueue(a, b, options, out, capacity, nullptr, w);
    const Report report = device().read(*w.report);
    const bool brute = Pipeline<Device>::brute_force(in, options.algorithm);
    pipeline::tell_plan(brute, r);
    r.times = device().times();
    r.comparisons = report.comparisons;
    const bool accepted = pipeline::accept(report, in, options.nan, r, second_);
    if (report.bad_worlds) {
      r.inactive = report.inactive;
      r.invalid_count = report.bad_worlds;
      r.first_invalid = in.local(report.first_bad_world());
      r.status = Status::bad_filter;
    } else if (accepted) {
      r.found = report.found;
      r.written = in_order && r.found > capacity ? 0 : std::min<std::uint64_t>(r.found, capacity);
      if (r.found > capacity) r.status = Status::buffer_too_small;
    }
  }

  void find_async(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                  std::size_t capacity, Report* report, Stream stream) override {
    const std::size_t count = a.size() + (b ? b->size() : 0);
    const bool in_order = options.order == Order::canonical;
    if (count > reserved_.boxes || (in_order && capacity > pairs_reserved_))
      throw Failure{Status::not_reserved, count};
    const Current current(device().ordinal());
    require_own(stream);
    if (!report) throw Failure{Status::bad_option, 0, "the report is null"};
    require_on_device(report, alignof(Report), Status::bad_option, "the report lies in host memory",
                      "the report is not aligned to 8 bytes");
    device().begin(stream, false);
    if (count == 0) return device().clear(report, sizeof(Report));
    Workspace w;
    enqueue(a, b, options, out, capacity, report, w);
  }

  std::size_t held() const noexcept override {
    return engine_.held() + boxes_.bytes() + workspace_.bytes() + unordered_.bytes() +
           sorting_.bytes();
  }

 private:
  // The device that this belongs to is current as long as this lives.
  class Current {
   public:
    explicit Current(int device) {
      check(cudaGetDevice(&before_));
      if (before_ != device) check(cudaSetDevice(device));
    }
    ~Current() { (void)cudaSetDevice(before_); }

   private:
    int before_ = 0;
  };

  Device& device() noexcept { return engine_.device(); }

  void check_pointers(const Boxes& boxes) const {
    if (boxes.size() == 0) return;
    for (int k = 0; k < (boxes.packed_data() ? 1 : 6); ++k)
      if (const char* p = boxes.corner_data(k))
        require_on_device(p, alignof(float), Status::bad_boxes,
                          "a coordinate array lies in host memory",
                          "a coordinate array is not aligned to 4 bytes");
    const Filters& f = boxes.filters;
    const void* words[4] = {f.group.data, f.mask.data, f.owner.data, f.world.data};
    for (const void* p : words)
      if (p)
        require_on_device(p, 4, Status::bad_filter, in_host, "a filter is not aligned to 4 bytes");
    if (f.is_static) require_on_device(f.is_static.data, 1, Status::bad_filter, in_host, "");
  }
  static constexpr const char* in_host = "a filter lies in host memory";

  // What is put on a stream of another device would not find our memory.
  void require_own(Stream stream) const {
    if (!stream) return;
    int of = 0;
    check(cudaStreamGetDevice(stream, &of));
    if (of != engine_.device().ordinal())
      throw Failure{Status::bad_option, 0, "the stream is of another device than this Finder"};
  }

  // All of a frame, put on the stream. `report` null: the workspace's own.
  Input enqueue(const Boxes& a, const Boxes* b, const Options& options, Pair* out,
                std::size_t capacity, Report* report, Workspace& w) {
    check_pointers(a);
    if (b) check_pointers(*b);
    if (capacity != 0)
      require_on_device(out, alignof(Pair), Status::bad_option, "the output lies in host memory",
                        "the output is not aligned to 4 bytes");
    const Input in = pipeline::make_input(a, b, options);
    w = reserved_;
    if (report) w.report = report;
    const bool brute = Pipeline<Device>::brute_force(in, options.algorithm);
    const bool in_order = options.order == Order::canonical;
    const Pipeline<Device> pipeline(device());
    pipeline.build(in, brute, w);
    pipeline.find(in, brute, w, {in_order ? unordered_.as<Pair>() : out, capacity, w.report});
    if (in_order) {
      device().sort(unordered_.as<Pair>(), sorting_.as<char>(), sorting_.bytes(), out, capacity,
                    capacity, w.report, in);
      device().mark(pipeline::Stage::order);
    }
    return in;
  }

  Memory memory_;
  pipeline::Engine<Device> engine_;  // of what lies in host memory; it owns the device
  Upload upload_;
  cudaStream_t own_ = nullptr;  // for these
  pipeline::Block<Device> boxes_{engine_.device()}, workspace_{engine_.device()},
      unordered_{engine_.device()}, sorting_{engine_.device()};
  Workspace reserved_;  // in workspace_, for reserved_.boxes boxes
  std::size_t pairs_reserved_ = 0;
  bool second_ = false;
};

}  // namespace

void check_available() {
  int count = 0;
  check(cudaGetDeviceCount(&count));
  if (count == 0) check(cudaErrorNoDevice);
  cudaFuncAttributes attributes{};  // this build has code for the device
  check(cudaFuncGetAttributes(&attributes, run_phases<pipeline::PlanGrid>));
}

Engine* create(const MemoryResource& resource) {
  check_available();
  Engine* engine = new (std::nothrow) Gpu(resource);
  if (!engine) throw Failure{Status::out_of_memory, sizeof(Gpu)};
  return engine;
}

}  // namespace throng::cuda
