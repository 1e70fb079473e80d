// From bodies to boxes to pairs: transforms, shapes, and swept boxes for fast bodies.
#include <throng/throng.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

// snippet-begin: body
struct Body {
  throng::Transform transform;  // position, rotation
  throng::Vec3 velocity;
  std::uint32_t shape;
};

// A body refers to a shape; many bodies may share a shape.
throng::Bodies view(const std::vector<Body>& bodies, const std::vector<throng::Shape>& shapes,
                    const std::vector<throng::Vec3>& points) {
  throng::Bodies shown(&bodies[0].transform, bodies.size(), shapes.data(), shapes.size(),
                       sizeof(Body));
  shown.shape = {&bodies[0].shape, bodies.size(), sizeof(Body)};
  shown.points = {points.data(), points.size()};
  return shown;
}
// snippet-end: body

}  // namespace

int main() {
  const std::vector<throng::Vec3> points = {{0, 1, 0}, {-1, 0, -1}, {1, 0, -1}, {0, 0, 1}};
  const float everywhere = INFINITY;
  const std::vector<throng::Shape> shapes = {
      throng::Shape::box({everywhere, 1, everywhere}, {0, -1, 0}),  // ground; top at y = 0
      throng::Shape::sphere(0.5f), throng::Shape::capsule(0.5f, 0.25f),
      throng::Shape::convex(0, 4),  // a pyramid
  };
  const throng::Quaternion upright;  // no rotation
  const throng::Quaternion lying = {0, 0, std::sqrt(0.5f), std::sqrt(0.5f)};
  std::vector<Body> bodies = {
      {{{0, 0, 0}, upright}, {0, 0, 0}, 0},
      {{{0, 0.5f, 0}, upright}, {0, 0, 0}, 1},   // a ball on the ground
      {{{1.2f, 2, 0}, lying}, {0, -200, 0}, 2},  // a capsule that falls fast
      {{{5, 3, 0}, upright}, {0, 0, 0}, 3},      // a pyramid in the air
  };

  std::vector<throng::Box> boxes(bodies.size());
  throng::Result result = throng::update_boxes(view(bodies, shapes, points), boxes.data());
  if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
  std::vector<throng::Pair> pairs = throng::find_pairs(boxes);
  CHECK(result.ok());
  CHECK(pairs.size() == 1);  // the ball touches the ground

  // Each box covers the whole path of its body in the next step.
  const float step = 1.0f / 60;
  std::vector<throng::Vec3> displacements;
  displacements.reserve(bodies.size());
  for (const Body& body : bodies)
    displacements.push_back(
        {body.velocity.x * step, body.velocity.y * step, body.velocity.z * step});
  throng::Bodies swept = view(bodies, shapes, points);
  swept.displacement = {displacements.data(), displacements.size()};
  result = throng::update_boxes(swept, boxes.data());
  pairs = throng::find_pairs(boxes);
  CHECK(result.ok());
  CHECK(pairs.size() == 3);  // the capsule hits the ground, and the ball on its path
  std::printf("%zu pairs\n", pairs.size());
}
