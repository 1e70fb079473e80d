// Generated triangle meshes: the same for tests, benchmarks and pictures.
//
// A mesh is a function of its spec in integer arithmetic and correctly rounded double operations,
// so every compiler and machine produces the same bits. Each is about 2 units in size, z up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <throng/mesh.hpp>
#include <throng/types.hpp>

namespace throng::scenes {

inline constexpr std::size_t min_mesh_triangles = 100;
inline constexpr std::size_t max_mesh_triangles = std::size_t{1} << 26;

struct MeshSpec {
  std::string name;
  std::size_t triangles = 0;  // at most; the mesh has the nearest number that its grid allows
  std::uint64_t seed = 1;
};

struct GeneratedMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  // Valid while this object lives and does not change.
  TriangleMesh view() const noexcept { return TriangleMesh(vertices, triangles); }
};

// sphere    a closed surface, star-shaped around 0, with bumps; no pairs
// crumpled  a sheet that noise folds through itself
// spiral    a rolled-up sheet; the layers are half an edge apart; no pairs
// spiral-touching  the same, with dents whose tips are vertices of the next layer: each is a point
//           that the triangles around both vertices share
// knot      thirteen tubes along torus knots, in one place
// soup      triangles at random in a cube, without shared vertices; about 4 pairs per triangle
const std::vector<std::string>& mesh_names();

// Throws std::invalid_argument, which names the error and the allowed values.
GeneratedMesh make_mesh(const MeshSpec& spec);

}  // namespace throng::scenes
