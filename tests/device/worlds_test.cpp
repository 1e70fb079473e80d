// Small worlds with contiguous boxes are searched one by one, and no others are; the pairs are the
// same.
#include "device/worlds.hpp"

#include <gtest/gtest.h>

#include <string>

#include "base/threads.hpp"
#include "device/collected.hpp"
#include "device/engine.hpp"
#include "device/host_device.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::device {
namespace {

using tests::BoxList;

struct Scene {
  BoxList boxes;
  std::vector<std::int32_t> worlds;
  // Adds boxes of one world, near each other.
  void add(std::int32_t world, std::uint32_t count, std::uint64_t seed = 1) {
    tests::Random random(seed + static_cast<std::uint64_t>(world + 7));
    const float extent = 1 + 0.02f * static_cast<float>(count);
    for (std::uint32_t k = 0; k < count; ++k) {
      const Vec3 at = random.point(0, extent);
      boxes.push_back(tests::cube(at.x, at.y, at.z, 1));
      worlds.push_back(world);
    }
  }
  Boxes view() const {
    Boxes all = boxes;
    all.filters.world = {worlds.data(), worlds.size()};
    return all;
  }
};

Engine<HostDevice>& engine() {
  static Engine<HostDevice> e(std::pmr::new_delete_resource(), HostDevice::Run{base::run_tasks});
  e.device().begin(base::default_executor(), 3);
  return e;
}

// Built and searched in one call, as on a GPU without a report in between: the result is the same.
void expect_at_once(const Boxes& view, const Options& options, const tests::Answer& answer) {
  HostDevice& device = engine().device();
  const Pipeline<HostDevice> pipeline(device);
  const Input in = make_input(view, nullptr, options);
  DeviceBuffer<HostDevice> memory(device);
  Workspace w;
  w.carve<HostDevice>(in.count, memory.ensure(w.carve<HostDevice>(in.count, nullptr)));
  std::vector<Pair> out(answer.pairs.size() + 1);
  const PairSink sink{out.data(), out.size(), w.report};
  pipeline.build(in, false, w);
  pipeline.find(in, false, w, sink);
  const Report apart = *w.report;
  pipeline.build_and_find(in, false, w, sink);
  const Report at_once = *w.report;
  EXPECT_EQ(at_once.found, answer.pairs.size());
  EXPECT_EQ(at_once.comparisons, apart.comparisons);
  EXPECT_EQ(at_once.inactive, answer.inactive);
  EXPECT_EQ(at_once.nan_count, apart.nan_count);
  EXPECT_EQ(at_once.nan_mark, apart.nan_mark);
  out.resize(answer.pairs.size());
  EXPECT_TRUE(tests::same_pairs(out, answer.pairs));
}

// All forms of the result; returns whether each world was searched by itself.
bool expect_exact(const Boxes& view, const Options& options = {}) {
  const tests::Answer answer = tests::reference_pairs(view, options.margin);
  bool one_by_one = false;
  expect_at_once(view, options, answer);
  for (const Order order : {Order::any, Order::canonical}) {
    Options o = options;
    o.order = order;
    o.algorithm = Algorithm::grid;
    o.nan = NanPolicy::inactive;
    std::vector<Pair> out(answer.pairs.size() + 1);
    base::Output output{out.data(), out.size(), nullptr, nullptr};
    Result r;
    engine().find(view, nullptr, o, 0, &output, nullptr, r);
    EXPECT_TRUE(r.ok());
    EXPECT_EQ(r.inactive, answer.inactive);
    EXPECT_EQ(r.found, answer.pairs.size());
    out.resize(r.written);
    EXPECT_TRUE(order == Order::any || out == answer.pairs);
    EXPECT_TRUE(tests::same_pairs(out, answer.pairs));
    one_by_one = std::string(r.plan.reason).find("each world") != std::string::npos;
    // In blocks, each with the pairs of some first indices.
    Collected taken;
    const Consumer consumer(taken);
    o.memory_cap_bytes = 1;
    Result needs;
    try {
      engine().find(view, nullptr, o, 0, nullptr, &consumer, needs);
      ADD_FAILURE() << "one byte was accepted as a cap";
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.status, Status::memory_cap_too_small);
      o.memory_cap_bytes = failure.bytes;
    }
    r = {};
    engine().find(view, nullptr, o, 0, nullptr, &consumer, r);
    EXPECT_TRUE(r.ok());
    EXPECT_TRUE(order == Order::any || taken.pairs == answer.pairs);
    EXPECT_TRUE(tests::same_pairs(taken.pairs, answer.pairs));
  }
  return one_by_one;
}

TEST(Worlds, OfAnySizeUpToTheLargest) {
  Scene scene;
  for (const std::uint32_t count : {1u, 2u, 31u, 32u, 33u, 64u, 255u, 256u, 257u, 1u, 511u, 512u})
    scene.add(static_cast<std::int32_t>(scene.boxes.size()), count);
  EXPECT_TRUE(expect_exact(scene.view()));
  Options options;
  options.margin = 0.2f;
  EXPECT_TRUE(expect_exact(scene.view(), options));
  // One box more makes a world that needs a grid, wherever it stands.
  scene.add(5000, 513);
  EXPECT_FALSE(expect_exact(scene.view()));
  scene.add(5001, 3);
  EXPECT_FALSE(expect_exact(scene.view()));
}

TEST(Worlds, OneAlone) {
  Scene scene;
  scene.add(2000000000, 1);
  EXPECT_TRUE(expect_exact(scene.view()));
  scene.add(2000000000, 99);
  EXPECT_TRUE(expect_exact(scene.view()));
}

// Boxes of all worlds come first and are few.
TEST(Worlds, BoxesOfAllOfThem) {
  for (const std::uint32_t of_all : {1u, 5u, 32u}) {
    Scene scene;
    scene.add(-1, of_all);
    scene.boxes[0] = {{-100, -100, -100}, {100, 100, 0.5f}};  // the ground
    for (const std::int32_t world : {0, 1, 7}) scene.add(world, 70);
    EXPECT_TRUE(expect_exact(scene.view())) << of_all;
    Scene late;
    late.add(3, 10);
    late.add(-1, of_all);
    EXPECT_FALSE(expect_exact(late.view())) << of_all;
    scene.worlds.back() = -1;
    EXPECT_FALSE(expect_exact(scene.view())) << of_all;
  }
  Scene none_else;
  none_else.add(-1, 32);
  EXPECT_TRUE(expect_exact(none_else.view()));
  Scene many;
  many.add(-1, 33);
  EXPECT_FALSE(expect_exact(many.view()));
  many.add(0, 50);
  EXPECT_FALSE(expect_exact(many.view()));
}

TEST(Worlds, OutOfOrder) {
  Scene scene;
  for (const std::int32_t world : {4, 5, 3}) scene.add(world, 40);
  EXPECT_FALSE(expect_exact(scene.view()));
  scene.worlds.assign(scene.worlds.size(), 6);
  EXPECT_TRUE(expect_exact(scene.view()));
  scene.worlds[60] = 5;  // in the middle of its world
  EXPECT_FALSE(expect_exact(scene.view()));
}

// In two sets no two boxes of one set are a pair, though their worlds are adjacent.
TEST(Worlds, TwoSetsHaveAGrid) {
  Scene first, second;
  first.add(0, 40), first.add(1, 40);
  second.add(1, 30, 2), second.add(2, 30);
  const Boxes a = first.view(), b = second.view();
  const std::vector<Pair> want = tests::reference_pairs(a, b).pairs;
  Options options;
  options.algorithm = Algorithm::grid;
  std::vector<Pair> out(want.size() + 1);
  base::Output output{out.data(), out.size(), nullptr, nullptr};
  Result r;
  engine().find(a, &b, options, 0, &output, nullptr, r);
  out.resize(r.written);
  EXPECT_EQ(r.found, want.size());
  EXPECT_TRUE(tests::same_pairs(out, want));
}

TEST(Worlds, OtherFiltersHold) {
  Scene scene;
  scene.add(-1, 3);
  for (int world = 0; world < 20; ++world) scene.add(world, 60);
  tests::Random random(9);
  std::vector<std::int32_t> owners;
  std::vector<std::uint8_t> still;
  std::vector<std::uint32_t> masks;
  for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
    owners.push_back(random.between(-1, 9));
    still.push_back(random.one_in(2));
    masks.push_back(random.below(7));
  }
  Boxes view = scene.view();
  view.filters.is_static = {still.data(), still.size()};
  EXPECT_TRUE(expect_exact(view));
  view.filters.owner = {owners.data(), owners.size()};
  EXPECT_TRUE(expect_exact(view));
  view.filters.mask = {masks.data(), masks.size()};
  EXPECT_TRUE(expect_exact(view));
}

TEST(Worlds, InactiveBoxesAreReportedOnce) {
  for (const bool in_order : {true, false}) {
    Scene scene;
    for (int world = 0; world < 12; ++world) scene.add(in_order ? world : world % 3, 50);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 10; i < scene.boxes.size(); i += 7)
      std::swap(scene.boxes[i].lower, scene.boxes[i].upper);
    for (std::size_t i = 33; i < scene.boxes.size(); i += 50) scene.boxes[i].upper.y = nan;
    EXPECT_EQ(expect_exact(scene.view()), in_order);
    Options refuse;
    refuse.algorithm = Algorithm::grid;
    Result r;
    base::Output nowhere{nullptr, 0, nullptr, nullptr};
    engine().find(scene.view(), nullptr, refuse, 0, &nowhere, nullptr, r);
    EXPECT_EQ(r.status, Status::nan_box);
    EXPECT_EQ(r.first_invalid, 33u);
    EXPECT_EQ(r.invalid_count, 12u);
  }
}

// A world below -1 counts as -1 and is reported.
TEST(Worlds, BadWorldsAreReportedOnce) {
  for (const bool first : {true, false}) {
    Scene scene;
    scene.add(0, 40);
    scene.add(1, 40);
    scene.worlds[first ? 0 : 50] = -3;
    Options options;
    const Input in = make_input(scene.view(), nullptr, options);
    Workspace w;
    std::vector<char> memory(w.carve<HostDevice>(in.count, nullptr) + 256);
    const auto base = (reinterpret_cast<std::uintptr_t>(memory.data()) + 255) / 256 * 256;
    w.carve<HostDevice>(in.count, reinterpret_cast<char*>(base));
    Pipeline<HostDevice>(engine().device()).build(in, false, w);
    EXPECT_EQ(w.worlds->grid_wanted != 0, !first);
    EXPECT_EQ(w.report->bad_worlds, 1u);
    EXPECT_EQ(w.report->first_bad_world(), first ? 0u : 50u);
  }
}

}  // namespace
}  // namespace throng::device
