// Questions to objects that live on a device, run by the host: against a loop over all objects, and
// byte for byte against throng::BroadPhase; what they cost, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "pipeline/live_actor.hpp"
#include "support/failing.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

constexpr ObjectId nothing = 0xffffffffu;

testing::AssertionResult answers(LiveActor& actor, std::size_t count, bool filtered) {
  const Questions questions(actor, count, filtered);
  return answers(actor.broad_phase, actor.model, questions);
}

// Moves that no update has told yet, ids given again, filters that come late, roll-backs.
void live(std::uint64_t seed, std::size_t objects, float side, bool filtered, bool thin = false) {
  LiveActor actor({}, seed, side, seed % 2 ? 0.7f : 0.0f);
  actor.thin = thin;
  ASSERT_TRUE(actor.add(objects, false));
  ASSERT_TRUE(answers(actor, 20, filtered));
  ASSERT_TRUE(actor.add(objects / 4, filtered));
  for (int step = 0; step < 24; ++step) {
    ASSERT_TRUE(actor.some_calls(step % 3 != 2, objects, filtered, true));
    if (step % 3 == 0) {
      ASSERT_TRUE(actor.update());
    }
    ASSERT_TRUE(answers(actor, 1 + actor.random.below(60), filtered)) << "step " << step;
  }
  LiveMachine copy({});
  ASSERT_TRUE(copy.copy_from(actor.broad_phase).ok());
  const Questions questions(actor, 30, filtered);
  ASSERT_TRUE(answers(copy, actor.model, questions));
  ASSERT_TRUE(actor.remove(actor.model.count()));
  ASSERT_TRUE(copy.copy_from(actor.broad_phase).ok());
  ASSERT_TRUE(answers(copy, actor.model, questions));
  ASSERT_TRUE(answers(actor, 20, filtered));
}

TEST(LiveQuestions, Few) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) live(seed, 150, 10, false);
}
TEST(LiveQuestions, Many) {
  for (std::uint64_t seed = 0; seed < 2; ++seed) live(seed, 3000, 24, false);
}
TEST(LiveQuestions, Filtered) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) live(seed, 700, 14, true);
}
TEST(LiveQuestions, RodsAndPlates) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) live(seed, 1500, 24, seed % 2, true);
}

// ---- against throng::BroadPhase -----------------------------------------------------------------

template <class List>
bool same_list(const List& a, const List& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

// Objects that both have, and the same questions to both.
class Both {
 public:
  explicit Both(const Boxes& boxes) {
    std::vector<ObjectId> ids(boxes.size());
    EXPECT_TRUE(device.add(boxes, ids.data()).ok());
    EXPECT_TRUE(host.add(boxes, ids.data()).ok());
  }
  LiveMachine device{{}};
  BroadPhase host;
  std::uint64_t told = 0;

  void ask(const BoxList& boxes, const std::vector<Sweep>& sweeps, const Filters& filters = {}) {
    Boxes view = boxes;
    view.filters = filters;
    EXPECT_TRUE(device.find_overlaps(view).ok());
    EXPECT_TRUE(host.find_overlaps(view).ok());
    EXPECT_TRUE(same_list(device.overlaps(), host.overlaps()));
    told += host.overlaps().size();
    for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
      EXPECT_TRUE(device.find_hits(sweeps.data(), sweeps.size(), which, filters).ok());
      EXPECT_TRUE(host.find_hits(sweeps.data(), sweeps.size(), which, filters).ok());
      EXPECT_TRUE(same_list(device.hits(), host.hits())) << (which == SweepHits::all);
      EXPECT_TRUE(device.overlaps().empty());  // those of the question before
      told += host.hits().size();
    }
    // Each at its own place; the host has them in a row.
    std::vector<SweepHit> out(sweeps.size(), SweepHit{7, 7, 7});
    const Result r = device.find_first_hits(sweeps.data(), sweeps.size(), filters, out.data());
    EXPECT_EQ(r.found, host.hits().size());
    EXPECT_TRUE(device.hits().empty());
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < out.size(); ++i) {
      const bool some = next < host.hits().size() && host.hits()[next].sweep == i;
      const SweepHit want = some ? host.hits()[next++]
                                 : SweepHit{i, nothing, std::numeric_limits<double>::infinity()};
      ASSERT_EQ(std::memcmp(&out[i], &want, sizeof want), 0) << "sweep " << i;
    }
  }
};

// Sweeps that begin at boxes of the scene and end at others, or go much further; some of them rays,
// some along an axis.
std::vector<Sweep> sweeps_among(const BoxList& boxes, std::size_t count, Random& random) {
  std::vector<Sweep> sweeps;
  for (std::size_t k = 0; k < count; ++k) {
    const auto any = [&] { return boxes[random.below(static_cast<std::uint32_t>(boxes.size()))]; };
    const Box from = any(), to = any();
    Vec3 by = {to.lower.x - from.lower.x, to.lower.y - from.lower.y, to.lower.z - from.lower.z};
    if (!std::isfinite(by.x) || !std::isfinite(by.y) || !std::isfinite(by.z)) by = {1, 2, 3};
    if (random.one_in(5)) by.x = by.z = 0;
    if (random.one_in(5)) by.y = 0;
    if (random.one_in(9)) by = {by.x * 64, by.y * 64, by.z * 64};
    if (!std::isfinite(by.x) || !std::isfinite(by.y) || !std::isfinite(by.z)) by = {};
    Box box = from;
    if (random.one_in(2)) box.upper = box.lower;
    sweeps.push_back({box, by});
  }
  return sweeps;
}

TEST(LiveQuestions, HardScenes) {
  for (const HardScene& scene : hard_scenes(6000)) {
    SCOPED_TRACE(scene.name);
    Random random(1);
    BoxList active;
    for (const Box& b : scene.boxes)
      if (core::is_active(b)) active.push_back(b);
    if (active.empty()) continue;
    Both both(scene.boxes);
    BoxList some;
    for (std::size_t k = 0; k < active.size(); k += 37) some.push_back(active[k]);
    both.ask(some, sweeps_among(active, 150, random));
    EXPECT_GT(both.told, 100u);
  }
}

// Boxes that touch where a sweep begins and ends, and face to face all along: what decides is
// whether a piece ends before its hit or after it.
TEST(LiveQuestions, Lattices) {
  std::uint64_t told = 0;
  for (const float pitch : {1.0f, 0.7f, 1.0f / 3}) {
    BoxList boxes;
    for (int x = 0; x < 16; ++x)
      for (int y = 0; y < 16; ++y)
        for (int z = 0; z < 16; ++z) {
          const auto at = [&](int i) { return static_cast<float>(i) * pitch; };
          boxes.push_back({{at(x), at(y), at(z)}, {at(x + 1), at(y + 1), at(z + 1)}});
        }
    Random random(7);
    std::vector<Sweep> sweeps;
    for (int k = 0; k < 300; ++k) {
      const auto any = [&] { return static_cast<float>(random.between(-2, 18)) * pitch; };
      const Vec3 from = {any(), any(), any()};
      Vec3 by = {any(), any(), any()};
      if (random.one_in(2)) by.x = 0;
      if (random.one_in(3)) by.y = 0;
      sweeps.push_back({{from, from}, by});
    }
    Both both(boxes);
    both.ask(boxes, sweeps);
    told += both.told;
  }
  EXPECT_GT(told, 300'000u);
}

// A world one cell deep, in which a region looks into more rows of cells than there are boxes, and
// so at all boxes; of two sizes, so that some are of another class.
TEST(LiveQuestions, FlatWorld) {
  Random random(3);
  BoxList boxes;
  for (int i = 0; i < 2200; ++i) {
    const Vec3 at = random.point(0, 100);
    boxes.push_back(cube({0, at.y, at.z}, i % 10 ? 0.8f : 7.0f));
  }
  const BoxList asked = {{{-1, -1, -1}, {9, 200, 200}},
                         {{0, 20, 5}, {1, 90, 99}},
                         {{-infinity, 3, -infinity}, {infinity, 3, infinity}}};
  std::vector<Sweep> sweeps = sweeps_among(boxes, 100, random);
  for (const Box& box : asked) sweeps.push_back({box, {1, 2, 3}});
  Both both(boxes);
  both.ask(asked, sweeps);
  EXPECT_GT(both.told, 4000u);
  std::vector<ObjectId> gone;
  for (ObjectId id = 0; id < 2200; ++id)
    if (id % 18 > 1) gone.push_back(id);
  EXPECT_TRUE(both.device.remove(gone.data(), gone.size()).ok());
  EXPECT_TRUE(both.host.remove(gone.data(), gone.size()).ok());
  both.ask(asked, sweeps);
}

// Clusters in an empty world, and a ground: where cells are empty is told once sweeps have gone
// far, and in each grid after that.
TEST(LiveQuestions, ClustersInAnEmptyWorld) {
  Random random(9);
  std::vector<Vec3> middles;
  for (int k = 0; k < 30; ++k) middles.push_back(random.point(0, 4000));
  // And one by one, so that a sweep meets them at the first cell of a block, or the last.
  const auto in_a_cluster = [&] {
    if (random.one_in(3)) return cube(random.point(0, 4000), random.one_in(3) ? 40.0f : 1.0f);
    const Vec3 m = middles[random.below(30)], at = random.point(0, 9);
    return cube({m.x + at.x, m.y + at.y, m.z + at.z}, 1);
  };
  BoxList boxes = {{{0, 0, -1}, {4000, 4000, 0}}};
  for (int i = 0; i < 5000; ++i) boxes.push_back(in_a_cluster());
  const auto sweeps = [&] {  // from one to another, and on
    std::vector<Sweep> list;
    for (int k = 0; k < 400; ++k) {
      const Vec3 from = boxes[1 + random.below(5000)].lower, to = boxes[random.below(5001)].upper;
      const float far = k % 3 ? 1.01f : 2;
      list.push_back(
          {{from, from}, {far * (to.x - from.x), far * (to.y - from.y), far * (to.z - from.z)}});
    }
    return list;
  };
  Both both(boxes);
  const auto held = [&] { return both.device.scene().questions().held(); };
  const std::vector<Sweep> first = sweeps();
  EXPECT_TRUE(both.device.find_hits(first.data(), first.size(), SweepHits::all, {}).ok());
  const std::size_t without = held();
  both.ask({}, first);
  EXPECT_GE(held(), without + boxes.size() * 2) << "two bytes a box";
  for (int step = 0; step < 6; ++step) {
    middles[step] = random.point(0, 4000);
    for (std::size_t i = 1 + random.below(9); i < boxes.size(); i += 9) boxes[i] = in_a_cluster();
    EXPECT_TRUE(both.device.move_all(boxes).ok());
    EXPECT_TRUE(both.host.move_all(boxes).ok());
    both.ask({}, sweeps());
  }
  EXPECT_GT(both.told, 5000u);
}

// Worlds in one place: small ones, which pairs are found in one by one, and a ground of none.
TEST(LiveQuestions, Worlds) {
  for (const bool one_by_one : {true, false}) {
    const std::int32_t worlds = one_by_one ? 100 : 3;
    Random random(static_cast<std::uint64_t>(worlds));
    BoxList boxes = {{{0, 0, -1}, {12, 12, 0}}};
    std::vector<std::int32_t> world = {-1};
    for (int i = 0; i < 6000; ++i) {
      boxes.push_back(cube(random.point(0, 12), 0.4f));
      world.push_back(one_by_one ? i / 60 : random.between(0, worlds - 1));
    }
    Boxes view = boxes;
    view.filters.world = {world.data(), world.size()};
    Both both(view);
    const std::vector<Sweep> sweeps = sweeps_among(boxes, 200, random);
    const BoxList asked(boxes.begin(), boxes.begin() + 200);
    std::vector<std::int32_t> of;
    for (int i = 0; i < 200; ++i) of.push_back(random.between(-1, worlds));
    Filters filters;
    filters.world = {of.data(), of.size()};
    both.ask(asked, sweeps, filters);
    both.ask(asked, sweeps);
    EXPECT_GT(both.told, 1000u);
    // Others go to other worlds, and nothing else changes.
    std::vector<ObjectId> ids;
    for (ObjectId id = 5; id < 6000; id += 3) ids.push_back(id);
    const std::vector<std::int32_t> other(ids.size(), 1);
    Filters moved;
    moved.world = {other.data(), other.size()};
    EXPECT_TRUE(both.device.set_filters(ids.data(), ids.size(), moved).ok());
    EXPECT_TRUE(both.host.set_filters(ids.data(), ids.size(), moved).ok());
    both.ask(asked, sweeps, filters);
  }
}

// What has changed and is no move.
TEST(LiveQuestions, FiltersAndOriginThatChange) {
  Random random(5);
  const BoxList boxes = uniform_boxes(3000, 6);
  const std::vector<std::uint8_t> fixed(3000, 1), free(3000, 0);
  Boxes view = boxes;
  view.filters.is_static = {fixed.data(), fixed.size()};
  Both both(view);
  BoxList asked(boxes.begin(), boxes.begin() + 300);
  std::vector<Sweep> sweeps = sweeps_among(boxes, 300, random);
  Filters filters;
  filters.is_static = {fixed.data(), 300};
  both.ask(asked, sweeps, filters);
  EXPECT_EQ(both.told, 0u);  // of two that are static
  std::vector<ObjectId> ids;
  for (ObjectId id = 0; id < 3000; id += 2) ids.push_back(id);
  Filters now;
  now.is_static = {free.data(), ids.size()};
  EXPECT_TRUE(both.device.set_filters(ids.data(), ids.size(), now).ok());
  EXPECT_TRUE(both.host.set_filters(ids.data(), ids.size(), now).ok());
  both.ask(asked, sweeps, filters);
  EXPECT_GT(both.told, 300u);
  const Vec3 by = {500, -70, 3};
  EXPECT_TRUE(both.device.shift_origin(by).ok());
  EXPECT_TRUE(both.host.shift_origin(by).ok());
  const auto shifted = [&](const Vec3& v) { return Vec3{v.x + by.x, v.y + by.y, v.z + by.z}; };
  for (Box& box : asked) box = {shifted(box.lower), shifted(box.upper)};
  for (Sweep& sweep : sweeps) sweep.box = {shifted(sweep.box.lower), shifted(sweep.box.upper)};
  const std::uint64_t before = both.told;
  both.ask(asked, sweeps, filters);
  EXPECT_GT(both.told, before + 300);
}

// ---- what it costs ------------------------------------------------------------------------------

// Cubes, one for each eight units of volume, and rays ten units long.
struct Uniform {
  explicit Uniform(int n) : boxes(uniform_boxes(n, 3)) {
    Random random(4);
    EXPECT_TRUE(machine.add(boxes, nullptr).ok());
    const float side = side_of(static_cast<float>(n) * 2);
    for (int k = 0; k < 1000; ++k) {
      const Vec3 from = random.point(0, side);
      rays.push_back({{from, from}, random.point(-6, 6)});
    }
  }
  Result hits(SweepHits which) { return machine.find_hits(rays.data(), rays.size(), which, {}); }

  LiveMachine machine{{}};
  BoxList boxes;
  std::vector<Sweep> rays;
};

TEST(LiveQuestions, LookAtLittle) {
  Uniform few(20000), many(80000);
  for (Uniform* scene : {&few, &many}) {
    const double rays = static_cast<double>(scene->rays.size());
    const Result all = scene->hits(SweepHits::all);
    EXPECT_LT(static_cast<double>(all.comparisons) / rays, 150);
    EXPECT_GT(all.found, 1000u);
    const Result first = scene->hits(SweepHits::first);
    EXPECT_LT(first.comparisons, all.comparisons * 3 / 4);
    const Result overlaps = scene->machine.find_overlaps(scene->boxes);
    EXPECT_LT(static_cast<double>(overlaps.comparisons) / static_cast<double>(scene->boxes.size()),
              40);
  }
  // However far a ray goes, it is cut where boxes are, and no finer.
  for (Sweep& ray : many.rays) ray.by = {ray.by.x * 1e6f, ray.by.y * 1e6f, ray.by.z * 1e6f};
  const Result far = many.hits(SweepHits::first);
  EXPECT_LT(static_cast<double>(far.comparisons) / 1000, 300);
}

TEST(LiveQuestions, TheGridIsKept) {
  Uniform scene(5000);
  pipeline::FarDevice& device = scene.machine.scene().device();
  (void)scene.hits(SweepHits::first);
  std::size_t puts = device.puts, waits = device.waits;
  (void)scene.hits(SweepHits::first);
  EXPECT_LE(device.puts - puts, 6u);  // emptied, checked, searched, told, sorted, timed
  EXPECT_EQ(device.waits - waits, 1u);
  std::vector<SweepHit> out(scene.rays.size());
  puts = device.puts, waits = device.waits;
  (void)scene.machine.find_first_hits(scene.rays.data(), scene.rays.size(), {}, out.data());
  EXPECT_LE(device.puts - puts, 4u);
  EXPECT_EQ(device.waits - waits, 1u);
  // One object that moves is enough to make it anew.
  const ObjectId id = 17;
  const Box away = cube(1000, 1000, 1000, 1);
  EXPECT_TRUE(scene.machine.move(&id, Boxes(&away, 1)).ok());
  EXPECT_TRUE(scene.machine.find_overlaps(Boxes(&away, 1)).ok());
  ASSERT_EQ(scene.machine.overlaps().size(), 1u);
  EXPECT_EQ(scene.machine.overlaps()[0].second, id);
}

// ---- what is refused ----------------------------------------------------------------------------

TEST(LiveQuestions, WhatIsRefused) {
  Uniform scene(500);
  LiveMachine& m = scene.machine;
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
  // Where a NaN is allowed such a box overlaps nothing, and the others what they do.
  Options lax;
  lax.nan = NanPolicy::inactive;
  LiveMachine other(lax);
  EXPECT_TRUE(other.add(scene.boxes, nullptr).ok());
  EXPECT_TRUE(other.find_overlaps(boxes).ok());
  std::vector<bool> some(9);
  for (const Pair& p : other.overlaps()) some[p.first] = true;
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(some[i], i != 3 && i != 7);
  // No objects, and no questions.
  LiveMachine empty({});
  EXPECT_TRUE(empty.find_overlaps(scene.boxes).ok());
  EXPECT_EQ(empty.find_overlaps(boxes).status, Status::nan_box);
  EXPECT_TRUE(empty.find_first_hits(good.data(), good.size(), {}, out.data()).ok());
  for (std::uint32_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i].object, nothing);
  EXPECT_TRUE(m.find_hits(nullptr, 0, SweepHits::all, {}).ok());
  EXPECT_TRUE(m.find_first_hits(nullptr, 0, {}, nullptr).ok());
}

// Memory that runs out at each place in turn: told, and the next question is answered.
TEST(LiveQuestions, MemoryRunsOut) {
  const BoxList boxes = uniform_boxes(700, 5);
  FailingResource memory;
  LiveMachine m({}, 0, &memory);
  ASSERT_TRUE(m.add(boxes, nullptr).ok());
  const auto see = [&] { return m.overlaps().size() + m.hits().size(); };
  EXPECT_GE(until_it_works(memory, see, [&] { return m.find_overlaps(boxes); }), 3u);
  EXPECT_GE(m.overlaps().size(), 700u);
  // With more to tell than there was room for.
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
