// A picture of triangle meshes: perspective, sun, shadows; marked triangles in a strong colour.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <throng/mesh.hpp>

#include "apps/report/draw_boxes.hpp"

namespace throng::report {

// A mesh with valid indices, and a mark per triangle: not 0 for the strong colour; null: none.
struct MeshPart {
  TriangleMesh mesh;
  const std::uint8_t* marked = nullptr;
  std::string name;  // for the key; empty: none
};

// The axis of the coordinates that points up in the picture.
enum class UpAxis { x, y, z };

// Sets azimuth and elevation for a viewer in this direction from the mesh, in its coordinates, not
// 0.
void look_from(const DoubleVec3& direction, UpAxis up, PictureStyle& style);

// Writes a PNG. `mark_name`: what marked triangles are, for the key. Marked triangles behind others
// shine through. Vertices that are not finite
// and the triangles with them are left out. A surface is smooth where triangles share vertices by
// index and its angles are small. The file gets its name when complete. Throws std::runtime_error
// that names the file.
void draw_meshes(const std::string& path, const std::vector<MeshPart>& parts,
                 const std::string& mark_name, UpAxis up, const PictureStyle& style = {});

}  // namespace throng::report
