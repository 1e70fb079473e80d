// Queries of persistent objects on a device, emulated on the host: results against a loop over all
// objects; cost; refused arguments.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "device/device_actor.hpp"
#include "support/failing_resource.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

testing::AssertionResult same_answers(DeviceActor& actor, std::size_t count, bool filtered) {
  const RandomQueries queries(actor, count, filtered);
  return same_answers(actor.broad_phase, actor.model, queries);
}

// Moves without an update, reused ids, filters that are set late, rollbacks.
void run_calls(std::uint64_t seed, std::size_t objects, float side, bool filtered,
               bool thin = false) {
  DeviceActor actor({}, seed, side, seed % 2 ? 0.7f : 0.0f);
  actor.thin = thin;
  ASSERT_TRUE(actor.add(objects, false));
  ASSERT_TRUE(same_answers(actor, 20, filtered));
  ASSERT_TRUE(actor.add(objects / 4, filtered));
  for (int step = 0; step < 24; ++step) {
    ASSERT_TRUE(actor.some_calls(step % 3 != 2, objects, filtered, true));
    if (step % 3 == 0) {
      ASSERT_TRUE(actor.update());
    }
    ASSERT_TRUE(same_answers(actor, 1 + actor.random.below(60), filtered)) << "step " << step;
  }
  EmulatedBroadPhase copy({});
  ASSERT_TRUE(copy.copy_from(actor.broad_phase).ok());
  const RandomQueries queries(actor, 30, filtered);
  ASSERT_TRUE(same_answers(copy, actor.model, queries));
  ASSERT_TRUE(actor.remove(actor.model.count()));
  ASSERT_TRUE(copy.copy_from(actor.broad_phase).ok());
  ASSERT_TRUE(same_answers(copy, actor.model, queries));
  ASSERT_TRUE(same_answers(actor, 20, filtered));
}

TEST(PersistentQueries, Few) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) run_calls(seed, 150, 10, false);
}
TEST(PersistentQueries, Many) {
  for (std::uint64_t seed = 0; seed < 2; ++seed)
    run_calls(seed, sanitized ? 1200 : 3000, 24, false);
}
TEST(PersistentQueries, Filtered) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) run_calls(seed, 700, 14, true);
}
TEST(PersistentQueries, RodsAndPlates) {
  for (std::uint64_t seed = 0; seed < seeds(4); ++seed)
    run_calls(seed, sanitized ? 700 : 1500, 24, seed % 2, true);
}

// ---- cost ---------------------------------------------------------------------------------------

// Cubes, one per eight units of volume, and rays ten units long.
struct Uniform {
  explicit Uniform(int n) : boxes(uniform_boxes(n, 3)) {
    Random random(4);
    EXPECT_TRUE(emulated.add(boxes, nullptr).ok());
    const float side = side_of(static_cast<float>(n) * 2);
    for (int k = 0; k < 1000; ++k) {
      const Vec3 from = random.point(0, side);
      rays.push_back({{from, from}, random.point(-6, 6)});
    }
  }
  Result hits(SweepHits which) { return emulated.find_hits(rays.data(), rays.size(), which, {}); }

  EmulatedBroadPhase emulated{{}};
  BoxList boxes;
  std::vector<Sweep> rays;
};

TEST(PersistentQueries, ComparesFewBoxes) {
  Uniform few(20000), many(80000);
  for (Uniform* scene : {&few, &many}) {
    const double rays = static_cast<double>(scene->rays.size());
    const Result all = scene->hits(SweepHits::all);
    EXPECT_LT(static_cast<double>(all.comparisons) / rays, 150);
    EXPECT_GT(all.found, 1000u);
    const Result first = scene->hits(SweepHits::first);
    EXPECT_LT(first.comparisons, all.comparisons * 3 / 4);
    const Result overlaps = scene->emulated.find_overlaps(scene->boxes);
    EXPECT_LT(static_cast<double>(overlaps.comparisons) / static_cast<double>(scene->boxes.size()),
              40);
  }
  // A ray of any length is cut only where boxes are, and no finer.
  for (Sweep& ray : many.rays) ray.by = {ray.by.x * 1e6f, ray.by.y * 1e6f, ray.by.z * 1e6f};
  const Result far = many.hits(SweepHits::first);
  EXPECT_LT(static_cast<double>(far.comparisons) / 1000, 300);
}

// A dense heap of static boxes. Its cells hold thousands; queries next to it must not search them.
TEST(PersistentQueries, BesideAHeap) {
  for (const float width : {0.0f, 4.0f, 8.0f, 30.0f}) {
    Random r(5);
    BoxList heap;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 at = r.point(1000, 1000 + width);
      heap.push_back({{at.x - 2, at.y - 2, at.z - 2}, {at.x + 2, at.y + 2, at.z + 2}});
    }
    const std::vector<std::uint8_t> is_static(heap.size(), 1);
    Boxes view = heap;
    view.filters.is_static = {is_static.data(), is_static.size()};
    EmulatedBroadPhase m({});
    ASSERT_TRUE(m.add(view, nullptr).ok());
    const float middle = 1000 + width / 2, above = 1000 + width + 2.1f;
    const Box far = cube(0, 3, 0, 1), near = cube(middle, above, middle, 1);
    for (const Box& box : {far, near}) {
      const Result overlaps = m.find_overlaps(Boxes(&box, 1));
      EXPECT_EQ(overlaps.found, 0u);
      EXPECT_EQ(overlaps.comparisons, 0u);
      for (const Vec3& by : {Vec3{0, 9, 0}, Vec3{9, 0, 9}, Vec3{0, 1e30f, 0}}) {
        const Sweep sweep{box, by};
        for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
          const Result hits = m.find_hits(&sweep, 1, which, {});
          EXPECT_EQ(hits.found, 0u);
          EXPECT_EQ(hits.comparisons, 0u) << by.x << ' ' << by.y;
        }
      }
    }
    // A sweep into the heap compares each box at most once per class.
    const Sweep into{{{middle, above + 9, middle}, {middle, above + 9, middle}}, {0, -100, 0}};
    const Result hits = m.find_hits(&into, 1, SweepHits::all, {});
    EXPECT_GT(hits.found, width < 30 ? 1000u : 50u);
    EXPECT_LE(hits.comparisons, 3 * heap.size());
  }
}

// A ray costs what lies on its way through the boxes, for any length.
TEST(PersistentQueries, RaysOfAnyLength) {
  Uniform scene(20000);
  const std::vector<Sweep> rays = scene.rays;
  for (const SweepHits which : {SweepHits::first, SweepHits::all}) {
    std::uint64_t found = 0, comparisons = 0;
    for (const float length : {100.0f, 1e6f, 1e12f, 1e14f, 1e20f, 1e30f, 3e38f}) {
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Vec3 by = rays[i].by;
        const float most = std::max({std::abs(by.x), std::abs(by.y), std::abs(by.z)});
        const auto along = [&](float x) { return x / most * length; };
        scene.rays[i].by = {along(by.x), along(by.y), along(by.z)};
      }
      const Result r = scene.hits(which);
      if (length == 100.0f) found = r.found, comparisons = r.comparisons;
      EXPECT_EQ(r.found, found) << length;
      EXPECT_LE(r.comparisons, comparisons * 11 / 10) << length;
    }
    EXPECT_GT(found, 900u);
  }
}

// Half of the boxes here, half far away: a query costs at most a few times as much as without a
// gap.
TEST(PersistentQueries, TwoClustersFarApart) {
  double ray_alone = 0, overlap_alone = 0;
  for (const float gap : {0.0f, 1e2f, 1e3f, 1e4f, 1e5f, 1e6f}) {
    Random r(5);
    BoxList boxes;
    const float side = side_of(10000 * 3);
    for (int i = 0; i < 20000; ++i) {
      const Vec3 at = r.point(0, side);
      const float by = i % 2 ? gap : 0;
      boxes.push_back(cube(at.x + by, at.y + by, at.z + by, 1));
    }
    EmulatedBroadPhase m({});
    ASSERT_TRUE(m.add(boxes, nullptr).ok());
    std::vector<Sweep> rays;
    BoxList query_boxes;
    for (int k = 0; k < 300; ++k) {
      const Vec3 from = r.point(0, side);
      rays.push_back({{from, from}, r.point(-30, 30)});
      query_boxes.push_back(cube(from, 2));
    }
    const double ray = static_cast<double>(
        m.find_hits(rays.data(), rays.size(), SweepHits::first, {}).comparisons);
    const double overlap = static_cast<double>(m.find_overlaps(query_boxes).comparisons);
    if (gap == 0) ray_alone = ray, overlap_alone = overlap;
    EXPECT_LE(ray, 12 * ray_alone) << gap;
    EXPECT_LE(overlap, 4 * overlap_alone) << gap;
    // Far beyond the other cluster, once the occupied blocks are known.
    for (Sweep& s : rays) s.by = {s.by.x * 2e5f, s.by.y * 2e5f, s.by.z * 2e5f};
    (void)m.find_hits(rays.data(), rays.size(), SweepHits::first, {});
    const double again = static_cast<double>(
        m.find_hits(rays.data(), rays.size(), SweepHits::first, {}).comparisons);
    EXPECT_LE(again, 20 * ray_alone) << gap;
  }
}

// A large box between two clusters, which overlaps only empty cells: it goes through all objects at
// most once per class, as a box or as a sweep.
TEST(PersistentQueries, LargeBoxesInEmptySpace) {
  Random r(5);
  BoxList boxes;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 at = r.point(0, 20);
    const float by = i % 2 ? 1e4f : 0;
    boxes.push_back(cube(at.x + by, at.y + by, at.z + by, 1));
  }
  EmulatedBroadPhase m({});
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  for (const float size : {1.0f, 10.0f, 100.0f, 1000.0f, 5000.0f}) {
    const Box box = cube(4000, 4000, 4000, size);
    EXPECT_LE(m.find_overlaps(Boxes(&box, 1)).comparisons, boxes.size()) << size;
    const Sweep sweep{box, {100, 100, 100}};
    EXPECT_LE(m.find_hits(&sweep, 1, SweepHits::all, {}).comparisons, 2 * boxes.size()) << size;
  }
}

TEST(PersistentQueries, TheGridIsKept) {
  Uniform scene(5000);
  const EmulatedBroadPhase& emulated = scene.emulated;
  (void)scene.hits(SweepHits::first);
  std::size_t launches = emulated.launches(), syncs = emulated.syncs();
  (void)scene.hits(SweepHits::first);
  EXPECT_LE(emulated.launches() - launches,
            6u);  // zeroed, checked, searched, reported, sorted, timed
  EXPECT_EQ(emulated.syncs() - syncs, 1u);
  std::vector<SweepHit> out(scene.rays.size());
  launches = emulated.launches(), syncs = emulated.syncs();
  (void)scene.emulated.find_first_hits(scene.rays.data(), scene.rays.size(), {}, out.data());
  EXPECT_LE(emulated.launches() - launches, 4u);
  EXPECT_EQ(emulated.syncs() - syncs, 1u);
  // A single object that moves invalidates the grid.
  const ObjectId id = 17;
  const Box away = cube(1000, 1000, 1000, 1);
  EXPECT_TRUE(scene.emulated.move(&id, Boxes(&away, 1)).ok());
  EXPECT_TRUE(scene.emulated.find_overlaps(Boxes(&away, 1)).ok());
  ASSERT_EQ(scene.emulated.overlaps().size(), 1u);
  EXPECT_EQ(scene.emulated.overlaps()[0].second, id);
}

// ---- what is refused ----------------------------------------------------------------------------

TEST(PersistentQueries, WhatIsRefused) {
  Uniform scene(500);
  EmulatedBroadPhase& m = scene.emulated;
  const auto refused = [&](const Result& r, Status status, std::uint64_t first,
                           std::uint64_t count) {
    EXPECT_EQ(r.status, status) << to_string(r.status);
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_EQ(r.invalid_count, count);
    EXPECT_EQ(r.found, 0u);
    EXPECT_TRUE(m.hits().empty());
    EXPECT_TRUE(m.overlaps().empty());
  };
  EXPECT_GT(scene.hits(SweepHits::all).found, 0u);
  BoxList boxes(scene.boxes.begin(), scene.boxes.begin() + 9);
  boxes[3].upper.z = boxes[7].lower.x = std::nanf("");
  refused(m.find_overlaps(boxes), Status::nan_box, 3, 2);
  const std::vector<Sweep> good = scene.rays;
  std::vector<SweepHit> out(good.size());
  for (const float bad : {std::nanf(""), infinity, -infinity}) {
    EXPECT_GT(scene.hits(SweepHits::all).found, 0u);
    scene.rays[5].by.y = bad;
    scene.rays[9].box.lower.x = std::nanf("");
    refused(scene.hits(SweepHits::all), Status::nan_box, 5, 2);
    refused(scene.hits(SweepHits::first), Status::nan_box, 5, 2);
    refused(m.find_first_hits(scene.rays.data(), scene.rays.size(), {}, out.data()),
            Status::nan_box, 5, 2);
    scene.rays = good;
  }
  std::vector<std::int32_t> worlds(good.size(), 0);
  worlds[4] = -2;
  Filters filters;
  filters.world = {worlds.data(), worlds.size()};
  refused(m.find_hits(good.data(), good.size(), SweepHits::all, filters), Status::bad_filter, 4, 1);
  Boxes in_worlds(scene.boxes.data(), 9);
  in_worlds.filters = filters;
  refused(m.find_overlaps(in_worlds), Status::bad_filter, 4, 1);
  // If NaNs are allowed, such a box overlaps nothing, and the others are unaffected.
  Options lax;
  lax.nan = NanPolicy::inactive;
  EmulatedBroadPhase other(lax);
  EXPECT_TRUE(other.add(scene.boxes, nullptr).ok());
  EXPECT_TRUE(other.find_overlaps(boxes).ok());
  std::vector<bool> some(9);
  for (const Pair& p : other.overlaps()) some[p.first] = true;
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(some[i], i != 3 && i != 7);
  // No objects; no queries.
  EmulatedBroadPhase empty({});
  EXPECT_TRUE(empty.find_overlaps(scene.boxes).ok());
  EXPECT_EQ(empty.find_overlaps(boxes).status, Status::nan_box);
  EXPECT_TRUE(empty.find_first_hits(good.data(), good.size(), {}, out.data()).ok());
  for (std::uint32_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i].object, cuda::no_object);
  EXPECT_TRUE(m.find_hits(nullptr, 0, SweepHits::all, {}).ok());
  EXPECT_TRUE(m.find_first_hits(nullptr, 0, {}, nullptr).ok());
}

// Memory runs out at each allocation in turn: it is reported, and the next query succeeds.
TEST(PersistentQueries, MemoryRunsOut) {
  const BoxList boxes = uniform_boxes(700, 5);
  FailingResource memory;
  EmulatedBroadPhase m({}, 0, &memory);
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  const auto see = [&] { return m.overlaps().size() + m.hits().size(); };
  EXPECT_GE(until_it_works(memory, see, [&] { return m.find_overlaps(boxes); }), 3u);
  EXPECT_GE(m.overlaps().size(), 700u);
  // With more results than the capacity reserved.
  const Sweep all{{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}}, {}};
  const std::vector<Sweep> sweeps(20, all);
  ASSERT_TRUE(m.find_hits(sweeps.data(), 0, SweepHits::all, {}).ok());
  EXPECT_GE(
      until_it_works(memory, see,
                     [&] { return m.find_hits(sweeps.data(), sweeps.size(), SweepHits::all, {}); }),
      3u);
  EXPECT_EQ(m.hits().size(), 20u * 700);
}

}  // namespace
}  // namespace throng::tests
