// Queries in cells, whatever objects enter and leave after they were built, against a loop over all
// objects.
#include <gtest/gtest.h>

#include <algorithm>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"

namespace throng::tests {
namespace {

// Few objects move, this one between the first two boxes: cells pay off and are built.
void make_cells(BroadPhase& b, ObjectId moves, const BoxList& boxes) {
  Result r;
  for (std::size_t k = 0; k < 20; ++k) {
    ASSERT_EQ(b.move(moves, boxes[(k + 1) % 2]), Status::ok);
    r = b.update();
  }
  ASSERT_TRUE(was_incremental(r));
}
bool is_hit(const BroadPhase& b, ObjectId id) {
  const SweepHitList hits = b.hits();
  return std::any_of(hits.begin(), hits.end(),
                     [&](const SweepHit& hit) { return hit.object == id; });
}

// Cells are built for rods of one length; a longer one is added and queried at its far end.
TEST(BroadPhaseQuery, ALongerRod) {
  const auto rod = [](float x, float y, float z, float length) {
    return Box{{x, y, z}, {x + length, y + 0.5f, z + 0.5f}};
  };
  Random random(4);
  BoxList boxes;
  for (int k = 0; k < 800; ++k) {
    const Vec3 v = random.point(0, 60);
    boxes.push_back(rod(v.x, v.y, v.z, 9));
  }
  BroadPhase rods;
  ASSERT_TRUE(rods.add(boxes, nullptr).ok());
  ASSERT_TRUE(rods.update().ok());
  make_cells(rods, 0, boxes);
  for (float length = 9; length < 40; length += 0.0625f) {
    BroadPhase b(rods);
    const float x = random.in(0, 60);
    const ObjectId id = b.add(rod(x, 80, 80, length));
    const Box end = cube(x + length, 80, 80, 0.25f);
    ASSERT_TRUE(b.find_overlaps(Boxes(&end, 1)).ok());
    ASSERT_EQ(b.overlaps().size(), 1u) << length;
    EXPECT_EQ(b.overlaps()[0].second, id);
    const Sweep down = {{{end.lower.x, 99, 80}, {end.upper.x, 99, 80}}, {0, -50, 0}};
    ASSERT_TRUE(b.find_hits(&down, 1).ok());
    ASSERT_EQ(b.hits().size(), 1u) << length;
    EXPECT_EQ(b.hits()[0].object, id);
    const Vec3 in = {boxes[5].lower.x + 1, boxes[5].lower.y, boxes[5].lower.z};
    const Sweep through = {{{in.x, in.y - 0.1f, in.z}, {in.x, in.y - 0.1f, in.z}}, {0, 0.2f, 0}};
    ASSERT_TRUE(b.find_hits(&through, 1).ok());
    EXPECT_TRUE(is_hit(b, 5));
  }
}

// Cells are built for worlds; then a box of world -1 is added, of a new size, or one grows. Queries
// of each world find it, in copies, too.
TEST(BroadPhaseQuery, ABoxOfEveryWorld) {
  Random random(6);
  BoxList boxes;
  std::vector<std::int32_t> world;
  for (int k = 0; k < 2000; ++k) {
    boxes.push_back(cube(random.point(0, 9), 1));
    world.push_back(k < 3 ? -1 : k % 40);
  }
  Boxes view(boxes);
  view.filters.world = {world.data(), world.size()};
  BroadPhase worlds;
  ASSERT_TRUE(worlds.add(view, nullptr).ok());
  make_cells(worlds, 5, boxes);
  for (const float size : {0.01f, 0.5f, 1.0f, 2.5f, 6.0f, 13.0f}) {
    for (const bool grows : {false, true}) {
      BroadPhase b(worlds);
      const Box big = grows ? Box{boxes[1].lower, boxes[1].upper} : cube(20, 3, 3, size);
      ObjectId id = 1;
      Box now = {big.lower, {big.lower.x + size, big.lower.y + size, big.lower.z + size}};
      if (grows)
        ASSERT_EQ(b.move(1, now), Status::ok);
      else
        id = b.add(now);
      const std::int32_t of = 7;
      Filters filters;
      filters.world = {&of, 1};
      const Vec3 above = {(now.lower.x + now.upper.x) / 2, now.upper.y + 30,
                          (now.lower.z + now.upper.z) / 2};
      const Sweep down = {{above, above}, {0, -60, 0}};
      ASSERT_TRUE(b.find_hits(&down, 1, SweepHits::all, filters).ok());
      EXPECT_TRUE(is_hit(b, id)) << size << grows;
      Boxes region(&now, 1);
      region.filters = filters;
      ASSERT_TRUE(b.find_overlaps(region).ok());
      EXPECT_TRUE(std::any_of(b.overlaps().begin(), b.overlaps().end(),
                              [&](const Pair& pair) { return pair.second == id; }))
          << size << grows;
      ASSERT_EQ(b.move(50, now), Status::ok);  // of world 10
      ASSERT_TRUE(b.update().ok());
      EXPECT_TRUE(std::any_of(b.pairs().begin(), b.pairs().end(),
                              [&](const LivePair& pair) {
                                return std::min(id, 50u) == pair.first &&
                                       std::max(id, 50u) == pair.second;
                              }))
          << size << grows;
    }
  }
}

// The few large boxes, which are in no class, are removed, then all but as few of the small ones.
TEST(BroadPhaseQuery, LargeBoxesAreRemoved) {
  Random random(7);
  BoxList boxes;
  for (int k = 0; k < 3000; ++k) boxes.push_back(cube(random.point(0, 20), 1));
  for (int k = 0; k < 8; ++k) boxes.push_back(cube(random.point(0, 20), 9));
  BroadPhase b;
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  make_cells(b, 0, boxes);
  for (ObjectId id = 3007; id >= 8; --id) {
    ASSERT_EQ(b.remove(id), Status::ok);
    if (id != 8 && id % 100 != 0) continue;
    const Vec3 at = b.box(5).lower;
    const Sweep ray = {{at, at}, {0.5f, 0.5f, 0.5f}};
    ASSERT_TRUE(b.find_hits(&ray, 1).ok());
    EXPECT_TRUE(is_hit(b, 5)) << id;
  }
}

// Clusters in an empty world: sweeps skip empty blocks of cells, once computing these pays off.
// Objects enter empty regions and leave until the block data is rebuilt.
TEST(BroadPhaseQuery, ClustersInAnEmptyWorld) {
  constexpr std::uint32_t objects = 4000;  // with fewer, queries loop over all
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Options options;
    options.threads = seed % 2 ? 1 : 3;
    if (thread_sanitized && options.threads == 1) continue;
    options.margin = seed == 3 ? 0.25f : 0;
    Actor actor(options, seed, 10);
    actor.thin = seed == 1;
    ASSERT_TRUE(actor.add(objects, seed == 2));
    Random& random = actor.random;
    Vec3 middles[15];
    for (Vec3& m : middles) m = random.point(-3000, 3000);
    std::vector<ObjectId> moved;
    const auto move = [&](std::size_t count) {
      const std::vector<ObjectId> ids = moved = actor.some_ids(count);
      BoxList boxes;
      for (const ObjectId id : ids) {
        const Vec3 m = middles[random.below(15)], at = random.point(0, 9);
        const Vec3 from = {m.x + at.x, m.y + at.y, m.z + at.z};
        boxes.push_back(actor.thin ? actor.rod_or_plate(from) : cube(from, 1));
        actor.model.at(id).box = boxes.back();
      }
      return actor.broad_phase.move(ids.data(), boxes).ok();
    };
    ASSERT_TRUE(move(objects));
    for (int step = 0; step < 26; ++step) {
      middles[step % 15] = random.point(-3000, 3000);
      ASSERT_TRUE(move(step % 13 == 12 ? objects : 60));
      if (step % 3 == 0) {
        ASSERT_TRUE(actor.update());
      }
      std::vector<Sweep> sweeps;
      std::vector<Filter> filters;
      const std::vector<ObjectId> ids = actor.model.ids();
      for (int k = 0; k < 60; ++k) {
        // From one object to another and beyond.
        const auto any = [&] { return actor.model.at(ids[random.below(objects)]).box; };
        const ObjectId last = moved[random.below(static_cast<std::uint32_t>(moved.size()))];
        const Vec3 from = any().lower, to = (k % 3 ? any() : actor.model.at(last).box).upper;
        const float far = k % 5 ? 1.01f : 2;
        const Vec3 by = {far * (to.x - from.x), far * (to.y - from.y), far * (to.z - from.z)};
        sweeps.push_back({{from, k % 2 ? from : Vec3{from.x + 1, from.y + 1, from.z + 1}}, by});
        filters.push_back(seed == 2 ? actor.any_filter() : Filter{});
      }
      ASSERT_TRUE(same_hits(actor.broad_phase, actor.model, sweeps, filters))
          << "step " << step << " seed " << seed;
      if (step % 10 == 9) {
        BroadPhase copy = actor.broad_phase;
        ASSERT_TRUE(same_hits(copy, actor.model, sweeps, filters));
        actor.broad_phase = copy;
        ASSERT_TRUE(same_hits(actor.broad_phase, actor.model, sweeps, filters));
      }
    }
  }
}

}  // namespace
}  // namespace throng::tests
