// The boxes of triangles, and the check of a mesh's indices and vertices.
//
// A coordinate x is represented by f(x) = float(x - origin), both steps rounded to nearest, which
// does not decrease. So triangles with a common point have overlapping boxes; the exact test
// decides the rest. For floats the origin is 0 and f is the identity.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <throng/mesh.hpp>

#include "base/threads.hpp"
#include "mesh/arrays.hpp"
#include "mesh/pair_kernels.hpp"

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

  Box box(const DoubleVec3& lower, const DoubleVec3& upper) const noexcept {
    Box b;
    round(lower.x, upper.x, origin.x, b.lower.x, b.upper.x);
    round(lower.y, upper.y, origin.y, b.lower.y, b.upper.y);
    round(lower.z, upper.z, origin.z, b.lower.z, b.upper.z);
    return b;
  }

 private:
  // The interval of an axis, as floats.
  void round(double lower, double upper, double from, float& to_lower,
             float& to_upper) const noexcept;
};

// Of the coordinates that triangles use: the least and the largest on each axis.
struct CoordinateRange {
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  DoubleVec3 lower = {infinity, infinity, infinity}, upper = {-infinity, -infinity, -infinity};

  void add(const DoubleVec3& least, const DoubleVec3& most) noexcept {
    lower = {std::min(lower.x, least.x), std::min(lower.y, least.y), std::min(lower.z, least.z)};
    upper = {std::max(upper.x, most.x), std::max(upper.y, most.y), std::max(upper.z, most.z)};
  }
  bool contains(const CoordinateRange& other) const noexcept {
    return lower.x <= other.lower.x && lower.y <= other.lower.y && lower.z <= other.lower.z &&
           upper.x >= other.upper.x && upper.y >= other.upper.y && upper.z >= other.upper.z;
  }
  // 0 if there is none.
  double largest_magnitude() const noexcept {
    return std::max({0.0, -lower.x, -lower.y, -lower.z, upper.x, upper.y, upper.z});
  }
};

// Writes the box of each triangle, and grows `range`. If the mesh has defects, neither is valid.
// Vertices are floats or doubles.
MeshDefects write_triangle_boxes(const MeshArrays& mesh, bool is_float, std::size_t triangles,
                                 std::size_t vertices, const BoxOptions& options,
                                 const PairKernels& kernels, const Executor& executor,
                                 unsigned tasks, Box* out, CoordinateRange& range);

// Writes an inverted box in place of each box that does not overlap the box of `range`. `of_boxes`:
// the range of the triangles of these boxes.
void drop_boxes_outside(const CoordinateRange& range, const CoordinateRange& of_boxes,
                        const BoxOptions& options, const Executor& executor, unsigned tasks,
                        Box* boxes, std::size_t count);

// An origin near the vertices of double meshes that lie far from 0; else 0.
DoubleVec3 choose_origin(const MeshArrays& mesh, std::size_t vertices) noexcept;

}  // namespace throng::mesh
