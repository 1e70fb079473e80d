// Boxes inside the caller's structures, filters, layers, a trigger, and two sets.
#include <throng/throng.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <iterator>
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

// A view copies nothing. Each array is a pointer, a count and a stride.
throng::Boxes view(const std::vector<Body>& bodies) {
  throng::Boxes boxes(&bodies[0].bounds, bodies.size(), sizeof(Body));
  boxes.filters.world = {&bodies[0].world, bodies.size(), sizeof(Body)};
  boxes.filters.is_static = {&bodies[0].is_static, bodies.size(), sizeof(Body)};
  return boxes;
}
// snippet-end: body

throng::Box cube(float x) { return {{x, 0, 0}, {x + 1, 1, 1}}; }

// snippet-begin: layers
// One bit per layer. `group` is the layer of an object, `mask` the layers that it collides with.
enum Layer : std::uint32_t { scenery = 1, player = 2, enemy = 4, trigger = 8 };

throng::Filter in_layer(Layer layer, std::uint32_t collides_with) {
  throng::Filter filter;
  filter.group = layer;
  filter.mask = collides_with;
  filter.is_static = layer == scenery;
  return filter;
}
// snippet-end: layers

void layers() {
  // snippet-begin: trigger
  throng::BroadPhase broad_phase;
  const throng::ObjectId zone = broad_phase.add(cube(4.0f), in_layer(trigger, player));
  const throng::ObjectId hero =
      broad_phase.add(cube(0.0f), in_layer(player, scenery | enemy | trigger));
  broad_phase.add(cube(4.5f), in_layer(enemy, scenery | player));
  throng::Result result = broad_phase.update();

  throng::Status status = broad_phase.move(hero, cube(3.5f));  // walks into the zone
  if (result.ok() && status == throng::Status::ok) result = broad_phase.update();
  for (const throng::LivePair& pair : broad_phase.begun()) {
    if (pair.first == zone || pair.second == zone) std::puts("entered the zone");
  }
  // snippet-end: trigger
  CHECK(result.ok());
  // The hero overlaps the zone and the enemy; the zone ignores the enemy.
  CHECK(broad_phase.pair_count() == 2 && broad_phase.begun().size() == 2);
}

}  // namespace

int main() {
  const std::vector<Body> bodies = {
      {cube(0.0f), 1.0f, 0, 0},  // 0
      {cube(0.5f), 1.0f, 0, 0},  // 1: overlaps 0
      {cube(0.5f), 1.0f, 1, 0},  // 2: the same place, another world
      {cube(0.2f), 0.0f, 0, 1},  // 3: static, overlaps 0 and 1
      {cube(0.3f), 0.0f, 0, 1},  // 4: static, overlaps 0 and 1; 3 is static too
  };
  throng::Options options;
  options.order = throng::Order::canonical;
  const auto pairs = throng::find_pairs(view(bodies), options);
  const std::vector<throng::Pair> wanted = {{0, 1}, {0, 3}, {0, 4}, {1, 3}, {1, 4}};
  CHECK(pairs == wanted);

  // snippet-begin: lambda
  const auto allowed = [&](throng::Pair pair) {
    return bodies[pair.first].mass != 0 && bodies[pair.second].mass != 0;
  };
  throng::Finder finder;
  std::vector<throng::Pair> heavy;
  const throng::Result result =
      finder.consume(view(bodies), [&](const throng::Pair* found, std::size_t count) {
        std::copy_if(found, found + count, std::back_inserter(heavy), allowed);
        return true;  // false: stop
      });
  // snippet-end: lambda
  CHECK(result.ok() && heavy == std::vector<throng::Pair>({{0, 1}}));

  // snippet-begin: two_sets
  const std::vector<throng::Box> rays = {{{0.1f, 0.5f, -9}, {0.1f, 0.5f, 9}}};
  // first: index of the ray; second: index of the body
  const std::vector<throng::Pair> hits = throng::find_pairs(rays, view(bodies));
  // snippet-end: two_sets
  CHECK(hits.size() == 1);
  CHECK((hits[0] == throng::Pair{0, 0}));
  layers();
}
