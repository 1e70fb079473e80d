// Number of comparisons for unevenly distributed boxes: a bound per box and pair for any scale, gap
// or range; and the pairs equal those of the CPU search.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include <throng/throng.hpp>

#include "support/hard_boxes.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {
namespace {

constexpr int count = 6000;

double share_of(const Boxes& view) {
  Options options;
  options.algorithm = Algorithm::grid;
  options.order = Order::canonical;
  std::vector<Pair> pairs[2];
  Result results[2];
  for (int k = 0; k < 2; ++k) {
    options.backend = k == 0 ? Backend::cpu : Backend::emulated;
    Finder finder(options);
    results[k] = finder.find(view);
    EXPECT_TRUE(results[k].ok()) << results[k].message;
    pairs[k].assign(finder.pairs().begin(), finder.pairs().end());
  }
  EXPECT_TRUE(same_bytes(pairs[0], pairs[1]));
  return static_cast<double>(results[1].comparisons) /
         static_cast<double>(view.size() + results[1].found);
}
void expect_few(const std::string& name, const Boxes& view, double limit) {
  SCOPED_TRACE(name);
  const double share = share_of(view);
  EXPECT_LE(share, limit);
  testing::Test::RecordProperty(name, std::to_string(share));
}

Box around(Vec3 p, float half) {
  return {{p.x - half, p.y - half, p.z - half}, {p.x + half, p.y + half, p.z + half}};
}
// One in `every` boxes is shifted by `gap` along all axes.
BoxList clusters(int every, float gap) {
  Random r(5);
  BoxList boxes;
  const float side = side_of(count * 4.0f);
  for (int i = 0; i < count; ++i) {
    Vec3 at = r.point(0, side);
    const float by = i % every == 0 ? gap * side : 0;
    boxes.push_back(around({at.x + by, at.y + by, at.z + by}, 0.5f));
  }
  return boxes;
}

TEST(Uneven, UniformBoxesAtAnyScale) {
  for (int exponent = -40; exponent <= 30; exponent += 5) {
    BoxList boxes = uniform_boxes(count, 1);
    const double scale = std::pow(10.0, exponent);
    for (Box& b : boxes)
      for (float* x = &b.lower.x; x <= &b.upper.z; ++x) *x = static_cast<float>(*x * scale);
    expect_few("1e" + std::to_string(exponent), boxes, 8);
  }
}

TEST(Uneven, CoordinatesOverDecades) {
  for (const int decades : {1, 2, 6, 12, 20, 32, 60}) {
    Random r(5);
    BoxList boxes;
    for (int i = 0; i < count; ++i) {
      const auto at = [&] {
        return std::pow(10.0f, r.in(-0.5f, 0.5f) * static_cast<float>(decades));
      };
      const Vec3 p{at(), at(), at()};
      boxes.push_back(
          {{p.x * 0.999f, p.y * 0.999f, p.z * 0.999f}, {p.x * 1.001f, p.y * 1.001f, p.z * 1.001f}});
    }
    expect_few(std::to_string(decades), boxes, 4);
  }
}

// Boxes as large as a hundredth of their distance from the centre: no single axis separates those
// in the middle.
TEST(Uneven, DistancesOverDecades) {
  for (const int decades : {2, 6, 12, 20}) {
    Random r(5);
    BoxList boxes;
    for (int i = 0; i < count; ++i) {
      const float out = std::pow(10.0f, r.in(-0.5f, 0.5f) * static_cast<float>(decades));
      const Vec3 at = r.point(-1, 1);
      boxes.push_back(around({at.x * out, at.y * out, at.z * out}, out * 0.01f));
    }
    expect_few(std::to_string(decades), boxes, 150);
  }
}

TEST(Uneven, ClustersFarApart) {
  for (const float gap : {1.0f, 10.0f, 1e2f, 1e3f, 1e4f, 1e5f}) {
    expect_few("two, " + std::to_string(gap), clusters(2, gap), 30);
    expect_few("a twentieth, " + std::to_string(gap), clusters(20, gap), 30);
  }
}

TEST(Uneven, BoxesFarOut) {
  for (const std::uint32_t percent : {1u, 6u, 12u, 30u}) {
    Random r(5);
    BoxList boxes = uniform_boxes(count, 2);
    for (Box& b : boxes)
      if (r.below(100) < percent) b = around(r.point(-1e6f, 1e6f), 0.5f);
    expect_few(std::to_string(percent), boxes, 30);
  }
  BoxList boxes = uniform_boxes(count, 2);
  for (const Box& far : {around({1e5f, 1e5f, 1e5f}, 1), around({1e30f, 1e30f, 1e30f}, 1e28f),
                         Box{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}},
                         Box{{-infinity, -infinity, -1}, {infinity, infinity, 0}}}) {
    boxes[77] = far;
    expect_few("one", boxes, 8);
  }
}

TEST(Uneven, UnboundedAlongAnAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool above : {false, true}) {
      Random r(7);
      BoxList boxes;
      for (int i = 0; i < count; ++i) {
        Box b = cube(r.point(0, 150), 1);
        (&b.lower.x)[axis] = above ? (&b.lower.x)[axis] : -infinity;
        (&b.upper.x)[axis] = infinity;
        boxes.push_back(b);
      }
      expect_few(std::to_string(axis) + (above ? " above" : ""), boxes, 8);
    }
  }
}

TEST(Uneven, Heaps) {
  for (const int heaps : {1, 10, 100}) {
    for (const float width : {1.0f, 4.0f, 8.0f}) {
      Random r(5);
      std::vector<Vec3> at;
      for (int k = 0; k < heaps; ++k) at.push_back(r.point(0, 1000));
      BoxList boxes;
      for (int i = 0; i < count / 3; ++i) {
        const Vec3 p = at[static_cast<std::size_t>(i % heaps)], by = r.point(0, width);
        boxes.push_back(around({p.x + by.x, p.y + by.y, p.z + by.z}, 0.5f));
      }
      expect_few(std::to_string(heaps) + " " + std::to_string(width), boxes, 8);
    }
  }
}

// A heap of static boxes, and some moving boxes far away or just above it: no two of the heap are
// compared.
TEST(Uneven, HeapOfStaticBoxes) {
  for (const float from : {0.0f, 990.0f}) {
    Random r(5);
    BoxList boxes;
    std::vector<std::uint8_t> is_static;
    for (int i = 0; i < count; ++i) {
      is_static.push_back(i % 10 != 0);
      const Vec3 at = r.point(0, 8), mover = r.point(from, from + 30);
      boxes.push_back(i % 10 ? around({1000 + at.x, 1000 + at.y, 1000 + at.z}, 2)
                             : around({mover.x, 1012 + at.y, mover.z}, 0.5f));
    }
    Boxes view = boxes;
    view.filters.is_static = {is_static.data(), is_static.size()};
    expect_few(std::to_string(from), view, 2);
  }
}

// Boxes that no cells separate: rods of three orientations as long as the scene is wide. The bound
// is the present value.
TEST(Uneven, LongRods) {
  Random r(7);
  BoxList boxes;
  for (int i = 0; i < count; ++i) {
    Box b = cube(r.point(0, 200), 0.1f);
    (&b.upper.x)[i % 3] += 130;
    boxes.push_back(b);
  }
  expect_few("three orientations", boxes, 150);
}

// Boxes in one place whose pairs the filters exclude: each two are compared at most once.
TEST(Uneven, ForbiddenInOnePlace) {
  Random r(5);
  BoxList boxes;
  for (int i = 0; i < count / 4; ++i) boxes.push_back(around(r.point(0, 1), 2));
  const std::vector<std::int32_t> owner(boxes.size(), 7);
  const std::vector<std::uint32_t> group(boxes.size(), 1), mask(boxes.size(), 2);
  Boxes view = boxes;
  view.filters.owner = {owner.data(), owner.size()};
  expect_few("owner", view, static_cast<double>(boxes.size()) / 2);
  view = boxes;
  view.filters.group = {group.data(), group.size()};
  view.filters.mask = {mask.data(), mask.size()};
  expect_few("group", view, static_cast<double>(boxes.size()) / 2);
}

}  // namespace
}  // namespace throng::tests
