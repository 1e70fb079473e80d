// The boxes of triangles, and the check of a mesh's indices and vertices.
//
// A coordinate x is represented by f(x) = float(x - origin), both steps rounded to nearest, which
// does not decrease. So triangles with a common point have overlapping boxes; the exact test
// decides the rest. For floats the origin is 0 and f is the identity.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/mesh.hpp>

#include "base/threads.hpp"
#include "mesh/arrays.hpp"

namespace throng::mesh {

// What is wrong with a mesh: the first bad triangle, and how many there are.
struct MeshDefects {
  std::uint64_t count = 0;
  std::uint64_t first = ~std::uint64_t{0};  // a triangle
  std::uint32_t vertex = 0;                 // the index of that triangle
  bool out_of_range = false;                // else the vertex is NaN or infinite

  void add(const MeshDefects& other) noexcept {
    count += other.count;
    if (other.first >= first) return;
    first = other.first;
    vertex = other.vertex;
    out_of_range = other.out_of_range;
  }
};

struct BoxOptions {
  DoubleVec3 origin = {0, 0, 0};
  double enlarge = 0;  // on every side, before rounding
};

// Writes the box of each triangle. If the mesh has defects, the boxes are not valid. `largest`
// becomes the largest magnitude of a coordinate, if that is larger. Vertices are floats or doubles.
MeshDefects write_triangle_boxes(const MeshArrays& mesh, bool is_float, std::size_t triangles,
                                 std::size_t vertices, const BoxOptions& options,
                                 const Executor& executor, unsigned tasks, Box* out,
                                 double& largest);

// An origin near the vertices of double meshes that lie far from 0; else 0.
DoubleVec3 choose_origin(const MeshArrays& mesh, std::size_t vertices) noexcept;

}  // namespace throng::mesh
