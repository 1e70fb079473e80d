// Checks of meshes.
#pragma once

#include <throng/mesh.hpp>
#include <throng/options.hpp>

#include "messages.hpp"

namespace throng {

// Triangles have no margin.
bool valid_mesh_margin(float margin, Result& r) noexcept;

// Checks the arrays, their strides, the filters and the transform, but not the indices and
// vertices. `which` names the mesh for messages: "the first mesh".
bool valid_mesh(const TriangleMesh& mesh, const char* which, Result& r) noexcept;
// The same for arrays in device memory: values are left to the device.
bool valid_mesh_on_device(const TriangleMesh& mesh, const char* which, Result& r) noexcept;

// Sets the message for a triangle whose index or vertex is not valid. `after` follows it.
void explain_bad_triangle(const TriangleMesh& mesh, const char* which, std::uint64_t triangle,
                          std::uint32_t vertex, const char* after, Result& r) noexcept;

}  // namespace throng
