// Pairs of triangles that are hard for geometry: drawn by kind.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include <throng/types.hpp>

#include "mesh/point_cases.hpp"
#include "mesh/triangle_pair.hpp"
#include "support/random.hpp"

namespace throng::tests {

struct TwoTriangles {
  mesh::TrianglePoints a, b;
};

enum class TriangleKind {
  random,           // in a cube
  small_grid,       // integers -2 .. 2: many touch, many are coplanar
  grid_plane,       // integer points in one integer plane
  rounded_plane,    // points of a plane, rounded
  star,             // in an integer plane, turned against each other
  degenerate,       // integers; at least one is a segment or a point
  sliver,           // close to one line
  parallel_planes,  // equal or similar triangles in parallel planes
  parallel_edges,   // b is a, moved, and then changed by some units in the last place
  vertex_above,     // a vertex of b above a point of a
  crossing,         // an edge of b through a point of a
  far_from_origin,  // small offsets from 1e7
  mixed_exponents,  // exponents -30 .. 30
  scaled_grid,      // as small_grid, times a power of two, also beyond 2^500 and below 2^-500
  scaled_random,    // as random, scaled in that way
  denormal,         // multiples of the least double
  any,              // any finite doubles
  extremes,         // 0, the least and the greatest doubles, 1
  count
};
constexpr int triangle_kind_count = static_cast<int>(TriangleKind::count);

inline DoubleVec3& vertex(TwoTriangles& t, int i) { return i < 3 ? t.a.p[i] : t.b.p[i - 3]; }

inline TwoTriangles draw_triangles(Random& random, TriangleKind kind) {
  TwoTriangles t{};
  const auto fill = [&](auto&& draw) {
    for (int i = 0; i < 6; ++i)
      for (int axis = 0; axis < 3; ++axis) coordinate(vertex(t, i), axis) = draw();
  };
  const auto integer = [&](int most) { return static_cast<double>(random.between(-most, most)); };
  const auto unit = [&] { return unit_double(random); };
  // The point of a at (s, t), rounded.
  const auto inside = [&](double r, double s) {
    DoubleVec3 x{};
    for (int axis = 0; axis < 3; ++axis) {
      const double origin = coordinate(t.a.p[0], axis);
      coordinate(x, axis) = origin + r * (coordinate(t.a.p[1], axis) - origin) +
                            s * (coordinate(t.a.p[2], axis) - origin);
    }
    return x;
  };
  // Two of the kinds for any scale.
  const auto scale = [&](int low, int high) {
    const int exponent = random.between(low, high);
    for (int i = 0; i < 6; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        double& x = coordinate(vertex(t, i), axis);
        x = std::ldexp(x, exponent);
      }
  };
  switch (kind) {
    case TriangleKind::random:
      fill(unit);
      break;
    case TriangleKind::small_grid:
      fill([&] { return integer(2); });
      break;
    case TriangleKind::grid_plane:
    case TriangleKind::rounded_plane:
    case TriangleKind::star: {
      const bool is_grid = kind != TriangleKind::rounded_plane;
      const double most = random.one_in(2) ? 3 : 30;
      const auto draw = [&] { return is_grid ? integer(10) : unit(); };
      const auto factor = [&] { return is_grid ? integer(static_cast<int>(most)) : unit(); };
      const DoubleVec3 o = {draw(), draw(), draw()}, u = {draw(), draw(), draw()},
                       v = {draw(), draw(), draw()};
      const double corners[3][2] = {{-8, -4}, {8, -4}, {0, 8}};
      for (int i = 0; i < 6; ++i) {
        double r = factor(), s = factor();
        if (kind == TriangleKind::star) {
          r = (i < 3 ? 1 : -1) * corners[i % 3][0] + integer(3);
          s = (i < 3 ? 1 : -1) * corners[i % 3][1] + integer(3);
        }
        vertex(t, i) = {o.x + r * u.x + s * v.x, o.y + r * u.y + s * v.y, o.z + r * u.z + s * v.z};
      }
      break;
    }
    case TriangleKind::degenerate: {
      fill([&] { return integer(2); });
      const int which = random.between(0, 2);
      for (mesh::TrianglePoints* x : {&t.a, &t.b}) {
        if (which != 2 && (which == 0) != (x == &t.a)) continue;
        // A point, a repeated vertex, or three points of a line.
        if (random.one_in(4)) {
          x->p[1] = x->p[2] = x->p[0];
        } else if (random.one_in(2)) {
          x->p[random.below(3)] = x->p[random.below(3)];
        } else {
          const double s = integer(2);
          for (int axis = 0; axis < 3; ++axis)
            coordinate(x->p[2], axis) = coordinate(x->p[0], axis) +
                                        s * (coordinate(x->p[1], axis) - coordinate(x->p[0], axis));
        }
      }
      break;
    }
    case TriangleKind::sliver: {
      const DoubleVec3 direction = {unit(), unit(), unit()};
      const double distance = random.one_in(2) ? 0 : std::ldexp(1.0, -random.between(5, 45));
      for (int i = 0; i < 6; ++i) {
        const double s = unit();
        vertex(t, i) = {nudged(s * direction.x, random), nudged(s * direction.y, random),
                        nudged(s * direction.z, random) + (i < 3 ? 0 : distance)};
      }
      break;
    }
    case TriangleKind::parallel_planes: {
      fill([&] { return integer(4); });
      const double height = std::ldexp(1 + integer(1) * 0.25, -random.between(-2, 40));
      const bool is_same = random.one_in(2);
      for (int i = 0; i < 3; ++i) {
        t.a.p[i].z = 0;
        if (is_same) t.b.p[i] = t.a.p[i];
        t.b.p[i].z = height;
      }
      break;
    }
    case TriangleKind::parallel_edges: {
      for (int i = 0; i < 3; ++i) t.a.p[i] = {unit(), unit(), unit()};
      const double length = std::ldexp(1.0, -random.between(0, 40));
      const DoubleVec3 offset = {length * unit(), length * unit(), length * unit()};
      for (int i = 0; i < 3; ++i) {
        const DoubleVec3& p = t.a.p[i];
        t.b.p[i] = {nudged(p.x + offset.x, random), nudged(p.y + offset.y, random),
                    nudged(p.z + offset.z, random)};
      }
      break;
    }
    case TriangleKind::vertex_above: {
      fill(unit);
      const double s = std::fabs(unit());
      t.b.p[0] = inside(s, (1 - s) * std::fabs(unit()));
      t.b.p[0].z += random.one_in(4) ? 0 : std::ldexp(unit(), -random.between(0, 40));
      break;
    }
    case TriangleKind::crossing: {
      fill(unit);
      const double s = std::fabs(unit());
      const DoubleVec3 x = inside(s, (1 - s) * (random.one_in(3) ? 0 : std::fabs(unit())));
      DoubleVec3& p = t.b.p[0];
      DoubleVec3& q = t.b.p[1];
      q = {2 * x.x - p.x, 2 * x.y - p.y, 2 * x.z - p.z};
      break;
    }
    case TriangleKind::far_from_origin:
      fill([&] { return 1e7 + integer(3) * 0x1p-20 + (random.one_in(3) ? unit() * 0x1p-30 : 0); });
      break;
    case TriangleKind::mixed_exponents:
      fill([&] { return std::ldexp(unit(), random.between(-30, 30)); });
      break;
    case TriangleKind::scaled_grid:
      fill([&] { return integer(2); });
      scale(-1074, 1020);
      break;
    case TriangleKind::scaled_random:
      fill(unit);
      scale(-1060, 1022);
      break;
    case TriangleKind::denormal:
      fill([&] { return integer(3) * 0x1p-1074; });
      break;
    case TriangleKind::any:
      fill([&] { return any_double(random); });
      break;
    case TriangleKind::extremes:
    case TriangleKind::count:
      fill([&] {
        const double values[] = {0, 0x1p-1074, 0x1p-1022, 1, 0x1.fffffffffffffp1023};
        return (random.one_in(2) ? 1 : -1) * values[random.below(5)];
      });
      break;
  }
  return t;
}

// The coordinates as they are written in a test.
inline std::string to_text(const TwoTriangles& t) {
  std::string text;
  for (const mesh::TrianglePoints* x : {&t.a, &t.b}) {
    for (const DoubleVec3& p : x->p) {
      char line[120];
      std::snprintf(line, sizeof line, "{%a, %a, %a}, ", p.x, p.y, p.z);
      text += line;
    }
    text += "\n";
  }
  return text;
}

}  // namespace throng::tests
