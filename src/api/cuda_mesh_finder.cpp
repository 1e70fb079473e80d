// API layer of the GPU's MeshFinder: checks arguments and calls the GPU backend, if it exists.
#include <throng/cuda_mesh.hpp>

#include <memory>
#include <new>
#include <utility>

#include "cuda/backend.hpp"
#include "device/failure.hpp"
#include "validate.hpp"
#include "validate_mesh.hpp"

namespace throng::cuda {

struct MeshFinder::State {
  std::unique_ptr<MeshEngine> engine;
};

namespace {

using ull = unsigned long long;

// Arrays in device memory, whose values only the device can check.
bool valid_on_device(const TriangleMesh& a, const TriangleMesh* b, const Options& options,
                     Result& r) noexcept {
  if (!valid_choices(options, r) || !valid_cell_scale(options.cell_scale, r) ||
      !valid_mesh_margin(options.margin, r))
    return false;
  return valid_mesh_on_device(a, b ? "the first mesh" : "the mesh", r) &&
         (!b || valid_mesh_on_device(*b, "the second mesh", r));
}

void explain_defects(const mesh::MeshDefects& defects, bool second, bool two, Result& r) noexcept {
  const char* const which = !two ? "the mesh" : (second ? "the second mesh" : "the first mesh");
  set_message(r, "triangle %llu of %s uses vertex %llu, which is %s; fix it (bad triangles: %llu)",
              ull{defects.first}, which, ull{defects.vertex},
              defects.out_of_range ? "out of range" : "not finite", ull{defects.count});
}

}  // namespace

// What the public calls share.
struct MeshFinderAccess {
  // Calls f(engine, result) and writes the messages of its errors.
  template <class F>
  static MeshResult run(MeshFinder& finder, const F& f) noexcept {
    MeshResult r;
    r.plan.backend = Backend::cuda;
    try {
      if (!finder.state_) finder.state_ = new (std::nothrow) MeshFinder::State;
      if (!finder.state_) throw device::Failure{Status::out_of_memory, sizeof(MeshFinder::State)};
      if (!finder.state_->engine) finder.state_->engine.reset(create_mesh_engine(finder.memory_));
      f(*finder.state_->engine, r);
    } catch (const device::Failure& failure) {
      explain_failure(r, failure);
    }
    return r;
  }

  template <class F>
  static MeshResult run(MeshFinder& finder, const TriangleMesh& a, const TriangleMesh* b,
                        const F& f) noexcept {
    MeshResult r;
    if (!valid_on_device(a, b, finder.options_, r)) return r;
    r = run(finder, f);
    if (r.status == Status::bad_mesh && !r.message[0]) {
      const MeshEngine& engine = *finder.state_->engine;
      explain_defects(engine.defects(), engine.defects_in_second(), b != nullptr, r);
    } else {
      explain(r, b != nullptr, false, "free some, or split the mesh");
    }
    return r;
  }

  static MeshResult find(MeshFinder& finder, const TriangleMesh& a, const TriangleMesh* b,
                         Pair* out, std::size_t capacity, Stream stream) noexcept {
    return run(finder, a, b, [&](MeshEngine& engine, MeshResult& r) {
      engine.find_on_device(a, b, finder.options_, out, out ? capacity : 0, stream, r);
    });
  }
  static MeshResult find_growing(MeshFinder& finder, const TriangleMesh& a, const TriangleMesh* b,
                                 Stream stream) noexcept {
    Pairs pairs;
    finder.pairs_ = {};
    const MeshResult r = run(finder, a, b, [&](MeshEngine& engine, MeshResult& result) {
      pairs = engine.find_growing(a, b, finder.options_, stream, result);
    });
    if (r.ok()) finder.pairs_ = pairs;
    return r;
  }
  static Result find_async(MeshFinder& finder, const TriangleMesh& a, const TriangleMesh* b,
                           Pair* out, std::size_t capacity, MeshReport* report,
                           Stream stream) noexcept {
    return run(finder, a, b, [&](MeshEngine& engine, MeshResult&) {
      engine.find_async(a, b, finder.options_, out, out ? capacity : 0, report, stream);
    });
  }
};

MeshFinder::~MeshFinder() { delete state_; }
MeshFinder::MeshFinder(MeshFinder&& other) noexcept
    : state_(std::exchange(other.state_, nullptr)),
      options_(other.options_),
      memory_(other.memory_),
      pairs_(std::exchange(other.pairs_, {})) {}
MeshFinder& MeshFinder::operator=(MeshFinder&& other) noexcept {
  std::swap(state_, other.state_);
  std::swap(options_, other.options_);
  std::swap(memory_, other.memory_);
  std::swap(pairs_, other.pairs_);
  return *this;
}

Result MeshFinder::reserve(std::size_t triangles, std::size_t pairs, Stream stream,
                           std::size_t converted_vertices) noexcept {
  return MeshFinderAccess::run(*this, [&](MeshEngine& engine, MeshResult&) {
    engine.reserve(triangles, pairs, converted_vertices, stream);
  });
}
MeshResult MeshFinder::find(const TriangleMesh& mesh, Pair* out, std::size_t capacity,
                            Stream stream) noexcept {
  return MeshFinderAccess::find(*this, mesh, nullptr, out, capacity, stream);
}
MeshResult MeshFinder::find(const TriangleMesh& a, const TriangleMesh& b, Pair* out,
                            std::size_t capacity, Stream stream) noexcept {
  return MeshFinderAccess::find(*this, a, &b, out, capacity, stream);
}
MeshResult MeshFinder::find(const TriangleMesh& mesh, Stream stream) noexcept {
  return MeshFinderAccess::find_growing(*this, mesh, nullptr, stream);
}
MeshResult MeshFinder::find(const TriangleMesh& a, const TriangleMesh& b, Stream stream) noexcept {
  return MeshFinderAccess::find_growing(*this, a, &b, stream);
}
Result MeshFinder::find_async(const TriangleMesh& mesh, Pair* out, std::size_t capacity,
                              MeshReport* report, Stream stream) noexcept {
  return MeshFinderAccess::find_async(*this, mesh, nullptr, out, capacity, report, stream);
}
Result MeshFinder::find_async(const TriangleMesh& a, const TriangleMesh& b, Pair* out,
                              std::size_t capacity, MeshReport* report, Stream stream) noexcept {
  return MeshFinderAccess::find_async(*this, a, &b, out, capacity, report, stream);
}
std::size_t MeshFinder::memory_bytes() const noexcept {
  return state_ && state_->engine ? state_->engine->held() : 0;
}

}  // namespace throng::cuda
