#include "meshes.hpp"

namespace throng::bench {

SelfIntersectionMethods self_intersection_competitors(const Mesh& mesh,
                                                      [[maybe_unused]] unsigned threads) {
#if defined(THRONG_CGAL)
  return cgal_self_intersections(mesh, threads);
#else
  return {mesh, {}};
#endif
}

std::vector<std::unique_ptr<MeshPairMethod>> mesh_pair_competitors([[maybe_unused]] const Mesh& a,
                                                                   [[maybe_unused]] const Mesh& b) {
#if defined(THRONG_FCL)
  return fcl_mesh_pairs(a, b);
#else
  return {};
#endif
}

}  // namespace throng::bench
