// Boxes and pairs in device memory against the double loop: geometry, layouts, filters, two sets.
#include "cuda/gpu_fixture.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class GpuFind : public OnGpu {};

TEST_P(GpuFind, HardScenes) {
  cuda::Finder finder(options());
  for (const int n : {600, 3000}) {
    for (const HardScene& scene : hard_scenes(n)) {
      SCOPED_TRACE(scene.name + ", " + std::to_string(scene.boxes.size()) + " boxes");
      const OnDevice<Box> boxes(scene.boxes);
      expect_answer(finder, view(boxes), nullptr, reference_pairs(scene.boxes));
    }
  }
}

// More boxes than one launch of 256-thread blocks has resident, for the grid and its scan.
TEST_P(GpuFind, ManyBoxes) {
  if (GetParam().algorithm == Algorithm::all_pairs) GTEST_SKIP() << "too slow";
  static const auto cases = [] {  // the reference sweep takes seconds
    std::vector<std::pair<BoxList, Answer>> all;
    for (const int n : {5000, 70001, 300001}) {
      const BoxList list = uniform_boxes(n, 7);
      all.emplace_back(list, swept_pairs(list));
    }
    return all;
  }();
  cuda::Finder finder(options());
  for (const auto& [list, answer] : cases) {
    SCOPED_TRACE(list.size());
    const OnDevice<Box> boxes(list);
    expect_answer(finder, view(boxes), nullptr, answer);
  }
}

// Boxes that overlap thousands of others, and one that overlaps all: the pairs of one first index
// exceed a block's capacity.
TEST_P(GpuFind, VeryManyPairsOfOne) {
  if (GetParam().algorithm == Algorithm::all_pairs) GTEST_SKIP() << "too slow";
  static const auto cases = [] {
    std::vector<std::pair<BoxList, Answer>> all;
    for (const std::size_t at : {std::size_t{0}, std::size_t{3000}}) {
      BoxList list = uniform_boxes(100000, 8);
      const Box around{{-1, -1, -1}, {100, 100, 100}};
      for (std::size_t k = 0; k < 20; ++k) {
        list[at + 5 * k] = around;
        list[at + 5 * k].upper.x = static_cast<float>(k);
      }
      list[at + 7] = around;
      all.emplace_back(list, swept_pairs(list));
    }
    return all;
  }();
  cuda::Finder finder(options());
  for (const auto& [list, answer] : cases) {
    SCOPED_TRACE(answer.pairs.size());
    const OnDevice<Box> boxes(list);
    expect_answer(finder, view(boxes), nullptr, answer);
  }
}

// One Finder with few boxes, many, none and one, in any sequence.
TEST_P(GpuFind, AnySizeInAnyOrder) {
  cuda::Finder finder(options());
  for (const int n : {0, 1, 2, 3, 5, 6, 31, 32, 33, 63, 64, 65, 128, 129, 4097, 257, 1, 0, 4096}) {
    SCOPED_TRACE(n);
    for (const BoxList& list : {uniform_boxes(n, 3), snapped_boxes(n, 6, 1.0f, 4)}) {
      const OnDevice<Box> boxes(list);
      expect_answer(finder, view(boxes), nullptr, reference_pairs(list));
    }
  }
}

// So few boxes that a box searches more rows of cells than there are boxes: the search over all
// boxes must not pair a box with itself or report a pair twice.
TEST_P(GpuFind, FewerBoxesThanRows) {
  cuda::Finder finder(options());
  const auto check = [&](const BoxList& list) {
    const OnDevice<Box> boxes(list);
    expect_answer(finder, view(boxes), nullptr, reference_pairs(list));
  };
  check({{{0x0p+0f, 0x0p+0f, 0x1p+2f}, {0x1.4f6fe8p-1f, 0x1.d0dd7ap-1f, 0x1.80466ep+2f}},
         {{0x1.b01d6ap+1f, 0x1.e1b984p+0f, 0x1.2501e8p+2f},
          {0x1.ee7d46p+1f, 0x1.6874fcp+1f, 0x1.58d8aap+2f}}});
  check({{{0x0p+0f, 0x1.8p+1f, 0x1p+2f}, {0x1.873c74p-1f, 0x1.039074p+2f, 0x1.3d2e4p+2f}},
         {{0x1.6532c4p+1f, 0x1.ab25b8p-2f, 0x1.53251ep+2f},
          {0x1.b4fca2p+1f, 0x1.260034p+1f, 0x1.9cf67p+2f}}});
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random r(seed);
    BoxList list(r.below(6) + 1);
    for (Box& b : list) b = cube(r.point(0, 6), r.in(0, 2));
    check(list);
  }
}

TEST_P(GpuFind, Layouts) {
  cuda::Finder finder(options());
  for (const int n : {700, 5000}) {
    const BoxList list = with_inverted(n, 5);
    const Answer answer = reference_pairs(list);
    {  // 40 bytes apart, from the 9th byte on
      SCOPED_TRACE("strided");
      std::vector<float> wide(list.size() * 10 + 2, -1e9f);
      for (std::size_t i = 0; i < list.size(); ++i)
        for (int k = 0; k < 6; ++k)
          wide[2 + 10 * i + static_cast<std::size_t>(k)] = (&list[i].lower.x)[k];
      const OnDevice<float> memory(wide);
      const Boxes boxes(reinterpret_cast<const Box*>(memory.data() + 2), list.size(), 40);
      expect_answer(finder, boxes, nullptr, answer);
    }
    {
      SCOPED_TRACE("lower and upper corners apart");
      std::vector<Vec3> lower, upper;
      for (const Box& b : list) lower.push_back(b.lower), upper.push_back(b.upper);
      const OnDevice<Vec3> low(lower), high(upper);
      expect_answer(finder, Boxes::split(low.data(), high.data(), list.size()), nullptr, answer);
    }
    std::vector<float> axis[6];
    for (const Box& b : list)
      for (int k = 0; k < 6; ++k) axis[k].push_back((&b.lower.x)[k]);
    std::vector<OnDevice<float>> six;
    for (const auto& values : axis) six.emplace_back(values);
    {
      SCOPED_TRACE("six arrays");
      expect_answer(finder,
                    Boxes::arrays(six[0].data(), six[1].data(), six[2].data(), six[3].data(),
                                  six[4].data(), six[5].data(), list.size()),
                    nullptr, answer);
    }
    {
      SCOPED_TRACE("2-D");
      BoxList flat = list;
      for (Box& b : flat) b.lower.z = b.upper.z = 0;
      expect_answer(finder,
                    Boxes::arrays(six[0].data(), six[1].data(), nullptr, six[3].data(),
                                  six[4].data(), nullptr, list.size()),
                    nullptr, reference_pairs(flat));
    }
    {
      SCOPED_TRACE("one box repeated");
      const OnDevice<Box> one(BoxList{cube(1, 2, 3, 4)});
      const BoxList same(150, cube(1, 2, 3, 4));
      expect_answer(finder, Boxes(one.data(), 150, 0), nullptr, reference_pairs(same));
    }
  }
}

// Filters of n boxes: on the host, and the same on the device.
struct FilterValues {
  explicit FilterValues(std::size_t n, std::uint64_t seed)
      : group(n), mask(n), owner(n), world(n), still(n) {
    Random r(seed);
    for (std::size_t i = 0; i < n; ++i) {
      group[i] = 1u << r.below(4);
      mask[i] = r.one_in(3) ? 0xffffffffu : 3u << r.below(3);
      owner[i] = r.between(-1, 20);
      world[i] = r.between(-1, 5);
      still[i] = static_cast<std::uint8_t>(r.one_in(2) ? r.below(255) + 1 : 0);
    }
  }
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> still;
};
struct DeviceFilterValues {
  explicit DeviceFilterValues(const FilterValues& t)
      : group(t.group), mask(t.mask), owner(t.owner), world(t.world), still(t.still) {}
  OnDevice<std::uint32_t> group, mask;
  OnDevice<std::int32_t> owner, world;
  OnDevice<std::uint8_t> still;
};
// Sets the filters whose bits 0 to 4 are set.
template <class T>
void attach_filters(Boxes& boxes, const T& t, unsigned bits) {
  const std::size_t n = boxes.size();
  if (bits & 1) boxes.filters.group = {t.group.data(), n};
  if (bits & 2) boxes.filters.mask = {t.mask.data(), n};
  if (bits & 4) boxes.filters.owner = {t.owner.data(), n};
  if (bits & 8) boxes.filters.world = {t.world.data(), n};
  if (bits & 16) boxes.filters.is_static = {t.still.data(), n};
}

TEST_P(GpuFind, EveryFilter) {
  cuda::Finder finder(options());
  const BoxList list = huge_among_small(1200, 3), other = uniform_boxes(900, 8);
  const FilterValues tags(list.size(), 1), tags2(other.size(), 2);
  const OnDevice<Box> boxes(list), boxes2(other);
  const DeviceFilterValues there(tags), there2(tags2);
  for (unsigned bits = 0; bits < 32; ++bits) {
    SCOPED_TRACE("filters " + std::to_string(bits));
    Boxes host(list), device = view(boxes);
    attach_filters(host, tags, bits);
    attach_filters(device, there, bits);
    expect_answer(finder, device, nullptr, reference_pairs(host));
    // The second set has other filters, or none.
    const unsigned bits2 = bits * 7 % 32;
    Boxes host2(other), device2 = view(boxes2);
    attach_filters(host2, tags2, bits2);
    attach_filters(device2, there2, bits2);
    expect_answer(finder, device, &device2, reference_pairs(host, host2));
  }
}

// 64 boxes per world, all worlds in one place, and some boxes that belong to every world.
TEST_P(GpuFind, ManyWorlds) {
  cuda::Finder finder(options());
  const std::size_t n = 6400;
  BoxList list(n);
  std::vector<std::int32_t> worlds(n);
  Random r(11);
  for (std::size_t i = 0; i < n; ++i) {
    list[i] = cube(r.point(0, 5), 1);
    worlds[i] = i % 997 == 0 ? -1 : static_cast<std::int32_t>(i / 64);
  }
  Boxes host(list);
  host.filters.world = {worlds.data(), n};
  const OnDevice<Box> boxes(list);
  const OnDevice<std::int32_t> there(worlds);
  Boxes device = view(boxes);
  device.filters.world = {there.data(), n};
  expect_answer(finder, device, nullptr, reference_pairs(host));
}

// Worlds of all sizes up to 512 boxes, after the ground of all worlds: each is searched by itself.
TEST_P(GpuFind, SmallWorldsOneByOne) {
  cuda::Finder finder(options());
  BoxList list = {{{-1, -1, -1}, {6, 6, 0.2f}}, {{0, 0, 5}, {1, 1, 6}}};
  std::vector<std::int32_t> worlds = {-1, -1};
  Random r(12);
  for (std::int32_t world = 0; world < 90; ++world) {
    const int count = world < 20 ? 1 + world : world == 50 ? 512 : r.between(1, 100);
    for (int k = 0; k < count; ++k) {
      list.push_back(cube(r.point(0, 5), 1));
      worlds.push_back(3 * world);
    }
  }
  for (std::size_t i = 40; i < list.size(); i += 61) std::swap(list[i].lower, list[i].upper);
  constexpr float inf = std::numeric_limits<float>::infinity();
  list[300] = {{-inf, -inf, -inf}, {inf, inf, inf}};
  for (std::size_t i = 500; i < list.size(); i += 97)
    (i % 2 ? list[i].lower.y = -inf : list[i].upper.z = inf);
  std::vector<std::uint8_t> still;
  for (std::size_t i = 0; i < list.size(); ++i) still.push_back(r.one_in(3));
  const OnDevice<Box> boxes(list);
  const OnDevice<std::int32_t> there(worlds);
  const OnDevice<std::uint8_t> still_there(still);
  Boxes host(list), device = view(boxes);
  host.filters.world = {worlds.data(), worlds.size()};
  device.filters.world = {there.data(), worlds.size()};
  expect_answer(finder, device, nullptr, reference_pairs(host));
  host.filters.is_static = {still.data(), still.size()};
  device.filters.is_static = {still_there.data(), still.size()};
  expect_answer(finder, device, nullptr, reference_pairs(host));
}

TEST_P(GpuFind, TwoSets) {
  cuda::Finder finder(options());
  for (const auto& [n, m] :
       {std::pair{900, 700}, {1, 3000}, {3000, 1}, {0, 5}, {5, 0}, {6000, 77}}) {
    SCOPED_TRACE(std::to_string(n) + " and " + std::to_string(m));
    const BoxList a = n ? with_inverted(n, 1) : BoxList(),
                  b = m ? huge_among_small(m, 2) : BoxList();
    const OnDevice<Box> first(a), second(b);
    const Boxes second_view = view(second);
    expect_answer(finder, view(first), &second_view, reference_pairs(a, b));
  }
}

TEST_P(GpuFind, Margin) {
  for (const float margin : {0.1f, 0.5f, 1e-30f}) {
    Options with = options();
    with.margin = margin;
    cuda::Finder finder(with);
    for (const BoxList& list : {snapped_boxes(1000, 16, 0.1f, 3), faces_edges_corners(1000, 4)}) {
      const OnDevice<Box> boxes(list);
      expect_answer(finder, view(boxes), nullptr, reference_pairs(list, margin));
    }
  }
}

// Both make the same plan, and so compare the same candidates; worlds are searched differently.
TEST_P(GpuFind, ComparesWhatTheHostCompares) {
  if (GetParam().algorithm == Algorithm::all_pairs) GTEST_SKIP() << "there is no plan";
  cuda::Finder finder(options());
  Options emulated = options();
  emulated.backend = Backend::emulated;
  Finder on_host(emulated);
  const PairBuffer buffer(500000);
  for (const HardScene& scene : hard_scenes(1500)) {
    const OnDevice<Box> boxes(scene.boxes);
    const Result want = on_host.find(scene.boxes);
    const Result r = finder.find(view(boxes), buffer.out(), buffer.capacity(), stream());
    EXPECT_EQ(r.found, want.found) << scene.name;
    EXPECT_EQ(r.comparisons, want.comparisons) << scene.name;
  }
}

TEST_P(GpuFind, PlanAndTimes) {
  cuda::Finder finder(options());
  const BoxList list = uniform_boxes(20000, 1);
  const OnDevice<Box> boxes(list);
  const PairBuffer buffer(200000);
  const Result r = finder.find(view(boxes), buffer.out(), buffer.capacity(), stream());
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(r.plan.algorithm,
            GetParam().algorithm == Algorithm::all_pairs ? Algorithm::all_pairs : Algorithm::grid);
  EXPECT_GT(r.times.bin_ms, 0.0);
  EXPECT_GT(r.times.find_ms, 0.0);
  EXPECT_EQ(r.times.order_ms > 0.0, canonical());
  EXPECT_GE(r.times.total_ms, r.times.bin_ms + r.times.find_ms);
  EXPECT_LT(r.times.total_ms, 1e4);
  Options silent = options();
  silent.measure_stages = false;
  cuda::Finder other(silent);
  const Result s = other.find(view(boxes), buffer.out(), buffer.capacity(), stream());
  EXPECT_EQ(s.found, r.found);
  EXPECT_EQ(s.times.total_ms, 0.0);
}

THRONG_INSTANTIATE_GPU(GpuFind);

}  // namespace
}  // namespace throng::tests
