// The program of docs/tutorials/cpp.md.
// snippet-begin: begin
#include <throng/throng.hpp>

#include <cstdio>
#include <optional>
#include <vector>

// A row of unit cubes. Every third cube moves along x.
throng::Box cube(int i, int frame) {
  const float x =
      1.5f * static_cast<float>(i) + (i % 3 == 0 ? 0.25f * static_cast<float>(frame) : 0);
  return {{x, 0, 0}, {x + 1, 1, 1}};
}
// snippet-end: begin

int main() {
  // snippet-begin: frames
  throng::Finder finder;  // keeps its workspace from frame to frame
  std::vector<throng::Box> boxes(1000);
  for (int frame = 0; frame < 4; ++frame) {
    for (int i = 0; i < 1000; ++i) boxes[static_cast<std::size_t>(i)] = cube(i, frame);
    const throng::Result result = finder.find(boxes);
    if (!result.ok()) {
      std::fprintf(stderr, "%s\n", result.message);
      return 1;
    }
    std::printf("frame %d: %zu pairs\n", frame, finder.pairs().size());
  }
  // snippet-end: frames

  // snippet-begin: add
  throng::BroadPhase broad_phase;
  std::vector<throng::ObjectId> ids(boxes.size());
  throng::Result result = broad_phase.add(boxes, ids.data());

  throng::Filter scenery;
  scenery.is_static = 1;  // static objects never pair with each other
  const throng::ObjectId ground = broad_phase.add({{-10, -1, -10}, {2000, 0, 10}}, scenery);
  if (result.ok()) result = broad_phase.update();
  // snippet-end: add

  // snippet-begin: update
  const std::vector<throng::ObjectId> movers = {ids[0]};  // other objects cost nothing
  const std::vector<throng::Box> moved = {cube(0, 8)};
  if (result.ok()) result = broad_phase.move(movers.data(), moved);
  if (result.ok()) result = broad_phase.update();
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.message);
    return 1;
  }
  for (const throng::LivePair& pair : broad_phase.begun()) {
    std::printf("contact %u begins: objects %u and %u\n", pair.slot, pair.first, pair.second);
  }
  for (const throng::LivePair& pair : broad_phase.ended()) {
    std::printf("contact %u ends: objects %u and %u\n", pair.slot, pair.first, pair.second);
  }
  // snippet-end: update

  // snippet-begin: ray
  const throng::Vec3 eye = {1.25f, 5, 0.5f}, down = {0, -1, 0};
  if (const std::optional<throng::RayHit> hit = broad_phase.raycast(eye, down, 100)) {
    std::printf("the ray hits object %u after %g: %s\n", hit->object, hit->distance,
                hit->object == ground ? "the ground" : "a cube");
  }
  // snippet-end: ray
}
