// The arrays of a mesh, as kernels read them.
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/mesh.hpp>

#include "base/host_device_macros.hpp"
#include "mesh/triangle_pair.hpp"

namespace throng::mesh {

struct MeshArrays {
  const char* vertices = nullptr;
  const char* triangles = nullptr;
  std::size_t vertex_stride_bytes = 0;
  std::size_t triangle_stride_bytes = 0;

  THRONG_HD const Triangle& triangle(std::uint32_t i) const noexcept {
    return *reinterpret_cast<const Triangle*>(triangles + i * triangle_stride_bytes);
  }
  // The address of the three coordinates of a vertex. Real: float or double.
  template <class Real>
  THRONG_HD const Real* coordinates(std::uint32_t vertex) const noexcept {
    return reinterpret_cast<const Real*>(vertices + vertex * vertex_stride_bytes);
  }
  template <class Real>
  THRONG_HD DoubleVec3 vertex(std::uint32_t i) const noexcept {
    const Real* const p = coordinates<Real>(i);
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  template <class Real>
  THRONG_HD TrianglePoints points(const Triangle& t) const noexcept {
    return {{vertex<Real>(t.a), vertex<Real>(t.b), vertex<Real>(t.c)}};
  }
};

// The triangles of candidate pairs: `first` of a, `second` of b. Both have vertices of one type.
struct PairInput {
  MeshArrays a, b;
  bool one_mesh = true;  // b is a: the rule for shared vertices applies
  bool is_float = true;
  // Coordinates are so large that a filter may overflow: that of floats, and that of doubles. In
  // the second case all tests are exact.
  bool large_floats = false, exact_only = false;
};

}  // namespace throng::mesh
