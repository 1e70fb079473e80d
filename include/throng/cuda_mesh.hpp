// GPU interface of triangle meshes: device pointers in and out, on the caller's stream. Standard
// C++ only; a build without the GPU backend returns Status::no_device.
//
// The arrays of a TriangleMesh, filters included, lie in device memory: they are never dereferenced
// on the host. For arrays in host memory: throng::MeshFinder with Backend::cuda.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/cuda.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>

namespace throng::cuda {

// A call's report in device memory, valid when the work before it on the stream is done.
struct MeshReport {
  Report search;  // `found` counts pairs of triangles; `inactive` counts bad triangles
  std::uint64_t candidates = 0;   // pairs of triangles whose boxes overlap
  std::uint64_t exact_tests = 0;  // candidates that floating-point arithmetic could not decide
  // Triangles with an index out of range or a vertex that is not finite. They intersect nothing.
  std::uint64_t bad_triangles = 0;
  std::uint64_t bad_in_second = 0;  // those of the second mesh
  std::uint32_t bad_mark = 0;       // ~ of the first such index, so that all fields start at zero
  std::uint32_t unused = 0;

  // With two meshes, indices of the second follow those of the first.
  constexpr std::uint32_t first_bad() const noexcept { return ~bad_mark; }
};

// Intersections of triangles on a GPU; see throng::MeshFinder for the rule, and cuda::Finder for
// what the two have in common. It uses the options algorithm, order, measure_stages and cell_scale.
// At most 1.8e9 triangles, both meshes together.
class THRONG_API MeshFinder {
 public:
  explicit MeshFinder(const Options& options = {}, const MemoryResource& memory = {}) noexcept
      : options_(options), memory_(memory) {}
  ~MeshFinder();
  MeshFinder(MeshFinder&& other) noexcept;
  MeshFinder& operator=(MeshFinder&& other) noexcept;
  MeshFinder(const MeshFinder&) = delete;
  MeshFinder& operator=(const MeshFinder&) = delete;

  // Allocates the memory for calls with up to `triangles` triangles (both meshes): 75 bytes per
  // triangle, 83 above 3.5 million; with sorted order 16 bytes more for each of `pairs`. A mesh
  // whose vertices must be converted, as it has a transform or is one of two of which only one has
  // floats, takes 24 bytes for each of its vertices: `converted_vertices` in all. Synchronizes with
  // the stream. In addition, CUDA keeps 3 KB of local memory per resident thread.
  Result reserve(std::size_t triangles, std::size_t pairs, Stream stream,
                 std::size_t converted_vertices = 0) noexcept;

  // Writes pairs to device memory, out[0 .. capacity-1]; synchronizes with the stream. If they do
  // not fit: status buffer_too_small, the exact total in `found`, the first `written` valid (sorted
  // order: none are written). Allocates memory unless reserve() has. With Status::bad_mesh the
  // contents of `out` are unspecified.
  MeshResult find(const TriangleMesh& mesh, Pair* out, std::size_t capacity,
                  Stream stream) noexcept;
  MeshResult find(const TriangleMesh& a, const TriangleMesh& b, Pair* out, std::size_t capacity,
                  Stream stream) noexcept;

  // Writes pairs to the MeshFinder's own device memory, which grows: see pairs(). Synchronizes with
  // the stream. The first call allocates 8 bytes per triangle for them.
  MeshResult find(const TriangleMesh& mesh, Stream stream) noexcept;
  MeshResult find(const TriangleMesh& a, const TriangleMesh& b, Stream stream) noexcept;
  // In device memory; valid until the next call.
  Pairs pairs() const noexcept { return pairs_; }

  // As find() into `out`, but asynchronous: it neither synchronizes nor allocates, so it can be
  // captured into a graph, and a replay is correct for any values in that memory. The results are
  // in *report, in device memory. The status is that of the launch; see cuda::Finder::find_async.
  Result find_async(const TriangleMesh& mesh, Pair* out, std::size_t capacity, MeshReport* report,
                    Stream stream) noexcept;
  Result find_async(const TriangleMesh& a, const TriangleMesh& b, Pair* out, std::size_t capacity,
                    MeshReport* report, Stream stream) noexcept;

  // Bytes of device memory that the MeshFinder holds now.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct MeshFinderAccess;
  State* state_ = nullptr;
  Options options_;
  MemoryResource memory_;
  Pairs pairs_;
};

}  // namespace throng::cuda
