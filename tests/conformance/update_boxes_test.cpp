// Boxes of bodies through the public API: exact for every shape, the same bits for every
// instruction set and thread count, in every layout, in any floating-point state.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "support/body_scenes.hpp"
#include "support/configs.hpp"
#include "support/modified_float_state.hpp"

namespace throng::tests {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

TEST(UpdateBoxes, EveryShapeIsContainedTightly) {
  const BodyScene scene = body_scene(20000, 1);
  for (const float margin : {0.0f, 0.125f}) {
    UpdateOptions options;
    options.margin = margin;
    const std::vector<Box> boxes = boxes_of(scene.view(), options);
    Tightness seen;
    std::size_t inactive = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const OneBody body = scene.body(i, margin);
      if (body.shape.kind == ShapeKind::convex && body.shape.point_count == 0) {
        EXPECT_EQ(boxes[i].lower.x, inf);
        EXPECT_EQ(boxes[i].upper.x, -inf);
        ++inactive;
        continue;
      }
      expect_tight(boxes[i], exact_box(body, scene.points), seen);
      if (HasFatalFailure()) FAIL() << "body " << i;
    }
    EXPECT_GT(inactive, 0u);
    // Zero-size shapes lie on floats, where the outward step is unavoidable.
    EXPECT_GT(seen.tightest, seen.sides / 100 * 95);
  }
}

TEST(UpdateBoxes, SameBitsEverywhere) {
  for (const std::size_t count : {0, 1, 63, 64, 65, 4096, 20011}) {
    const BodyScene scene = body_scene(count, 2 + count);
    for (int form = 0; form < 6; ++form) {
      Bodies bodies = scene.view();
      if (form & 1) bodies.rotation = {};
      if (form & 2) bodies.displacement = {};
      if (form & 4) {
        bodies.shape = {};
        bodies.shapes = {&scene.shapes[form == 4 ? 1 : 4], 1};
      }
      // One body per call: the scalar path, or a block of one.
      UpdateOptions plain;
      plain.isa = Isa::scalar;
      plain.threads = 1;
      const std::vector<Box> want = boxes_of(bodies, plain);
      for (std::size_t i = 0; i < count; i += 97) {
        Bodies one = bodies;
        one.position = {&bodies.position[i], 1};
        if (one.rotation) one.rotation = {&bodies.rotation[i], 1};
        if (one.displacement) one.displacement = {&bodies.displacement[i], 1};
        if (one.shape) one.shape = {&bodies.shape[i], 1};
        ASSERT_TRUE(same_bits(boxes_of(one, plain), {want[i]})) << i;
      }
      for (const Isa isa : supported_isas()) {
        for (const unsigned threads : {1u, 2u, 5u}) {
          UpdateOptions options;
          options.isa = isa;
          options.threads = threads;
          EXPECT_TRUE(same_bits(boxes_of(bodies, options), want))
              << count << " bodies, form " << form << ", " << to_string(isa) << ", " << threads;
        }
      }
    }
  }
}

// FNV-1a over the bits, in 32-bit words.
std::uint64_t checksum(const std::vector<Box>& boxes) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  for (const Box& b : boxes) {
    std::uint32_t words[6];
    std::memcpy(words, &b, sizeof words);
    for (const std::uint32_t word : words) sum = (sum ^ word) * 0x100000001b3u;
  }
  return sum;
}

// For every compiler and processor, too: the number is from GCC 12 on x86-64, without vectors.
TEST(UpdateBoxes, SameBitsOnEveryMachine) {
  EXPECT_EQ(checksum(boxes_of(body_scene(20000, 10).view())), 675090157258462416u);
}

TEST(UpdateBoxes, AnyLayout) {
  const BodyScene scene = body_scene(9000, 3);
  const std::vector<Box> want = boxes_of(scene.view());
  struct Thing {
    std::uint32_t before, shape;
    Transform transform;
    Vec3 displacement;
    Box box;
    float after;
  };
  std::vector<Thing> things(9000);
  std::vector<Shape> own(9000);
  for (std::size_t i = 0; i < things.size(); ++i) {
    things[i] = {7, scene.shape[i], scene.transforms[i], scene.displacements[i], {}, 8};
    own[i] = scene.shapes[scene.shape[i]];
  }
  Bodies bodies(&things[0].transform, things.size(), scene.shapes.data(), scene.shapes.size(),
                sizeof(Thing));
  bodies.displacement = {&things[0].displacement, things.size(), sizeof(Thing)};
  bodies.shape = {&things[0].shape, things.size(), sizeof(Thing)};
  struct Padded {
    Vec3 point;
    float unused;
  };
  std::vector<Padded> points;
  for (const Vec3& p : scene.points) points.push_back({p, quiet});
  bodies.points = {&points[0].point, points.size(), sizeof(Padded)};
  ASSERT_TRUE(update_boxes(bodies, &things[0].box, {}, sizeof(Thing)).ok());
  for (std::size_t i = 0; i < things.size(); ++i) {
    ASSERT_EQ(std::memcmp(&things[i].box, &want[i], sizeof(Box)), 0) << i;
    ASSERT_EQ(things[i].before, 7u);
    ASSERT_EQ(things[i].shape, scene.shape[i]);
    ASSERT_EQ(things[i].after, 8);
  }
  // One shape per body, without indices.
  bodies.shape = {};
  bodies.shapes = {own.data(), own.size()};
  EXPECT_TRUE(same_bits(boxes_of(bodies), want));
  // A stride of 0 repeats one value.
  Bodies repeated = bodies;
  repeated.position = {scene.view().position.data, 100, 0};
  repeated.rotation = {scene.view().rotation.data, 100, 0};
  repeated.displacement = {scene.displacements.data(), 100, 0};
  repeated.shapes = {own.data(), 100, 0};
  EXPECT_TRUE(same_bits(boxes_of(repeated), std::vector<Box>(100, want[0])));
}

TEST(UpdateBoxes, ConvexOfCornersIsTheBox) {
  BodyScene scene = body_scene(500, 4);
  scene.points.clear();
  for (int k = 0; k < 8; ++k)
    scene.points.push_back({k & 1 ? 1.f : -1.f, k & 2 ? 2.f : -2.f, k & 4 ? 3.f : -3.f});
  scene.shapes = {Shape::box({1, 2, 3}), Shape::convex(0, 8), Shape::convex(3, 1),
                  Shape::sphere(0, scene.points[3])};
  const std::vector<std::uint32_t> box(500, 0), hull(500, 1), point(500, 2), sphere(500, 3);
  std::vector<Box> boxes[4];
  for (const auto* which : {&box, &hull, &point, &sphere}) {
    scene.shape = *which;
    boxes[(*which)[0]] = boxes_of(scene.view());
  }
  // The bound is larger for the hull, as |v| counts twice: floats do not show it.
  EXPECT_TRUE(same_bits(boxes[0], boxes[1]));
  EXPECT_TRUE(same_bits(boxes[2], boxes[3]));
}

// A caller's rounding mode and flushing have no effect, and are restored.
TEST(UpdateBoxes, AnyFloatState) {
  BodyScene scene = body_scene(10000, 5);
  for (std::size_t i = 0; i < scene.transforms.size(); i += 2) {
    Vec3& p = scene.transforms[i].position;  // denormal
    p = {p.x * 1e-42f, p.y * 1e-42f, p.z * 1e-42f};
  }
  const std::vector<Box> want = boxes_of(scene.view());
  for (const int rounding : {FE_DOWNWARD, FE_UPWARD, FE_TOWARDZERO, FE_TONEAREST}) {
    for (const bool flush : {true, false}) {
      for (const unsigned threads : {1u, 3u}) {
        std::vector<Box> got(want.size());
        UpdateOptions options;
        options.threads = threads;
        bool unchanged = false;
        UpdateOptions negative;
        negative.margin = -1e-45f;
        Result refused;
        {
          const ModifiedFloatState state(rounding, flush);
          (void)update_boxes(scene.view(), got.data(), options);
          refused = update_boxes(scene.view(), got.data(), negative);
          unchanged = state.unchanged();
        }
        EXPECT_TRUE(unchanged);
        EXPECT_EQ(refused.status, Status::bad_option);
        EXPECT_TRUE(same_bits(got, want)) << rounding << flush << threads;
      }
    }
  }
}

// Non-finite input gives a NaN box, and find_pairs names the body.
TEST(UpdateBoxes, NotFiniteIsSeen) {
  for (const float bad : {quiet, inf, -inf}) {
    for (int where = 0; where < 16; ++where) {
      BodyScene scene = body_scene(100, 6);
      scene.points = {{1, 2, 3}, {-1, -2, -3}, {3, 1, -2}};
      scene.shapes = {Shape::sphere(0), Shape::sphere(1), Shape::box({1, 2, 3}, {1, 1, 1}),
                      Shape::convex(0, 3)};
      scene.shape.assign(100, 0);
      for (std::uint32_t shape = 0; shape < 4; ++shape) {
        BodyScene broken = scene;
        broken.shape[70] = shape;
        Transform& t = broken.transforms[70];
        float* const place[16] = {&t.position.x,
                                  &t.position.y,
                                  &t.position.z,
                                  &t.rotation.x,
                                  &t.rotation.y,
                                  &t.rotation.z,
                                  &t.rotation.w,
                                  &broken.displacements[70].x,
                                  &broken.displacements[70].y,
                                  &broken.displacements[70].z,
                                  &broken.shapes[2].center.x,
                                  &broken.shapes[2].center.y,
                                  &broken.shapes[2].center.z,
                                  &broken.points[0].x,
                                  &broken.points[1].y,
                                  &broken.points[2].z};
        if ((where >= 13) != (shape == 3) && where >= 10) continue;
        if (where >= 10 && where < 13 && shape != 2) continue;
        *place[where] = bad;
        const std::vector<Box> boxes = boxes_of(broken.view());
        EXPECT_TRUE(has_nan(boxes[70])) << bad << " at " << where << ", shape " << shape;
        Finder finder;
        const Result r = finder.find(boxes);
        EXPECT_EQ(r.status, Status::nan_box);
        EXPECT_EQ(r.first_invalid, 70u);
        EXPECT_EQ(r.invalid_count, 1u);
      }
    }
  }
}

// A sphere shared by all bodies takes a shorter path, which only checks that rotations are finite:
// the bits are those of the general path, which one shape per body takes.
TEST(UpdateBoxes, SharedSpheresGiveTheSameBits) {
  BodyScene scene = body_scene(1000, 9);
  const std::vector<Shape> each(1000, Shape::sphere(0.75f));
  float* const broken[4] = {&scene.transforms[70].rotation.x, &scene.transforms[333].rotation.y,
                            &scene.transforms[512].rotation.z, &scene.transforms[999].rotation.w};
  for (const float bad : {0.0f, quiet, inf, -inf, 3e38f}) {
    for (float* const at : broken) *at = bad;
    for (const bool displaced : {false, true}) {
      Bodies own = scene.view();
      own.shape = {};
      if (!displaced) own.displacement = {};
      Bodies shared = own;
      own.shapes = {each.data(), each.size()};
      shared.shapes = {each.data(), 1};
      const std::vector<Box> want = boxes_of(own), got = boxes_of(shared);
      for (std::size_t i = 0; i < want.size(); ++i) {
        ASSERT_EQ(has_nan(want[i]), has_nan(got[i])) << i << " " << bad;
        if (!has_nan(want[i])) {
          ASSERT_EQ(std::memcmp(&want[i], &got[i], sizeof(Box)), 0) << i << " " << bad;
        }
      }
      EXPECT_EQ(has_nan(got[333]), !std::isfinite(bad)) << bad;
    }
  }
}

}  // namespace
}  // namespace throng::tests
