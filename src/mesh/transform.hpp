// The transform of a mesh's vertices.
#pragma once

#include <throng/mesh.hpp>

#include "base/host_device_macros.hpp"

namespace throng::mesh {

inline bool is_identity(const AffineTransform& t) noexcept {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 4; ++k) {
      if (t.row[i][k] != (i == k ? 1 : 0)) return false;
    }
  }
  return true;
}

// Every operation is rounded to nearest: the result is documented at TriangleMesh::transform.
THRONG_HD inline DoubleVec3 transformed(const AffineTransform& t, const DoubleVec3& p) noexcept {
  const auto row = [&](const double(&m)[4]) {
    return ((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3];
  };
  return {row(t.row[0]), row(t.row[1]), row(t.row[2])};
}

}  // namespace throng::mesh
