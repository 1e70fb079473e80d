// MeshFinder, and the functions that use a temporary one.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <utility>

#include <throng/throng.hpp>

#include "base/float_state.hpp"
#include "base/large_pages.hpp"
#include "mesh/engine.hpp"
#include "validate.hpp"
#include "validate_mesh.hpp"

namespace throng {

using ull = unsigned long long;

struct MeshFinder::State {
  explicit State(std::pmr::memory_resource* memory) noexcept
      : resource(memory), engine(memory, sizeof(State)) {}

  std::pmr::memory_resource* resource;
  mesh::MeshEngine engine;
};

namespace {

bool valid(const mesh::MeshCall& call, const Options& options, Result& r) noexcept {
  if (!valid_search(options, r) || !valid_on_cpu(options, "triangles are searched", r))
    return false;
  if (options.margin != 0) {
    set_message(r, "the margin is %g, but a margin is for boxes; use find_within for triangles",
                double{options.margin});
    return refuse(r, Status::bad_option);
  }
  if (call.within && !(call.distance >= 0 && std::isfinite(call.distance))) {
    set_message(r, "the distance is %g; it must be finite and not negative", call.distance);
    return refuse(r, Status::bad_option);
  }
  const char* const first = call.b ? "the first mesh" : "the mesh";
  return valid_mesh(*call.a, first, r) && (!call.b || valid_mesh(*call.b, "the second mesh", r));
}

// The message for an index or a vertex that is not valid.
void explain_defects(const mesh::MeshCall& call, const mesh::MeshEngine& engine,
                     Result& r) noexcept {
  const bool second = call.b && engine.defects_in_second();
  const TriangleMesh& mesh = second ? *call.b : *call.a;
  const char* const which = !call.b ? "the mesh" : (second ? "the second mesh" : "the first mesh");
  const mesh::MeshDefects& defects = engine.defects();
  char others[64];
  std::snprintf(others, sizeof others, " (%llu more bad triangles)", ull{defects.count - 1});
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
    mesh::MeshEngine& engine = finder.state_->engine;
    base::Buffer<Pair>& pairs = engine.search().pairs();
    base::Output own{pairs.data(), pairs.capacity(), grid::grow_pairs, &pairs};
    const bool keeps = !output && !consumer;
    r = engine.find(call, finder.options_, keeps ? &own : output, consumer);
    if (keeps && r.ok()) finder.pairs_ = {own.data, static_cast<std::size_t>(r.found)};
    if (r.status == Status::bad_mesh)
      explain_defects(call, engine, r);
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
std::size_t MeshFinder::memory_bytes() const noexcept {
  return state_ ? state_->engine.search().memory().held() : 0;
}

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
