// Orientation signs by ExactInteger, which shares no code with mesh/orient.hpp.
#pragma once

#include "mesh/exact_integer.hpp"
#include "mesh/point_cases.hpp"

namespace throng::tests {

inline int integer_orient3d(const FourPoints& p) {
  mesh::CommonUnit unit;
  for (const DoubleVec3& q : p) unit.include(q);
  const int u = unit.value();
  const mesh::ExactVector a(p[0], u), b(p[1], u), c(p[2], u), d(p[3], u);
  return dot(cross(b - a, c - a), d - a).sign();
}

// Of x and y.
inline int integer_orient2d(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c) {
  return integer_orient3d({{{a.x, a.y, 0}, {b.x, b.y, 0}, {c.x, c.y, 0}, {a.x, a.y, 1}}});
}

}  // namespace throng::tests
