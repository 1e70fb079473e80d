// The C API of candidates for contact: those of the C++ API, and its errors.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <throng/contact.hpp>

#include "support/random.hpp"

namespace throng::tests {
namespace {

using Found = std::vector<Pair>;

class CContact : public testing::Test {
 protected:
  void SetUp() override {
    constexpr std::uint32_t n = 12;
    Random random(11);
    for (std::uint32_t i = 0; i < n * n; ++i) {
      const DoubleVec3 p = {static_cast<double>(i % n), static_cast<double>(i / n),
                            static_cast<double>(random.in(-1, 1))};
      start_.push_back(p);
      end_.push_back({p.x + static_cast<double>(random.in(-1, 1)), p.y, -p.z});
      float_start_.push_back(
          {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
      group_.push_back(1u << i % 3);
      mask_.push_back(i % 2 ? 7 : 3);
    }
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      for (std::uint32_t j = 0; j + 1 < n; ++j) {
        const std::uint32_t a = i * n + j;
        edges_.push_back({a, a + 1});
        edges_.push_back({a, a + n});
        edges_.push_back({a, a + n + 1});
        faces_.push_back({a, a + 1, a + n + 1});
        faces_.push_back({a, a + n + 1, a + n});
      }
    }
    c_.start = {start_.size(), nullptr, &start_[0].x, 0};
    c_.end = {end_.size(), nullptr, &end_[0].x, 0};
    c_.edges = {edges_.size(), &edges_[0].a, 0};
    c_.faces = {faces_.size(), &faces_[0].a, 0};
    cpp_.start = start_;
    cpp_.end = end_;
    cpp_.edges = {edges_.data(), edges_.size()};
    cpp_.faces = {faces_.data(), faces_.size()};
    throng_options_init(&options_);
    options_.order = THRONG_ORDER_CANONICAL;
  }
  void TearDown() override { throng_contact_finder_destroy(finder_); }

  throng_contact_finder* finder() {
    if (!finder_) finder_ = throng_contact_finder_create(&options_);
    return finder_;
  }
  const throng_result& result() { return *throng_contact_finder_result(finder_); }
  std::string message() { return result().message; }
  Found list(const throng_pair* (*get)(const throng_contact_finder*, size_t*)) {
    size_t count = 0;
    const throng_pair* const pairs = get(finder_, &count);
    EXPECT_EQ(get(finder_, nullptr), pairs);
    Found found;
    for (size_t i = 0; i < count; ++i) found.push_back({pairs[i].first, pairs[i].second});
    return found;
  }
  // Returns the number of candidates.
  std::size_t compare(double radius) {
    Options options;
    options.order = Order::canonical;
    const ContactCandidates want = find_contact_candidates(cpp_, radius, options);
    EXPECT_EQ(throng_contact_finder_find(finder(), &c_, radius), THRONG_OK) << message();
    EXPECT_EQ(list(throng_contact_finder_vertex_face), want.vertex_face);
    EXPECT_EQ(list(throng_contact_finder_edge_edge), want.edge_edge);
    EXPECT_EQ(list(throng_contact_finder_edge_vertex), want.edge_vertex);
    const std::size_t all =
        want.vertex_face.size() + want.edge_edge.size() + want.edge_vertex.size();
    EXPECT_EQ(result().found, all);
    return all;
  }

  std::vector<DoubleVec3> start_, end_;
  std::vector<Vec3> float_start_;
  std::vector<Edge> edges_;
  std::vector<Triangle> faces_;
  std::vector<std::uint32_t> group_, mask_;
  throng_contact_mesh c_{};
  ContactMesh cpp_;
  throng_options options_;
  throng_contact_finder* finder_ = nullptr;
};

TEST_F(CContact, GivesTheCandidatesOfTheCppApi) {
  const std::size_t moving = compare(0.25);
  EXPECT_GT(moving, 1000u);
  EXPECT_GT(throng_contact_finder_memory_bytes(finder_), 0u);
  EXPECT_GT(compare(0.5), moving);
  c_.rings = cpp_.rings = 2;
  EXPECT_LT(compare(0.25), moving);
  c_.rings = cpp_.rings = 0;
  c_.group = {group_.data(), 0};
  c_.mask = {mask_.data(), sizeof(std::uint32_t)};
  cpp_.group = {group_.data(), group_.size()};
  cpp_.mask = {mask_.data(), mask_.size()};
  EXPECT_LT(compare(0.25), moving);
  c_.group = c_.mask = {};
  cpp_.group = cpp_.mask = {};
  c_.dimension = cpp_.dimension = 2;
  compare(0.25);
  EXPECT_FALSE(list(throng_contact_finder_edge_vertex).empty());
  c_.dimension = cpp_.dimension = 3;
  EXPECT_EQ(compare(0.25), moving);
}

TEST_F(CContact, FloatsThatDoNotMove) {
  c_.start = {float_start_.size(), &float_start_[0].x, nullptr, sizeof(Vec3)};
  c_.end = {};
  cpp_.start = float_start_;
  cpp_.end = {};
  EXPECT_GT(compare(0.25), 100u);
}

TEST_F(CContact, Errors) {
  const throng_contact_mesh good = c_;
  const auto expect_refused = [&](throng_status status, const char* text) {
    EXPECT_EQ(throng_contact_finder_find(finder(), &c_, 0.25), status);
    EXPECT_NE(message().find(text), std::string::npos) << message();
    c_ = good;
  };
  faces_[7].c = 5000;
  expect_refused(THRONG_BAD_MESH, "5000");
  EXPECT_EQ(result().first_invalid, 7u);
  faces_[7].c = 0;
  c_.start.floats = &float_start_[0].x;
  expect_refused(THRONG_BAD_MESH, "as floats and as doubles");
  c_.end.floats = &float_start_[0].x;
  expect_refused(THRONG_BAD_MESH, "as floats and as doubles");
  c_.dimension = 4;
  expect_refused(THRONG_BAD_MESH, "dimension");
  c_.edges.indices = nullptr;
  expect_refused(THRONG_BAD_MESH, "edges");
  EXPECT_EQ(throng_contact_finder_find(finder_, &c_, -1), THRONG_BAD_OPTION);
  EXPECT_EQ(throng_contact_finder_find(finder_, nullptr, 0), THRONG_BAD_MESH);
  EXPECT_NE(message().find("found no mesh (NULL)"), std::string::npos) << message();
  EXPECT_EQ(throng_contact_finder_find(finder_, &c_, 0.25), THRONG_OK) << message();
}

TEST(CContactFinder, NoHandle) {
  throng_contact_finder* const none = nullptr;
  const throng_contact_mesh mesh{};
  size_t count = 1;
  EXPECT_EQ(throng_contact_finder_find(none, &mesh, 0), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_contact_finder_vertex_face(none, &count), nullptr);
  EXPECT_EQ(count, 0u);
  EXPECT_EQ(throng_contact_finder_edge_edge(none, nullptr), nullptr);
  EXPECT_EQ(throng_contact_finder_edge_vertex(none, nullptr), nullptr);
  EXPECT_EQ(throng_contact_finder_result(none)->status, THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_contact_finder_memory_bytes(none), 0u);
  throng_contact_finder_stop(none);
  throng_contact_finder_destroy(none);
}

}  // namespace
}  // namespace throng::tests
