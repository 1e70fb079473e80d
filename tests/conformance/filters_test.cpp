// Group and mask, owner, world, static: alone, combined, strided, in one set and in two, invalid.
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class Filter : public Conformance {};

// All five filters for n boxes, as strided views of one array of records.
struct Labels {
  struct Record {
    std::uint32_t group, mask;
    std::int32_t owner, world;
    std::uint8_t is_static;
  };
  std::vector<Record> records;

  Labels(std::size_t n, std::uint64_t seed, int worlds = 5) : records(n) {
    Random r(seed);
    for (Record& record : records) {
      record.group = r.one_in(4) ? 0xffffffffu : 1u << r.below(4);
      record.mask = r.one_in(20) ? 0 : static_cast<std::uint32_t>(r.next());
      record.owner = r.one_in(3) ? -1 : r.between(0, 20);
      record.world = r.one_in(9) ? -1 : r.between(0, worlds - 1);
      record.is_static = r.one_in(3) ? static_cast<std::uint8_t>(r.between(1, 255)) : 0;
    }
  }

  // The filters whose bit is in `which`: 1 group, 2 mask, 4 owner, 8 world, 16 static.
  Filters view(int which) const {
    Filters f;
    const std::size_t n = records.size(), stride = sizeof(Record);
    if (which & 1) f.group = {&records[0].group, n, stride};
    if (which & 2) f.mask = {&records[0].mask, n, stride};
    if (which & 4) f.owner = {&records[0].owner, n, stride};
    if (which & 8) f.world = {&records[0].world, n, stride};
    if (which & 16) f.is_static = {&records[0].is_static, n, stride};
    return f;
  }
};

TEST_P(Filter, EveryCombination) {
  const BoxList boxes = snapped_boxes(400, 12, 1, 1);
  const Labels labels(boxes.size(), 2);
  for (int which = 0; which < 32; ++which) {
    SCOPED_TRACE("filters " + std::to_string(which));
    Boxes view = boxes;
    view.filters = labels.view(which);
    expect_exact(view, config(), reference_pairs(view));
  }
}

TEST_P(Filter, EveryCombinationInTwoSets) {
  const BoxList a = snapped_boxes(150, 9, 1, 1), b = snapped_boxes(230, 9, 1, 2);
  const Labels of_a(a.size(), 3), of_b(b.size(), 4);
  for (int which = 0; which < 32; ++which) {
    // All filters in both sets, then some in one only: the other set then allows everything.
    for (const int of_second : {which, (which * 7 + 3) % 32}) {
      SCOPED_TRACE("filters " + std::to_string(which) + " and " + std::to_string(of_second));
      Boxes view_a = a, view_b = b;
      view_a.filters = of_a.view(which);
      view_b.filters = of_b.view(of_second);
      expect_exact(view_a, view_b, config(), reference_pairs(view_a, view_b));
    }
  }
}

// Clusters in which most boxes have one owner, or layers that do not collide, or both: forbidden
// pairs are not compared, and all others are found. The other boxes have several owners, and two of
// the layers collide with themselves.
TEST_P(Filter, ClustersMostlyForbidden) {
  struct Cluster {
    BoxList boxes;
    std::vector<std::int32_t> owner;
    std::vector<std::uint32_t> group, mask;
    std::vector<std::uint8_t> is_static;

    Boxes view(int which) const {
      Boxes all = boxes;
      const std::size_t n = boxes.size();
      if (which & 1) all.filters.owner = {owner.data(), n};
      if (which & 2) all.filters.group = {group.data(), n}, all.filters.mask = {mask.data(), n};
      if (which & 4) all.filters.is_static = {is_static.data(), n};
      return all;
    }
  };
  static const auto make_cluster = [](std::uint64_t seed) {
    Cluster c;
    Random r(seed);
    for (int i = 0; i < 1500; ++i) {
      c.boxes.push_back(cube(r.point(0, 1), r.in(0.5f, 1)));
      c.owner.push_back(r.one_in(12) ? r.between(-1, 2) : 1);
      const std::uint32_t layer = r.one_in(12) ? 3 + r.below(2) : r.below(3);
      c.group.push_back(1u << layer);
      c.mask.push_back(layer < 3 ? 8 : (r.one_in(2) ? 24 : 31));
      c.is_static.push_back(!r.one_in(8));
    }
    return c;
  };
  static const Cluster one = make_cluster(1), two = make_cluster(2);
  struct Case {
    int first, second;  // second < 0: one set
    Answer answer;
  };
  static std::vector<Case> cases;
  if (cases.empty()) {
    for (const int which : {1, 2, 3, 5, 7})
      cases.push_back({which, -1, reference_pairs(one.view(which))});
    for (const auto& [a, b] : {std::pair(1, 1), std::pair(2, 2), std::pair(3, 7), std::pair(2, 1)})
      cases.push_back({a, b, reference_pairs(one.view(a), two.view(b))});
  }
  for (const Case& c : cases) {
    SCOPED_TRACE(std::to_string(c.first) + " and " + std::to_string(c.second));
    if (c.second < 0)
      expect_exact(one.view(c.first), config(), c.answer);
    else
      expect_exact(one.view(c.first), two.view(c.second), config(), c.answer);
  }
}

TEST_P(Filter, OnHardScenes) {
  static std::vector<HardScene> scenes = hard_scenes(250);
  for (const HardScene& scene : scenes) {
    SCOPED_TRACE(scene.name);
    const Labels labels(scene.boxes.size(), 5);
    Boxes view = scene.boxes;
    for (const int which : {8, 16, 31}) {
      view.filters = labels.view(which);
      expect_exact(view, config(), reference_pairs(view));
    }
  }
}

// Many worlds in one place with few boxes each; some boxes are in every world.
TEST_P(Filter, ManyWorlds) {
  const BoxList boxes = snapped_boxes(2000, 9, 1, 1);
  static std::vector<Answer> answers;  // shared by all configurations
  std::size_t next = 0;
  for (const int worlds : {2, 60, 2000, 2000000000}) {
    SCOPED_TRACE(std::to_string(worlds) + " worlds");
    const Labels labels(boxes.size(), 6, worlds);
    Boxes view = boxes;
    for (const int which : {8, 8 | 16}) {
      view.filters = labels.view(which);
      if (answers.size() == next) answers.push_back(reference_pairs(view));
      expect_exact(view, config(), answers[next++]);
    }
  }
}

// Worlds with enough boxes to fill columns of their own.
TEST_P(Filter, LargeWorlds) {
  const BoxList boxes = uniform_boxes(6000, 8);
  const Labels labels(boxes.size(), 6, 3);
  Boxes view = boxes;
  view.filters = labels.view(8);
  static const Answer answer = reference_pairs(view);
  expect_exact(view, config(), answer);
}

TEST_P(Filter, AllStaticAllOneOwnerAllOneWorld) {
  const BoxList boxes = identical_boxes(90, 1);
  const std::size_t n = boxes.size();
  const Answer all = reference_pairs(boxes);
  const std::uint8_t still = 200;
  const std::int32_t someone = 7, nobody = -1, highest = 2147483647;
  const std::uint32_t no_bits = 0;
  Boxes view = boxes;  // a stride of 0 gives every box the same value
  view.filters.is_static = {&still, n, 0};
  expect_exact(view, config(), Answer{});
  view.filters = {};
  view.filters.owner = {&someone, n, 0};
  expect_exact(view, config(), Answer{});
  view.filters.owner = {&nobody, n, 0};
  expect_exact(view, config(), all);
  view.filters = {};
  view.filters.world = {&highest, n, 0};
  expect_exact(view, config(), all);
  view.filters.world = {&nobody, n, 0};
  expect_exact(view, config(), all);
  view.filters = {};
  view.filters.group = {&no_bits, n, 0};
  expect_exact(view, config(), Answer{});
  view.filters = {};
  view.filters.mask = {&no_bits, n, 0};
  expect_exact(view, config(), Answer{});
}

// Scenes with a few filter classes: layers that collide with some others, as in games. The classes
// fit the reject bits of a sweep, exceed them slightly, or exceed them by far.
TEST_P(Filter, Layers) {
  const BoxList boxes = snapped_boxes(1500, 20, 1, 21);
  const std::size_t n = boxes.size();
  for (const int layers : {1, 2, 3, 6, 7, 16, 17, 32}) {
    SCOPED_TRACE(std::to_string(layers) + " layers");
    Random r(40 + static_cast<std::uint64_t>(layers));
    std::vector<std::uint32_t> meets(static_cast<std::size_t>(layers));
    for (std::uint32_t& mask : meets) mask = static_cast<std::uint32_t>(r.next());
    std::vector<std::uint32_t> group(n), mask(n);
    std::vector<std::uint8_t> still(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto layer = static_cast<std::size_t>(r.between(0, layers - 1));
      group[i] = 1u << layer;
      mask[i] = meets[layer];
      still[i] = layer % 4 == 3;
    }
    Boxes view = boxes;
    view.filters.group = {group.data(), n};
    view.filters.mask = {mask.data(), n};
    expect_exact(view, config(), reference_pairs(view));
    view.filters.is_static = {still.data(), n};
    expect_exact(view, config(), reference_pairs(view));
    view.filters.group = {};
    view.filters.mask = {};
    expect_exact(view, config(), reference_pairs(view));
  }
}

// Two sets with different filter classes, in both roles.
TEST_P(Filter, LayersOfTwoSets) {
  const BoxList a = snapped_boxes(900, 14, 1, 22), b = snapped_boxes(700, 14, 1, 23);
  std::vector<std::uint32_t> group_a, mask_a, group_b, mask_b;
  std::vector<std::uint8_t> still_a, still_b;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    group_a.push_back(1u << i % 3);
    mask_a.push_back(i % 3 == 0 ? 1u : 6u);
    still_a.push_back(i % 5 == 0);
  }
  for (std::uint32_t i = 0; i < b.size(); ++i) {
    group_b.push_back(1u << i % 4);
    mask_b.push_back(i % 4 == 1 ? 2u : 5u);
    still_b.push_back(i % 7 < 3);
  }
  Boxes first = a, second = b;
  first.filters.group = {group_a.data(), a.size()};
  first.filters.mask = {mask_a.data(), a.size()};
  first.filters.is_static = {still_a.data(), a.size()};
  second.filters.group = {group_b.data(), b.size()};
  second.filters.mask = {mask_b.data(), b.size()};
  second.filters.is_static = {still_b.data(), b.size()};
  expect_exact(first, second, config(), reference_pairs(first, second));
  expect_exact(second, first, config(), reference_pairs(second, first));
}

// A dense cluster of static boxes has no quadratic cost, whether few boxes or many; and boxes that
// pair with none are not compared at all.
TEST_P(Filter, ClustersOfStaticBoxes) {
  if (config().backend != Backend::cpu || config().algorithm == Algorithm::all_pairs) GTEST_SKIP();
  for (const std::size_t one_in : {2, 6}) {
    BoxList boxes = uniform_boxes(24000, 24);
    std::vector<std::uint8_t> still(boxes.size());
    for (std::size_t i = 0; i < boxes.size(); i += one_in) {
      boxes[i] = boxes[0];
      still[i] = 1;
    }
    Boxes view = boxes;
    view.filters.is_static = {still.data(), boxes.size()};
    Finder finder(options());
    const Result result = finder.find(view);
    ASSERT_TRUE(result.ok()) << result.message;
    EXPECT_LE(result.comparisons, 100 * (boxes.size() + result.found));
  }
}

// Pairs that are never allowed are not even compared, except by brute force on a device.
TEST_P(Filter, StaticBoxesAreNotCompared) {
  if (config().backend != Backend::cpu && config().algorithm != Algorithm::grid) GTEST_SKIP();
  const BoxList boxes = uniform_boxes(5000, 1);
  const std::uint8_t still = 1;
  Boxes view = boxes;
  view.filters.is_static = {&still, boxes.size(), 0};
  Finder finder(options());
  const Result result = finder.find(view);
  EXPECT_TRUE(result.ok()) << result.message;
  EXPECT_EQ(result.comparisons, 0u);
}

// Filters with empty slots: an inactive box of any world stays inactive.
TEST_P(Filter, WithInactiveBoxes) {
  const BoxList boxes = with_inverted(900, 3);
  const Labels labels(boxes.size(), 9);
  Boxes view = boxes;
  for (const int which : {8, 16, 24, 31}) {
    view.filters = labels.view(which);
    expect_exact(view, config(), reference_pairs(view));
  }
}

void expect_bad_filter(const Result& result, const char* what) {
  EXPECT_EQ(result.status, Status::bad_filter) << what;
  EXPECT_EQ(result.written, 0u) << what;
  EXPECT_STRNE(result.message, "") << what;
}

TEST_P(Filter, WrongLengthIsRefused) {
  const BoxList boxes = uniform_boxes(50, 1);
  const Labels labels(60, 1);
  Finder finder(options());
  for (int bit = 1; bit < 32; bit *= 2) {
    for (const std::size_t length : {std::size_t{49}, std::size_t{51}, std::size_t{0}}) {
      Boxes view = boxes;
      view.filters = labels.view(bit);
      Filters& f = view.filters;
      f.group.count = f.mask.count = f.owner.count = f.world.count = f.is_static.count = length;
      const std::string what =
          "filter " + std::to_string(bit) + " of length " + std::to_string(length);
      const Result one = finder.find(view);
      expect_bad_filter(one, what.c_str());
      EXPECT_NE(std::string(one.message).find(std::to_string(length)), std::string::npos)
          << one.message;
      expect_bad_filter(finder.find(view, boxes), what.c_str());
      expect_bad_filter(finder.find(boxes, view), what.c_str());
    }
  }
  EXPECT_TRUE(finder.find(boxes).ok()) << "the Finder is still usable";
}

// Unaligned 32-bit values: a fault on a device, undefined behaviour here.
TEST_P(Filter, OddStrideIsRefused) {
  const BoxList boxes = uniform_boxes(20, 1);
  const Labels labels(60, 1);
  Finder finder(options());
  for (int bit = 1; bit < 16; bit *= 2) {
    for (const std::size_t stride : {1, 2, 6, 29}) {
      Boxes view = boxes;
      view.filters = labels.view(bit);
      Filters& f = view.filters;
      f.group.count = f.mask.count = f.owner.count = f.world.count = boxes.size();
      f.group.stride_bytes = f.mask.stride_bytes = f.owner.stride_bytes = f.world.stride_bytes =
          stride;
      const Result one = finder.find(view);
      const std::string what =
          "is " + std::to_string(stride) + " bytes; it must be a multiple of 4";
      expect_bad_filter(one, what.c_str());
      EXPECT_NE(std::string(one.message).find(what), std::string::npos) << one.message;
      expect_bad_filter(finder.find(view, boxes), what.c_str());
      expect_bad_filter(finder.find(boxes, view), what.c_str());
    }
  }
  std::vector<std::uint8_t> still(60, 1);
  Boxes view = boxes;
  view.filters.is_static = {still.data(), boxes.size(), 3};  // bytes need no alignment
  expect_exact(view, config(), reference_pairs(view));
}

TEST_P(Filter, WorldBelowMinusOneIsRefused) {
  const BoxList boxes = uniform_boxes(3000, 1);
  Labels labels(boxes.size(), 1);
  labels.records[1234].world = -2;
  labels.records[2999].world = std::numeric_limits<std::int32_t>::min();
  Boxes view = boxes;
  view.filters = labels.view(8);
  Finder finder(options());
  const Result result = finder.find(view);
  expect_bad_filter(result, "world -2");
  EXPECT_EQ(result.first_invalid, 1234u);
  EXPECT_EQ(result.invalid_count, 2u);
  EXPECT_NE(std::string(result.message).find("1234"), std::string::npos) << result.message;
  expect_bad_filter(finder.find(boxes, view), "world -2 in the second set");
  expect_bad_filter(finder.find(view, boxes), "world -2 in the first set");
}

THRONG_INSTANTIATE(Filter, suite_configs);

}  // namespace
}  // namespace throng::tests
