// throng_update_boxes: the same bits as the C++ call in each layout, and its errors.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "support/body_scenes.hpp"

namespace throng::tests {
namespace {

class CUpdateBoxes : public testing::Test {
 protected:
  CUpdateBoxes() {
    bodies_.count = scene_.transforms.size();
    bodies_.position = {&scene_.transforms[0].position, sizeof(Transform)};
    bodies_.rotation = {&scene_.transforms[0].rotation, sizeof(Transform)};
    bodies_.displacement.data = scene_.displacements.data();
    bodies_.shape.data = scene_.shape.data();
    bodies_.shapes.data = scene_.shapes.data();
    bodies_.shape_count = scene_.shapes.size();
    bodies_.points.data = scene_.points.data();
    bodies_.point_count = scene_.points.size();
  }
  void TearDown() override { throng_finder_destroy(finder_); }

  throng_status update(float margin = 0) {
    out_.assign(bodies_.count, throng_box{});
    return throng_update_boxes(finder_, &bodies_, margin, out_.data(), 0);
  }
  std::string message() const { return throng_finder_result(finder_)->message; }
  std::vector<Box> written() const {
    std::vector<Box> boxes;
    for (const throng_box& b : out_) {
      boxes.push_back({{b.lower[0], b.lower[1], b.lower[2]}, {b.upper[0], b.upper[1], b.upper[2]}});
    }
    return boxes;
  }

  BodyScene scene_ = body_scene(500, 9);
  throng_bodies bodies_{};
  std::vector<throng_box> out_;
  throng_finder* finder_ = throng_finder_create(nullptr);
};

TEST_F(CUpdateBoxes, SameBitsAsTheCppCall) {
  for (const float margin : {0.0f, 0.25f}) {
    UpdateOptions options;
    options.margin = margin;
    Bodies cpp = scene_.view();
    ASSERT_EQ(update(margin), THRONG_OK) << message();
    EXPECT_TRUE(same_bits(written(), boxes_of(cpp, options)));
    EXPECT_EQ(throng_finder_result(finder_)->written, bodies_.count);
  }
  // Without the optional arrays, one shape for all.
  Bodies cpp = scene_.view();
  cpp.rotation = {};
  cpp.displacement = {};
  cpp.shape = {};
  cpp.shapes.count = 1;
  bodies_.rotation = bodies_.displacement = bodies_.shape = {};
  bodies_.shape_count = 1;
  ASSERT_EQ(update(), THRONG_OK) << message();
  EXPECT_TRUE(same_bits(written(), boxes_of(cpp)));
}

TEST_F(CUpdateBoxes, BoxesInLargerStructs) {
  struct Entity {
    unsigned id;
    throng_box box;
    float mass;
  };
  std::vector<Entity> entities(bodies_.count, {7, {}, 3});
  ASSERT_EQ(throng_update_boxes(finder_, &bodies_, 0, &entities[0].box, sizeof(Entity)), THRONG_OK)
      << message();
  ASSERT_EQ(update(), THRONG_OK);
  for (std::size_t i = 0; i < entities.size(); ++i) {
    EXPECT_EQ(std::memcmp(&entities[i].box, &out_[i], sizeof(throng_box)), 0) << i;
    EXPECT_EQ(entities[i].id, 7u);
    EXPECT_EQ(entities[i].mass, 3);
  }
  // And the search reads them there.
  const throng_boxes packed = throng_boxes_packed(out_.data(), out_.size());
  ASSERT_EQ(throng_find(finder_, &packed, nullptr), THRONG_OK) << message();
  const std::uint64_t found = throng_finder_result(finder_)->found;
  EXPECT_GT(found, 0u);
  const throng_boxes strided =
      throng_boxes_strided(&entities[0].box, entities.size(), sizeof(Entity));
  ASSERT_EQ(throng_find(finder_, &strided, nullptr), THRONG_OK) << message();
  EXPECT_EQ(throng_finder_result(finder_)->found, found);
}

// The caller's threads, some of them; a stop; an instruction set.
TEST_F(CUpdateBoxes, OptionsOfTheFinder) {
  struct Host {
    throng_finder* stops = nullptr;
    unsigned tasks = 0;
  } host;
  throng_options options;
  throng_options_init(&options);
  options.concurrency = 3;
  options.run_self = &host;
  options.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    Host& h = *static_cast<Host*>(self);
    h.tasks = count;
    throng_finder_stop(h.stops);
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  options.stoppable = 1;
  const auto with_options = [&] {
    throng_finder_destroy(finder_);
    finder_ = throng_finder_create(&options);
  };
  scene_ = body_scene(20000, 9);
  bodies_.count = scene_.transforms.size();
  bodies_.position.data = &scene_.transforms[0].position;
  bodies_.rotation.data = &scene_.transforms[0].rotation;
  bodies_.displacement.data = scene_.displacements.data();
  bodies_.shape.data = scene_.shape.data();
  bodies_.shapes.data = scene_.shapes.data();
  bodies_.points.data = scene_.points.data();
  for (const unsigned threads : {0u, 2u}) {
    options.threads = threads;
    with_options();
    ASSERT_EQ(update(), THRONG_OK) << message();
    EXPECT_EQ(host.tasks, threads == 0 ? 3u : threads);
    EXPECT_TRUE(same_bits(written(), boxes_of(scene_.view())));
  }
  host.stops = finder_;
  EXPECT_EQ(update(), THRONG_STOPPED);
  host.stops = nullptr;
  EXPECT_EQ(update(), THRONG_OK);
#if defined(__x86_64__) || defined(_M_X64)
  options.isa = THRONG_ISA_NEON;
#else
  options.isa = THRONG_ISA_AVX2;
#endif
  with_options();
  EXPECT_EQ(update(), THRONG_UNSUPPORTED_ISA);
}

TEST_F(CUpdateBoxes, Errors) {
  EXPECT_EQ(throng_update_boxes(nullptr, &bodies_, 0, nullptr, 0), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_update_boxes(finder_, nullptr, 0, nullptr, 0), THRONG_BAD_BOXES);
  EXPECT_NE(message().find("bodies"), std::string::npos) << message();
  EXPECT_EQ(throng_update_boxes(finder_, &bodies_, 0, nullptr, 0), THRONG_BAD_BODIES);
  EXPECT_NE(message(), "");
  EXPECT_EQ(update(-1), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("margin"), std::string::npos) << message();
  throng_bodies given = bodies_;
  bodies_.position.data = nullptr;
  EXPECT_EQ(update(), THRONG_BAD_BODIES);
  EXPECT_NE(message().find("position"), std::string::npos) << message();
  bodies_ = given;
  bodies_.rotation.stride_bytes = 30;
  EXPECT_EQ(update(), THRONG_BAD_BODIES);
  EXPECT_NE(message().find("rotation"), std::string::npos) << message();
  bodies_ = given;
  scene_.shapes[scene_.shape[3]].radius = -1;
  EXPECT_EQ(update(), THRONG_BAD_SHAPE);
  const throng_result r = *throng_finder_result(finder_);
  EXPECT_LE(r.first_invalid, 3u);
  EXPECT_GE(r.invalid_count, 1u);
  EXPECT_TRUE(std::isnan(out_[3].lower[0]));
  // Zeros: nothing.
  bodies_ = {};
  EXPECT_EQ(update(), THRONG_OK) << message();
  EXPECT_EQ(throng_finder_result(finder_)->written, 0u);
}

}  // namespace
}  // namespace throng::tests
