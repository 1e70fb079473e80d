// The search for pairs of triangles on the CPU: boxes of triangles, candidates from the grid, and
// the test of each block of candidates in the worker that finds it.
#pragma once

#include <throng/memory_resource.hpp>
#include <throng/mesh.hpp>

#include "base/memory.hpp"
#include "base/output.hpp"
#include "grid/engine.hpp"
#include "mesh/triangle_boxes.hpp"

namespace throng::mesh {

// A search: intersections, or triangles within a distance.
struct MeshCall {
  const TriangleMesh* a = nullptr;
  const TriangleMesh* b = nullptr;  // null: one mesh
  bool within = false;
  double distance = 0;
};

class MeshEngine {
 public:
  // `already_held`: bytes that the owner took from `memory` for the engine itself.
  MeshEngine(std::pmr::memory_resource* memory, std::size_t already_held) noexcept;

  // Arguments other than the values of indices and vertices are validated by the API layer. If
  // defects().count is not 0, the status is bad_mesh. `output` or `consumer` is null.
  MeshResult find(const MeshCall& call, const Options& options, base::Output* output,
                  const Consumer* consumer);

  const MeshDefects& defects() const noexcept { return defects_; }
  bool defects_in_second() const noexcept { return defects_in_second_; }
  // After status nan_box: see grid::Engine.
  grid::Engine& search() noexcept { return search_; }

 private:
  MeshArrays arrays_of(const TriangleMesh& mesh, bool as_floats, unsigned tasks,
                       const Executor& executor, DoubleVec3* points) const;

  grid::Engine search_;
  base::Buffer<Box> boxes_;
  base::Buffer<DoubleVec3> points_;  // transformed or widened vertices
  MeshDefects defects_;
  bool defects_in_second_ = false;
};

}  // namespace throng::mesh
