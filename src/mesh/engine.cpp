#include "mesh/engine.hpp"

#include <algorithm>
#include <atomic>

#include "base/bounds.hpp"
#include "base/threads.hpp"
#include "grid/engine_call.hpp"
#include "mesh/distance.hpp"
#include "mesh/pair_kernels.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/shared_vertices.hpp"
#include "mesh/transform.hpp"

namespace throng::mesh {
namespace {

// The counters of a search.
class CountingTest : public grid::PairTest {
 public:
  void restart() noexcept final { candidates_ = exact_tests_ = 0; }
  std::uint64_t candidates() const noexcept { return candidates_; }
  std::uint64_t exact_tests() const noexcept { return exact_tests_; }

 protected:
  ~CountingTest() = default;
  void count(std::size_t candidates, std::uint64_t exact_tests) const noexcept {
    candidates_.fetch_add(candidates, std::memory_order_relaxed);
    exact_tests_.fetch_add(exact_tests, std::memory_order_relaxed);
  }

 private:
  mutable std::atomic<std::uint64_t> candidates_{0}, exact_tests_{0};
};

class IntersectionTest final : public CountingTest {
 public:
  IntersectionTest(const PairInput& input, const PairKernels& kernels) noexcept
      : input_(input), kernels_(kernels) {}
  std::size_t keep(Pair* pairs, std::size_t candidates) const override {
    std::uint64_t exact_tests = 0;
    const std::size_t kept = kernels_.keep(input_, pairs, candidates, exact_tests);
    count(candidates, exact_tests);
    return kept;
  }

 private:
  const PairInput& input_;
  const PairKernels& kernels_;
};

class DistanceTest final : public CountingTest {
 public:
  DistanceTest(const PairInput& input, double distance) noexcept
      : input_(input), distance_(distance) {}
  std::size_t keep(Pair* pairs, std::size_t candidates) const override {
    count(candidates, 0);
    return input_.is_float ? keep_within<float>(pairs, candidates)
                           : keep_within<double>(pairs, candidates);
  }

 private:
  template <class Real>
  std::size_t keep_within(Pair* pairs, std::size_t count) const noexcept {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Pair pair = pairs[i];
      const Triangle a = input_.a.triangle(pair.first), b = input_.b.triangle(pair.second);
      if (input_.one_mesh && equal_indices(a, b) != 0) continue;
      if (!triangles_within(input_.a.points<Real>(a), input_.b.points<Real>(b), distance_))
        continue;
      pairs[kept++] = pair;
    }
    return kept;
  }

  const PairInput& input_;
  double distance_;
};

const PairKernels& kernels_for(Isa isa) noexcept {
  const PairKernels* const simd = isa == Isa::scalar ? nullptr : simd_pair_kernels(isa);
  return simd ? *simd : scalar_pair_kernels;
}

}  // namespace

MeshEngine::MeshEngine(std::pmr::memory_resource* memory, std::size_t already_held) noexcept
    : search_(memory, already_held), boxes_(search_.memory()), points_(search_.memory()) {}

// The arrays that the search reads: the caller's, or vertices as doubles in `points`.
MeshArrays MeshEngine::arrays_of(const TriangleMesh& mesh, bool as_given, unsigned tasks,
                                 const Executor& executor, DoubleVec3* points) const {
  MeshArrays arrays;
  arrays.triangles = reinterpret_cast<const char*>(mesh.triangles.data);
  arrays.triangle_stride_bytes = mesh.triangles.stride_bytes;
  arrays.vertices = static_cast<const char*>(mesh.vertices.data());
  arrays.vertex_stride_bytes = mesh.vertices.stride_bytes();
  if (as_given) return arrays;
  const bool moves = !is_identity(mesh.transform);
  base::ChunkQueue chunks(mesh.vertices.size(), tasks, 512);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; chunks.take(t, begin, end);) {
      for (std::size_t i = begin; i < end; ++i) {
        const DoubleVec3 p = mesh.vertices[i];
        points[i] = moves ? transformed(mesh.transform, p) : p;
      }
    }
  };
  base::run_tasks(executor, tasks, task);
  arrays.vertices = reinterpret_cast<const char*>(points);
  arrays.vertex_stride_bytes = sizeof(DoubleVec3);
  return arrays;
}

MeshResult MeshEngine::find(const MeshCall& call, const Options& options, base::Output* output,
                            const Consumer* consumer) {
  MeshResult r;
  grid::Clock clock(options.measure_stages);
  defects_ = {};
  const TriangleMesh& a = *call.a;
  const TriangleMesh& b = call.b ? *call.b : a;
  const Executor& executor = base::executor_of(options);
  const std::size_t triangles = a.size() + (call.b ? b.size() : 0);
  const unsigned tasks = grid::threads_for(triangles, options);
  base::Memory& memory = search_.memory();
  const PairKernels& kernels = kernels_for(grid::find_kernels(options.isa)->isa);
  PairInput input;
  Boxes sides[2];
  // Both meshes are read as floats, or both as doubles.
  const bool a_moves = !is_identity(a.transform), b_moves = !is_identity(b.transform);
  input.is_float = a.vertices.is_float() && b.vertices.is_float() && !a_moves && !b_moves;
  const bool a_as_given = input.is_float || (!a.vertices.is_float() && !a_moves);
  const bool b_as_given = !call.b || input.is_float || (!b.vertices.is_float() && !b_moves);
  const std::size_t of_a = a_as_given ? 0 : a.vertices.size();
  const std::size_t of_b = b_as_given ? 0 : b.vertices.size();
  try {
    memory.set_cap(consumer ? options.memory_cap_bytes : 0);
    Box* const boxes = boxes_.ensure(triangles, memory.cap() != 0);
    DoubleVec3* const points = points_.ensure(of_a + of_b, memory.cap() != 0);
    input.a = arrays_of(a, a_as_given, tasks, executor, points);
    input.b = call.b ? arrays_of(b, b_as_given, tasks, executor, points + of_a) : input.a;
    input.one_mesh = call.b == nullptr;
    BoxOptions box_options;
    if (!input.is_float) box_options.origin = choose_origin(input.a, a.vertices.size());
    if (call.within) box_options.enlarge = -base::next_down(-call.distance / 2);
    CoordinateRange ranges[2];
    for (int side = 0; side < (call.b ? 2 : 1); ++side) {
      const TriangleMesh& mesh = side == 0 ? a : b;
      Box* const to = side == 0 ? boxes : boxes + a.size();
      defects_ = write_triangle_boxes(side == 0 ? input.a : input.b, input.is_float, mesh.size(),
                                      mesh.vertices.size(), box_options, kernels, executor, tasks,
                                      to, ranges[side]);
      if (defects_.count != 0) {
        defects_in_second_ = side == 1;
        r.status = Status::bad_mesh;
        r.first_invalid = defects_.first;
        r.invalid_count = defects_.count;
        return r;
      }
      sides[side] = Boxes(to, mesh.size());
      sides[side].filters = mesh.filters;
    }
    // Only where both meshes are can they meet.
    if (call.b && a.size() != 0 && b.size() != 0) {
      drop_boxes_outside(ranges[1], ranges[0], box_options, executor, tasks, boxes, a.size());
      drop_boxes_outside(ranges[0], ranges[1], box_options, executor, tasks, boxes + a.size(),
                         b.size());
    }
    const double largest = std::max(ranges[0].largest_magnitude(), ranges[1].largest_magnitude());
    input.large_floats = !(largest <= double{Bounds<float>::largest});
    input.exact_only = !(largest <= Bounds<double>::largest);
  } catch (const base::AllocationFailed& failure) {
    r.status = Status::out_of_memory;
    r.bytes_needed = failure.bytes;
    return r;
  } catch (const base::CapExceeded& failure) {
    // The search that follows counts, too.
    const bool has_worlds = a.filters.world || b.filters.world;
    const std::size_t enough = triangles * sizeof(Box) + (of_a + of_b) * sizeof(DoubleVec3) +
                               search_.sufficient_bytes(options, triangles, has_worlds);
    r.status = Status::memory_cap_too_small;
    r.bytes_needed = std::max<std::uint64_t>(failure.bytes_needed, enough);
    return r;
  }
  const double boxes_ms = clock.lap();
  Options of_boxes = options;
  of_boxes.margin = 0;
  of_boxes.nan = NanPolicy::refuse;
  const auto search = [&](CountingTest& test) {
    static_cast<Result&>(r) =
        search_.find(sides[0], call.b ? &sides[1] : nullptr, of_boxes, output, consumer, &test);
    r.inactive = 0;
    r.candidates = test.candidates();
    r.exact_tests = test.exact_tests();
  };
  if (call.within) {
    DistanceTest test(input, call.distance);
    search(test);
  } else {
    IntersectionTest test(input, kernels);
    search(test);
  }
  if (r.status == Status::memory_cap_too_small) r.bytes_needed += boxes_.bytes() + points_.bytes();
  r.times.bin_ms += boxes_ms;
  r.times.total_ms += boxes_ms;
  return r;
}

}  // namespace throng::mesh
