// The contents of each scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/scenes/scene.hpp"
#include "scene_density.hpp"

namespace throng::scenes {
namespace {

TEST(Mixed, SizesAreLogUniform) {
  const Scene scene(spec_of("mixed", 20001));
  const std::vector<Box> boxes = frame_of(scene, 0);
  int below_ten = 0, on_ground = 0;
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    const float size = boxes[i].upper.z - boxes[i].lower.z;
    ASSERT_TRUE(size > 0.999f && size < 100.001f) << size;
    below_ten += size < 10;
    on_ground += boxes[i].lower.z <= boxes[0].upper.z;
    EXPECT_TRUE(boxes[i].lower.x > boxes[0].lower.x && boxes[i].upper.x < boxes[0].upper.x &&
                boxes[i].lower.y > boxes[0].lower.y && boxes[i].upper.y < boxes[0].upper.y);
  }
  EXPECT_NEAR(below_ten, 10000, 20);
  EXPECT_NEAR(on_ground, 400, 80);
}

TEST(Rods, AreLongAndUniformlyOriented) {
  int along[3] = {0, 0, 0};
  for (const Box& b : frame_of(Scene(spec_of("rods", 3000)), 0)) {
    const float s[3] = {b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z};
    for (int k = 0; k < 3; ++k) {
      if (s[k] < 63) continue;
      ++along[k];
      EXPECT_NEAR(s[(k + 1) % 3] + s[(k + 2) % 3], 2, 1e-3);
    }
  }
  for (int n : along) EXPECT_NEAR(n, 1000, 10);
  // If uniform over the sphere, each |component| of the direction is uniform over [0, 1].
  double mean[3] = {0, 0, 0};
  for (const Box& b : frame_of(Scene(spec_of("rods-any", 10000)), 0)) {
    const float s[3] = {b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z};
    for (int k = 0; k < 3; ++k) mean[k] += s[k] / 10000;
  }
  for (double m : mean) EXPECT_NEAR(m, 32 + 3.14159 / 4, 0.8);
}

TEST(Rectangles, HaveSixOrientations) {
  int ways[3][3] = {};
  for (const Box& b : frame_of(Scene(spec_of("rectangles", 6000)), 60)) {
    const float s[3] = {b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z};
    int of[3];  // the axis of the sides 1, 2 and 4
    for (int k = 0; k < 3; ++k) of[std::lround(s[k]) == 4 ? 2 : std::lround(s[k]) - 1] = k;
    EXPECT_NEAR(s[of[0]], 1, 1e-3);
    EXPECT_NEAR(s[of[1]], 2, 1e-3);
    EXPECT_NEAR(s[of[2]], 4, 1e-3);
    ++ways[of[2]][of[1]];
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(ways[a][b], a == b ? 0 : 1000, 10) << a << b;
  }
}

TEST(Nbody, FourConesStandUnderSpheres) {
  for (std::size_t n : {1, 2, 3, 4, 5, 3000}) {
    const Scene scene(spec_of("nbody", n));
    const std::vector<Box> first = frame_of(scene, 0), later = frame_of(scene, 60);
    bool quadrants[2][2] = {};
    for (std::size_t i = 0; i < n; ++i) {
      const Box& b = later[i];
      const float size = i < 4 ? 4 : 1;
      EXPECT_NEAR(b.upper.x - b.lower.x, size, 1e-4) << i;
      EXPECT_NEAR(b.upper.y - b.lower.y, size, 1e-4) << i;
      EXPECT_NEAR(b.upper.z - b.lower.z, size, 1e-4) << i;
      EXPECT_GE(b.lower.z, 0) << i;
      EXPECT_LE(std::max({b.upper.x, b.upper.y, -b.lower.x, -b.lower.y, b.upper.z / 2}),
                scene.side() / 2 + 1e-4)
          << i;
      if (i >= 4) continue;
      EXPECT_TRUE(same_bits(first[i], b) && !scene.moves(i)) << i;
      EXPECT_EQ(b.lower.z, 0) << i;
      bool& quadrant = quadrants[b.lower.x + b.upper.x > 0][b.lower.y + b.upper.y > 0];
      EXPECT_FALSE(quadrant) << "two cones in one quadrant";
      quadrant = true;
      EXPECT_TRUE(n < 1000 || b.lower.x * b.upper.x > 0) << "cones meet in the middle";
    }
  }
  // The cones count: among few boxes their share of the pairs is noticeable.
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Spec spec = spec_of("nbody", 200);
    spec.seed = seed;
    sum += pairs_per_box(Scene(spec), 0) / 40;
  }
  EXPECT_NEAR(sum, 1, 0.05);
}

TEST(Spheres, HaveThreeSizes) {
  int of_size[5] = {};
  for (const Box& b : frame_of(Scene(spec_of("spheres", 10000)), 0)) {
    const float s = b.upper.x - b.lower.x;
    ++of_size[static_cast<int>(std::lround(s))];
    EXPECT_NEAR(b.upper.y - b.lower.y, s, 1e-4);
  }
  EXPECT_NEAR(of_size[1], 6000, 10);
  EXPECT_NEAR(of_size[2], 3000, 10);
  EXPECT_NEAR(of_size[4], 1000, 10);
}

TEST(Clusters, AreSmallInALargeWorld) {
  const Scene scene(spec_of("clusters", 10000));
  const std::vector<Box> boxes = frame_of(scene, 60);
  double volume = 0;
  for (std::size_t c = 0; c < 100; ++c) {
    float low = INFINITY, high = -INFINITY;
    for (std::size_t i = c; i < boxes.size(); i += 100) {
      low = std::min(low, boxes[i].lower.x);
      high = std::max(high, boxes[i].upper.x);
    }
    volume += std::pow(high - low, 3.0);
  }
  EXPECT_LT(volume, 0.001 * std::pow(scene.side(), 3));
}

TEST(Line, IsOne) {
  for (const Box& b : frame_of(Scene(spec_of("line", 1000)), 60)) {
    EXPECT_TRUE(b.lower.y == 0 && b.upper.y == 1 && b.lower.z == 0 && b.upper.z == 1);
  }
}

TEST(Worlds, Have64BoxesInOnePlace) {
  const Scene scene(spec_of("worlds", 8192 * 64));
  ASSERT_TRUE(scene.has_worlds());
  for (std::size_t i = 0; i < scene.size(); i += 63) {
    ASSERT_EQ(scene.world(i), static_cast<std::int32_t>(i / 64));
  }
  EXPECT_LT(scene.side(), 10);
  for (const std::string& name : names()) {
    if (name == "worlds") continue;
    const Scene other(spec_of(name, 10));
    EXPECT_FALSE(other.has_worlds()) << name;
    EXPECT_EQ(other.world(3), -1) << name;
  }
}

TEST(Pile, IsDenserBelowAndNarrowerAbove) {
  const Scene scene(spec_of("pile", 20000));
  const double height = scene.side();
  int low = 0, high = 0;
  float breadth_low = 0, breadth_high = 0;
  for (const Box& b : frame_of(scene, 0)) {
    (b.lower.z < height / 2 ? low : high) += 1;
    if (b.lower.z < height / 10) breadth_low = std::max(breadth_low, b.upper.x);
    if (b.lower.z > height * 9 / 10) breadth_high = std::max(breadth_high, b.upper.x);
  }
  EXPECT_GT(low, high * 1.3);
  EXPECT_LT(breadth_high, 0.85f * breadth_low);
}

TEST(Column, FallsOntoThePlaneAndComesToRest) {
  const Scene scene(spec_of("column", 20000));
  EXPECT_EQ(pairs_per_box(scene, 0), 0);
  EXPECT_FALSE(scene.moves(0));
  double top_before = INFINITY;
  for (std::size_t f = 0; f <= 140; f += 10) {
    const std::vector<Box> boxes = frame_of(scene, f);
    double top = 0;
    for (std::size_t i = 1; i < boxes.size(); ++i) {
      ASSERT_GE(boxes[i].lower.z, boxes[0].upper.z) << "box " << i << " under the plane at " << f;
      ASSERT_LT(std::fabs(boxes[i].lower.x), boxes[0].upper.x - 1);
      ASSERT_LT(std::fabs(boxes[i].lower.y), boxes[0].upper.y - 1);
      top = std::max(top, double{boxes[i].upper.z});
    }
    EXPECT_LE(top, top_before) << f;
    top_before = top;
    EXPECT_LT(pairs_per_box(scene, f), 3.5) << f;
  }
  EXPECT_TRUE(same_bits(frame_of(scene, 130), frame_of(scene, 1000)));
  EXPECT_LT(top_before, scene.side() / 3);
  EXPECT_NEAR(pairs_per_box(scene, 130), 3, 0.5);
}

TEST(Column, MovesContinuously) {
  const Scene scene(spec_of("column", 5000));
  std::vector<Box> before = frame_of(scene, 0);
  for (std::size_t f = 1; f < 130; ++f) {
    const std::vector<Box> now = frame_of(scene, f);
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double dx = now[i].lower.x - before[i].lower.x, dy = now[i].lower.y - before[i].lower.y,
                   dz = now[i].lower.z - before[i].lower.z;
      ASSERT_LT(dx * dx + dy * dy + dz * dz, 16) << "box " << i << " at frame " << f;
    }
    before = now;
  }
}

}  // namespace
}  // namespace throng::scenes
