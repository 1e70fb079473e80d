// Scenes for tests, and their density.
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "apps/scenes/scene.hpp"
#include "support/same_bits.hpp"

namespace throng::scenes {

inline Spec spec_of(const std::string& name, std::size_t objects, double density = 0) {
  Spec spec;
  spec.name = name;
  spec.objects = objects;
  spec.density = density;
  return spec;
}

inline std::vector<Box> frame_of(const Scene& scene, std::size_t f) {
  std::vector<Box> boxes(scene.size());
  scene.frame(f, boxes.data());
  return boxes;
}

using tests::same_bits;

// Pairs per box, by a plain sweep along x in each world.
inline double pairs_per_box(const Scene& scene, std::size_t f) {
  const std::vector<Box> b = frame_of(scene, f);
  std::vector<std::uint32_t> order(b.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t p, std::uint32_t q) {
    return scene.world(p) != scene.world(q) ? scene.world(p) < scene.world(q)
                                            : b[p].lower.x < b[q].lower.x;
  });
  std::uint64_t pairs = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const Box& p = b[order[k]];
    for (std::size_t l = k + 1; l < order.size(); ++l) {
      const Box& q = b[order[l]];
      if (q.lower.x > p.upper.x || scene.world(order[k]) != scene.world(order[l])) break;
      pairs += (p.lower.y <= q.upper.y) & (q.lower.y <= p.upper.y) & (p.lower.z <= q.upper.z) &
               (q.lower.z <= p.upper.z);
    }
  }
  return static_cast<double>(pairs) / static_cast<double>(b.size());
}

}  // namespace throng::scenes
