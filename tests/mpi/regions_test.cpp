// Regions and bisection, without MPI.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "mpi/bisect.hpp"
#include "mpi/minimum_copies.hpp"
#include "mpi/regions.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::mpi {
namespace {

using tests::Random;

std::vector<Point> points_of(const std::vector<Box>& boxes) {
  std::vector<Point> points;
  for (const Box& box : boxes) {
    const KeyBox r = key_box_of(box, 0);
    if (!r.empty()) points.push_back({{r.lower[0], r.lower[1], r.lower[2]}, 1});
  }
  return points;
}

TEST(Keys, AreOrderedLikeFloats) {
  const float inf = tests::infinity;
  const std::vector<float> rising = {-inf, -tests::float_max, -1.5f, -1.0f, -tests::denormal,
                                     0.0f, tests::denormal,   1.0f,  1.5f,  tests::float_max,
                                     inf};
  for (std::size_t i = 1; i < rising.size(); ++i) {
    EXPECT_LT(key_of(rising[i - 1]), key_of(rising[i])) << rising[i];
  }
  for (const float x : rising) EXPECT_EQ(float_of(key_of(x)), x);
  EXPECT_EQ(key_of(-0.0f), key_of(0.0f));
}

// Both boxes of a pair overlap the region of the pair's reference corner; bounds() agrees with
// visit().
TEST(Regions, BothBoxesOverlapThePairsOwner) {
  for (const tests::HardScene& scene : tests::hard_scenes(300)) {
    for (const float margin : {0.0f, 0.1f}) {
      for (const int ranks : {1, 2, 3, 7, 16}) {
        std::vector<Point> points = points_of(scene.boxes);
        const Regions regions = bisect(points.data(), points.size(), ranks);
        std::vector<std::set<int>> reached(scene.boxes.size());
        std::vector<KeyBox> key_boxes;
        for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
          key_boxes.push_back(key_box_of(scene.boxes[i], margin));
          regions.visit(key_boxes[i], [&](int rank) { return reached[i].insert(rank).second; });
          for (int rank = 0; rank < ranks; ++rank) {
            ASSERT_EQ(regions.bounds(rank, rank + 1).meets(key_boxes[i]),
                      reached[i].count(rank) > 0)
                << scene.name << ", box " << i << ", rank " << rank << " of " << ranks;
          }
        }
        for (const Pair pair : tests::reference_pairs(scene.boxes, margin).pairs) {
          Key corner[3];
          for (int k = 0; k < 3; ++k) {
            corner[k] = std::max(key_boxes[pair.first].lower[k], key_boxes[pair.second].lower[k]);
          }
          const int owner = regions.owner_of(corner);
          ASSERT_TRUE(reached[pair.first].count(owner) && reached[pair.second].count(owner))
              << scene.name << ": " << pair.first << ", " << pair.second << " at rank " << owner;
        }
      }
    }
  }
}

TEST(Regions, AnInactiveBoxOverlapsNothing) {
  const float nan = std::nanf("");
  const Box bad[] = {{{1, 0, 0}, {0, 1, 1}}, {{0, nan, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, nan}}};
  for (const Box& box : bad) {
    EXPECT_TRUE(key_box_of(box, 0).empty());
    EXPECT_TRUE(key_box_of(box, 5).empty());
  }
}

TEST(Bisection, BalancesWeightsNotCounts) {
  Random random(3);
  std::vector<Point> points;
  std::uint64_t total = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 at = random.point(-50, 50);
    const std::uint32_t weight = at.x < 0 ? 10 : 1;
    points.push_back({{key_of(at.x), key_of(at.y), key_of(at.z)}, weight});
    total += weight;
  }
  for (const int ranks : {2, 3, 7, 64}) {
    std::vector<std::uint64_t> load(static_cast<std::size_t>(ranks));
    const Regions regions = bisect(points.data(), points.size(), ranks);
    for (const Point& p : points)
      load[static_cast<std::size_t>(regions.owner_of(p.at))] += p.weight;
    const double mean = static_cast<double>(total) / ranks;
    EXPECT_LT(static_cast<double>(*std::max_element(load.begin(), load.end())), 1.03 * mean + 20);
    EXPECT_GT(static_cast<double>(*std::min_element(load.begin(), load.end())), 0.97 * mean - 20);
  }
}

TEST(Bisection, AcceptsNoPointsAndEqualPoints) {
  const Regions none = bisect(nullptr, 0, 5);
  const Key anywhere[3] = {7, -7, 0};
  EXPECT_LT(none.owner_of(anywhere), 5);
  std::vector<Point> same(100, Point{{5, 5, 5}, 3});
  const Regions regions = bisect(same.data(), same.size(), 4);
  EXPECT_LT(regions.owner_of(same[0].at), 4);
}

// Unit boxes at random in a cube.
TEST(Bisection, IsCloseToCubesForUniformBoxes) {
  Random random(8);
  const double side = 100;
  std::vector<Box> boxes;
  for (int i = 0; i < 60000; ++i) boxes.push_back(tests::cube(random.point(0, 100), 1));
  for (const int ranks : {2, 3, 4, 5, 7, 8, 16, 27, 64}) {
    std::vector<Point> points = points_of(boxes);
    const Regions regions = bisect(points.data(), points.size(), ranks);
    std::uint64_t copies = 0;
    for (const Box& box : boxes) {
      int reached = 0;
      regions.visit(key_box_of(box, 0), [&](int) { return ++reached > 0; });
      copies += static_cast<std::uint64_t>(reached - 1);
    }
    EXPECT_LT(static_cast<double>(copies),
              1.3 * minimum_copies(ranks, side) * static_cast<double>(boxes.size()))
        << ranks;
  }
}

}  // namespace
}  // namespace throng::mpi
