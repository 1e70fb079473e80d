// GridTraversal visits all hits of a sweep, for any contents of the cells, stops correctly at the
// first hit, and visits little else.
#include "tracking/grid_traversal.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "base/threads.hpp"
#include "support/random.hpp"

namespace throng::tracking {
namespace {

using tests::Random;

constexpr float infinity = std::numeric_limits<float>::infinity();

// Objects in cells.
class World {
 public:
  explicit World(float margin = 0)
      : memory_(std::pmr::new_delete_resource(), 0), objects_(memory_, margin), cells_(memory_) {}

  void add(const Box& box, const Filter& filter = {}) {
    objects_.reserve_more(1);
    objects_.add(box, filter);
  }
  void make() {
    ASSERT_TRUE(cells_.make(objects_, infinity, base::default_executor(), 1));
    cells_.make_blocks(objects_);
  }

  const Objects& objects() const { return objects_; }
  const Cells& cells() const { return cells_; }

 private:
  base::Memory memory_;
  Objects objects_;
  Cells cells_;
};

struct Sum {
  std::size_t met = 0, visited = 0, aborted = 0, lost = 0;
};

struct Hit {
  ObjectId id;
  base::ContactInterval touch;
};
// Hits of a sweep, by a loop over all objects.
std::vector<Hit> expected_hits(const Objects& objects, const Sweep& sweep) {
  std::vector<Hit> all;
  for (std::size_t i = 0; i < objects.limit(); ++i) {
    const auto id = static_cast<ObjectId>(i);
    const Box& box = objects.body(id).box;
    if (!base::is_active(box)) continue;
    const base::ContactInterval t = base::contact_interval(sweep, box);
    if (t.enter <= t.leave) all.push_back({id, t});
  }
  return all;
}

// Both modes: all hits, and the first.
void check_traversal(const World& w, const BlockOccupancy* blocks, const Sweep& sweep,
                     const std::vector<Hit>& wanted, Sum& sum) {
  const Objects& objects = w.objects();
  const base::MovingBox path(sweep);
  const base::SweptBounds cover(path);
  std::set<ObjectId> visited;
  double first = 2;  // of all objects; and as found with early termination
  for (const Hit& m : wanted) first = std::min(first, m.touch.enter);
  Work work;
  const double never = 2;
  if (!GridTraversal(w.cells(), blocks, {}, path, cover, false)
           .traverse(never, work, [&](const CellLine& line, std::uint32_t k) {
             visited.insert(line.id[k]);
             ++sum.visited;
           })) {
    ++sum.aborted;
    return;
  }
  for (const Hit& m : wanted) {
    ++sum.met;
    if (visited.count(m.id) != 0 || sum.lost++ != 0) continue;
    const Box& box = objects.body(m.id).box;
    const base::ContactInterval& t = m.touch;
    ADD_FAILURE() << "box " << box.lower.x << ' ' << box.lower.y << ' ' << box.lower.z << ", "
                  << box.upper.x << ' ' << box.upper.y << ' ' << box.upper.z << " of "
                  << objects.limit() << "; sweep " << sweep.box.lower.x << ' ' << sweep.box.lower.y
                  << ' ' << sweep.box.lower.z << ", " << sweep.box.upper.x << ' '
                  << sweep.box.upper.y << ' ' << sweep.box.upper.z << " by " << sweep.by.x << ' '
                  << sweep.by.y << ' ' << sweep.by.z << ", hit from " << t.enter << " to "
                  << t.leave;
  }
  double found = 2;
  GridTraversal to_first(w.cells(), blocks, {}, path, cover, true);
  ASSERT_TRUE(to_first.traverse(found, work, [&](const CellLine& line, std::uint32_t k) {
    const base::ContactInterval t = base::contact_interval(sweep, objects.body(line.id[k]).box);
    if (t.enter <= t.leave) found = std::min(found, t.enter);
  }));
  EXPECT_EQ(found, first);
}

Box cube(const Vec3& v, float e) { return {v, {v.x + e, v.y + e, v.z + e}}; }
Vec3 any_direction(Random& random, float most) { return random.point(-most, most); }

// Random boxes from `box`, rays and wide sweeps from `sweep`.
using Make = std::function<Box(Random&)>;
Sum run_sweeps(std::uint64_t seed, int boxes, const Make& box, int sweeps,
               const std::function<Sweep(Random&)>& sweep, float margin = 0) {
  Random random(seed);
  World world(margin);
  for (int i = 0; i < boxes; ++i) world.add(box(random));
  world.make();
  Sum sum;
  for (int i = 0; i < sweeps; ++i) {
    const Sweep one = sweep(random);
    const std::vector<Hit> wanted = expected_hits(world.objects(), one);
    check_traversal(world, nullptr, one, wanted, sum);
    check_traversal(world, &world.cells().blocks(), one, wanted, sum);
  }
  EXPECT_EQ(sum.lost, 0u);
  return sum;
}

TEST(GridTraversal, RaysAmongCubes) {
  const Make box = [](Random& r) { return cube(r.point(0, 40), 1); };
  const auto ray = [](Random& r) {
    const Vec3 from = r.point(-5, 45);
    return Sweep{{from, from}, any_direction(r, 12)};
  };
  for (const float margin : {0.0f, 0.25f}) {
    const Sum sum = run_sweeps(1, 8000, box, 2000, ray, margin);
    EXPECT_GT(sum.met, 2000u);
    EXPECT_EQ(sum.aborted, 0u);
    if (margin == 0) {
      EXPECT_LE(sum.visited, sum.met + sum.met / 20);
    }
  }
}

// From far away, across all boxes and far beyond: visits only cells near boxes.
TEST(GridTraversal, FarRays) {
  const Make box = [](Random& r) { return cube(r.point(0, 40), 1); };
  const Sum sum = run_sweeps(8, 8000, box, 1000, [](Random& r) {
    const Vec3 to = r.point(5, 35), by = any_direction(r, r.one_in(2) ? 1e3f : 1e5f);
    const Vec3 from = {to.x - by.x, to.y - by.y, to.z - by.z};
    return Sweep{{from, from}, {2 * by.x, 2 * by.y, 2 * by.z}};
  });
  EXPECT_GT(sum.met, 2000u);
  EXPECT_EQ(sum.aborted, 0u);
  const Sum further = run_sweeps(9, 8000, box, 1000, [](Random& r) {
    const Vec3 from = r.point(-2, 42);
    return Sweep{{from, from}, any_direction(r, 1e9f)};
  });
  EXPECT_GT(further.met, 2000u);
  EXPECT_EQ(further.aborted, 0u);
}

TEST(GridTraversal, WideSlowSweeps) {
  const Make box = [](Random& r) { return cube(r.point(0, 30), r.one_in(9) ? 5 : 0.5f); };
  const auto sweep = [](Random& r) {
    const Vec3 by = {r.one_in(3) ? 0.0f : r.in(-9, 9), r.one_in(3) ? 0.0f : r.in(-1, 1),
                     r.one_in(3) ? 0.0f : std::ldexp(r.in(-1, 1), r.between(-140, 3))};
    return Sweep{cube(r.point(-2, 30), r.in(0, 3)), by};
  };
  const Sum sum = run_sweeps(2, 6000, box, 2000, sweep);
  EXPECT_GT(sum.met, 10'000u);
  EXPECT_LT(sum.aborted, 200u);
}

// Sizes of many classes, long and thin boxes, and some too wide for any class.
TEST(GridTraversal, SizesOfManyClasses) {
  const Make log_uniform = [](Random& r) { return cube(r.point(0, 60), r.magnitude(-4, 3)); };
  const Make rods = [](Random& r) {
    Vec3 e = {0.2f, 0.2f, 0.2f};
    (&e.x)[r.below(3)] = r.in(4, 40);
    const Vec3 v = r.point(-60, 60);
    return Box{v, {v.x + e.x, v.y + e.y, v.z + e.z}};
  };
  const Make wide = [](Random& r) {
    return r.one_in(20) ? cube(r.point(-60, 0), r.magnitude(2, 40)) : cube(r.point(0, 60), 1);
  };
  for (const Make& box : {log_uniform, rods, wide}) {
    const Sum sum = run_sweeps(3, 4000, box, 1500, [](Random& r) {
      const Vec3 from = r.point(-20, 60);
      return Sweep{r.one_in(2) ? Box{from, from} : cube(from, r.in(0, 2)), any_direction(r, 30)};
    });
    EXPECT_GT(sum.met, 1000u);
    EXPECT_LT(sum.aborted, 150u);
  }
}

// Touching faces, edges and corners of a lattice, on cell bounds or next to them, near and far from
// the origin.
TEST(GridTraversal, Grazing) {
  Random pitches(4);
  std::size_t met = 0;
  for (int round = 0; round < 60; ++round) {
    const float pitch =
        std::ldexp(pitches.one_in(2) ? 1.0f : pitches.in(1, 2), pitches.between(-40, 40));
    const float origin = pitches.one_in(2) ? 0 : pitch * std::ldexp(1.0f, pitches.between(0, 24));
    const auto at = [=](Random& r, int low, int high) {
      return tests::nudge(origin + pitch * static_cast<float>(r.between(low, high)),
                          r.one_in(2) ? 0 : r.between(-2, 2));
    };
    const auto box = [=](Random& r) {
      Box b;
      for (int k = 0; k < 3; ++k) {
        const float x = at(r, -6, 6), y = r.one_in(2) ? x : at(r, -6, 6);
        (&b.lower.x)[k] = std::fmin(x, y);
        (&b.upper.x)[k] = std::fmax(x, y);
      }
      return b;
    };
    const Sum sum = run_sweeps(50 + round, 300, box, 150, [=](Random& r) {
      const auto by = [&] { return pitch * static_cast<float>(r.between(-9, 9)); };
      Box b = box(r);
      if (r.one_in(2)) b.upper = b.lower;
      return Sweep{b, {by(), by(), by()}};
    });
    met += sum.met;
  }
  EXPECT_GT(met, 20'000u);
}

// Numbers of any magnitude, infinite ones, and some beyond the clamp of the cells.
TEST(GridTraversal, AnyNumbers) {
  const auto number = [](Random& r, bool finite) {
    const float some[] = {0,    1,     3,     10,       1e-20f,  1e-42f,   1e8f,
                          3e8f, 1e20f, 1e30f, 0x1p100f, FLT_MAX, infinity, infinity};
    float x = some[r.between(0, r.one_in(2) ? 3 : finite ? 11 : 13)];
    if (r.one_in(3)) x = r.in(0, 10);
    return r.one_in(2) ? -x : x;
  };
  const Make box = [&](Random& r) {
    Box b;
    for (int k = 0; k < 3; ++k) {
      const float x = number(r, false), y = r.one_in(2) ? x + 1 : number(r, false);
      (&b.lower.x)[k] = std::fmin(x, y);
      (&b.upper.x)[k] = std::fmax(x, y);
    }
    return b;
  };
  Sum all;
  for (int round = 0; round < 40; ++round) {
    // Mostly small boxes, which determine the cell size.
    const Make most = [&](Random& r) { return r.one_in(3) ? box(r) : cube(r.point(0, 20), 1); };
    const Sum sum = run_sweeps(200 + round, 400, round % 2 ? box : most, 150, [&](Random& r) {
      Box b = box(r);
      if (r.one_in(2)) b.upper = b.lower;
      return Sweep{b, {number(r, true), number(r, true), number(r, true)}};
    });
    all.met += sum.met;
    all.aborted += sum.aborted;
  }
  EXPECT_GT(all.met, 100'000u);  // each in both modes
  EXPECT_LT(all.aborted, 8'000u);
}

// Clusters in an empty world, and sweeps along its diagonal: few of the cells in between are
// visited, and no more sweeps give up.
TEST(GridTraversal, SkipsEmptyBlocks) {
  Random random(8);
  for (const bool diagonal : {false, true}) {
    World world;
    std::vector<Vec3> middles;
    for (int k = 0; k < 20; ++k) middles.push_back(random.point(-2000, 2000));
    for (int i = 0; i < 4000; ++i) {
      const float x = random.in(-2000, 2000);
      const Vec3 m = diagonal ? Vec3{x, x, x} : middles[random.below(20)];
      world.add(cube({m.x + random.in(0, 12), m.y + random.in(0, 12), m.z + random.in(0, 12)}, 1));
    }
    world.make();
    const BlockOccupancy& blocks = world.cells().blocks();
    std::uint64_t visited[2] = {};
    std::size_t aborted[2] = {};
    Sum sum;
    for (int k = 0; k < 300; ++k) {
      const auto any = [&] { return world.objects().body(random.below(4000)).box.lower; };
      const Vec3 from = any(), to = any();
      Sweep ray{{from, from}, any_direction(random, 4000)};
      if (k % 2 && !diagonal) ray.by = {to.x - from.x, to.y - from.y, to.z - from.z};
      const base::MovingBox path(ray);
      const base::SweptBounds cover(path);
      for (const bool passes : {false, true}) {
        Work work;
        const double never = 2;
        GridTraversal traversal(world.cells(), passes ? &blocks : nullptr, {}, path, cover, false);
        aborted[passes] += !traversal.traverse(never, work, [](const CellLine&, std::uint32_t) {});
        visited[passes] += work.far;
      }
      check_traversal(world, &blocks, ray, expected_hits(world.objects(), ray), sum);
    }
    EXPECT_GT(aborted[false], 100u);
    EXPECT_LT(aborted[true], 10u);  // along the diagonal
    EXPECT_LT(visited[true] * 10, visited[false]);
    EXPECT_LT(visited[true], 300u * 50);
    EXPECT_EQ(sum.lost, 0u);
    EXPECT_GT(sum.met, 300u);
  }
}

// Bits stay when boxes leave, so they are rebuilt after twice as many insertions.
TEST(BlockOccupancy, BecomeStale) {
  base::Memory memory(std::pmr::new_delete_resource(), 0);
  BlockOccupancy blocks(memory);
  EXPECT_FALSE(blocks.made() || blocks.is_stale());
  blocks.make(100);
  EXPECT_TRUE(blocks.made());
  CellMap::Range cell{};
  for (std::int32_t k = 0; k < 200; ++k) {
    cell.lower[0] = cell.upper[0] = -100'000 + 1000 * k;
    blocks.add(cell, 2);
    EXPECT_FALSE(blocks.is_stale());
    for (int level = 1; level <= BlockOccupancy::levels; ++level)
      EXPECT_TRUE(blocks.any(cell, 2, level));
  }
  blocks.add(cell, 2);
  EXPECT_TRUE(blocks.is_stale());
  // Few false positives, in another class and elsewhere; very large ranges are not checked.
  std::size_t wrong = 0;
  for (std::int32_t k = 0; k < 200; ++k) {
    cell.lower[0] = cell.upper[0] = -100'000 + 1000 * k;
    wrong += blocks.any(cell, 3, 1);
    cell.lower[1] = cell.upper[1] = 5000;
    wrong += blocks.any(cell, 2, 1);
    cell.lower[1] = cell.upper[1] = 0;
  }
  EXPECT_LT(wrong, 200u);
  cell.upper[1] = 100'000;
  EXPECT_TRUE(blocks.any(cell, 3, 1));
  blocks.clear();
  EXPECT_FALSE(blocks.made() || blocks.is_stale());
}

// Objects of the sweep's world and of none; if every world is wanted, the traversal gives up.
TEST(GridTraversal, Worlds) {
  Random random(6);
  World world;
  for (int i = 0; i < 6000; ++i) {
    Filter filter;
    filter.world = random.between(-1, 3);
    world.add(cube(random.point(0, 25), 1), filter);
  }
  world.make();
  std::size_t met = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 from = random.point(0, 25);
    const Sweep ray = {{from, from}, any_direction(random, 10)};
    const base::MovingBox path(ray);
    const base::SweptBounds cover(path);
    std::set<ObjectId> visited;
    Work work;
    const double never = 2;
    const auto look = [&](const CellLine& line, std::uint32_t k) { visited.insert(line.id[k]); };
    GridTraversal traversal(world.cells(), nullptr, {2, true, false}, path, cover, false);
    ASSERT_TRUE(traversal.traverse(never, work, look));
    for (std::size_t k = 0; k < world.objects().limit(); ++k) {
      const auto id = static_cast<ObjectId>(k);
      const std::int32_t of = world.objects().filter(id).world;
      const base::ContactInterval t = base::contact_interval(ray, world.objects().body(id).box);
      if ((of != 2 && of != -1) || t.enter > t.leave) continue;
      ++met;
      EXPECT_EQ(visited.count(id), 1u);
    }
    GridTraversal of_all(world.cells(), nullptr, {-1, false, true}, path, cover, false);
    EXPECT_FALSE(of_all.traverse(never, work, look));
  }
  EXPECT_GT(met, 300u);
}

// The swept bounds contain every box that touch() reports, at that time.
TEST(SweptBounds, ContainsHits) {
  Random random(7);
  std::size_t met = 0;
  for (int i = 0; i < 300'000; ++i) {
    const float pitch = std::ldexp(random.in(0.5f, 1), random.between(-120, 120));
    const auto at = [&] { return pitch * static_cast<float>(random.between(-4, 4)); };
    const auto box = [&] {
      const Vec3 v = {at(), at(), at()};
      return cube(v, pitch * static_cast<float>(random.between(0, 2)));
    };
    const Sweep sweep = {box(), {2 * at(), 2 * at(), 2 * at()}};
    const Box other = box();
    const base::ContactInterval t = base::contact_interval(sweep, other);
    if (t.enter > t.leave) continue;
    ++met;
    const double before = random.one_in(2) ? t.enter : t.enter * random.unit();
    EXPECT_TRUE(base::overlaps(base::SweptBounds(sweep)(before, t.enter), other));
  }
  EXPECT_GT(met, 10'000u);
}

}  // namespace
}  // namespace throng::tracking
