// The testable parts of the program: the double loop of `check`, its report of a wrong list, and
// the heap of the demo.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <throng/checksum.hpp>

#include "apps/throng/double_loop.hpp"
#include "apps/throng/expected_pairs.hpp"
#include "apps/throng/falling_boxes.hpp"

namespace throng::test {
namespace {

const auto quiet = [](std::size_t) {};

// Small integers, so that many faces touch; a few infinite, inverted and NaN boxes.
std::vector<Box> boxes(std::size_t n, std::uint64_t seed) {
  std::vector<Box> all(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t r = mix64(seed * 1000003 + i);
    const auto at = [&](int shift, unsigned range) {
      return static_cast<float>((r >> shift) % range);
    };
    const Vec3 low{at(0, 13), at(8, 13), at(16, 13)};
    all[i] = {low, {low.x + at(24, 4), low.y + at(32, 4), low.z + at(40, 4)}};
    if (i % 97 == 5) all[i].upper.z = std::numeric_limits<float>::infinity();
    if (i % 89 == 7) std::swap(all[i].lower.x, all[i].upper.x);
    if (i % 83 == 9) all[i].lower.y = NAN;
  }
  return all;
}

bool active(const Box& b) {
  return b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z;
}
bool meet(const Box& a, const Box& b) {
  return active(a) && active(b) && a.lower.x <= b.upper.x && b.lower.x <= a.upper.x &&
         a.lower.y <= b.upper.y && b.lower.y <= a.upper.y && a.lower.z <= b.upper.z &&
         b.lower.z <= a.upper.z;
}

TEST(DoubleLoop, matches_a_simpler_double_loop) {
  for (const std::size_t n : {0, 1, 2, 31, 63, 64, 65, 128, 1000, 2111}) {
    const auto all = boxes(n, n);
    std::vector<Pair> wanted;
    std::uint64_t inactive = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      inactive += !active(all[i]);
      for (std::uint32_t j = i + 1; j < n; ++j) {
        if (meet(all[i], all[j])) wanted.push_back({i, j});
      }
    }
    const auto found = cli::double_loop(all, nullptr, 0, quiet);
    EXPECT_EQ(found.pairs, wanted) << n;
    EXPECT_EQ(found.inactive, inactive) << n;
  }
}

TEST(DoubleLoop, two_sets_and_their_worlds_and_owners) {
  const auto first = boxes(777, 1), second = boxes(1234, 2);
  std::vector<std::int32_t> worlds, owners;
  for (std::int32_t i = 0; i < 2000; ++i) {
    worlds.push_back(i % 7 - 1);
    owners.push_back(i % 5 - 1);
  }
  Boxes a(first), b(second);
  a.filters.world = {worlds.data(), first.size(), 4};
  b.filters.world = {worlds.data() + 3, second.size(), 4};
  a.filters.owner = {owners.data(), first.size(), 4};
  b.filters.owner = {owners.data() + 1, second.size(), 4};
  std::vector<Pair> wanted;
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    for (std::uint32_t j = 0; j < second.size(); ++j) {
      const int wa = worlds[i], wb = worlds[j + 3], oa = owners[i], ob = owners[j + 1];
      const bool allowed = (wa == wb || wa == -1 || wb == -1) && (oa != ob || oa == -1);
      if (allowed && meet(first[i], second[j])) wanted.push_back({i, j});
    }
  }
  ASSERT_GT(wanted.size(), 1000u);
  EXPECT_EQ(cli::double_loop(a, &b, 0, quiet).pairs, wanted);
}

TEST(DoubleLoop, a_margin_is_rounded_outward) {
  // 1 + 2^-24 is not a float. Rounded outward it is the float after 1, where the other box begins.
  const float next = std::nextafter(1.0f, 2.0f);
  const std::vector<Box> touching = {{{0, 0, 0}, {1, 1, 1}}, {{2 * next - 1, 0, 0}, {9, 1, 1}}};
  const float tiny = std::ldexp(1.0f, -24);
  EXPECT_EQ(cli::double_loop(touching, nullptr, tiny, quiet).pairs.size(), 1u);
  EXPECT_EQ(cli::double_loop(touching, nullptr, 0, quiet).pairs.size(), 0u);
  // So small that only the rounding error of the sum shows that anything was added.
  const std::vector<Box> far = {{{0, 0, 0}, {1, 1, 1}}, {{next, 0, 0}, {9, 1, 1}}};
  EXPECT_EQ(cli::double_loop(far, nullptr, 1e-30f, quiet).pairs.size(), 1u);
}

TEST(ExpectedPairs, reports_each_kind_of_difference) {
  const auto all = boxes(500, 3);
  cli::ExpectedPairs expected_pairs(all, nullptr, 0, quiet);
  const std::vector<Pair> right = expected_pairs.pairs();
  ASSERT_GT(right.size(), 100u);
  const auto says = [&](const std::vector<Pair>& list, bool in_order) {
    std::string text;
    for (const auto& line : expected_pairs.differences(list.data(), list.size(), in_order))
      text += line + ";";
    return text;
  };
  EXPECT_EQ(says(right, true), "");
  std::vector<Pair> list(right.rbegin(), right.rend());
  EXPECT_EQ(says(list, false), "");
  EXPECT_NE(says(list, true).find("order"), std::string::npos);
  list = right;
  list.pop_back();
  EXPECT_NE(says(list, false).find("in all 1 missing, 0 extra, 0 reported twice"),
            std::string::npos);
  list.push_back(right[0]);
  EXPECT_NE(says(list, false).find("in all 1 missing, 0 extra, 1 reported twice"),
            std::string::npos);
  list.back() = {right[0].second, right[0].first};  // the wrong way round
  EXPECT_NE(says(list, false).find("in all 1 missing, 1 extra, 0 reported twice"),
            std::string::npos);
  list.back() = {7000000, 1};
  EXPECT_NE(says(list, true).find("extra (7000000, 1)"), std::string::npos);
}

std::vector<Pair> pairs_of(const cli::FallingBoxes& heap) {
  return cli::double_loop(heap.boxes(), nullptr, 0, quiet).pairs;
}

TEST(FallingBoxes, falls_and_does_not_depend_on_the_order_of_pairs) {
  cli::FallingBoxes heap(300), other(300);
  const auto top = [](const cli::FallingBoxes& h) {
    float z = 0;
    for (std::size_t i = 0; i < h.objects(); ++i) z = std::max(z, h.boxes()[i].upper.z);
    return z;
  };
  const float at_first = top(heap);
  for (int frame = 0; frame < 90; ++frame) {
    heap.fall();
    other.fall();
    std::vector<Pair> pairs = pairs_of(heap);
    heap.push_apart(pairs.data(), pairs.size());
    std::reverse(pairs.begin(), pairs.end());
    other.push_apart(pairs.data(), pairs.size());
  }
  EXPECT_LT(top(heap), 0.6f * at_first);
  float touching = 0;
  const std::vector<Pair> pairs = pairs_of(heap);
  for (const float t : heap.touches(pairs.data(), pairs.size())) touching += t;
  EXPECT_GT(touching, 300);
  for (std::size_t i = 0; i < heap.objects(); ++i) {
    const Box a = heap.boxes()[i], b = other.boxes()[i];
    ASSERT_TRUE(a.lower.x == b.lower.x && a.lower.y == b.lower.y && a.lower.z == b.lower.z) << i;
    ASSERT_GT(a.upper.z, 0) << "box " << i << " fell through the plane";
  }
}

}  // namespace
}  // namespace throng::test
