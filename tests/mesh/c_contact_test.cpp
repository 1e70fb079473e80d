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

TEST_F(CContact, StridedArrays) {
  struct Vertex {
    double other;
    DoubleVec3 position;
  };
  struct TaggedEdge {
    Edge edge;
    std::uint32_t tag;
  };
  struct TaggedFace {
    Triangle face;
    std::uint32_t tag[2];
  };
  struct Filter {
    std::uint32_t group, mask;
  };
  std::vector<Vertex> start, end;
  std::vector<TaggedEdge> edges;
  std::vector<TaggedFace> faces;
  std::vector<Filter> filters;
  for (std::size_t i = 0; i < start_.size(); ++i) {
    start.push_back({9, start_[i]});
    end.push_back({9, end_[i]});
    filters.push_back({group_[i], mask_[i]});
  }
  for (const Edge& e : edges_) edges.push_back({e, 9});
  for (const Triangle& f : faces_) faces.push_back({f, {9, 9}});
  c_.start = {start.size(), nullptr, &start[0].position.x, sizeof(Vertex)};
  c_.end = {end.size(), nullptr, &end[0].position.x, sizeof(Vertex)};
  c_.edges = {edges.size(), &edges[0].edge.a, sizeof(TaggedEdge)};
  c_.faces = {faces.size(), &faces[0].face.a, sizeof(TaggedFace)};
  c_.group = {&filters[0].group, sizeof(Filter)};
  c_.mask = {&filters[0].mask, sizeof(Filter)};
  cpp_.group = {group_.data(), group_.size()};
  cpp_.mask = {mask_.data(), mask_.size()};
  EXPECT_GT(compare(0.25), 100u);
  // One filter alone.
  c_.mask = {};
  cpp_.mask = {};
  EXPECT_GT(compare(0.25), 100u);
}

TEST_F(CContact, Options) {
  const auto expect_refused = [&](const char* text) {
    EXPECT_EQ(throng_contact_finder_find(finder(), &c_, 0.25), THRONG_BAD_OPTION);
    EXPECT_NE(message().find(text), std::string::npos) << message();
    EXPECT_TRUE(list(throng_contact_finder_edge_edge).empty());
    TearDown();
    finder_ = nullptr;
    throng_options_init(&options_);
  };
  options_.margin = 1;
  expect_refused("margin");
  options_.struct_bytes = 0;
  expect_refused("throng_options_init");
  options_.backend = THRONG_BACKEND_CUDA;
  expect_refused("backend");
  options_.isa = 99;
  expect_refused("isa");
  options_.order = THRONG_ORDER_CANONICAL;
  options_.isa = THRONG_ISA_SCALAR;
  options_.algorithm = THRONG_ALGORITHM_ALL_PAIRS;
  options_.threads = 2;
  EXPECT_GT(compare(0.25), 1000u);
  EXPECT_EQ(result().isa, THRONG_ISA_SCALAR);
}

// Stops the call from a task of its own executor.
TEST_F(CContact, Stop) {
  static throng_contact_finder* running;
  options_.stoppable = 1;
  options_.concurrency = 2;
  options_.run = [](void*, unsigned count, void (*task)(void*, unsigned), void* context) {
    throng_contact_finder_stop(running);
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  running = finder();
  // Enough elements for the executor.
  std::vector<Edge> edges;
  for (int k = 0; k < 30; ++k) edges.insert(edges.end(), edges_.begin(), edges_.end());
  c_.edges = {edges.size(), &edges[0].a, 0};
  EXPECT_EQ(throng_contact_finder_find(running, &c_, 0), THRONG_STOPPED);
  EXPECT_EQ(result().found, 0u);
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
