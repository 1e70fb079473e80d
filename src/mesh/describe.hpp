// How two triangles intersect: the kind, and the extreme points of the intersection.
#pragma once

#include <throng/mesh.hpp>

#include "mesh/triangle_pair.hpp"

namespace throng::mesh {

// Any finite coordinates. The kind and the number of points are exact. Each coordinate is that of
// the exact point, rounded to nearest. The points of a polygon are in the order of a's winding.
TriangleIntersection describe_intersection(const TrianglePoints& a,
                                           const TrianglePoints& b) noexcept;

}  // namespace throng::mesh
