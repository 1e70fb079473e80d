// Triangle meshes in files: .obj, .off, .ply and .stl.
//
// Vertices and faces keep the file's numbers: nothing is welded, split or reordered, since
// triangles that share a vertex by index are neighbours. STL has no indices: it is welded. A
// polygon is cut into a fan from its first vertex; a triangle with a repeated index and a polygon
// of fewer than three vertices are dropped and counted. Decimal numbers are rounded to the nearest
// double, then to float32.
//
// Every failure is a scenes::FileError that names the file and the line or the byte. Memory is
// allocated for what the file holds, never for what its header claims.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <throng/mesh.hpp>
#include <throng/types.hpp>

namespace throng::meshes {

enum class Precision { float32, float64 };

struct MeshFile {
  Precision precision = Precision::float32;
  std::vector<Vec3> vertices;               // of float32
  std::vector<DoubleVec3> double_vertices;  // of float64
  std::vector<Triangle> triangles;
  std::uint64_t dropped = 0;

  std::size_t vertex_count() const noexcept {
    return precision == Precision::float32 ? vertices.size() : double_vertices.size();
  }
  // Valid while this object lives and does not change.
  TriangleMesh view() const noexcept {
    return precision == Precision::float32
               ? TriangleMesh(Vertices(vertices.data(), vertices.size()), triangles)
               : TriangleMesh(Vertices(double_vertices.data(), double_vertices.size()), triangles);
  }
};

// Makes vertices at equal positions one vertex, the first of them, and drops and counts triangles
// that then repeat an index. The other vertices keep their order. 0 and -0 are equal; a NaN equals
// nothing. Returns the number of vertices that are gone.
std::size_t weld_vertices(MeshFile& mesh);

// The name's suffix, in any case, chooses the format.
MeshFile read_mesh(const std::string& path, Precision precision = Precision::float32);
// The same from the bytes of a file; `name` is for the format and messages.
MeshFile parse_mesh(const char* data, std::size_t size, const std::string& name,
                    Precision precision = Precision::float32);

}  // namespace throng::meshes
