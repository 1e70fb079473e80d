// Tests of the generator of hard cases, the vectorized reference and the minimizer.
#include "support/cases.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/minimize.hpp"
#include "support/oracle.hpp"

namespace throng::tests {
namespace {

std::vector<std::uint8_t> bytes_of(std::uint64_t seed) {
  Random random(seed);
  return random_bytes(random, 40 + random.below(1500));
}

TEST(Cases, AThirdDependsOnTheLastBit) {
  int close = 0, two_sets = 0, filtered = 0;
  std::set<std::string> shapes;
  constexpr int cases = 300;
  for (int i = 0; i < cases; ++i) {
    const std::vector<std::uint8_t> bytes = bytes_of(static_cast<std::uint64_t>(i));
    Bytes stream(bytes);
    const Case c = make_case(stream, 300);
    close += has_close_pair(c);
    two_sets += c.two_sets;
    filtered += c.filters_a != 0;
    shapes.insert(c.shape);
  }
  EXPECT_GE(close, cases / 3);
  EXPECT_GE(two_sets, cases / 8);
  EXPECT_GE(filtered, cases / 3);
  EXPECT_EQ(shapes.size(), 7u);
}

TEST(Cases, CloseMeansWithinTwoSteps) {
  Case c;
  c.a.add(cube(0, 0, 0, 1), 0);
  c.a.add(cube(1, 0, 0, 1), 0);
  EXPECT_TRUE(has_close_pair(c));
  c.a.boxes[1].lower.x = nudge(1, 2);
  EXPECT_TRUE(has_close_pair(c));
  c.a.boxes[1].lower.x = nudge(1, 3);
  EXPECT_FALSE(has_close_pair(c));
  c.a.boxes[1] = cube(1, 5, 0, 1);  // separated on another axis
  EXPECT_FALSE(has_close_pair(c));
}

// The vectorized double loop against the scalar one.
TEST(VectorizedReference, MatchesTheReference) {
  std::size_t pairs = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const std::vector<std::uint8_t> bytes = bytes_of(seed);
    Bytes stream(bytes);
    const Case c = make_case(stream, 300);
    VectorizedReference loop;
    loop.run(c.first(), c.second(), c.two_sets, c.margin);
    const Answer want = c.two_sets ? reference_pairs(c.first(), c.second(), c.margin)
                                   : reference_pairs(c.first(), c.margin);
    EXPECT_EQ(loop.pairs(), want.pairs) << describe(c);
    EXPECT_EQ(loop.inactive(), want.inactive) << describe(c);
    pairs += want.pairs.size();
  }
  EXPECT_GT(pairs, 10000u);
}

TEST(VectorizedReference, DetectsEveryDifference) {
  const BoxList boxes = snapped_boxes(60, 5, 1, 4);
  VectorizedReference loop;
  loop.run(boxes, Boxes(), false, 0);
  const std::vector<Pair> right = loop.pairs();
  ASSERT_GT(right.size(), 10u);
  const auto wrong = [&](const std::vector<Pair>& pairs, bool in_order = false) {
    return !loop.compare(pairs.data(), pairs.size(), in_order).empty();
  };
  std::vector<Pair> pairs = right;
  EXPECT_FALSE(wrong(pairs, true));
  std::swap(pairs[2], pairs[7]);
  EXPECT_FALSE(wrong(pairs));
  EXPECT_TRUE(wrong(pairs, true));
  pairs = right;
  pairs.pop_back();
  EXPECT_TRUE(wrong(pairs)) << "one is missing";
  pairs.push_back(right[0]);
  EXPECT_TRUE(wrong(pairs)) << "one is missing, another duplicated";
  pairs.back() = {right.back().second, right.back().first};
  EXPECT_TRUE(wrong(pairs)) << "the wrong way round";
  pairs.back() = {70, 71};
  EXPECT_TRUE(wrong(pairs)) << "no such box";
  pairs = right;
  pairs.push_back(right[0]);
  EXPECT_TRUE(wrong(pairs)) << "one too many";
}

// The failing condition is a pair that touches exactly along x: two boxes must remain.
TEST(Minimize, KeepsOnlyWhatFails) {
  const auto touches = [](const Case& c) {
    for (const Box& a : c.a.boxes)
      for (const Box& b : c.a.boxes)
        if (a.upper.x == b.lower.x && a.upper.x != 0) return true;
    return false;
  };
  Case c;
  for (const Box& box : snapped_boxes(80, 7, 0.25f, 9)) c.a.add(box, 3);
  c.filters_a = all_filters;
  c.margin = 1;
  ASSERT_TRUE(touches(c));
  const Case least = minimize_case(c, touches);
  ASSERT_TRUE(touches(least));
  EXPECT_LE(least.a.size(), 2u);
  EXPECT_EQ(least.filters_a, 0u);
  EXPECT_EQ(least.margin, 0.0f);
  const Config config{Algorithm::grid, Isa::scalar, 2, Order::canonical};
  const std::string text = as_test(least, config, "Touching");
  for (const char* part : {"TEST(Regression, Touching)", "Algorithm::grid", "Isa::scalar",
                           "threads = 2", "reference_pairs(view_a", "0x"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(Minimize, BytesToo) {
  const auto has_7_before_9 = [](const std::vector<std::uint8_t>& b) {
    const auto seven = std::find(b.begin(), b.end(), 7);
    return std::find(seven, b.end(), 9) != b.end();
  };
  std::vector<std::uint8_t> bytes = bytes_of(3);
  bytes.insert(bytes.begin() + 5, 7);
  bytes.push_back(9);
  EXPECT_EQ(minimize_bytes(bytes, has_7_before_9), (std::vector<std::uint8_t>{7, 9}));
}

}  // namespace
}  // namespace throng::tests
