// Bodies of every shape, in arrays for a Bodies view.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/throng.hpp>

#include "support/exact_bodies.hpp"
#include "support/random.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {

inline Quaternion random_unit(Random& random) {
  for (;;) {
    const float x = random.in(-1, 1), y = random.in(-1, 1), z = random.in(-1, 1),
                w = random.in(-1, 1);
    const float s = x * x + y * y + z * z + w * w;
    if (s > 1 || s < 0.01f) continue;
    const float f = 1 / std::sqrt(s);
    return {x * f, y * f, z * f, w * f};
  }
}

struct BodyScene {
  std::vector<Transform> transforms;
  std::vector<Vec3> displacements;
  std::vector<std::uint32_t> shape;
  std::vector<Shape> shapes;
  std::vector<Vec3> points;

  Bodies view() const {
    Bodies b(transforms.data(), transforms.size(), shapes.data(), shapes.size());
    b.displacement = {displacements.data(), displacements.size()};
    b.shape = {shape.data(), shape.size()};
    b.points = {points.data(), points.size()};
    return b;
  }
  OneBody body(std::size_t i, float margin = 0) const {
    return {transforms[i].position, transforms[i].rotation, displacements[i], shapes[shape[i]],
            margin};
  }
};

// Spheres, boxes, capsules, plates and convex hulls of 0 to 20 points, at very different scales.
inline BodyScene body_scene(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  BodyScene scene;
  for (int k = 0; k < 60; ++k) scene.points.push_back(random.point(-2, 2));
  for (std::uint32_t k = 0; k < 20; ++k) {
    const float size = k < 15 ? 1.0f : k < 18 ? 1e-30f : 1e6f;
    // One draw per statement: the evaluation order of arguments is unspecified.
    const Vec3 half = random.point(0, size), center = random.point(-size, size);
    const float radius = random.unit() * size;
    scene.shapes.push_back(Shape::sphere(radius));
    scene.shapes.push_back(Shape::box(half, center));
    scene.shapes.push_back(Shape::capsule(half.y, radius));
    scene.shapes.push_back(Shape::box({half.x, 0, half.z}));
    scene.shapes.push_back(Shape::convex(2 * k, k, k % 2 ? 0.1f : 0.0f));
  }
  const auto kinds = static_cast<std::uint32_t>(scene.shapes.size());
  for (std::size_t i = 0; i < count; ++i) {
    const float reach = random.one_in(10) ? 1e5f : 50.0f;
    scene.transforms.push_back({random.point(-reach, reach), random_unit(random)});
    scene.displacements.push_back(random.one_in(3) ? Vec3{0, 0, 0} : random.point(-1, 1));
    scene.shape.push_back(random.below(kinds));
  }
  return scene;
}

inline std::vector<Box> boxes_of(const Bodies& bodies, const UpdateOptions& options = {}) {
  std::vector<Box> boxes(bodies.size());
  const Result r = update_boxes(bodies, boxes.data(), options);
  EXPECT_EQ(r.status, Status::ok) << r.message;
  EXPECT_EQ(r.written, bodies.size());
  return boxes;
}

}  // namespace throng::tests
