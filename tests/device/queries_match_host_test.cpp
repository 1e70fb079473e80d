// Queries of persistent objects on a device, emulated on the host: byte for byte against
// throng::BroadPhase, for hard scenes, worlds, clusters and changes.
#include <gtest/gtest.h>

#include <cmath>

#include "base/bounds.hpp"
#include "device/device_actor.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// The same objects and the same queries on both.
class HostAndDevice {
 public:
  explicit HostAndDevice(const Boxes& boxes) {
    std::vector<ObjectId> ids(boxes.size());
    EXPECT_TRUE(device.add(boxes, ids.data()).ok());
    EXPECT_TRUE(host.add(boxes, ids.data()).ok());
  }
  EmulatedBroadPhase device{{}};
  BroadPhase host;
  std::uint64_t result_count = 0;

  void compare(const BoxList& boxes, const std::vector<Sweep>& sweeps,
               const Filters& filters = {}) {
    Boxes view = boxes;
    view.filters = filters;
    EXPECT_TRUE(device.find_overlaps(view).ok());
    EXPECT_TRUE(host.find_overlaps(view).ok());
    EXPECT_TRUE(same_bytes(device.overlaps(), host.overlaps()));
    result_count += host.overlaps().size();
    for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
      EXPECT_TRUE(device.find_hits(sweeps.data(), sweeps.size(), which, filters).ok());
      EXPECT_TRUE(host.find_hits(sweeps.data(), sweeps.size(), which, filters).ok());
      EXPECT_TRUE(same_bytes(device.hits(), host.hits())) << (which == SweepHits::all);
      EXPECT_TRUE(device.overlaps().empty());  // those of the previous query
      result_count += host.hits().size();
    }
    // One result per sweep; the host lists only sweeps with hits.
    std::vector<SweepHit> out(sweeps.size(), SweepHit{7, 7, 7});
    const Result r = device.find_first_hits(sweeps.data(), sweeps.size(), filters, out.data());
    EXPECT_EQ(r.found, host.hits().size());
    EXPECT_TRUE(device.hits().empty());
    EXPECT_TRUE(same_bytes(out, gpu_layout(host.hits(), out.size())));
  }
};

// Sweeps that begin at boxes of the scene and end at others, or go much further; some are rays,
// some parallel to an axis.
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

TEST(PersistentQueries, HardScenes) {
  for (const HardScene& scene : hard_scenes(6000)) {
    SCOPED_TRACE(scene.name);
    Random random(1);
    BoxList active;
    for (const Box& b : scene.boxes)
      if (base::is_active(b)) active.push_back(b);
    if (active.empty()) continue;
    HostAndDevice both(scene.boxes);
    BoxList some;
    for (std::size_t k = 0; k < active.size(); k += 37) some.push_back(active[k]);
    both.compare(some, sweeps_among(active, 150, random));
    EXPECT_GT(both.result_count, 100u);
  }
}

// Boxes that touch where a sweep begins and ends, and face to face everywhere: tests whether a
// piece ends before or after its hit.
TEST(PersistentQueries, Lattices) {
  std::uint64_t result_count = 0;
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
    HostAndDevice both(boxes);
    both.compare(boxes, sweeps);
    result_count += both.result_count;
  }
  EXPECT_GT(result_count, 300'000u);
}

// A world one cell deep, in which a region query searches more rows of cells than there are boxes,
// and so all boxes. Two sizes, so that some are of another class.
TEST(PersistentQueries, FlatWorld) {
  Random random(3);
  BoxList boxes;
  for (int i = 0; i < 2200; ++i) {
    const Vec3 at = random.point(0, 100);
    boxes.push_back(cube({0, at.y, at.z}, i % 10 ? 0.8f : 7.0f));
  }
  const BoxList query_boxes = {{{-1, -1, -1}, {9, 200, 200}},
                               {{0, 20, 5}, {1, 90, 99}},
                               {{-infinity, 3, -infinity}, {infinity, 3, infinity}}};
  std::vector<Sweep> sweeps = sweeps_among(boxes, 100, random);
  for (const Box& box : query_boxes) sweeps.push_back({box, {1, 2, 3}});
  HostAndDevice both(boxes);
  both.compare(query_boxes, sweeps);
  EXPECT_GT(both.result_count, 4000u);
  std::vector<ObjectId> gone;
  for (ObjectId id = 0; id < 2200; ++id)
    if (id % 18 > 1) gone.push_back(id);
  EXPECT_TRUE(both.device.remove(gone.data(), gone.size()).ok());
  EXPECT_TRUE(both.host.remove(gone.data(), gone.size()).ok());
  both.compare(query_boxes, sweeps);
}

// Clusters in an otherwise empty world, and a ground: the bitmap of occupied blocks is built once
// sweeps have been long, and in each later grid.
TEST(PersistentQueries, ClustersInAnEmptyWorld) {
  Random random(9);
  std::vector<Vec3> middles;
  for (int k = 0; k < 30; ++k) middles.push_back(random.point(0, 4000));
  // And single boxes, so that a sweep meets them at the first cell of a block, or the last.
  const auto in_a_cluster = [&] {
    if (random.one_in(3)) return cube(random.point(0, 4000), random.one_in(3) ? 40.0f : 1.0f);
    const Vec3 m = middles[random.below(30)], at = random.point(0, 9);
    return cube({m.x + at.x, m.y + at.y, m.z + at.z}, 1);
  };
  BoxList boxes = {{{0, 0, -1}, {4000, 4000, 0}}};
  for (int i = 0; i < 5000; ++i) boxes.push_back(in_a_cluster());
  const auto sweeps = [&] {  // from one to another, and further
    std::vector<Sweep> list;
    for (int k = 0; k < 400; ++k) {
      const Vec3 from = boxes[1 + random.below(5000)].lower, to = boxes[random.below(5001)].upper;
      const float far = k % 3 ? 1.01f : 2;
      list.push_back(
          {{from, from}, {far * (to.x - from.x), far * (to.y - from.y), far * (to.z - from.z)}});
    }
    return list;
  };
  HostAndDevice both(boxes);
  const auto held = [&] { return both.device.query_bytes(); };
  const std::vector<Sweep> first = sweeps();
  EXPECT_TRUE(both.device.find_hits(first.data(), first.size(), SweepHits::all, {}).ok());
  const std::size_t without = held();
  both.compare({}, first);
  EXPECT_GE(held(), without + boxes.size() * 2) << "two bytes per box";
  for (int step = 0; step < 6; ++step) {
    middles[step] = random.point(0, 4000);
    for (std::size_t i = 1 + random.below(9); i < boxes.size(); i += 9) boxes[i] = in_a_cluster();
    EXPECT_TRUE(both.device.move_all(boxes).ok());
    EXPECT_TRUE(both.host.move_all(boxes).ok());
    both.compare({}, sweeps());
  }
  EXPECT_GT(both.result_count, 5000u);
}

// Worlds in one place: small ones, each searched by itself when finding pairs, and a ground of all
// worlds.
TEST(PersistentQueries, Worlds) {
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
    HostAndDevice both(view);
    const std::vector<Sweep> sweeps = sweeps_among(boxes, 200, random);
    const BoxList query_boxes(boxes.begin(), boxes.begin() + 200);
    std::vector<std::int32_t> of;
    for (int i = 0; i < 200; ++i) of.push_back(random.between(-1, worlds));
    Filters filters;
    filters.world = {of.data(), of.size()};
    both.compare(query_boxes, sweeps, filters);
    both.compare(query_boxes, sweeps);
    EXPECT_GT(both.result_count, 1000u);
    // Some objects change worlds, and nothing else changes.
    std::vector<ObjectId> ids;
    for (ObjectId id = 5; id < 6000; id += 3) ids.push_back(id);
    const std::vector<std::int32_t> other(ids.size(), 1);
    Filters moved;
    moved.world = {other.data(), other.size()};
    EXPECT_TRUE(both.device.set_filters(ids.data(), ids.size(), moved).ok());
    EXPECT_TRUE(both.host.set_filters(ids.data(), ids.size(), moved).ok());
    both.compare(query_boxes, sweeps, filters);
  }
}

// Changes that are not moves.
TEST(PersistentQueries, FiltersAndOriginThatChange) {
  Random random(5);
  const BoxList boxes = uniform_boxes(3000, 6);
  const std::vector<std::uint8_t> fixed(3000, 1), free(3000, 0);
  Boxes view = boxes;
  view.filters.is_static = {fixed.data(), fixed.size()};
  HostAndDevice both(view);
  BoxList query_boxes(boxes.begin(), boxes.begin() + 300);
  std::vector<Sweep> sweeps = sweeps_among(boxes, 300, random);
  Filters filters;
  filters.is_static = {fixed.data(), 300};
  both.compare(query_boxes, sweeps, filters);
  EXPECT_EQ(both.result_count, 0u);  // both static
  std::vector<ObjectId> ids;
  for (ObjectId id = 0; id < 3000; id += 2) ids.push_back(id);
  Filters now;
  now.is_static = {free.data(), ids.size()};
  EXPECT_TRUE(both.device.set_filters(ids.data(), ids.size(), now).ok());
  EXPECT_TRUE(both.host.set_filters(ids.data(), ids.size(), now).ok());
  both.compare(query_boxes, sweeps, filters);
  EXPECT_GT(both.result_count, 300u);
  const Vec3 by = {500, -70, 3};
  EXPECT_TRUE(both.device.shift_origin(by).ok());
  EXPECT_TRUE(both.host.shift_origin(by).ok());
  const auto shifted = [&](const Vec3& v) { return Vec3{v.x + by.x, v.y + by.y, v.z + by.z}; };
  for (Box& box : query_boxes) box = {shifted(box.lower), shifted(box.upper)};
  for (Sweep& sweep : sweeps) sweep.box = {shifted(sweep.box.lower), shifted(sweep.box.upper)};
  const std::uint64_t before = both.result_count;
  both.compare(query_boxes, sweeps, filters);
  EXPECT_GT(both.result_count, before + 300);
}

}  // namespace
}  // namespace throng::tests
