// The predicates against GMP: each path by itself, for all kinds of points.
#include "mesh/orient.hpp"

#include <gtest/gtest.h>

#include "mesh/exact_orientation.hpp"
#include "support/sanitized.hpp"

namespace throng::mesh {
namespace {

using tests::FourPoints;
using tests::PointKind;
using tests::Random;

constexpr int rounds = tests::sanitized ? 300 : 3000;

class OrientExact : public testing::TestWithParam<int> {};

TEST_P(OrientExact, InSpace) {
  Random random(static_cast<std::uint64_t>(GetParam()) + 1);
  for (int n = 0; n < rounds; ++n) {
    const FourPoints p = tests::draw_points(random, static_cast<PointKind>(GetParam()));
    const int expected = tests::exact_orient3d(p);
    ASSERT_EQ(orient3d_sign(p[0], p[1], p[2], p[3]), expected) << tests::to_text(p);
    const int filter = orient3d_filter(p[0], p[1], p[2], p[3]);
    if (filter != uncertain) {
      ASSERT_EQ(filter, expected) << tests::to_text(p);
    }
    ASSERT_EQ(orient3d_exact_sign(p[0], p[1], p[2], p[3]), expected) << tests::to_text(p);
    ASSERT_EQ(orient3d_integer_sign(p[0], p[1], p[2], p[3]), expected) << tests::to_text(p);
  }
}

TEST_P(OrientExact, InThePlane) {
  Random random(static_cast<std::uint64_t>(GetParam()) + 1000);
  for (int n = 0; n < rounds; ++n) {
    FourPoints p = tests::draw_points(random, static_cast<PointKind>(GetParam()));
    // Points of a plane in space are collinear at random only: make half of them so.
    if (random.one_in(2)) {
      for (DoubleVec3& q : p) q.y = random.one_in(8) ? tests::nudged(q.x, random) : q.x;
    }
    const int expected = tests::exact_orient2d(p[0], p[1], p[2]);
    const auto check = [&](auto&& predicate) {
      return predicate(p[0].x, p[0].y, p[1].x, p[1].y, p[2].x, p[2].y);
    };
    ASSERT_EQ(check(orient2d_sign), expected) << tests::to_text(p);
    const int filter = check(orient2d_filter);
    if (filter != uncertain) {
      ASSERT_EQ(filter, expected) << tests::to_text(p);
    }
    ASSERT_EQ(check(orient2d_exact_sign), expected) << tests::to_text(p);
    ASSERT_EQ(check(orient2d_integer_sign), expected) << tests::to_text(p);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, OrientExact, testing::Range(0, tests::point_kind_count));

}  // namespace
}  // namespace throng::mesh
