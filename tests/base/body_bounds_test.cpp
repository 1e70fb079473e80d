// The arithmetic of a body's box against 113-bit floats, before and after rounding to float.
#include "base/update_boxes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "support/body_scenes.hpp"

namespace throng::base {
namespace {

using tests::OneBody;
using tests::Random;
using tests::random_unit;
using tests::Tightness;
using tests::Wide;

constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float largest = std::numeric_limits<float>::max();
constexpr float tiny = std::numeric_limits<float>::denorm_min();

Box box_of(const OneBody& b) {
  return place(b.position, b.displacement,
               extents_of(b.rotation, b.shape.center, b.shape.half_extents,
                          static_cast<double>(b.shape.radius) + static_cast<double>(b.margin)));
}

OneBody random_body(Random& random) {
  OneBody b;
  b.position = random.point(-100, 100);
  b.rotation = random_unit(random);
  b.displacement = random.point(-1, 1);
  b.shape.center = random.point(-2, 2);
  b.shape.half_extents = random.point(0, 3);
  b.shape.radius = random.unit();
  return b;
}

// Any finite float: either sign, any exponent up to `top`, zeros and denormals included.
float any_float(Random& random, int top) {
  const float sign = random.one_in(2) ? -1.0f : 1.0f;
  switch (random.below(8)) {
    case 0:
      return 0.0f * sign;
    case 1:
      return tiny * sign * static_cast<float>(random.below(5));
    case 2:
      return sign * static_cast<float>(random.below(3));
    default:
      return sign * random.magnitude(-140, top);
  }
}
Vec3 any_point(Random& random, int top) {
  return {any_float(random, top), any_float(random, top), any_float(random, top)};
}

TEST(BodyBounds, ContainsAndIsTight) {
  Random random(1);
  Tightness seen;
  for (int trial = 0; trial < 50000; ++trial) {
    const OneBody b = random_body(random);
    tests::expect_tight(box_of(b), tests::exact_box(b), seen);
    if (HasFatalFailure()) return;
  }
  // A side is one float further out only if a float lies within 2^-48 of the sum: one in some
  // millions at random sizes.
  EXPECT_EQ(seen.sides, 300000u);
  EXPECT_GE(seen.tightest, seen.sides - 3);
}

// Any exponents, quaternions far from unit length, denormals: no special cases.
TEST(BodyBounds, ContainsForAnySizes) {
  Random random(2);
  Tightness seen;
  for (int trial = 0; trial < 100000; ++trial) {
    OneBody b;
    const int top = trial % 2 ? 126 : 10;
    b.position = any_point(random, top);
    const Vec3 axis = any_point(random, trial % 3 ? 0 : 60);
    b.rotation = {axis.x, axis.y, axis.z, any_float(random, 0)};
    b.displacement = any_point(random, top);
    b.shape.center = any_point(random, top);
    const Vec3 h = any_point(random, top);
    b.shape.half_extents = {std::abs(h.x), std::abs(h.y), std::abs(h.z)};
    b.shape.radius = std::abs(any_float(random, top));
    b.margin = std::abs(any_float(random, 0));
    tests::expect_tight(box_of(b), tests::exact_box(b), seen);
    if (HasFatalFailure()) return;
  }
}

// Inputs that round a double toward the body: the error bound is necessary.
TEST(BodyBounds, ContainsDespiteDoubleRounding) {
  Tightness seen;
  const float small = 0x1p-80f;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      for (int what = 0; what < 3; ++what) {
        OneBody b;
        float p[3] = {0, 0, 0}, v[3] = {0, 0, 0};
        p[axis] = sign;
        v[axis] = -sign * small;
        b.position = {p[0], p[1], p[2]};
        if (what == 0) b.shape.center = {v[0], v[1], v[2]};
        if (what == 1) b.shape.radius = small;
        if (what == 2) b.displacement = {v[0], v[1], v[2]};
        tests::expect_tight(box_of(b), tests::exact_box(b), seen);
        if (HasFatalFailure()) return;
      }
    }
  }
  EXPECT_EQ(seen.sides, 108u);
}

// The greatest error of the doubles, in units of their rounding and of the weight in E.
double worst_error(const OneBody& b) {
  const Extents e = extents_of(b.rotation, b.shape.center, b.shape.half_extents,
                               static_cast<double>(b.shape.radius));
  OneBody still = b;
  still.position = still.displacement = {0, 0, 0};
  const tests::ExactBox exact = tests::exact_box(still);
  const Extent axes[3] = {e.x, e.y, e.z};
  Wide worst = 0;
  for (int i = 0; i < 3; ++i) {
    const Wide unit = Wide(axes[i].weight) * Wide(0x1p-53);
    worst = std::max(worst, tests::size_of(Wide(axes[i].low) - exact.low[i]) / unit);
    worst = std::max(worst, tests::size_of(Wide(axes[i].high) - exact.high[i]) / unit);
  }
  return static_cast<double>(worst);
}

// Within the proven bound, which also covers the cases where no float is near enough to show an
// error.
TEST(BodyBounds, ErrsByLessThanTheBound) {
  Random random(3);
  double worst = 0, worst_cancelled = 0;
  for (int trial = 0; trial < 50000; ++trial) {
    OneBody b = random_body(random);
    worst = std::max(worst, worst_error(b));
    // 1 - t with t near 1, and no other term along the axis: this error alone.
    b.rotation.y = random.in(0.1f, 0.7f);
    b.rotation.z = std::sqrt(0.5f - b.rotation.y * b.rotation.y);
    b.rotation.x = b.rotation.y;
    b.rotation.w = b.rotation.z;
    b.shape = Shape::box({random.unit(), 0, 0});
    worst_cancelled = std::max(worst_cancelled, worst_error(b));
  }
  // These steps have 9 of the 13 u S of the proof. A nonzero error shows that the test measures it.
  EXPECT_LT(worst, 10);
  EXPECT_GT(worst, 0.5);
  EXPECT_LT(worst_cancelled, 10);
  EXPECT_GT(worst_cancelled, 0.05);
}

// Half turns, quarter turns, thirds of a turn, and quaternions that are no rotation.
TEST(BodyBounds, KnownRotations) {
  const float s = 0.70710678f;
  const std::vector<Quaternion> rotations = {
      {0, 0, 0, 1}, {0, 0, 0, -1},           {1, 0, 0, 0}, {0, 1, 0, 0},
      {0, 0, 1, 0}, {0, 0, -1, 0},           {s, 0, 0, s}, {0, s, 0, -s},
      {0, 0, s, s}, {.5f, .5f, .5f, .5f},    {0, 0, 0, 0}, {s, s, 0, 0},
      {0, 0, 0, 5}, {-0.0f, -0.0f, -0.0f, 1}};
  const std::vector<float> values = {0.0f, -0.0f, 1.0f, -1.0f, tiny, 0.5f, 1e30f, -1e30f, 3e38f};
  Tightness seen;
  for (const Quaternion& q : rotations) {
    for (const float p : values) {
      for (const float c : values) {
        OneBody b{{p, c, 1}, q, {0, 0, 0}, Shape::box({1, 2, 3}, {c, p, 0.25f}), 0};
        tests::expect_tight(box_of(b), tests::exact_box(b), seen);
        if (HasFatalFailure()) return;
      }
    }
  }
  // A quarter turn about z swaps x and y, to within the float quaternion's error.
  const Box quarter = box_of({{10, 20, 30}, {0, 0, s, s}, {0, 0, 0}, Shape::box({1, 2, 3}), 0});
  EXPECT_NEAR(quarter.lower.x, 8, 1e-5);
  EXPECT_NEAR(quarter.upper.y, 21, 1e-5);
  EXPECT_NEAR(quarter.upper.z, 33, 1e-5);
  // The direction: x rotates to y.
  const Box turned = box_of({{0, 0, 0}, {0, 0, s, s}, {0, 0, 0}, Shape::sphere(0, {1, 0, 0}), 0});
  EXPECT_NEAR(turned.lower.y, 1, 1e-6);
  EXPECT_NEAR(turned.lower.x, 0, 1e-6);
}

// Without a rotation the short form equals the general one.
TEST(BodyBounds, UnrotatedIsTheIdentity) {
  Random random(4);
  for (int trial = 0; trial < 20000; ++trial) {
    OneBody b = random_body(random);
    b.rotation = {};
    if (trial % 2) b.displacement = {0, 0, 0};
    const Extents e =
        extents_of(b.shape.center, b.shape.half_extents, static_cast<double>(b.shape.radius));
    const Box box = trial % 2 ? place(b.position, e) : place(b.position, b.displacement, e);
    const Box want = box_of(b);
    ASSERT_EQ(std::memcmp(&box, &want, sizeof box), 0) << trial;
  }
}

TEST(BodyBounds, OverflowsOutward) {
  Tightness seen;
  for (const float p : {largest, -largest, 3e38f, 1e30f}) {
    for (const float h : {0.0f, 1.0f, 1e30f, 2e38f, largest}) {
      const OneBody b{{p, -p, p}, {}, {p, p, 0}, Shape::box({h, h, 0}, {p, 0, 0}), 1};
      tests::expect_tight(box_of(b), tests::exact_box(b), seen);
      if (HasFatalFailure()) return;
    }
  }
  const Box far = box_of({{largest, -largest, 0}, {}, {0, 0, 0}, Shape::sphere(1e38f), 0});
  EXPECT_EQ(far.upper.x, inf);
  EXPECT_EQ(far.lower.y, -inf);
  EXPECT_LT(far.lower.x, largest);
  // Entirely beyond the largest float: the box still contains a float.
  const Box beyond = box_of({{largest, 0, 0}, {}, {0, 0, 0}, Shape::sphere(0, {largest, 0, 0}), 0});
  EXPECT_EQ(beyond.lower.x, largest);
  EXPECT_EQ(beyond.upper.x, inf);
}

TEST(BodyBounds, InfiniteSizes) {
  const OneBody ground{{5, -1, 5}, {}, {0, 0, 0}, Shape::box({inf, 1, inf}), 0};
  for (const Quaternion& q : {Quaternion{}, Quaternion{1, 0, 0, 0}, Quaternion{0, 1, 0, 0},
                              Quaternion{0, 0.6f, 0, 0.8f}, Quaternion{0, -0.28f, 0, 0.96f}}) {
    OneBody b = ground;
    b.rotation = q;
    const Box box = box_of(b);
    EXPECT_EQ(box.lower.x, -inf);
    EXPECT_EQ(box.upper.x, inf);
    EXPECT_EQ(box.lower.z, -inf);
    EXPECT_EQ(box.upper.z, inf);
    EXPECT_EQ(box.lower.y, std::nextafter(-2.0f, -3.0f));
    EXPECT_LT(box.upper.y, 1e-6f);
    EXPECT_GE(box.upper.y, 0.0f);
  }
  OneBody tilted = ground;
  tilted.rotation = {tiny, 0, 0, 1};  // the least float
  EXPECT_EQ(box_of(tilted).lower.y, -inf);
  EXPECT_EQ(box_of(tilted).upper.y, inf);
  const Box all = box_of({{1, 2, 3}, {.5f, .5f, .5f, .5f}, {0, 0, 0}, Shape::sphere(inf), 0});
  for (const float x : {all.lower.x, all.lower.y, all.lower.z}) EXPECT_EQ(x, -inf);
  for (const float x : {all.upper.x, all.upper.y, all.upper.z}) EXPECT_EQ(x, inf);
}

TEST(BodyBounds, RoundedAsTheNeighbours) {
  Random random(5);
  const auto check = [](double x) {
    const float down = rounded_down(x), up = rounded_up(x);
    ASSERT_LE(static_cast<double>(down), x);
    ASSERT_GE(static_cast<double>(up), x);
    ASSERT_TRUE(down == up || std::nextafter(down, inf) == up) << std::hexfloat << x;
  };
  for (int trial = 0; trial < 200000; ++trial) {
    const double x = std::ldexp(static_cast<double>(random.next() >> 11), random.between(-220, 80));
    check(x);
    check(-x);
    check(static_cast<double>(static_cast<float>(x)));
    if (HasFatalFailure()) return;
  }
  for (const double x : {0.0, -0.0, 1e-300, -1e-300, 1e300, -1e300, 0x1p-150, 0x1p-149}) check(x);
  EXPECT_TRUE(std::isnan(rounded_down(std::nan(""))));
  EXPECT_TRUE(std::isnan(rounded_up(std::nan(""))));
}

constexpr Box at_compile_time =
    place(Vec3{1, 2, 3}, extents_of(Quaternion{}, {0, 0, 0}, {1, 1, 1}, 0.5));
static_assert(at_compile_time.lower.x <= -0.5f && at_compile_time.upper.z >= 4.5f);

}  // namespace
}  // namespace throng::base
