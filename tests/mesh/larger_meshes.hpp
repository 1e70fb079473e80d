// Meshes of some hundred to some thousand triangles, and their pairs by a double loop.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/mesh.hpp>

#include "mesh/mesh_cases.hpp"
#include "mesh/triangle_pair.hpp"
#include "support/random.hpp"

namespace throng::tests {

inline mesh::TrianglePoints points_of(const SmallMesh& m, std::size_t i) {
  const auto t = m.points(i);
  return {{t[0], t[1], t[2]}};
}

inline std::vector<Pair> pairs_of(const SmallMesh& m) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < m.triangles.size(); ++i) {
    for (std::uint32_t j = i + 1; j < m.triangles.size(); ++j) {
      if (mesh::triangles_pair(m.triangles[i], m.triangles[j], points_of(m, i), points_of(m, j)))
        pairs.push_back({i, j});
    }
  }
  return pairs;
}
inline std::vector<Pair> pairs_of(const SmallMesh& a, const SmallMesh& b) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < a.triangles.size(); ++i) {
    for (std::uint32_t j = 0; j < b.triangles.size(); ++j) {
      if (mesh::triangles_meet(points_of(a, i), points_of(b, j))) pairs.push_back({i, j});
    }
  }
  return pairs;
}

// Small triangles in a cube, two thousand: enough for several columns.
inline SmallMesh soup(std::uint64_t seed, std::size_t triangles = 2000, double size = 0.15) {
  Random random(seed);
  SmallMesh m;
  const auto real = [&] { return static_cast<double>(random.in(-1, 1)); };
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const DoubleVec3 c{real(), real(), real()};
    for (int k = 0; k < 3; ++k) {
      const DoubleVec3 p{c.x + size * real(), c.y + size * real(), c.z + size * real()};
      m.vertices.push_back(rounded_to_float(p));
    }
    m.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return m;
}

// A wavy sheet of 2 n^2 triangles, whose neighbours share vertices; folds cross each other.
inline SmallMesh sheet(std::uint32_t n) {
  SmallMesh m;
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t j = 0; j <= n; ++j) {
      const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
      m.vertices.push_back(
          rounded_to_float({u + 0.05 * std::sin(31 * v), v + 0.05 * std::sin(29 * u),
                            0.05 * std::sin(23 * u) * std::sin(27 * v)}));
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
      m.triangles.push_back({a, b, b + 1});
      m.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return m;
}

// Integers on a plane that is parallel to no axis, folded into three layers that overlap and have
// no vertices at one position: only exact tests find the pairs.
inline SmallMesh flat_sheet(std::uint32_t n) {
  SmallMesh m = sheet(n);
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t k = 0; k <= n; ++k) {
      const double u = 7 * (i - i / 3 * 2), v = 7 * k + 2 * (i % 3);
      m.vertices[i * (n + 1) + k] = {u + v, 2 * u - v, 3 * v};
    }
  }
  return m;
}

}  // namespace throng::tests
