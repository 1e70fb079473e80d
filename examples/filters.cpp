// Boxes inside the caller's own structures, which pairs are wanted, and two sets.
#include <throng/throng.hpp>

#include <cstdint>
#include <vector>

#include "check.hpp"

namespace {

// snippet-begin: body
struct Body {
  throng::Box bounds;
  float mass;
  std::int32_t world;
  std::uint8_t is_static;
};

// A view copies nothing: each array is a pointer, a count and a stride.
throng::Boxes view(const std::vector<Body>& bodies) {
  throng::Boxes boxes(&bodies[0].bounds, bodies.size(), sizeof(Body));
  boxes.filters.world = {&bodies[0].world, bodies.size(), sizeof(Body)};
  boxes.filters.is_static = {&bodies[0].is_static, bodies.size(), sizeof(Body)};
  return boxes;
}
// snippet-end: body

throng::Box cube(float x) { return {{x, 0, 0}, {x + 1, 1, 1}}; }

}  // namespace

int main() {
  const std::vector<Body> bodies = {
      {cube(0.0f), 1.0f, 0, 0},  // 0
      {cube(0.5f), 1.0f, 0, 0},  // 1: meets 0
      {cube(0.5f), 1.0f, 1, 0},  // 2: in the same place, in another world
      {cube(0.2f), 0.0f, 0, 1},  // 3: static, meets 0 and 1
      {cube(0.3f), 0.0f, 0, 1},  // 4: static, meets 0 and 1, never 3
  };
  throng::Options options;
  options.order = throng::Order::canonical;
  const auto pairs = throng::find_pairs(view(bodies), options);
  const std::vector<throng::Pair> wanted = {{0, 1}, {0, 3}, {0, 4}, {1, 3}, {1, 4}};
  CHECK(pairs == wanted);

  // snippet-begin: two_sets
  const std::vector<throng::Box> rays = {{{0.1f, 0.5f, -9}, {0.1f, 0.5f, 9}}};
  // first: which ray; second: which body
  const std::vector<throng::Pair> hits = throng::find_pairs(rays, view(bodies));
  // snippet-end: two_sets
  CHECK(hits.size() == 1);
  CHECK((hits[0] == throng::Pair{0, 0}));
}
