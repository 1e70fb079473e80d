// The decisions about one candidate pair, by one thread: the filter's, and the exact one.
#pragma once

#include <cstdint>

#include "base/host_device_macros.hpp"
#include "mesh/arrays.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/shared_vertices.hpp"
#include "mesh/triangle_pair.hpp"

namespace throng::mesh {

// How to read a vertex: by a type that is known when compiled, or at run time.
template <class Real>
struct VertexAs {
  THRONG_HD DoubleVec3 operator()(const MeshArrays& mesh, std::uint32_t i) const noexcept {
    return mesh.vertex<Real>(i);
  }
};
struct VertexOfEither {
  bool is_float;
  THRONG_HD DoubleVec3 operator()(const MeshArrays& mesh, std::uint32_t i) const noexcept {
    return is_float ? mesh.vertex<float>(i) : mesh.vertex<double>(i);
  }
};

template <class Vertex>
THRONG_HD inline TrianglePoints points_of(const MeshArrays& mesh, const Triangle& t,
                                          const Vertex& vertex) noexcept {
  return {{vertex(mesh, t.a), vertex(mesh, t.b), vertex(mesh, t.c)}};
}

// The index at a position, counted modulo 3. Selections: a device has no indexed registers.
THRONG_HD inline std::uint32_t index_at(const Triangle& t, int position) noexcept {
  const int i = position < 3 ? position : position - 3;
  return i == 0 ? t.a : (i == 1 ? t.b : t.c);
}

// By the filter of doubles, which needs coordinates of at most Bounds<double>::largest.
template <class Vertex>
THRONG_HD inline Decision filter_pair(const PairInput& input, Pair pair,
                                      const Vertex& vertex) noexcept {
  const Triangle a = input.a.triangle(pair.first), b = input.b.triangle(pair.second);
  const auto in_a = [&](int i) { return vertex(input.a, index_at(a, i)); };
  const auto in_b = [&](int i) { return vertex(input.b, index_at(b, i)); };
  const unsigned equal = input.one_mesh ? equal_indices(a, b) : 0;
  if (equal == 0)
    return decide_meeting(points_of(input.a, a, vertex).p, points_of(input.b, b, vertex).p);
  // The positions of a bit of equal_indices().
  const auto of_a = [](unsigned bit) { return bit & 7 ? 0 : (bit & 7 << 3 ? 1 : 2); };
  const auto of_b = [](unsigned bit) { return bit & 0x49 ? 0 : (bit & 0x49 << 1 ? 1 : 2); };
  const unsigned bit = equal & (0 - equal), others = equal ^ bit;
  const int i = of_a(bit), k = of_b(bit);
  if (others == 0)
    return decide_beyond_vertex(in_a(i), in_a(i + 1), in_a(i + 2), in_b(k + 1), in_b(k + 2));
  const int j = of_a(others), l = of_b(others);
  const bool is_edge = (others & (others - 1)) == 0 && i != j && k != l;
  if (!is_edge) return Decision::unsure;
  return decide_beyond_edge(in_a(i), in_a(j), in_a(3 - i - j), in_b(3 - k - l));
}

template <class Vertex>
THRONG_HD THRONG_OUTLINE inline bool exact_pair(const PairInput& input, Pair pair,
                                                const Vertex& vertex) noexcept {
  const Triangle a = input.a.triangle(pair.first), b = input.b.triangle(pair.second);
  const TrianglePoints pa = points_of(input.a, a, vertex), pb = points_of(input.b, b, vertex);
  return input.one_mesh ? triangles_pair(a, b, pa, pb) : triangles_meet(pa, pb);
}

}  // namespace throng::mesh
