// Views of the arrays of meshes that the C API takes.
#pragma once

#include <throng/throng.h>

#include <cstddef>
#include <cstdint>

#include <throng/mesh.hpp>

#include "c_api_common.hpp"

namespace throng::c_api {

inline Vertices view(const throng_vertices& v) noexcept {
  if (v.doubles) {
    return {reinterpret_cast<const DoubleVec3*>(v.doubles), v.count,
            v.stride_bytes ? v.stride_bytes : sizeof(DoubleVec3)};
  }
  return {reinterpret_cast<const Vec3*>(v.floats), v.count,
          v.stride_bytes ? v.stride_bytes : sizeof(Vec3)};
}

// Element is Triangle or Edge.
template <class Element>
Strided<Element> view_as(const throng_elements& e) noexcept {
  return {reinterpret_cast<const Element*>(e.indices), e.count,
          e.stride_bytes ? e.stride_bytes : sizeof(Element)};
}

// Whether the view of the vertices would ignore one of two arrays.
inline bool is_ambiguous(const throng_vertices& v) noexcept { return v.floats && v.doubles; }

inline Result no_mesh() noexcept {
  return refused(Status::bad_mesh, "found no mesh (NULL), which this call needs");
}
inline Result two_arrays() noexcept {
  return refused(Status::bad_mesh, "the vertices are given as floats and as doubles; give one");
}

inline const throng_pair* as_c_pairs(const Pairs& pairs, size_t* count) noexcept {
  if (count) *count = pairs.size();
  return reinterpret_cast<const throng_pair*>(pairs.data());
}

}  // namespace throng::c_api
