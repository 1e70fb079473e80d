// Properties of arbitrary boxes, which rapidcheck draws and shrinks. Coordinates come from a small
// pool of special values and small integers, so that many faces meet.
#include <rapidcheck.h>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/oracle.hpp"

namespace throng::tests {
namespace {

rc::Gen<float> any_coordinate() {
  const rc::Gen<float> special =
      rc::gen::element(0.0f, -0.0f, denormal, -denormal, 0x1p-126f, 1.0f, 0.1f, 1e7f, -1e7f,
                       16777216.0f, 1e30f, -1e30f, float_max, -float_max, infinity, -infinity);
  const rc::Gen<float> whole =
      rc::gen::map(rc::gen::inRange(-8, 9), [](int i) { return static_cast<float>(i); });
  const rc::Gen<float> tenths =
      rc::gen::map(rc::gen::inRange(-40, 41), [](int i) { return static_cast<float>(i) * 0.1f; });
  const rc::Gen<float> base =
      rc::gen::weightedOneOf<float>({{6, whole}, {4, tenths}, {1, special}});
  return rc::gen::map(rc::gen::pair(base, rc::gen::inRange(-2, 3)),
                      [](const std::pair<float, int>& p) { return nudge(p.first, p.second); });
}

rc::Gen<Box> any_box() {
  const auto corner = rc::gen::container<std::vector<float>>(6, any_coordinate());
  return rc::gen::map(rc::gen::pair(corner, rc::gen::inRange(0, 12)),
                      [](const std::pair<std::vector<float>, int>& p) {
                        std::vector<float> c = p.first;
                        for (std::size_t k = 0; k < 3; ++k)  // one in twelve is not sorted
                          if (p.second != 0 && c[k] > c[k + 3]) std::swap(c[k], c[k + 3]);
                        return Box{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
                      });
}

rc::Gen<BoxList> any_boxes() {
  return rc::gen::withSize([](int size) {
    return rc::gen::mapcat(rc::gen::inRange(0, 4 * size + 2), [](int n) {
      return rc::gen::container<BoxList>(static_cast<std::size_t>(n), any_box());
    });
  });
}

Config any_config() {
  static const std::vector<Config> configs = all_configs();
  return *rc::gen::elementOf(configs);
}

std::vector<Pair> sorted_pairs(const Boxes& boxes, const Options& options) {
  std::vector<Pair> pairs = find_pairs(boxes, options);
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

void assert_same(std::vector<Pair> got, const std::vector<Pair>& want) {
  const testing::AssertionResult same = same_pairs(std::move(got), want);
  if (!same) RC_FAIL(same.message());
}

void check_property(const char* what, const std::function<void()>& property) {
  EXPECT_TRUE(rc::check(what, property)) << what;
}

// The generator that fuzzers and soak share; rapidcheck draws and shrinks its bytes.
TEST(Property, AnyBytesMatchTheDoubleLoop) {
  Oracle oracle;
  check_property("a case made of bytes has the pairs of a double loop", [&oracle] {
    const auto bytes = *rc::gen::resize(
        800, rc::gen::container<std::vector<std::uint8_t>>(rc::gen::arbitrary<std::uint8_t>()));
    Bytes stream(bytes);
    const Case c = make_case(stream, 300);
    const auto config = *rc::gen::inRange<std::size_t>(0, oracle.configs().size());
    RC_LOG() << oracle.configs()[config].name() << ": " << describe(c) << '\n';
    oracle.begin(c);
    try {
      for (std::uint32_t form = 0; form < 3; ++form) oracle.search(c, config, form);
    } catch (const Difference& difference) {
      RC_FAIL(difference.what());
    }
  });
}

TEST(Property, MatchesTheDoubleLoop) {
  check_property("the pairs are those of a double loop", [] {
    const BoxList boxes = *any_boxes();
    const Config config = any_config();
    Options options = config.options();
    options.margin = *rc::gen::element(0.0f, 0.0f, 0.1f, 1.0f, denormal);
    options.cell_scale = *rc::gen::element(1.0f, 1.0f, 0.1f, 7.0f);
    RC_LOG() << config.name() << " margin " << options.margin << " cells " << options.cell_scale
             << '\n';
    assert_same(find_pairs(boxes, options), reference_pairs(boxes, options.margin).pairs);
  });
}

TEST(Property, TwoSetsMatchTheDoubleLoop) {
  check_property("the pairs of two sets are those of a double loop", [] {
    const BoxList a = *any_boxes(), b = *any_boxes();
    const Config config = any_config();
    RC_LOG() << config.name() << '\n';
    assert_same(find_pairs(a, b, config.options()), reference_pairs(a, b).pairs);
  });
}

TEST(Property, FiltersMatchTheDoubleLoop) {
  check_property("filters keep the pairs that a double loop keeps", [] {
    BoxList boxes = *any_boxes();
    const std::size_t n = boxes.size();
    const auto labels = [n](int low, int high) {
      return *rc::gen::container<std::vector<std::int32_t>>(n, rc::gen::inRange(low, high));
    };
    const std::vector<std::int32_t> owner = labels(-1, 5), world = labels(-1, 3),
                                    bits = labels(0, 8), still = labels(0, 3);
    const std::vector<std::uint32_t> group(bits.begin(), bits.end());
    const std::vector<std::uint8_t> is_static(still.begin(), still.end());
    Boxes view = boxes;
    const int which = *rc::gen::inRange(0, 16);
    if (n > 0) {  // an empty vector has no data: the filter would be absent
      if (which & 1) view.filters.owner = {owner.data(), n};
      if (which & 2) view.filters.world = {world.data(), n};
      if (which & 4) view.filters.group = {group.data(), n};
      if (which & 8) view.filters.is_static = {is_static.data(), n};
    }
    const Config config = any_config();
    RC_LOG() << config.name() << " filters " << which << '\n';
    assert_same(find_pairs(view, config.options()), reference_pairs(view).pairs);
  });
}

TEST(Property, MirrorImageHasTheSamePairs) {
  check_property("negating an axis changes no pair", [] {
    BoxList boxes = *any_boxes();
    const Options options = any_config().options();
    const std::vector<Pair> before = sorted_pairs(boxes, options);
    const int axis = *rc::gen::inRange(0, 3);
    for (Box& box : boxes) {
      float& lower = (&box.lower.x)[axis];
      float& upper = (&box.upper.x)[axis];
      const float kept = lower;
      lower = -upper;
      upper = -kept;
    }
    assert_same(sorted_pairs(boxes, options), before);
  });
}

TEST(Property, AxesMayBeExchanged) {
  check_property("exchanging axes changes no pair", [] {
    BoxList boxes = *any_boxes();
    const Options options = any_config().options();
    const std::vector<Pair> before = sorted_pairs(boxes, options);
    for (Box& box : boxes) {
      box.lower = {box.lower.y, box.lower.z, box.lower.x};
      box.upper = {box.upper.y, box.upper.z, box.upper.x};
    }
    assert_same(sorted_pairs(boxes, options), before);
  });
}

TEST(Property, ScalingByAPowerOfTwoChangesNothing) {
  check_property("doubling every coordinate changes no pair", [] {
    BoxList boxes;
    for (const Box& box : *any_boxes()) {
      bool modest = true;  // neither overflow nor a lost bit
      for (int k = 0; k < 6; ++k) {
        const float c = std::abs((&box.lower.x)[k]);
        modest = modest && (c == 0 || c == infinity || (c > 1e-37f && c < 1e37f));
      }
      if (modest) boxes.push_back(box);
    }
    const Options options = any_config().options();
    const std::vector<Pair> before = sorted_pairs(boxes, options);
    for (Box& box : boxes)
      for (int k = 0; k < 6; ++k) (&box.lower.x)[k] *= 2;
    assert_same(sorted_pairs(boxes, options), before);
  });
}

TEST(Property, OneSetIsHalfOfTwoEqualSets) {
  check_property(
      "a set against itself gives both orders of each pair, and each active box with itself", [] {
        const BoxList boxes = *any_boxes();
        const Options options = any_config().options();
        std::vector<Pair> want;
        for (const Pair& pair : find_pairs(boxes, options)) {
          want.push_back(pair);
          want.push_back({pair.second, pair.first});
        }
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
          const Box& b = boxes[i];
          if (b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z)
            want.push_back({i, i});
        }
        std::sort(want.begin(), want.end());
        assert_same(find_pairs(boxes, boxes, options), want);
      });
}

}  // namespace
}  // namespace throng::tests
