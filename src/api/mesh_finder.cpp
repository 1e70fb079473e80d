// MeshFinder, and the functions that use a temporary one.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <utility>

#include <throng/throng.hpp>

#include "base/float_state.hpp"
#include "base/large_pages.hpp"
#include "base/threads.hpp"
#include "cuda/backend.hpp"
#include "device/emulated.hpp"
#include "mesh/engine.hpp"
#include "validate.hpp"
#include "validate_mesh.hpp"

namespace throng {

using ull = unsigned long long;

// The memory of each backend that the MeshFinder has used.
struct MeshFinder::State {
  explicit State(std::pmr::memory_resource* memory) noexcept
      : resource(memory),
        engine(memory, sizeof(State)),
        emulated(memory, device::HostDevice::Run{base::run_tasks}) {}

  std::size_t held() noexcept {
    return engine.search().memory().held() + emulated.held() + (gpu ? gpu->held() : 0);
  }

  MeshResult find(const mesh::MeshCall& call, const Options& options, base::Output* output,
                  const Consumer* consumer, const char* if_no_memory) {
    if (options.backend != Backend::emulated && options.backend != Backend::cuda) {
      MeshResult r = engine.find(call, options, output, consumer);
      defects = engine.defects();
      defects_in_second = engine.defects_in_second();
      return r;
    }
    MeshResult r;
    r.plan.backend = options.backend;
    r.plan.isa = Isa::scalar;
    engine.search().memory().set_cap(0);  // the device's search enforces the cap
    try {
      const auto throw_if_stopped = [&] {
        if (options.stop && options.stop->load()) throw device::Failure{Status::stopped};
      };
      throw_if_stopped();
      if (options.backend == Backend::emulated)
        find_emulated(call, options, output, consumer, r);
      else
        find_on_gpu(call, options, output, consumer, r);
      throw_if_stopped();
    } catch (const device::Failure& failure) {
      explain_failure(r, failure, if_no_memory);
    }
    return r;
  }

  std::pmr::memory_resource* resource;
  mesh::MeshEngine engine;
  device::EmulatedEngine emulated;
  std::unique_ptr<cuda::MeshEngine> gpu;
  mesh::MeshDefects defects;  // of the last call
  bool defects_in_second = false;

 private:
  void find_emulated(const mesh::MeshCall& call, const Options& options, base::Output* output,
                     const Consumer* consumer, MeshResult& r) {
    r.plan.threads = base::threads_of(options);
    const device::EmulatedDefects found = device::find_emulated(
        emulated, *call.a, call.b, options, engine.search().memory().held(), output, consumer, r);
    defects = found.defects;
    defects_in_second = found.in_second;
  }
  void find_on_gpu(const mesh::MeshCall& call, const Options& options, base::Output* output,
                   const Consumer* consumer, MeshResult& r) {
    if (!gpu) gpu.reset(cuda::create_mesh_engine({}));
    gpu->find(*call.a, call.b, options, engine.search().memory().held(), output, consumer, r);
    defects = gpu->defects();
    defects_in_second = gpu->defects_in_second();
  }
};

namespace {

bool valid(const mesh::MeshCall& call, const Options& options, Result& r) noexcept {
  if (!valid_search(options, r) || !valid_mesh_margin(options.margin, r) ||
      (call.within && !valid_on_cpu(options, "triangles within a distance are searched", r))) {
    return false;
  }
  if (call.within && !(call.distance >= 0 && std::isfinite(call.distance))) {
    set_message(r, "the distance is %g; it must be finite and not negative", call.distance);
    return refuse(r, Status::bad_option);
  }
  const char* const first = call.b ? "the first mesh" : "the mesh";
  return valid_mesh(*call.a, first, r) && (!call.b || valid_mesh(*call.b, "the second mesh", r));
}

// The message for an index or a vertex that is not valid.
void explain_defects(const mesh::MeshCall& call, const mesh::MeshDefects& defects, bool second,
                     Result& r) noexcept {
  const TriangleMesh& mesh = call.b && second ? *call.b : *call.a;
  const char* const which = !call.b ? "the mesh" : (second ? "the second mesh" : "the first mesh");
  char others[64];
  others[0] = 0;
  if (defects.count > 1)
    std::snprintf(others, sizeof others, " (%llu more bad triangle%s)", ull{defects.count - 1},
                  defects.count == 2 ? "" : "s");
  explain_bad_triangle(mesh, which, defects.first, defects.vertex, others, r);
}

const char* remedy(const Consumer* consumer) noexcept {
  return consumer ? "free some, or split the mesh"
                  : "take pairs in blocks by MeshFinder::consume, or split the mesh";
}

base::Output into(Pair* out, std::size_t capacity) noexcept {
  return {out, out ? capacity : 0, nullptr, nullptr};
}

}  // namespace

struct MeshFinderAccess {
  // Pairs go to `output` or `consumer`; with both null, into the finder's own memory.
  static MeshResult run(MeshFinder& finder, const mesh::MeshCall& call, base::Output* output,
                        const Consumer* consumer) {
    const base::FloatState float_state;
    finder.pairs_ = {};
    MeshResult r;
    if (!valid(call, finder.options_, r) || !make_state(finder, r)) return r;
    MeshFinder::State& state = *finder.state_;
    base::Buffer<Pair>& pairs = state.engine.search().pairs();
    base::Output own{pairs.data(), pairs.capacity(), grid::grow_pairs, &pairs};
    const bool keeps = !output && !consumer;
    r = state.find(call, finder.options_, keeps ? &own : output, consumer, remedy(consumer));
    if (keeps && r.ok()) finder.pairs_ = {own.data, static_cast<std::size_t>(r.found)};
    if (r.status == Status::bad_mesh)
      explain_defects(call, state.defects, state.defects_in_second, r);
    else
      explain(r, call.b != nullptr, false, remedy(consumer));
    return r;
  }

  static bool make_state(MeshFinder& finder, Result& r) noexcept {
    if (finder.state_) return true;
    std::pmr::memory_resource* memory = finder.options_.memory;
    if (!memory) memory = base::large_blocks();
    void* block = allocate_state(*memory, sizeof(MeshFinder::State), alignof(MeshFinder::State), r);
    if (!block) return false;
    finder.state_ = new (block) MeshFinder::State(memory);
    return true;
  }
};

MeshFinder::~MeshFinder() {
  if (!state_) return;
  std::pmr::memory_resource* memory = state_->resource;
  state_->~State();
  memory->deallocate(state_, sizeof(State), alignof(State));
}
MeshFinder::MeshFinder(MeshFinder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      pairs_(std::exchange(other.pairs_, {})) {}
MeshFinder& MeshFinder::operator=(MeshFinder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(pairs_, other.pairs_);
  return *this;
}
std::size_t MeshFinder::memory_bytes() const noexcept { return state_ ? state_->held() : 0; }

MeshResult MeshFinder::find(const TriangleMesh& mesh) noexcept {
  return MeshFinderAccess::run(*this, {&mesh}, nullptr, nullptr);
}
MeshResult MeshFinder::find(const TriangleMesh& a, const TriangleMesh& b) noexcept {
  return MeshFinderAccess::run(*this, {&a, &b}, nullptr, nullptr);
}
MeshResult MeshFinder::find(const TriangleMesh& mesh, Pair* out, std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return MeshFinderAccess::run(*this, {&mesh}, &output, nullptr);
}
MeshResult MeshFinder::find(const TriangleMesh& a, const TriangleMesh& b, Pair* out,
                            std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return MeshFinderAccess::run(*this, {&a, &b}, &output, nullptr);
}
MeshResult MeshFinder::consume(const TriangleMesh& mesh, Consumer consumer) {
  return MeshFinderAccess::run(*this, {&mesh}, nullptr, &consumer);
}
MeshResult MeshFinder::consume(const TriangleMesh& a, const TriangleMesh& b, Consumer consumer) {
  return MeshFinderAccess::run(*this, {&a, &b}, nullptr, &consumer);
}

MeshResult MeshFinder::find_within(const TriangleMesh& mesh, double distance) noexcept {
  return MeshFinderAccess::run(*this, {&mesh, nullptr, true, distance}, nullptr, nullptr);
}
MeshResult MeshFinder::find_within(const TriangleMesh& a, const TriangleMesh& b,
                                   double distance) noexcept {
  return MeshFinderAccess::run(*this, {&a, &b, true, distance}, nullptr, nullptr);
}
MeshResult MeshFinder::find_within(const TriangleMesh& mesh, double distance, Pair* out,
                                   std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return MeshFinderAccess::run(*this, {&mesh, nullptr, true, distance}, &output, nullptr);
}
MeshResult MeshFinder::find_within(const TriangleMesh& a, const TriangleMesh& b, double distance,
                                   Pair* out, std::size_t capacity) noexcept {
  base::Output output = into(out, capacity);
  return MeshFinderAccess::run(*this, {&a, &b, true, distance}, &output, nullptr);
}
MeshResult MeshFinder::consume_within(const TriangleMesh& mesh, double distance,
                                      Consumer consumer) {
  return MeshFinderAccess::run(*this, {&mesh, nullptr, true, distance}, nullptr, &consumer);
}
MeshResult MeshFinder::consume_within(const TriangleMesh& a, const TriangleMesh& b, double distance,
                                      Consumer consumer) {
  return MeshFinderAccess::run(*this, {&a, &b, true, distance}, nullptr, &consumer);
}

namespace {

std::vector<Pair> find_or_throw(const mesh::MeshCall& call, const Options& options) {
  MeshFinder finder(options);
  const MeshResult r = MeshFinderAccess::run(finder, call, nullptr, nullptr);
  if (!r.ok()) throw Error(r);
  return std::vector<Pair>(finder.pairs().begin(), finder.pairs().end());
}

}  // namespace

std::vector<Pair> find_self_intersections(const TriangleMesh& mesh, const Options& options) {
  return find_or_throw({&mesh}, options);
}
std::vector<Pair> find_intersections(const TriangleMesh& a, const TriangleMesh& b,
                                     const Options& options) {
  return find_or_throw({&a, &b}, options);
}
std::vector<Pair> find_within(const TriangleMesh& mesh, double distance, const Options& options) {
  return find_or_throw({&mesh, nullptr, true, distance}, options);
}
std::vector<Pair> find_within(const TriangleMesh& a, const TriangleMesh& b, double distance,
                              const Options& options) {
  return find_or_throw({&a, &b, true, distance}, options);
}

}  // namespace throng
