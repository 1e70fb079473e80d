// Persistent objects: a BroadPhase reports which pairs began and which ended.
#include <throng/throng.hpp>

#include <cstdio>
#include <functional>
#include <optional>
#include <thread>
#include <vector>

#include "check.hpp"

namespace {

// What an engine stores per pair.
struct Contact {
  throng::ObjectId first, second;
  int age;
};

void begin(std::vector<Contact>& contacts, const throng::LivePair& pair) {
  if (contacts.size() <= pair.slot) contacts.resize(pair.slot + 1);
  contacts[pair.slot] = {pair.first, pair.second, 0};
}

}  // namespace

int main() {
  std::vector<throng::Box> boxes;
  for (int i = 0; i < 1000; ++i) {
    const float x = 2.0f * static_cast<float>(i);
    boxes.push_back({{x, 0, 0}, {x + 1, 1, 1}});
  }
  std::vector<Contact> contacts;
  throng::BroadPhase broad_phase;
  std::vector<throng::ObjectId> ids(boxes.size());
  throng::Result result = broad_phase.add(boxes, ids.data());
  if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);

  throng::Filter scenery;
  scenery.is_static = 1;
  const throng::ObjectId ground =
      broad_phase.add({{-10, -1, -10}, {9999, 0, 10}}, scenery);  // throws Error
  for (int frame = 0; frame < 60; ++frame) {
    // Only movers are passed. An object that does not move is asleep.
    const std::vector<throng::ObjectId> movers = {ids[frame], ids[2 * frame + 1]};
    std::vector<throng::Box> moved;
    for (const throng::ObjectId id : movers) {
      throng::Box box = broad_phase.box(id);
      box.lower.x += 1;
      box.upper.x += 1;
      moved.push_back(box);
    }
    result = broad_phase.move(movers.data(), moved);  // other objects cost nothing
    if (result.ok()) result = broad_phase.update();
    if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
    // The slot stays the same while the pair exists: use it as the index of the contact.
    for (const throng::LivePair& pair : broad_phase.ended()) contacts[pair.slot] = {};
    for (const throng::LivePair& pair : broad_phase.begun()) begin(contacts, pair);
  }
  for (const throng::LivePair& pair : broad_phase.pairs()) {
    CHECK(contacts[pair.slot].first == pair.first && contacts[pair.slot].second == pair.second);
  }
  CHECK(broad_phase.pair_count() > boxes.size());

  const throng::BroadPhase saved = broad_phase;  // a snapshot: ids, slots, pending changes
  broad_phase.remove(ground);
  CHECK(broad_phase.update().ok());
  CHECK(broad_phase.ended().size() == boxes.size());
  broad_phase = saved;
  CHECK(broad_phase.is_alive(ground));

  // snippet-begin: raycast
  // From (0.5, 5, 0.5) downward. A maximum distance and a layer mask are optional.
  const std::optional<throng::RayHit> hit = broad_phase.raycast({0.5f, 5, 0.5f}, {0, -1, 0}, 100);
  if (hit) {
    std::printf("hits object %u after %g, at height %g; normal (%g, %g, %g)\n", hit->object,
                hit->distance, hit->point.y, hit->normal.x, hit->normal.y, hit->normal.z);
  }
  // snippet-end: raycast
  CHECK(hit && hit->object == ground && hit->distance == 5 && hit->normal.y == 1);
  // snippet-begin: raycast_filter
  constexpr std::uint32_t walls = 1, props = 2;  // bits of Filter::group
  const throng::ObjectId shooter = ids[3];
  const throng::Vec3 muzzle = {broad_phase.box(shooter).upper.x, 0.5f, 0.5f};
  const auto target = broad_phase.raycast(muzzle, {1, 0, 0}, 100, walls | props,
                                          [&](throng::ObjectId id) { return id != shooter; });
  // snippet-end: raycast_filter
  CHECK(target && target->object != shooter && target->object != ground);
  // snippet-begin: raycast_status
  std::optional<throng::RayHit> ground_hit;
  throng::Filter of_ray;
  of_ray.world = 7;  // hits the objects of this world, and those of every world
  result = broad_phase.raycast({0.5f, 5, 0.5f}, {0, -1, 0}, 100, of_ray, {}, ground_hit);
  if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
  // snippet-end: raycast_status
  CHECK(result.ok() && ground_hit && ground_hit->object == ground);

  // snippet-begin: sweeps
  const throng::Vec3 eye = {0.5f, 5, 0.5f};
  const std::vector<throng::Sweep> sweeps = {
      {{eye, eye}, {0, -100, 0}},              // a ray: a point that moves down by 100
      {{{20, 3, 0}, {24, 4, 1}}, {30, 0, 0}},  // a box that moves along x
  };
  result = broad_phase.find_hits(sweeps.data(), sweeps.size(), throng::SweepHits::first);
  if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
  for (const throng::SweepHit& found : broad_phase.hits()) {
    std::printf("sweep %u hits object %u at t = %g\n", found.sweep, found.object, found.time);
  }
  // snippet-end: sweeps
  CHECK(broad_phase.hits().size() == 1 && broad_phase.hits()[0].object == ground);
  // snippet-begin: overlaps
  const std::vector<throng::Box> regions = {{{0, 0, 0}, {100, 10, 10}}};
  const auto not_ground = [&](throng::ObjectId id) { return id != ground; };
  result = broad_phase.find_overlaps(regions, not_ground);  // the filter is optional
  if (!result.ok()) std::fprintf(stderr, "%s\n", result.message);
  for (const throng::Pair& pair : broad_phase.overlaps()) {
    std::printf("object %u is in region %u\n", pair.second, pair.first);
  }
  // snippet-end: overlaps
  CHECK(broad_phase.overlaps().size() == 50);

  // snippet-begin: query
  const auto shoot = [&](throng::ObjectId caster, throng::SweepHit& first) {
    throng::BroadPhaseQuery query;  // one per thread; an engine keeps it
    const throng::Vec3 at = broad_phase.box(caster).lower, from = {at.x + 0.5f, 0.5f, 0.5f};
    const throng::Sweep ray = {{from, from}, {100, 0, 0}};
    // Leaves out the object that casts the ray. An engine would also test the exact shape here.
    const auto test = [&](std::uint32_t, throng::ObjectId object, double time) {
      return object == caster ? 2 : time;  // above 1: no hit
    };
    const throng::Result result_of_ray =
        query.find_hits(broad_phase, &ray, 1, throng::SweepHits::first, {}, test);
    if (result_of_ray.ok() && !query.hits().empty()) first = query.hits()[0];
  };
  throng::SweepHit hits[2] = {};
  std::thread other(shoot, ids[0], std::ref(hits[0]));
  shoot(ids[1], hits[1]);
  other.join();
  // snippet-end: query
  CHECK(hits[0].object != ids[0] && hits[0].time > 0 && hits[1].object != ids[1]);
}
