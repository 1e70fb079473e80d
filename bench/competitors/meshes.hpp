// Methods that find the intersecting triangles of one mesh, or of two.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <throng/mesh.hpp>
#include <throng/types.hpp>

#include "competitors.hpp"

namespace throng::bench {

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  TriangleMesh view() const { return {vertices, triangles}; }
};

class SelfIntersectionMethod {
 public:
  virtual ~SelfIntersectionMethod() = default;
  virtual std::string name() const = 0;
  virtual unsigned threads() const = 0;
  // Timed: from the library's own mesh to the pairs in memory. Returns the number of pairs.
  virtual std::size_t run() = 0;
  // Not timed: the pairs of the last run, first <= second, in any order.
  virtual std::vector<Pair> pairs() const = 0;
};

// The methods of a library whose mesh may differ from the one that is given.
struct SelfIntersectionMethods {
  // What all of them search: triangles as given, but a vertex may be split into several of equal
  // position where the surface is not a manifold.
  Mesh mesh;
  std::vector<std::unique_ptr<SelfIntersectionMethod>> methods;  // empty: not found at build time
};

class MeshPairMethod {
 public:
  virtual ~MeshPairMethod() = default;
  virtual std::string name() const = 0;
  // Timed. Returns the number of pairs.
  virtual std::size_t run() = 0;
  // Not timed: the pairs of the last run, a triangle of the first mesh and one of the second.
  virtual std::vector<Pair> pairs() const = 0;
};

SelfIntersectionMethods cgal_self_intersections(const Mesh& mesh, unsigned threads);
// `a` and `b` must outlive the methods.
std::vector<std::unique_ptr<MeshPairMethod>> fcl_mesh_pairs(const Mesh& a, const Mesh& b);

// Those that were found at build time.
THRONG_BENCH_EXPORT SelfIntersectionMethods self_intersection_competitors(const Mesh& mesh,
                                                                          unsigned threads);
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<MeshPairMethod>> mesh_pair_competitors(
    const Mesh& a, const Mesh& b);

}  // namespace throng::bench
