// The conservative sweep test accepts every hit, for any numbers, and rejects most distant boxes.
#include "tracking/sweep_prefilter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <vector>

#include "support/random.hpp"
#include "tracking/queries.hpp"

namespace throng::tracking {
namespace {

using tests::Random;

constexpr float infinity = std::numeric_limits<float>::infinity();

Body body_of(const Box& box) { return {box, 0, none}; }

struct TestCounts {
  std::size_t met = 0, grazed = 0, passed = 0, lost = 0;
};
// Tests up to time `end`.
void check_accepted(const Sweep& sweep, double end, const Body (&four)[4], TestCounts& sum) {
  const SweepPrefilter prefilter(sweep.box, base::SweptBounds(sweep), end);
  std::uint32_t passes = 0;  // each alone
  for (unsigned i = 0; i < 4; ++i) {
    CellLine line = CellLine::empty();
    line.used = 1;
    line.set(0, four[i].box);
    passes |= prefilter.passes(line) << i;
  }
  for (unsigned i = 0; i < 4; ++i) {
    const bool passed = (passes >> i & 1) != 0;
    // The same with a second box.
    CellLine line = CellLine::empty();
    for (; line.used < 2; ++line.used) line.set(line.used, four[(i + line.used) % 4].box);
    EXPECT_EQ(prefilter.passes(line), (passed ? 1u : 0u) | (passes >> (i + 1) % 4 & 1) << 1);
    const base::ContactInterval t = base::contact_interval(sweep, four[i].box);
    const bool met = base::is_active(four[i].box) && t.enter <= std::min(t.leave, end);
    sum.met += met;
    sum.grazed += met && t.enter == t.leave;
    sum.passed += passed;
    if (met && !passed && sum.lost++ == 0) {
      const Box &b = four[i].box, &s = sweep.box;
      ADD_FAILURE() << "box " << b.lower.x << ' ' << b.lower.y << ' ' << b.lower.z << ", "
                    << b.upper.x << ' ' << b.upper.y << ' ' << b.upper.z << "; sweep " << s.lower.x
                    << ' ' << s.lower.y << ' ' << s.lower.z << ", " << s.upper.x << ' ' << s.upper.y
                    << ' ' << s.upper.z << " by " << sweep.by.x << ' ' << sweep.by.y << ' '
                    << sweep.by.z << ", hit from " << t.enter << " to " << t.leave;
    }
  }
}

// A number of any magnitude, often a repeated one or its neighbour.
float any_number(Random& random, bool finite) {
  const float some[] = {0,     1,        2,        3,     10,        1e-20f, 1e-38f,  1e-42f,
                        1e20f, 0x1p-64f, 0x1p100f, 1e30f, 0x1p-126f, 3e38f,  FLT_MAX, infinity};
  const int last = finite ? 14 : 15;
  float x = some[random.between(0, random.one_in(2) ? 4 : last)];
  if (random.one_in(4)) x = random.in(0, 10);
  if (random.one_in(5)) x = std::nextafter(x, random.one_in(2) ? -infinity : FLT_MAX);
  return random.one_in(2) ? -x : x;
}
Box any_box(Random& random) {
  Box box;
  float* const lower = &box.lower.x;
  float* const upper = &box.upper.x;
  for (int k = 0; k < 3; ++k) {
    const float a = any_number(random, false);
    const float b = random.one_in(4) ? a : any_number(random, false);
    lower[k] = std::fmin(a, b);
    upper[k] = std::fmax(a, b);
  }
  return box;
}

// An end time: the whole sweep, the time at which it hits or leaves a box, or any.
double any_end(Random& random, const Sweep& sweep, const Box& box) {
  const base::ContactInterval t = base::contact_interval(sweep, box);
  const double ends[] = {1, t.enter, t.leave,
                         std::ldexp(double{random.unit()}, -random.between(0, 90))};
  return std::clamp(ends[random.below(4)], 0.0, 1.0);
}

TEST(SweepPrefilter, AnyNumbers) {
  Random random(1);
  TestCounts sum;
  for (int k = 0; k < 400'000; ++k) {
    Sweep sweep;
    sweep.box = any_box(random);
    if (random.one_in(2)) sweep.box.upper = sweep.box.lower;
    sweep.by = {any_number(random, true), any_number(random, true), any_number(random, true)};
    const Body four[4] = {body_of(any_box(random)), body_of(any_box(random)),
                          body_of(any_box(random)), body_of(any_box(random))};
    check_accepted(sweep, any_end(random, sweep, four[random.below(4)].box), four, sum);
  }
  EXPECT_EQ(sum.lost, 0u);
  EXPECT_GT(sum.met, 100'000u);
  EXPECT_GT(sum.grazed, 10'000u);
  EXPECT_LT(sum.passed, 800'000u);
}

// Integers times a pitch: sweeps graze edges and corners at fractional times.
TEST(SweepPrefilter, Grazing) {
  Random random(2);
  TestCounts sum;
  for (int k = 0; k < 200'000; ++k) {
    const float pitch = std::ldexp(random.in(0.5f, 1), random.between(-60, 60));
    const auto at = [&](int low, int high) {
      return pitch * static_cast<float>(random.between(low, high));
    };
    const auto box_at = [&] {
      const Vec3 v = {at(-4, 4), at(-4, 4), at(-4, 4)};
      const float e = at(0, 2);
      return Box{v, {v.x + e, v.y + e, v.z + e}};
    };
    const Sweep sweep = {box_at(), {at(-9, 9), at(-9, 9), at(-9, 9)}};
    const Body four[4] = {body_of(box_at()), body_of(box_at()), body_of(box_at()),
                          body_of(box_at())};
    check_accepted(sweep, any_end(random, sweep, four[random.below(4)].box), four, sum);
  }
  EXPECT_EQ(sum.lost, 0u);
  EXPECT_GT(sum.grazed, 10'000u);
}

// Rays through a volume of small boxes: few boxes pass that are not hit.
TEST(SweepPrefilter, FewFalsePositives) {
  Random random(3);
  TestCounts sum;
  for (int k = 0; k < 100'000; ++k) {
    const auto small = [&] {
      const Vec3 v = random.point(0, 100);
      return body_of({v, {v.x + 1, v.y + 1, v.z + 1}});
    };
    const Vec3 from = random.point(0, 100), to = random.point(0, 100);
    const Sweep ray = {{from, from}, {to.x - from.x, to.y - from.y, to.z - from.z}};
    const Body four[4] = {small(), small(), small(), small()};
    check_accepted(ray, 1, four, sum);
  }
  EXPECT_GT(sum.met, 20u);
  EXPECT_LE(sum.passed, sum.met + sum.met / 20);
}

// The same rays, 1e14 to 1e30 times as long, tested until they leave the volume.
TEST(SweepPrefilter, FewFalsePositivesOfLongRays) {
  Random random(4);
  TestCounts sum;
  for (int k = 0; k < 100'000; ++k) {
    const auto small = [&] {
      const Vec3 v = random.point(0, 100);
      return body_of({v, {v.x + 1, v.y + 1, v.z + 1}});
    };
    const Vec3 from = random.point(0, 100), to = random.point(0, 100);
    const float far = std::ldexp(1.0f, random.between(46, 100));
    const Sweep ray = {{from, from},
                       {(to.x - from.x) * far, (to.y - from.y) * far, (to.z - from.z) * far}};
    const Body four[4] = {small(), small(), small(), small()};
    check_accepted(ray, base::contact_interval(ray, {{0, 0, 0}, {101, 101, 101}}).leave, four, sum);
  }
  EXPECT_EQ(sum.lost, 0u);
  EXPECT_GT(sum.met, 20u);
  EXPECT_LE(sum.passed, sum.met + sum.met / 20);
}

// Odd counts, and removed ids.
TEST(SweepPrefilter, ReportsEachOnce) {
  for (std::size_t count = 0; count < 14; ++count) {
    base::Memory memory(std::pmr::new_delete_resource(), 0);
    Objects objects(memory, 0);
    objects.reserve_more(count);
    std::vector<ObjectId> want;
    for (std::size_t i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i), y = i % 3 == 0 ? 9.0f : 0.0f;  // some off the path
      const ObjectId id = objects.add({{x, y, 0}, {x + 1, y + 1, 1}}, {});
      if (i % 5 != 2 && i % 3 != 0) want.push_back(id);
    }
    for (std::size_t i = 2; i < count; i += 5) objects.remove(static_cast<ObjectId>(i));
    const Sweep sweep = {{{-1, 0.5f, 0.5f}, {-1, 0.5f, 0.5f}}, {100, 0, 0}};
    std::vector<ObjectId> got;
    SweepPrefilter(sweep.box, base::SweptBounds(sweep), 1).each(objects, [&](ObjectId id) {
      if (objects.is_active(id)) got.push_back(id);
    });
    EXPECT_EQ(got, want) << count;
  }
}

}  // namespace
}  // namespace throng::tracking
