// Queries against a loop over all objects: overlaps by the reference comparison; sweeps by exact
// integer arithmetic and by the formula in the header.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/counting_resource.hpp"

namespace throng::tests {
namespace {

testing::AssertionResult same_overlaps(Actor& actor, std::size_t count, bool filtered) {
  BoxList boxes;
  std::vector<Filter> filters;
  for (std::size_t i = 0; i < count; ++i) {
    boxes.push_back(actor.any_box());
    filters.push_back(filtered ? actor.any_filter() : Filter{});
  }
  return same_overlaps(actor.broad_phase, actor.model, boxes, filters, filtered);
}

// With and without cells, moves before an update, one thread and several.
void check_queries(std::uint64_t seed, bool filtered, std::size_t query_count, float margin,
                   bool thin = false) {
  Options options;
  options.threads = seed % 2 ? 1 : 3;
  options.margin = margin;
  const float side = 14;
  Actor actor(options, seed, side);
  actor.thin = thin;
  ASSERT_TRUE(actor.add(400, filtered));
  for (int step = 0; step < 30; ++step) {
    if (step % 8 == 5) {
      ASSERT_TRUE(actor.move_all(100));
    } else if (step % 10 != 0) {
      ASSERT_TRUE(actor.move(step % 7 == 0 ? 300 : 3));
    }
    if (step % 6 == 0) {
      ASSERT_TRUE(actor.remove(3));
      ASSERT_TRUE(actor.add(7, filtered));
    }
    if (step % 3 == 0) {
      ASSERT_TRUE(actor.update());
    }
    if (step % 2 == 0) {
      ASSERT_TRUE(same_overlaps(actor, 1 + query_count, filtered)) << "step " << step;
      continue;
    }
    std::vector<Sweep> sweeps;
    std::vector<Filter> filters;
    for (std::size_t k = 0; k < query_count; ++k) {
      sweeps.push_back(actor.any_sweep());
      filters.push_back(filtered ? actor.any_filter() : Filter{});
    }
    ASSERT_TRUE(same_hits(actor.broad_phase, actor.model, sweeps, filters)) << "step " << step;
  }
  ASSERT_TRUE(actor.update());
}

TEST(BroadPhaseQuery, Few) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) check_queries(seed, false, 3, 0);
}
TEST(BroadPhaseQuery, Many) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) check_queries(seed, false, 150, 0);
}
TEST(BroadPhaseQuery, Filtered) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) check_queries(seed, true, 40, 0);
}
TEST(BroadPhaseQuery, RodsAndPlates) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed)
    check_queries(seed, seed % 3 == 0, 3 + 20 * (seed % 2), 0, true);
}
TEST(BroadPhaseQuery, TheMarginIsIgnored) {
  for (std::uint64_t seed = 0; seed < 6; ++seed)
    check_queries(seed, false, seed < 3 ? 30 : 2, 0.5f);
}

// Without an index every object is compared.
TEST(BroadPhaseQuery, ComparisonsAreCounted) {
  BroadPhase objects;
  BoxList boxes;
  for (int i = 0; i < 20; ++i) boxes.push_back(cube(static_cast<float>(i), 0, 0, 0.5f));
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_EQ(objects.add(boxes, ids.data()).status, Status::ok);
  const BoxList all = {{{-1, -1, -1}, {30, 1, 1}}};
  const Result r = objects.find_overlaps(all);
  ASSERT_EQ(r.status, Status::ok);
  EXPECT_EQ(r.found, boxes.size());
  EXPECT_GE(r.comparisons, boxes.size());
}

// After an update in which most objects moved, queries use the columns of its full search, plus
// later changes. There are none in a copy, after a two-set search in the same memory, or when few
// objects moved.
void query_after_all_moved(std::uint64_t seed, float margin, bool filtered) {
  Options options;
  options.threads = seed % 2 ? 1 : 3;
  options.margin = margin;
  const float side = 26;
  Actor actor(options, seed, side);
  actor.in_worlds = false;  // worlds have separate columns
  ASSERT_TRUE(actor.add(2000, filtered));
  const auto check_queries = [&](Actor& queried, const char* when) {
    SCOPED_TRACE(when);
    for (int k = 0; k < 4; ++k) {
      ASSERT_TRUE(same_overlaps(queried, 2, filtered));
      std::vector<Sweep> sweeps;
      for (int i = 0; i < 2; ++i) {
        sweeps.push_back(queried.any_sweep());
        const Vec3 at = sweeps.back().box.lower;
        if (k % 2) sweeps.back().box = {at, {at.x + 0.5f, at.y + 0.5f, at.z + 0.5f}};
      }
      const std::vector<Filter> filters(2, filtered ? queried.any_filter() : Filter{});
      ASSERT_TRUE(same_hits(queried.broad_phase, queried.model, sweeps, filters));
    }
  };
  for (int step = 0; step < 3; ++step) {
    ASSERT_TRUE(actor.move(2000));
    ASSERT_TRUE(actor.update());
    const BroadPhase saved = actor.broad_phase;
    const Model model = actor.model;
    if (step == 2) {
      ASSERT_TRUE(actor.move(2000));
      ASSERT_TRUE(actor.update());
      actor.broad_phase = saved;
      actor.model = model;
      check_queries(actor, "rolled back");
      continue;
    }
    check_queries(actor, "all moved");
    Actor copy = actor;
    check_queries(copy, "a copy");
    ASSERT_TRUE(actor.move(30));
    check_queries(actor, "some moved");
    ASSERT_TRUE(actor.remove(10));
    ASSERT_TRUE(actor.add(15, filtered));
    check_queries(actor, "some removed and added");
    if (step == 1) {
      ASSERT_TRUE(same_overlaps(actor, 300, filtered));
      check_queries(actor, "a large query");
    }
    ASSERT_TRUE(actor.move(100));
    check_queries(actor, "more moved");
    ASSERT_TRUE(actor.update());
    check_queries(actor, "some moved, updated");
    ASSERT_TRUE(actor.move(3));
    ASSERT_TRUE(actor.update());
    check_queries(actor, "few moved, updated");
  }
}
TEST(BroadPhaseQuery, AfterAllMoved) {
  for (std::uint64_t seed = 0; seed < 2; ++seed) query_after_all_moved(seed, 0, false);
}
TEST(BroadPhaseQuery, AfterAllMovedWithFilters) { query_after_all_moved(2, 0, true); }
TEST(BroadPhaseQuery, AfterAllMovedWithAMargin) { query_after_all_moved(3, 0.25f, false); }

// A stopped update, which finds all pairs from scratch after few changes, leaves no valid columns.
TEST(BroadPhaseQuery, AfterAnUpdateThatWasStopped) {
  struct Stopper {
    std::atomic<bool> stop{false};
    bool armed = false;
    static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
      auto& me = *static_cast<Stopper*>(self);
      if (me.armed) me.stop = true;
      for (unsigned i = 0; i < count; ++i) task(context, i);
    }
  } stopper;
  const Executor executor{3, &Stopper::run, &stopper};
  Options options;
  options.threads = 3;
  options.executor = &executor;
  options.stop = &stopper.stop;
  Random random(21);
  BoxList boxes;
  for (int k = 0; k < 20000; ++k) boxes.push_back(cube(random.point(0, 54), 1));
  BroadPhase b(options);
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  ASSERT_TRUE(b.update().ok());
  const std::vector<Box> queried(boxes.begin(), boxes.begin() + 3);
  const auto check_queries = [&](BroadPhase& of) {
    EXPECT_TRUE(of.find_overlaps(queried).ok());
    return to_vector(of.overlaps());
  };
  ASSERT_EQ(b.move(7, cube(30, 30, 30, 1)), Status::ok);
  const std::vector<Pair> before = check_queries(b);
  stopper.armed = true;
  ASSERT_EQ(b.update().status, Status::stopped);
  stopper.armed = stopper.stop = false;
  EXPECT_EQ(check_queries(b), before);
  ASSERT_TRUE(b.update().ok());
  EXPECT_EQ(check_queries(b), before);
}

// A copy replaces the contents on which queries prepared their index.
TEST(BroadPhaseQuery, ACopyAfterMoves) {
  Random random(22);
  BoxList boxes;
  for (int k = 0; k < 3000; ++k) boxes.push_back(cube(random.point(0, 30), 1));
  BroadPhase b;
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  // builds cells
  for (int k = 0; k < 200; ++k) ASSERT_TRUE(b.find_overlaps(Boxes(&boxes[0], 1)).ok());
  BroadPhase other(b);
  const Box far = cube(90, 90, 90, 1);
  ASSERT_EQ(b.move(5, far), Status::ok);
  ASSERT_TRUE(other.find_overlaps(Boxes(&far, 1)).ok());
  EXPECT_TRUE(other.overlaps().empty());
  ASSERT_TRUE(other.copy_from(b).ok());
  ASSERT_TRUE(other.find_overlaps(Boxes(&far, 1)).ok());
  ASSERT_EQ(other.overlaps().size(), 1u);
  EXPECT_EQ(other.overlaps()[0].second, 5u);
}

// Slanted sweeps through many small boxes: a box near the start of the path may be hit late, or
// never.
TEST(BroadPhaseQuery, TheFirstHitIsTheEarliest) {
  Random random(3);
  BroadPhase b;
  BoxList boxes;
  for (int k = 0; k < 6000; ++k)
    boxes.push_back(cube(random.point(0, 20), random.in(0, random.one_in(20) ? 3.0f : 0.3f)));
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 3000; ++k) {
    const Vec3 at = random.point(-2, 22);
    sweeps.push_back({{at, at}, random.point(-20, 20)});
  }
  ASSERT_TRUE(b.find_hits(sweeps.data(), sweeps.size()).ok());
  std::vector<SweepHit> want;
  for (const SweepHit& hit : b.hits()) {
    if (want.empty() || want.back().sweep != hit.sweep)
      want.push_back(hit);
    else if (hit.time < want.back().time)
      want.back() = hit;
  }
  EXPECT_GT(b.hits().size(), 2 * want.size());
  ASSERT_TRUE(b.find_hits(sweeps.data(), sweeps.size(), SweepHits::first).ok());
  ASSERT_EQ(b.hits().size(), want.size());
  for (std::size_t k = 0; k < want.size(); ++k) {
    EXPECT_EQ(b.hits()[k].sweep, want[k].sweep);
    EXPECT_EQ(b.hits()[k].object, want[k].object);
    EXPECT_EQ(b.hits()[k].time, want[k].time);
  }
}

// On a lattice of touching cubes, integer sweeps graze edges and corners. Whether they hit depends
// on fractions, compared here exactly by cross multiplication.
TEST(BroadPhaseQuery, GrazingSweeps) {
  Actor actor({}, 1, 8);
  Random& random = actor.random;
  BoxList boxes;
  for (int k = 0; k < 400; ++k) {
    const auto c = [&] { return static_cast<float>(random.between(0, 9)); };
    const float e = static_cast<float>(random.between(0, 2));
    boxes.push_back(cube(c(), c(), c(), e));
  }
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(actor.broad_phase.add(boxes, ids.data()).ok());
  std::vector<Sweep> sweeps;
  for (int k = 0; k < 300; ++k) {
    const auto c = [&](int low, int high) { return static_cast<float>(random.between(low, high)); };
    const Vec3 at = {c(-3, 12), c(-3, 12), c(-3, 12)};
    const float e = c(0, 1);
    sweeps.push_back({cube(at, e), {c(-13, 13), c(-13, 13), c(-13, 13)}});
  }
  const auto check_queries = [&](std::size_t i, std::size_t count, std::vector<SweepHit>& hits) {
    BroadPhase fresh(actor.broad_phase);
    ASSERT_TRUE(fresh.find_hits(sweeps.data() + i, count).ok());
    for (SweepHit hit : fresh.hits()) {
      hit.sweep += static_cast<std::uint32_t>(i);
      hits.push_back(hit);
    }
  };
  // One batch, for which cells are built, and single queries, which loop over all objects.
  std::vector<SweepHit> hits, single;
  check_queries(0, sweeps.size(), hits);
  for (std::size_t i = 0; i < sweeps.size(); ++i) check_queries(i, 1, single);
  ASSERT_TRUE(std::equal(hits.begin(), hits.end(), single.begin(), single.end(),
                         [](const SweepHit& a, const SweepHit& b) {
                           return a.sweep == b.sweep && a.object == b.object && a.time == b.time;
                         }));
  std::size_t at = 0, grazing = 0;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    for (const ObjectId id : ids) {
      const Sweep& s = sweeps[i];
      const Box& b = boxes[id];
      const float low[3] = {b.lower.x - s.box.upper.x, b.lower.y - s.box.upper.y,
                            b.lower.z - s.box.upper.z};
      const float high[3] = {b.upper.x - s.box.lower.x, b.upper.y - s.box.lower.y,
                             b.upper.z - s.box.lower.z};
      const float by[3] = {s.by.x, s.by.y, s.by.z};
      // enter = en / ed, leave = ln / ld, denominators > 0.
      long en = 0, ed = 1, ln = 1, ld = 1;
      bool hit = true;
      for (int k = 0; k < 3; ++k) {
        long p = static_cast<long>(low[k]), q = static_cast<long>(high[k]),
             d = static_cast<long>(by[k]);
        if (d == 0) {
          hit = hit && p <= 0 && q >= 0;
          continue;
        }
        if (d < 0) {
          std::swap(p, q);
          p = -p, q = -q, d = -d;
        }
        if (p * ed > en * d) en = p, ed = d;
        if (q * ld < ln * d) ln = q, ld = d;
      }
      grazing += hit && en * ld == ln * ed;
      hit = hit && en * ld <= ln * ed;
      const bool reported = at < hits.size() && hits[at].sweep == i && hits[at].object == id;
      ASSERT_EQ(reported, hit) << "sweep " << i << ", object " << id;
      at += reported;
    }
  }
  EXPECT_EQ(at, hits.size());
  EXPECT_GT(grazing, 100u);
}

// Infinity minus infinity sets no limit: a box that reaches an infinity hits one that lies at it
// from the start.
TEST(BroadPhaseQuery, EqualInfinitiesTouch) {
  constexpr float inf = infinity;
  for (const float sign : {1.0f, -1.0f}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto between = [&](float from, float to) {
        Box box = cube(0, 0, 0, 1);
        (&box.lower.x)[axis] = sign > 0 ? from : -to;
        (&box.upper.x)[axis] = sign > 0 ? to : -from;
        return box;
      };
      // At infinity, reaching it from 5 on, everywhere, and a box from 2 to 3.
      const BoxList objects = {between(inf, inf), between(5, inf), between(-inf, inf),
                               between(2, 3)};
      BroadPhase b;
      ASSERT_TRUE(b.add(objects, nullptr).ok());
      for (const float by : {4.0f, -4.0f, 3e38f}) {
        Sweep sweep = {between(0, inf), {0, 0, 0}};
        (&sweep.by.x)[axis] = sign * by;
        ASSERT_TRUE(b.find_hits(&sweep, 1).ok());
        ASSERT_EQ(b.hits().size(), 4u) << axis << " by " << by;
        for (const SweepHit& hit : b.hits()) EXPECT_EQ(hit.time, 0) << hit.object << " by " << by;
        // A sweep that ends at 1 never reaches infinity, and hits the others at the regular times.
        sweep.box = between(0, 1);
        ASSERT_TRUE(b.find_hits(&sweep, 1).ok());
        std::vector<ObjectId> met;
        for (const SweepHit& hit : b.hits()) met.push_back(hit.object);
        const std::vector<ObjectId> all = {1, 2, 3}, back = {2};
        EXPECT_EQ(met, by > 0 ? all : back) << axis << " by " << by;
      }
    }
  }
}

// An unbounded ray has the same hits as one that just leaves the scene.
TEST(BroadPhaseQuery, ARayOfMaximalLength) {
  const BoxList boxes = uniform_boxes(400, 6);
  BroadPhase b;
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  Random random(4);
  std::size_t met = 0;
  for (int k = 0; k < 60; ++k) {
    const Box& at = boxes[random.below(boxes.size())];
    const Vec3 from = at.lower;
    Vec3 by = {0, 0, 0};
    (&by.x)[k % 3] = k % 2 ? 1e6f : -1e6f;
    std::vector<ObjectId> found[2];
    for (const float scale : {1.0f, 3e32f}) {
      const Sweep ray = {{from, from}, {by.x * scale, by.y * scale, by.z * scale}};
      ASSERT_TRUE(b.find_hits(&ray, 1).ok());
      for (const SweepHit& hit : b.hits()) found[scale > 1].push_back(hit.object);
    }
    EXPECT_EQ(found[0], found[1]);
    met += found[0].size();
  }
  EXPECT_GT(met, 60u);
}

TEST(BroadPhaseQuery, InvalidQueries) {
  BroadPhase b;
  const BoxList boxes = {cube(0, 0, 0, 1)};
  ASSERT_TRUE(b.add(boxes, nullptr).ok());
  const Snapshot before(b);
  Sweep sweeps[2] = {{boxes[0], {1, 0, 0}}, {boxes[0], {0, infinity, 0}}};
  Result r = b.find_hits(sweeps, 2);
  EXPECT_EQ(r.status, Status::nan_box);
  EXPECT_EQ(r.first_invalid, 1u);
  EXPECT_NE(std::string(r.message).find("3.4e38"), std::string::npos)
      << "no suggested fix: " << r.message;
  EXPECT_TRUE(b.hits().empty());
  sweeps[1] = {{{0, std::nanf(""), 0}, {1, 1, 1}}, {1, 0, 0}};
  EXPECT_EQ(b.find_hits(sweeps, 2).status, Status::nan_box);
  EXPECT_EQ(b.find_hits(nullptr, 2).status, Status::bad_boxes);
  EXPECT_EQ(b.find_overlaps(Boxes(&sweeps[1].box, 1)).status, Status::nan_box);
  const std::int32_t world = -3;
  Filters filters;
  filters.world = {&world, 1};
  EXPECT_EQ(b.find_hits(sweeps, 1, SweepHits::all, filters).status, Status::bad_filter);
  const Result odd = b.find_hits(sweeps, 1, static_cast<SweepHits>(77));
  EXPECT_EQ(odd.status, Status::bad_option);
  EXPECT_NE(std::string(odd.message).find("77"), std::string::npos) << odd.message;
  EXPECT_EQ(Snapshot(b), before);
  EXPECT_TRUE(b.find_hits(sweeps, 1).ok());
  EXPECT_EQ(b.hits().size(), 1u);
  EXPECT_TRUE(b.find_overlaps(boxes).ok());
  EXPECT_EQ(b.overlaps().size(), 1u);
  BroadPhase none;
  EXPECT_TRUE(none.hits().empty() && none.overlaps().empty());
  EXPECT_TRUE(none.find_hits(sweeps, 1).ok());
  EXPECT_TRUE(none.find_overlaps(boxes).ok());
}

}  // namespace
}  // namespace throng::tests
