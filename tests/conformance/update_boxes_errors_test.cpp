// Boxes of bodies: rejected inputs and their messages.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "support/body_scenes.hpp"
#include "support/configs.hpp"

namespace throng::tests {
namespace {

constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

// An invalid shape affects only its own body.
TEST(UpdateBoxes, WrongShapesAreNamed) {
  const BodyScene scene = body_scene(20000, 7);
  const std::vector<Box> want = boxes_of(scene.view());
  struct Wrong {
    Shape shape;
    const char* said;
  };
  const auto some = static_cast<std::uint32_t>(scene.points.size());
  Shape strange = Shape::sphere(1);
  strange.kind = static_cast<ShapeKind>(9);
  for (const Wrong& wrong : std::vector<Wrong>{
           {Shape::sphere(-1), "radius -1; it must be 0 or more"},
           {Shape::sphere(quiet), "radius nan"},
           {Shape::convex(0, 1, -2), "radius -2"},
           {Shape::box({1, -3, 1}), "half extents 1 -3 1; they must be 0 or more"},
           {Shape::box({1, 1, quiet}), "half extents 1 1 nan"},
           {Shape::convex(some, 1), "points 60 to 60 of 60; fix the range or give more"},
           {Shape::convex(0xffffffffu, 2), "points 4294967295 to 4294967296 of 60"},
           {strange, "kind 9; it must be a ShapeKind"}}) {
    BodyScene broken = scene;
    broken.shapes.push_back(wrong.shape);
    const auto index = static_cast<std::uint32_t>(broken.shapes.size() - 1);
    for (const std::size_t i : {19999, 12345, 4100}) broken.shape[i] = index;
    for (const unsigned threads : {1u, 4u}) {
      UpdateOptions options;
      options.threads = threads;
      std::vector<Box> boxes(want.size());
      const Result r = update_boxes(broken.view(), boxes.data(), options);
      EXPECT_EQ(r.status, Status::bad_shape);
      EXPECT_EQ(r.first_invalid, 4100u);
      EXPECT_EQ(r.invalid_count, 3u);
      EXPECT_EQ(r.written, want.size());
      EXPECT_NE(std::strstr(r.message, wrong.said), nullptr) << r.message;
      EXPECT_NE(std::strstr(r.message, "3 bodies"), nullptr) << r.message;
      EXPECT_NE(std::strstr(r.message, "body 4100: shape 100"), nullptr) << r.message;
      for (std::size_t i = 0; i < want.size(); ++i) {
        if (broken.shape[i] == index) {
          const float all[6] = {boxes[i].lower.x, boxes[i].lower.y, boxes[i].lower.z,
                                boxes[i].upper.x, boxes[i].upper.y, boxes[i].upper.z};
          for (const float x : all) EXPECT_TRUE(std::isnan(x));
        } else {
          ASSERT_EQ(std::memcmp(&boxes[i], &want[i], sizeof(Box)), 0) << i;
        }
      }
    }
  }
  BodyScene broken = scene;
  broken.shape[3] = 100;
  std::vector<Box> boxes(want.size());
  Result r = update_boxes(broken.view(), boxes.data());
  EXPECT_EQ(r.status, Status::bad_shape);
  EXPECT_STREQ(
      r.message,
      "1 bodies have an invalid shape, the first is body 3 with shape 100 of 100; use 0 to "
      "one less than that");
  // One invalid shape for all bodies.
  const Shape negative = Shape::sphere(-1);
  r = update_boxes(Bodies(scene.transforms.data(), 100, &negative, 1), boxes.data());
  EXPECT_EQ(r.status, Status::bad_shape);
  EXPECT_EQ(r.invalid_count, 100u);
  EXPECT_TRUE(has_nan(boxes[99]));
}

struct Refusal {
  const char* name;
  Status status;
  const char* said;
  void (*spoil)(Bodies&, Box*& out, UpdateOptions&, std::size_t& stride);
};

TEST(UpdateBoxes, Refusals) {
  const BodyScene scene = body_scene(10, 8);
  const std::vector<Refusal> refusals = {
    {"null positions", Status::bad_bodies, "'position' has 10 values but is null",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.position.data = nullptr; }},
    {"null rotations", Status::bad_bodies, "'rotation' has 10 values but is null",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.rotation.data = nullptr; }},
    {"few rotations", Status::bad_bodies, "'rotation' has 9 values for 10 bodies",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.rotation.count = 9; }},
    {"few displacements", Status::bad_bodies, "'displacement' has 1 values for 10 bodies",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.displacement.count = 1; }},
    {"many indices", Status::bad_bodies, "'shape' has 11 values for 10 bodies",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.shape.count = 11; }},
    {"null shapes", Status::bad_bodies, "'shapes' has 100 values but is null",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.shapes.data = nullptr; }},
    {"null points", Status::bad_bodies, "'points' has 60 values but is null",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.points.data = nullptr; }},
    {"odd stride", Status::bad_bodies, "the stride of 'points' is 13 bytes",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.points.stride_bytes = 13; }},
    {"neither one nor all", Status::bad_bodies, "there are 100 shapes for 10 bodies",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.shape = {}; }},
    {"no shapes", Status::bad_bodies, "there are 0 shapes for 10 bodies",
     [](Bodies& b, Box*&, UpdateOptions&, std::size_t&) { b.shape = {}, b.shapes = {}; }},
    {"null boxes", Status::bad_bodies, "provide space for 10 boxes",
     [](Bodies&, Box*& out, UpdateOptions&, std::size_t&) { out = nullptr; }},
    {"narrow boxes", Status::bad_bodies, "the stride of the boxes is 20 bytes",
     [](Bodies&, Box*&, UpdateOptions&, std::size_t& stride) { stride = 20; }},
    {"odd boxes", Status::bad_bodies, "the stride of the boxes is 26 bytes",
     [](Bodies&, Box*&, UpdateOptions&, std::size_t& stride) { stride = 26; }},
    {"negative margin", Status::bad_option, "the margin is -1",
     [](Bodies&, Box*&, UpdateOptions& o, std::size_t&) { o.margin = -1; }},
    {"infinite margin", Status::bad_option, "the margin is inf",
     [](Bodies&, Box*&, UpdateOptions& o, std::size_t&) {
       o.margin = std::numeric_limits<float>::infinity();
     }},
#if !defined(__aarch64__)
    {"foreign instruction set", Status::unsupported_isa, "instruction set 'neon'",
     [](Bodies&, Box*&, UpdateOptions& o, std::size_t&) { o.isa = Isa::neon; }},
#endif
  };
  for (const Refusal& refusal : refusals) {
    SCOPED_TRACE(refusal.name);
    Bodies bodies = scene.view();
    std::vector<Box> boxes(20, Box{{1, 2, 3}, {4, 5, 6}});
    Box* out = boxes.data();
    UpdateOptions options;
    std::size_t stride = sizeof(Box);
    refusal.spoil(bodies, out, options, stride);
    const Result r = update_boxes(bodies, out, options, stride);
    EXPECT_EQ(r.status, refusal.status);
    EXPECT_NE(std::strstr(r.message, refusal.said), nullptr) << r.message;
    EXPECT_EQ(r.written, 0u);
    for (const Box& b : boxes) EXPECT_EQ(b.lower.x, 1) << "something was written";
  }
  EXPECT_TRUE(update_boxes(Bodies(), nullptr).ok());
  EXPECT_STREQ(to_string(Status::bad_bodies), "bad bodies");
  EXPECT_STREQ(to_string(Status::bad_shape), "bad shape");
}

// An executor that cannot start all its tasks: the caller does the rest.
TEST(UpdateBoxes, ExecutorThatFails) {
  const BodyScene scene = body_scene(30000, 9);
  Executor executor;
  executor.concurrency = 3;
  executor.run = [](void*, unsigned, void (*)(void*, unsigned), void*) { throw std::bad_alloc(); };
  UpdateOptions options;
  options.executor = &executor;
  EXPECT_TRUE(same_bits(boxes_of(scene.view(), options), boxes_of(scene.view())));
}

}  // namespace
}  // namespace throng::tests
