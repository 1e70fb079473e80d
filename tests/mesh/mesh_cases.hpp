// Small meshes that are hard for a test of triangles, drawn by kind.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <throng/mesh.hpp>

#include "support/random.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {

inline Vec3 to_float(const DoubleVec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}
inline std::vector<Vec3> to_floats(const std::vector<DoubleVec3>& points) {
  std::vector<Vec3> floats;
  floats.reserve(points.size());
  for (const DoubleVec3& p : points) floats.push_back(to_float(p));
  return floats;
}
// Each coordinate rounded to a float.
inline DoubleVec3 rounded_to_float(const DoubleVec3& p) {
  const Vec3 f = to_float(p);
  return {static_cast<double>(f.x), static_cast<double>(f.y), static_cast<double>(f.z)};
}

struct SmallMesh {
  std::vector<DoubleVec3> vertices;
  std::vector<Triangle> triangles;

  std::array<DoubleVec3, 3> points(std::size_t i) const {
    const Triangle& t = triangles[i];
    return {vertices[t.a], vertices[t.b], vertices[t.c]};
  }
};

enum class MeshKind {
  random,           // vertices in a cube
  small_grid,       // integers -1 .. 1: most triangles touch or are coplanar
  grid,             // integers -3 .. 3
  flat,             // integers in one plane that is not parallel to an axis
  line,             // integers on one line: no triangle has an area
  nudged_grid,      // small_grid, some coordinates one float away
  slivers,          // close to a line
  far_from_origin,  // a small grid at 1e6, one float apart
  denormal,         // a small grid times the least float
  huge,             // a small grid times 1e38
  count
};

// `floats`: all coordinates are floats; else most use all digits of a double. Triangles share
// vertices, repeat indices, and occur twice.
inline SmallMesh small_mesh(MeshKind kind, bool floats, std::uint64_t seed,
                            std::size_t triangles = sanitized ? 12 : 24) {
  Random random(seed);
  SmallMesh mesh;
  const auto below = [&random](std::uint32_t n) { return random.below(n); };
  const auto integer = [&](int most) {
    return static_cast<double>(below(static_cast<std::uint32_t>(2 * most + 1))) - most;
  };
  const auto real = [&] {
    const double x = static_cast<double>(below(1u << 31)) * 0x1p-30 - 1;
    return floats ? static_cast<double>(static_cast<float>(x))
                  : x + static_cast<double>(below(1u << 20)) * 0x1p-52;
  };
  const auto one_up = [floats](double x) {
    if (!floats) return std::nextafter(x, std::numeric_limits<double>::infinity());
    return static_cast<double>(
        std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity()));
  };
  const std::uint32_t vertices = 6 + below(24);
  for (std::uint32_t i = 0; i < vertices; ++i) {
    DoubleVec3 p{};
    switch (kind) {
      case MeshKind::random:
        p = {real(), real(), real()};
        break;
      case MeshKind::small_grid:
        p = {integer(1), integer(1), integer(1)};
        break;
      case MeshKind::grid:
        p = {integer(3), integer(3), integer(3)};
        break;
      case MeshKind::flat: {
        const double u = integer(2), v = integer(2);
        p = {u + v, 2 * u - v, 3 * v};
        break;
      }
      case MeshKind::line: {
        const double u = integer(4);
        p = {u, 2 * u, -3 * u};
        break;
      }
      case MeshKind::nudged_grid:
        p = {integer(1), integer(1), integer(1)};
        if (below(3) == 0) p.x = one_up(p.x);
        if (below(3) == 0) p.z = one_up(p.z);
        break;
      case MeshKind::slivers: {
        const double u = integer(3);
        p = {u, u, u};
        if (below(2) == 0) p.y = one_up(p.y);
        if (below(4) == 0) p.z = integer(1);
        break;
      }
      case MeshKind::far_from_origin:
        p = {1e6 + integer(1) * 0.0625, 1e6 + integer(1) * 0.0625, integer(1) * 0.0625};
        break;
      case MeshKind::denormal: {
        const double scale = floats ? static_cast<double>(std::numeric_limits<float>::denorm_min())
                                    : std::numeric_limits<double>::denorm_min();
        p = {integer(2) * scale, integer(2) * scale, integer(2) * scale};
        break;
      }
      case MeshKind::huge: {
        const double scale = floats ? 1e38 : 8e307;
        p = {integer(2) * scale, integer(2) * scale, integer(2) * scale};
        if (floats) {
          p = rounded_to_float(p);
        }
        break;
      }
      case MeshKind::count:
        break;
    }
    mesh.vertices.push_back(p);
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    if (i != 0 && below(12) == 0) {
      mesh.triangles.push_back(mesh.triangles[below(static_cast<std::uint32_t>(i))]);
      continue;
    }
    mesh.triangles.push_back({below(vertices), below(vertices), below(vertices)});
  }
  return mesh;
}

}  // namespace throng::tests
