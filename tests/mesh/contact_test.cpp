// ContactFinder: candidates against double loops, layouts, options, and what it refuses.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cfenv>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "mesh/mesh_cases.hpp"
#include "support/configs.hpp"
#include "support/contact_reference.hpp"
#include "support/counting_resource.hpp"
#include "support/failing_resource.hpp"
#include "support/guarded_resource.hpp"
#include "support/heap_count.hpp"
#include "support/modified_float_state.hpp"

namespace throng::tests {
namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
constexpr double endless = std::numeric_limits<double>::infinity();

testing::AssertionResult finds(ContactFinder& finder, const ContactMesh& mesh, double radius,
                               const ContactCandidates& expected) {
  const Result r = finder.find(mesh, radius);
  if (!r.ok()) return testing::AssertionFailure() << r.message;
  const ContactCandidatesView got = finder.candidates();
  const std::uint64_t all = got.vertex_face.size() + got.edge_edge.size() + got.edge_vertex.size();
  if (r.found != all || r.written != all || r.message[0] != 0)
    return testing::AssertionFailure() << r.found << " found, " << r.written << " written";
  const std::string difference = contact_difference(got, expected);
  if (!difference.empty()) return testing::AssertionFailure() << difference;
  return testing::AssertionSuccess();
}

std::vector<Config> cpu_configs() {
  std::vector<Config> configs = all_configs();
  configs.erase(std::remove_if(configs.begin(), configs.end(),
                               [](const Config& c) { return c.backend != Backend::cpu; }),
                configs.end());
  return configs;
}

TEST(ContactMesh, ArraysAreContainersToo) {
  const std::vector<DoubleVec3> vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, 1}, {2, 1, 1}};
  const std::vector<Triangle> faces = {{0, 1, 2}};
  std::array<Edge, 2> edges = {{{3, 4}, {0, 1}}};
  const std::vector<std::uint32_t> group = {1, 1, 1, 1, 1}, mask = {1, 1, 1, 1, 0};
  ContactMesh mesh;
  mesh.start = vertices;
  mesh.edges = edges;
  mesh.faces = faces;
  mesh.group = group;
  mesh.mask = mask;
  EXPECT_EQ(mesh.edges.data, edges.data());
  EXPECT_EQ(mesh.edges.count, 2u);
  EXPECT_EQ(mesh.edges.stride_bytes, sizeof(Edge));
  EXPECT_EQ(mesh.faces.count, 1u);
  const ContactCandidates found = find_contact_candidates(mesh, 0.6);
  EXPECT_EQ(found.vertex_face, (std::vector<Pair>{{3, 0}}));  // 4 collides with nothing
  EXPECT_EQ(found.edge_edge, (std::vector<Pair>{{0, 1}}));
  Boxes boxes;
  boxes.filters.group = group;
  EXPECT_EQ(boxes.filters.group.data, group.data());
  static_assert(!std::is_convertible<const std::vector<int>&, Strided<std::uint32_t>>::value, "");
  static_assert(std::is_trivially_copyable<Strided<Edge>>::value, "");
}

// A sheet of side x side vertices with waves and a random motion, on the units of the reference.
ContactScene sheet(std::uint32_t side, std::uint64_t seed) {
  Random random(seed);
  const auto on_unit = [](double x) { return std::round(x / contact_unit) * contact_unit; };
  ContactScene s;
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const auto off = [&] { return static_cast<double>(random.in(-0.2f, 0.2f)); };
      const double z = 3 * std::sin(0.3 * x) * std::cos(0.2 * y);
      const DoubleVec3 p{on_unit(x * 0.5 + off()), on_unit(y * 0.5 + off()), on_unit(z + off())};
      s.start.push_back(p);
      s.end.push_back({on_unit(p.x + off()), on_unit(p.y + off()), on_unit(p.z + off())});
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const std::uint32_t a = y * side + x, b = a + 1, c = a + side, d = c + 1;
      if (x + 1 < side) s.edges.push_back({a, b});
      if (y + 1 < side) s.edges.push_back({a, c});
      if (x + 1 == side || y + 1 == side) continue;
      s.edges.push_back({a, d});
      s.faces.push_back({a, b, d});
      s.faces.push_back({a, d, c});
    }
  }
  s.radius = 0.0625;
  return s;
}

TEST(ContactFinder, SmallMeshesOfAnyKind) {
  const std::vector<Config> configs = cpu_configs();
  std::vector<ContactFinder> finders(configs.size());
  Random random(1);
  std::size_t candidates[3] = {};
  for (std::size_t k = 0; k < (sanitized ? 300u : 3000u); ++k) {
    const std::vector<std::uint8_t> data = random_bytes(random, 900);
    Bytes bytes(data);
    const ContactScene scene = make_contact_scene(bytes, 30);
    const ContactReference reference(scene);
    candidates[0] += reference.expected.vertex_face.size();
    candidates[1] += reference.expected.edge_edge.size();
    candidates[2] += reference.expected.edge_vertex.size();
    const std::size_t which = k % configs.size();
    finders[which].set_options(configs[which].options());
    ASSERT_TRUE(finds(finders[which], scene.view(), scene.radius, reference.expected))
        << configs[which].name() << ", mesh " << k;
  }
  for (const std::size_t count : candidates) EXPECT_GT(count, 1000u);
}

TEST(ContactFinder, SheetsOnAllThreads) {
  ContactScene scene = sheet(sanitized ? 36 : 46, 2);  // large enough for several threads
  Random random(3);
  for (int turn = 0; turn < 5; ++turn) {
    scene.rings = static_cast<unsigned>(turn);
    scene.radius = 0.0625 + 0.25 * turn;
    scene.dimension = turn == 4 ? 2 : 3;
    if (turn == 3) {
      for (std::size_t v = 0; v < scene.start.size(); ++v) {
        scene.group.push_back(1u << random.below(3));
        scene.mask.push_back(random.below(8));
      }
    }
    if (turn == 4) scene.group.clear(), scene.mask.clear();
    const ContactReference reference(scene);
    EXPECT_GT(reference.expected.edge_edge.size() + reference.expected.edge_vertex.size(), 1000u);
    for (const Config& config : cpu_configs()) {
      if (turn != 0 && config.threads != 3 && config.threads != 0) continue;
      ContactFinder finder(config.options());
      ASSERT_TRUE(finds(finder, scene.view(), scene.radius, reference.expected))
          << config.name() << ", turn " << turn;
    }
  }
}

TEST(ContactFinder, SortedOnRequest) {
  const ContactScene scene = sheet(40, 4);
  Options options;
  options.order = Order::canonical;
  for (const unsigned threads : {1u, 3u}) {
    options.threads = threads;
    ContactFinder finder(options);
    ASSERT_TRUE(finder.find(scene.view(), scene.radius).ok());
    const ContactCandidatesView got = finder.candidates();
    for (const Pairs& pairs : {got.vertex_face, got.edge_edge}) {
      EXPECT_GT(pairs.size(), 100u);
      EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
    }
  }
}

TEST(ContactFinder, OneCallReturnsTheSame) {
  const ContactScene scene = sheet(12, 5);
  const ContactReference reference(scene);
  Options options;
  options.order = Order::canonical;
  const ContactCandidates got = find_contact_candidates(scene.view(), scene.radius, options);
  EXPECT_EQ(got.vertex_face, reference.expected.vertex_face);
  EXPECT_EQ(got.edge_edge, reference.expected.edge_edge);
  ContactScene flat = scene;
  flat.dimension = 2;
  EXPECT_EQ(find_contact_candidates(flat.view(), flat.radius, options).edge_vertex,
            ContactReference(flat).expected.edge_vertex);
  try {
    find_contact_candidates(scene.view(), -1);
    FAIL() << "a negative radius is accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.result().status, Status::bad_option);
  }
}

// Layouts.

struct Node {
  std::uint32_t before;
  Vec3 start;
  Vec3 end;
  std::uint32_t group, mask;
};
struct WideNode {
  double before;
  DoubleVec3 end, start;
};
struct EdgeRecord {
  std::uint32_t id;
  Edge edge;
  float length;
};
struct FaceRecord {
  Triangle face;
  std::uint32_t material;
};

TEST(ContactFinder, LayoutsGiveTheSame) {
  ContactScene scene = sheet(14, 6);
  for (std::vector<DoubleVec3>* points : {&scene.start, &scene.end})  // exact as floats
    for (DoubleVec3& p : *points)
      for (double* x : {&p.x, &p.y, &p.z}) *x = static_cast<double>(static_cast<float>(*x));
  std::vector<Node> nodes;
  std::vector<WideNode> wide;
  for (std::size_t v = 0; v < scene.start.size(); ++v) {
    scene.group.push_back(v % 3 == 0 ? 1 : 2);
    scene.mask.push_back(v % 5 == 0 ? 1 : 3);
    nodes.push_back(
        {0, to_float(scene.start[v]), to_float(scene.end[v]), scene.group[v], scene.mask[v]});
    wide.push_back({no_number, scene.end[v], scene.start[v]});
  }
  std::vector<EdgeRecord> edges;
  for (const Edge& e : scene.edges) edges.push_back({7, e, 1});
  std::vector<FaceRecord> faces;
  for (const Triangle& f : scene.faces) faces.push_back({f, 9});

  const ContactReference reference(scene);
  ASSERT_GT(reference.expected.edge_edge.size(), 100u);
  const Vertices float_start(&nodes[0].start, nodes.size(), sizeof(Node));
  const Vertices float_end(&nodes[0].end, nodes.size(), sizeof(Node));
  const Vertices double_start(&wide[0].start, wide.size(), sizeof(WideNode));
  const Vertices double_end(&wide[0].end, wide.size(), sizeof(WideNode));
  ContactMesh mesh = scene.view();
  mesh.edges = {&edges[0].edge, edges.size(), sizeof(EdgeRecord)};
  mesh.faces = {&faces[0].face, faces.size(), sizeof(FaceRecord)};
  mesh.group = {&nodes[0].group, nodes.size(), sizeof(Node)};
  mesh.mask = {&nodes[0].mask, nodes.size(), sizeof(Node)};
  ContactFinder finder;
  for (const Vertices& start : {float_start, double_start}) {
    for (const Vertices& end : {float_end, double_end}) {
      mesh.start = start;
      mesh.end = end;
      EXPECT_TRUE(finds(finder, mesh, scene.radius, reference.expected))
          << start.is_float() << end.is_float();
    }
  }
  // Rings read strided elements, too.
  scene.rings = mesh.rings = 2;
  EXPECT_TRUE(finds(finder, mesh, scene.radius, ContactReference(scene).expected));
}

TEST(ContactFinder, AStrideOf0RepeatsOneValue) {
  const Vec3 point{1, 2, 3};
  const Edge edge{0, 1};
  const std::uint32_t group = 1;
  ContactMesh mesh;
  mesh.start = Vertices(&point, 4, 0);
  mesh.edges = {&edge, 3, 0};
  const Triangle face{1, 2, 2};
  mesh.faces = {&face, 2, 0};
  mesh.group = {&group, 4, 0};
  ContactFinder finder;
  ContactCandidates expected;
  expected.vertex_face = {{0, 0}, {0, 1}, {3, 0}, {3, 1}};
  EXPECT_TRUE(finds(finder, mesh, 0, expected));
}

TEST(ContactFinder, StartAndEndMayBeOneArray) {
  const ContactScene scene = sheet(10, 7);
  ContactScene still = scene;
  still.end.clear();
  const ContactReference reference(still);
  ContactMesh mesh = still.view();
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, mesh, still.radius, reference.expected));
  mesh.end = mesh.start;
  EXPECT_TRUE(finds(finder, mesh, still.radius, reference.expected));
  EXPECT_FALSE(contact_difference(finder.candidates(), ContactReference(scene).expected).empty());
}

// Rules, by hand.

// Two triangles over one another, `gap` apart, the second half of the way to the side.
ContactScene two_triangles(double gap) {
  ContactScene s;
  s.start = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, gap}, {4, 0, gap}, {0, 4, gap}};
  s.edges = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}};
  s.faces = {{0, 1, 2}, {3, 4, 5}};
  return s;
}

TEST(ContactFinder, RadiusIsHalfTheDistance) {
  const ContactScene s = two_triangles(1);
  ContactFinder finder;
  for (const double radius : {0.5, 0.75}) {
    ASSERT_TRUE(finder.find(s.view(), radius).ok());
    EXPECT_EQ(finder.candidates().vertex_face.size(), 6u) << radius;
    EXPECT_EQ(finder.candidates().edge_edge.size(), 9u) << radius;
  }
  // The next double below a half: rounded outward to floats, the boxes of z still touch.
  ASSERT_TRUE(finder.find(s.view(), std::nextafter(0.5, 0.0)).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 6u);
  // The next float below: they do not.
  ASSERT_TRUE(finder.find(s.view(), static_cast<double>(std::nextafter(0.5f, 0.0f))).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 0u);
  EXPECT_EQ(finder.candidates().edge_edge.size(), 0u);
}

TEST(ContactFinder, TheWholeWayCounts) {
  ContactScene s = two_triangles(8);
  s.end = s.start;
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, s.view(), 0.5, {}));
  for (std::size_t v = 3; v < 6; ++v) s.end[v].z = -8;  // passes through the other
  ASSERT_TRUE(finder.find(s.view(), 0).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 6u);
  EXPECT_EQ(finder.candidates().edge_edge.size(), 9u);
  std::swap(s.start, s.end);
  ASSERT_TRUE(finder.find(s.view(), 0).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 6u);
}

TEST(ContactFinder, AVertexOfNoElementIsAnElement) {
  ContactScene s = two_triangles(8);
  s.start.push_back({1, 1, 0});
  ContactCandidates expected;
  expected.vertex_face = {{6, 0}};
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, s.view(), 0.5, expected));
  for (const double x : {no_number, endless, -endless}) {
    for (int axis = 0; axis < 3; ++axis) {
      ContactScene t = s;
      double* const at[] = {&t.start[6].x, &t.start[6].y, &t.start[6].z};
      *at[axis] = x;
      EXPECT_TRUE(finds(finder, t.view(), 0.5, {})) << x;
      EXPECT_EQ(finder.find(t.view(), 0.5).inactive, 1u);
      t = s;
      t.end = t.start;
      double* const end[] = {&t.end[6].x, &t.end[6].y, &t.end[6].z};
      *end[axis] = x;
      EXPECT_TRUE(finds(finder, t.view(), 0.5, {})) << x;
    }
  }
}

TEST(ContactFinder, ZIsNotUsedIn2D) {
  ContactScene s;
  s.dimension = 2;
  s.start = {{0, 0, no_number}, {4, 0, endless}, {2, 1, 7}, {2, 3, -endless}};
  s.edges = {{0, 1}};
  s.faces = {{9, 9, 9}};  // not used
  ContactCandidates expected;
  expected.edge_vertex = {{0, 2}};
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, s.view(), 0.5, expected));
  ContactMesh mesh = s.view();
  mesh.faces.stride_bytes = 3;
  EXPECT_TRUE(finds(finder, mesh, 0.5, expected));
  s.start[1].y = no_number;
  EXPECT_EQ(finder.find(s.view(), 0.5).status, Status::bad_mesh);
}

// A path of vertices: 0 - 1 - 2 - ... along x, each with the edge to the next.
ContactScene path(std::uint32_t count) {
  ContactScene s;
  s.dimension = 2;
  for (std::uint32_t v = 0; v < count; ++v) s.start.push_back({0.001 * v, 0, 0});
  for (std::uint32_t v = 0; v + 1 < count; ++v) s.edges.push_back({v, v + 1});
  return s;
}

TEST(ContactFinder, ErrorsDoNotNameZIn2D) {
  ContactScene s = path(4);
  s.start[0].z = no_number;
  s.start[1].x = no_number;
  ContactFinder finder;
  const Result r = finder.find(s.view(), 1);
  EXPECT_EQ(r.status, Status::bad_mesh);
  EXPECT_NE(std::string(r.message).find("edge 0: its vertex 1 is (nan"), std::string::npos)
      << r.message;
}

TEST(ContactFinder, RingsLeaveOutNeighbors) {
  ContactScene s = path(12);
  ContactFinder finder;
  for (const unsigned rings : {0u, 1u, 2u, 3u, 9u, 10u, 1000u}) {
    s.rings = rings;
    std::size_t expected = 0;
    for (std::uint32_t e = 0; e + 1 < 12; ++e)
      for (std::uint32_t v = 0; v < 12; ++v) expected += v + rings < e || v > e + 1 + rings;
    ASSERT_TRUE(finder.find(s.view(), 1).ok());
    EXPECT_EQ(finder.candidates().edge_vertex.size(), expected) << rings;
  }
}

// The lists of neighbors are kept while the elements stay the same, and only then.
TEST(ContactFinder, RingsFollowTheElements) {
  Random random(8);
  ContactFinder finder;
  ContactScene s = sheet(8, 8);
  s.radius = 2;
  s.rings = 1;
  const auto check = [&](const char* what) {
    const ContactReference reference(s);
    EXPECT_TRUE(finds(finder, s.view(), s.radius, reference.expected)) << what;
    EXPECT_TRUE(finds(finder, s.view(), s.radius, reference.expected)) << what << ", again";
  };
  check("first");
  for (DoubleVec3& p : s.start) p.x += 1;
  check("moved");
  s.edges[5].b = 60;
  check("the end of an edge");
  s.edges[6].a = 59;
  check("the begin of an edge");
  s.faces[7].a = 61;
  check("the first of a face");
  s.faces[8].b = 62;
  check("the second of a face");
  s.faces[9].c = 63;
  check("the third of a face");
  s.rings = 2;
  check("more rings");
  s.edges.back() = {10, 40};
  s.faces.back() = {12, 31, 50};
  check("across the sheet");
  s.edges.pop_back();
  check("fewer edges");
  s.faces.pop_back();
  check("fewer faces");
  s.start.push_back(s.start[0]);
  s.end.push_back(s.end[0]);
  check("one more vertex");
  s.dimension = 2;
  check("faces are not used");
  s.dimension = 3;
  check("faces are used again");
  s.rings = 0;
  check("no rings");
}

TEST(ContactFinder, ElementsPairIfAnyTwoVerticesMay) {
  ContactScene s = two_triangles(1);
  s.group = {1, 1, 1, 2, 2, 2};
  s.mask = {2, 2, 2, 1, 1, 1};
  ContactFinder finder;
  ASSERT_TRUE(finder.find(s.view(), 1).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 6u);
  EXPECT_EQ(finder.candidates().edge_edge.size(), 9u);
  s.mask = {2, 2, 2, 4, 4, 4};  // one of the two forbids
  EXPECT_TRUE(finds(finder, s.view(), 1, {}));
  s.mask = {2, 2, 2, 4, 4, 1};  // only vertex 5 may collide, with vertices 0, 1, 2
  const ContactReference reference(s);
  s.radius = 1;
  ASSERT_TRUE(finder.find(s.view(), 1).ok());
  EXPECT_EQ(finder.candidates().vertex_face.size(), 4u);
  EXPECT_EQ(finder.candidates().edge_edge.size(), 6u);
  // The groups and masks of two elements match, but those of no two vertices.
  s.group = {1, 1, 1, 2, 4, 4};
  s.mask = {2, 2, 2, 0, 1, 1};
  EXPECT_TRUE(finds(finder, s.view(), 1, {}));
  // One filter alone: the other counts as all ones.
  s.mask.clear();
  s.group = {0, 0, 0, 1, 1, 1};
  EXPECT_TRUE(finds(finder, s.view(), 1, {}));
  s.group = {1, 1, 1, 1, 1, 1};
  ASSERT_TRUE(finder.find(s.view(), 1).ok());
  EXPECT_EQ(finder.candidates().edge_edge.size(), 9u);
  s.mask = std::exchange(s.group, {});
  ASSERT_TRUE(finder.find(s.view(), 1).ok());
  EXPECT_EQ(finder.candidates().edge_edge.size(), 9u);
}

TEST(ContactFinder, EqualVerticesMakePoints) {
  ContactScene s;
  s.start = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 0, 0}};
  s.edges = {{0, 0}, {1, 1}, {0, 1}, {1, 0}, {3, 2}};
  s.faces = {{2, 2, 2}, {3, 3, 0}};
  const ContactReference reference(s);
  EXPECT_EQ(reference.expected.edge_edge,
            (std::vector<Pair>{{0, 1}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}));
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, s.view(), 0, reference.expected));
  s.rings = 1;
  EXPECT_TRUE(finds(finder, s.view(), 0, ContactReference(s).expected));
}

TEST(ContactFinder, CoordinatesBeyondFloats) {
  // On x: beyond the largest float on either side, and beyond the smallest on the other axes.
  ContactScene s;
  s.start = {{1e300, 0, 0},  {1e300, 1, 0},  {2e300, 0, 0},  {2e300, 1, 0},
             {-1e300, 0, 0}, {-1e300, 1, 0}, {-2e300, 0, 0}, {-2e300, 1, 0},
             {0, 1e-300, 0}, {0, 1, 1e-300}, {1e-60, 0, 0},  {1e-60, 1, 0}};
  for (std::uint32_t v = 0; v < 12; v += 2) s.edges.push_back({v, v + 1});
  ContactCandidates expected;
  expected.edge_edge = {{0, 1}, {2, 3}, {4, 5}};
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, s.view(), 0, expected));
  EXPECT_TRUE(finds(finder, s.view(), 1e-320, expected));
  // A radius near the largest double: all boxes are everything.
  ASSERT_TRUE(finder.find(s.view(), 1.7e308).ok());
  EXPECT_EQ(finder.candidates().edge_edge.size(), 15u);
}

TEST(ContactFinder, TheCallersFloatStateDoesNotMatter) {
  const ContactScene scene = sheet(12, 9);
  const ContactReference reference(scene);
  ContactFinder finder;
  for (const int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    const ModifiedFloatState state(rounding, true);
    const Result r = finder.find(scene.view(), scene.radius);
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_TRUE(state.unchanged());
    EXPECT_EQ(contact_difference(finder.candidates(), reference.expected), "");
  }
}

// Nothing is lost: elements within twice the radius at some time are candidates.

double dot(const DoubleVec3& a, const DoubleVec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
DoubleVec3 along(const DoubleVec3& a, const DoubleVec3& b, double t) {
  return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
}
double distance(const DoubleVec3& a, const DoubleVec3& b) {
  const DoubleVec3 d{b.x - a.x, b.y - a.y, b.z - a.z};
  return std::sqrt(dot(d, d));
}
// Upper bounds of the distances that are close to them: by samples of the elements.
double sampled_distance(const DoubleVec3& p, const DoubleVec3 (&t)[3]) {
  double least = endless;
  for (int i = 0; i <= 12; ++i)
    for (int j = 0; j <= 12; ++j)
      least = std::min(least, distance(p, along(t[0], along(t[1], t[2], j / 12.0), i / 12.0)));
  return least;
}
double sampled_distance(const DoubleVec3 (&e)[2], const DoubleVec3 (&f)[2]) {
  double least = endless;
  for (int i = 0; i <= 16; ++i)
    for (int j = 0; j <= 16; ++j)
      least = std::min(least, distance(along(e[0], e[1], i / 16.0), along(f[0], f[1], j / 16.0)));
  return least;
}

TEST(ContactFinder, LosesNoContact) {
  Random random(10);
  Options options;
  options.order = Order::canonical;
  ContactFinder finder(options);
  std::size_t contacts = 0;
  for (int turn = 0; turn < (sanitized ? 6 : 40); ++turn) {
    ContactScene s;
    const auto real = [&] { return static_cast<double>(random.in(-1, 1)); };
    for (int v = 0; v < 18; ++v) s.start.push_back({real(), real(), real()});
    for (int v = 0; v < 18; ++v) {
      s.end.push_back(
          {s.start[v].x + 0.6 * real(), s.start[v].y + 0.6 * real(), s.start[v].z + 0.6 * real()});
    }
    for (std::uint32_t v = 0; v + 2 < 18; v += 3) {
      s.faces.push_back({v, v + 1, v + 2});
      s.edges.push_back({v, v + 1});
      s.edges.push_back({v + 1, v + 2});
    }
    s.radius = 0.02 + 0.05 * std::abs(real());
    ASSERT_TRUE(finder.find(s.view(), s.radius).ok());
    const Pairs vertex_face = finder.candidates().vertex_face;
    const Pairs edge_edge = finder.candidates().edge_edge;
    for (int step = 0; step <= 32; ++step) {
      const auto at = [&](std::uint32_t v) { return along(s.start[v], s.end[v], step / 32.0); };
      for (std::uint32_t f = 0; f < s.faces.size(); ++f) {
        const Triangle& face = s.faces[f];
        const DoubleVec3 corners[3] = {at(face.a), at(face.b), at(face.c)};
        for (std::uint32_t v = 0; v < s.start.size(); ++v) {
          if (v == face.a || v == face.b || v == face.c) continue;
          if (sampled_distance(at(v), corners) > 2 * s.radius) continue;
          ++contacts;
          EXPECT_TRUE(std::binary_search(vertex_face.begin(), vertex_face.end(), Pair{v, f}));
        }
      }
      for (std::uint32_t i = 0; i < s.edges.size(); ++i) {
        const Edge& e = s.edges[i];
        const DoubleVec3 first[2] = {at(e.a), at(e.b)};
        for (std::uint32_t j = i + 1; j < s.edges.size(); ++j) {
          const Edge& o = s.edges[j];
          if (e.a == o.a || e.a == o.b || e.b == o.a || e.b == o.b) continue;
          const DoubleVec3 second[2] = {at(o.a), at(o.b)};
          if (sampled_distance(first, second) > 2 * s.radius) continue;
          ++contacts;
          EXPECT_TRUE(std::binary_search(edge_edge.begin(), edge_edge.end(), Pair{i, j}));
        }
      }
    }
  }
  EXPECT_GT(contacts, 500u);
}

// What it refuses.

struct Refused {
  const char* what;
  std::function<void(ContactMesh&, double&, Options&)> change;
  Status status;
  std::uint64_t first, count;
  const char* message;
};

TEST(ContactFinder, RefusesWithTheRemedy) {
  const std::vector<DoubleVec3> points = {{0, 0, 0},         {1, 0, 0},       {0, 1, 0},
                                          {no_number, 0, 0}, {0, endless, 0}, {5, 6, 7}};
  const std::vector<DoubleVec3> moved = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                         {0, 0, 0}, {0, 0, 0}, {5, 6, -endless}};
  const std::vector<Edge> edges = {{0, 1}, {1, 2}, {2, 6}, {7, 0}}, bad_edges = {{0, 1}, {3, 0}},
                          edges_at_5 = {{1, 5}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 1, 4}, {4, 3, 0}},
                              out = {{0, 1, 2}, {0, 9, 1}};
  const std::vector<std::uint32_t> values(6, 1);
  static const Executor no_run{};
  const auto take = [](auto& strided, const auto& from) {
    strided.data = from.data();
    strided.count = from.size();
  };
  const Refused cases[] = {
      {"an edge out of range", [&](auto& m, double&, Options&) { take(m.edges, edges); },
       Status::bad_mesh, 2, 2,
       "2 edges are invalid, the first is edge 2 with vertex 6 of 6; use 0 to one less than that"},
      {"an edge of a NaN", [&](auto& m, double&, Options&) { take(m.edges, bad_edges); },
       Status::bad_mesh, 1, 1,
       "1 edges are invalid, the first is edge 1: its vertex 3 is (nan, 0, 0) at the start; make "
       "it finite, or leave the edge out"},
      {"an edge that ends at infinity",
       [&](auto& m, double&, Options&) { take(m.edges, edges_at_5), m.end = moved; },
       Status::bad_mesh, 0, 1,
       "1 edges are invalid, the first is edge 0: its vertex 5 is (5, 6, -inf) at the end; make it "
       "finite, or leave the edge out"},
      {"a face of an infinity", [&](auto& m, double&, Options&) { take(m.faces, faces); },
       Status::bad_mesh, 1, 2,
       "2 faces are invalid, the first is face 1: its vertex 4 is (0, inf, 0) at the start; make "
       "it finite, or leave the face out"},
      {"a face out of range", [&](auto& m, double&, Options&) { take(m.faces, out); },
       Status::bad_mesh, 1, 1,
       "1 faces are invalid, the first is face 1 with vertex 9 of 6; use 0 to one less than that"},
      {"edges before faces",
       [&](auto& m, double&, Options&) { take(m.faces, out), take(m.edges, edges); },
       Status::bad_mesh, 2, 2,
       "2 edges are invalid, the first is edge 2 with vertex 6 of 6; use 0 to one less than that"},
      {"lengths", [&](auto& m, double&, Options&) { m.end = Vertices(points.data(), 5); },
       Status::bad_mesh, 0, 0,
       "there are 6 start vertices and 5 end vertices; give as many, or no end vertices if nothing "
       "moves"},
      {"no start",
       [](auto& m, double&, Options&) { m.start = Vertices(static_cast<const Vec3*>(nullptr), 3); },
       Status::bad_mesh, 0, 0,
       "there are 3 start vertices but their address is null; give it, or count 0"},
      {"no end",
       [](auto& m, double&, Options&) { m.end = Vertices(static_cast<const Vec3*>(nullptr), 6); },
       Status::bad_mesh, 0, 0,
       "there are 6 end vertices but their address is null; give it, or count 0"},
      {"no edges", [](auto& m, double&, Options&) { m.edges.count = 2; }, Status::bad_mesh, 0, 0,
       "there are 2 edges but their address is null; give it, or count 0"},
      {"no faces", [](auto& m, double&, Options&) { m.faces.count = 2; }, Status::bad_mesh, 0, 0,
       "there are 2 faces but their address is null; give it, or count 0"},
      {"stride of doubles",
       [&](auto& m, double&, Options&) { m.start = Vertices(points.data(), 6, 28); },
       Status::bad_mesh, 0, 0,
       "the stride of the start vertices is 28 bytes; it must be a multiple of 8"},
      {"stride of floats",
       [&](auto& m, double&, Options&) {
         m.end = Vertices(reinterpret_cast<const Vec3*>(points.data()), 6, 14);
       },
       Status::bad_mesh, 0, 0,
       "the stride of the end vertices is 14 bytes; it must be a multiple of 4"},
      {"stride of edges",
       [&](auto& m, double&, Options&) { take(m.edges, edges), m.edges.stride_bytes = 9; },
       Status::bad_mesh, 0, 0, "the stride of the edges is 9 bytes; it must be a multiple of 4"},
      {"stride of faces",
       [&](auto& m, double&, Options&) { take(m.faces, faces), m.faces.stride_bytes = 13; },
       Status::bad_mesh, 0, 0, "the stride of the faces is 13 bytes; it must be a multiple of 4"},
      {"dimension", [](auto& m, double&, Options&) { m.dimension = 4; }, Status::bad_mesh, 0, 0,
       "the dimension is 4; use 2 or 3"},
      {"too many edges",
       [&](auto& m, double&, Options&) {
         m.edges = {edges.data(), max_box_count + 1, 0};
       },
       Status::too_many_boxes, 0, 0,
       "there are 4294901761 edges, at most 4294901760 can be indexed; split the mesh"},
      {"too many faces",
       [&](auto& m, double&, Options&) {
         m.faces = {faces.data(), max_box_count + 1, 0};
       },
       Status::too_many_boxes, 0, 0,
       "there are 4294901761 faces, at most 4294901760 can be indexed; split the mesh"},
      {"too many vertices",
       [&](auto& m, double&, Options&) { m.start = Vertices(points.data(), max_box_count + 1, 0); },
       Status::too_many_boxes, 0, 0,
       "there are 4294901761 start vertices, at most 4294901760 can be indexed; split the mesh"},
      {"length of group",
       [&](auto& m, double&, Options&) {
         m.group = {values.data(), 5, 4};
       },
       Status::bad_filter, 0, 0, nullptr},
      {"stride of mask",
       [&](auto& m, double&, Options&) {
         m.mask = {values.data(), 6, 3};
       },
       Status::bad_filter, 0, 0, nullptr},
      {"negative radius", [](auto&, double& radius, Options&) { radius = -0.5; },
       Status::bad_option, 0, 0, "the radius is -0.5; it must be finite and not negative"},
      {"NaN radius", [](auto&, double& radius, Options&) { radius = no_number; },
       Status::bad_option, 0, 0, nullptr},
      {"infinite radius", [](auto&, double& radius, Options&) { radius = endless; },
       Status::bad_option, 0, 0, "the radius is inf; it must be finite and not negative"},
      {"margin", [](auto&, double&, Options& o) { o.margin = 0.25f; }, Status::bad_option, 0, 0,
       "Options::margin is 0.25; set it to 0 and add it to the radius"},
      {"backend", [](auto&, double&, Options& o) { o.backend = Backend::cuda; }, Status::bad_option,
       0, 0,
       "backend cuda: contact candidates are found on the CPU alone; set backend to cpu or "
       "automatic"},
      {"executor", [](auto&, double&, Options& o) { o.executor = &no_run; }, Status::bad_option, 0,
       0, nullptr},
      {"order", [](auto&, double&, Options& o) { o.order = static_cast<Order>(7); },
       Status::bad_option, 0, 0, nullptr},
      {"cell scale", [](auto&, double&, Options& o) { o.cell_scale = 0; }, Status::bad_option, 0, 0,
       nullptr},
      {"isa", [](auto&, double&, Options& o) { o.isa = static_cast<Isa>(77); }, Status::bad_option,
       0, 0, nullptr},
  };
  ContactFinder finder;
  const ContactScene good = two_triangles(1);
  for (const Refused& c : cases) {
    SCOPED_TRACE(c.what);
    finder.set_options({});
    ASSERT_TRUE(finder.find(good.view(), 1).ok());
    ASSERT_FALSE(finder.candidates().edge_edge.empty());
    ContactMesh mesh;
    mesh.start = points;
    double radius = 0.5;
    Options options;
    c.change(mesh, radius, options);
    finder.set_options(options);
    const Result r = finder.find(mesh, radius);
    EXPECT_EQ(r.status, c.status) << r.message;
    EXPECT_EQ(r.first_invalid, c.first);
    EXPECT_EQ(r.invalid_count, c.count);
    EXPECT_EQ(r.found, 0u);
    EXPECT_NE(r.message[0], 0);
    if (c.message) {
      EXPECT_STREQ(r.message, c.message);
    }
    EXPECT_TRUE(finder.candidates().edge_edge.empty());
    EXPECT_TRUE(finder.candidates().vertex_face.empty());
  }
}

// The first invalid element does not depend on the threads that find it.
TEST(ContactFinder, NamesTheFirstOfManyInvalidElements) {
  ContactScene s = sheet(70, 11);
  Options options;
  options.threads = 5;
  ContactFinder finder(options);
  for (std::size_t e = 1234; e < s.edges.size(); e += 7) s.edges[e].b = 70 * 70;
  for (int k = 0; k < 5; ++k) {
    const Result r = finder.find(s.view(), 1);
    EXPECT_EQ(r.status, Status::bad_mesh);
    EXPECT_EQ(r.first_invalid, 1234u);
    EXPECT_EQ(r.invalid_count, (s.edges.size() - 1234 + 6) / 7);
  }
}

TEST(ContactFinder, EmptyMeshes) {
  ContactFinder finder;
  EXPECT_TRUE(finds(finder, {}, 1, {}));
  ContactMesh flat;
  flat.dimension = 2;
  EXPECT_TRUE(finds(finder, flat, 1, {}));
  ContactScene s = two_triangles(1);
  ContactMesh mesh = s.view();
  mesh.edges = {};
  ContactCandidates expected = ContactReference(s).expected;
  mesh.faces = {};
  EXPECT_TRUE(finds(finder, mesh, 1, {})) << "vertices alone";
  mesh.rings = 3;
  EXPECT_TRUE(finds(finder, mesh, 1, {})) << "vertices alone";
}

// Memory, threads and stopping.

TEST(ContactFinder, AWarmFinderAllocatesNothing) {
  ContactScene scenes[] = {sheet(40, 12), sheet(40, 13)};
  for (const unsigned rings : {0u, 2u}) {
    for (const bool filtered : {false, true}) {
      for (const Order order : {Order::any, Order::canonical}) {
        for (const unsigned threads : {1u, 3u}) {
          for (ContactScene& s : scenes) {
            s.rings = rings;
            s.group.assign(filtered ? s.start.size() : 0, 1);
          }
          CountingResource memory;
          Options options;
          options.order = order;
          options.threads = threads;
          options.memory = &memory;
          ContactFinder finder(options);
          for (int k = 0; k < 2; ++k)  // the threads share the work in another way each time
            for (const ContactScene& s : scenes) ASSERT_TRUE(finder.find(s.view(), s.radius).ok());
          EXPECT_EQ(finder.memory_bytes(), memory.held());
          const std::size_t before = memory.allocations();
          HeapCount::start();
          const Result r = finder.find(scenes[0].view(), scenes[0].radius);
          const std::size_t allocations = HeapCount::stop();
          EXPECT_TRUE(r.ok()) << r.message;
          EXPECT_GT(r.found, 100u);
          EXPECT_EQ(memory.allocations(), before);
          if (threads == 1) {
            EXPECT_EQ(allocations, 0u);
          }
        }
      }
    }
  }
}

TEST(ContactFinder, AllMemoryComesFromTheResource) {
  GuardedResource memory;
  ContactScene s = sheet(40, 14);
  s.rings = 2;
  s.mask.assign(s.start.size(), 1);
  const ContactReference reference(s);
  Options options;
  options.memory = &memory;
  options.threads = 3;
  ContactFinder finder(options);
  EXPECT_TRUE(finds(finder, s.view(), s.radius, reference.expected));
  EXPECT_TRUE(memory.check());
  EXPECT_GT(memory.allocations(), 0u);
}

TEST(ContactFinder, ReportsThatMemoryRunsOut) {
  FailingResource memory;
  ContactScene s = sheet(40, 15);
  s.rings = 1;
  const ContactReference reference(s);
  for (const unsigned threads : {1u, 3u}) {
    Options options;
    options.memory = &memory;
    options.threads = threads;
    ContactFinder finder(options);
    std::size_t allowed = 0;
    if (threads == 3) {
      // What the finder holds of another mesh is not taken for this one's.
      ContactScene other = sheet(20, 15);
      other.rings = 1;
      ASSERT_TRUE(finder.find(other.view(), other.radius).ok());
    }
    for (;; ++allowed) {
      memory.fail(allowed, true);
      const Result r = finder.find(s.view(), s.radius);
      memory.calm();
      if (r.ok()) break;
      ASSERT_EQ(r.status, Status::out_of_memory) << r.message;
      EXPECT_NE(r.bytes_needed, 0u);
      EXPECT_NE(std::string(r.message).find("out of memory"), std::string::npos);
      EXPECT_EQ(r.found, 0u);
      EXPECT_TRUE(finder.candidates().edge_edge.empty());
      ASSERT_LT(allowed, 1000u);
    }
    EXPECT_GT(allowed, 5u);
    EXPECT_TRUE(finds(finder, s.view(), s.radius, reference.expected));
  }
}

TEST(ContactFinder, StopsWhenItIsStopped) {
  ContactScene s = sheet(50, 16);
  s.rings = 2;
  std::atomic<bool> stop{true};
  Options options;
  options.stop = &stop;
  ContactFinder finder(options);
  const Result r = finder.find(s.view(), s.radius);
  EXPECT_EQ(r.status, Status::stopped);
  EXPECT_EQ(r.found, 0u);
  EXPECT_TRUE(finder.candidates().edge_edge.empty());
  stop = false;
  EXPECT_TRUE(finds(finder, s.view(), s.radius, ContactReference(s).expected));
}

// Sets the stop flag at the n-th request for memory, and clears it at the next if `brief`.
class StoppingResource : public CountingResource {
 public:
  std::atomic<bool> stop{false};
  std::size_t left = 0;
  bool brief = false, was_set = false;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (brief && stop) stop = false;
    if (left != 0 && --left == 0) stop = was_set = true;
    return CountingResource::do_allocate(bytes, alignment);
  }
};

TEST(ContactFinder, StopsAtAnyPoint) {
  ContactScene s = sheet(40, 17);
  s.rings = 2;
  const ContactReference reference(s);
  std::size_t stopped = 0;
  for (std::size_t at = 1; at < 200; ++at) {
    StoppingResource memory;
    memory.left = at;
    Options options;
    options.memory = &memory;
    options.stop = &memory.stop;
    options.threads = 1;
    ContactFinder finder(options);
    const Result r = finder.find(s.view(), s.radius);
    if (!memory.stop) break;  // fewer requests
    // A stop that comes after the last pair is not seen.
    ASSERT_TRUE(r.ok() || r.status == Status::stopped) << r.message;
    stopped += !r.ok();
    EXPECT_EQ(finder.candidates().vertex_face.empty(), !r.ok());
    EXPECT_EQ(finder.candidates().edge_edge.empty(), !r.ok());
    EXPECT_EQ(r.found == 0, !r.ok());
    memory.stop = false;
    ASSERT_TRUE(finds(finder, s.view(), s.radius, reference.expected)) << at;
  }
  EXPECT_GT(stopped, 10u);
}

// After a stop while lists of neighbors are built, those of the mesh before are not taken.
TEST(ContactFinder, AStoppedSearchLeavesNoLists) {
  ContactScene before = sheet(8, 8), s = sheet(24, 17);
  before.rings = s.rings = 2;
  const ContactReference reference(s);
  std::size_t stopped = 0;
  for (std::size_t at = 1; at < 200; ++at) {
    StoppingResource memory;
    Options options;
    options.memory = &memory;
    options.stop = &memory.stop;
    options.threads = 1;
    ContactFinder finder(options);
    ASSERT_TRUE(finder.find(before.view(), before.radius).ok());
    memory.left = at;
    const Result r = finder.find(s.view(), s.radius);
    if (!memory.stop) break;  // fewer requests
    stopped += r.status == Status::stopped;
    memory.stop = false;
    ASSERT_TRUE(finds(finder, s.view(), s.radius, reference.expected)) << at;
  }
  EXPECT_GT(stopped, 5u);
}

// A flag that is set for a while either stops the search or changes nothing.
TEST(ContactFinder, AWithdrawnStopLeavesNoPartialResult) {
  ContactScene s = sheet(40, 17);
  std::size_t stopped = 0;
  for (const unsigned rings : {0u, 1u}) {
    s.rings = rings;
    const ContactReference reference(s);
    for (std::size_t at = 1; at < 200; ++at) {
      StoppingResource memory;
      memory.left = at;
      memory.brief = true;
      Options options;
      options.memory = &memory;
      options.stop = &memory.stop;
      options.threads = 1;
      ContactFinder finder(options);
      const Result r = finder.find(s.view(), s.radius);
      if (!memory.was_set) break;  // fewer requests
      stopped += r.status == Status::stopped;
      if (r.ok()) {
        EXPECT_EQ(contact_difference(finder.candidates(), reference.expected), "") << at;
      } else {
        EXPECT_EQ(r.status, Status::stopped) << r.message;
      }
    }
  }
  EXPECT_GT(stopped, 5u);
}

// Runs tasks in turn on the caller, the last first, and counts calls.
struct Backwards {
  unsigned runs = 0, most_tasks = 0;
  Executor executor{4, run, this};
  static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    auto& me = *static_cast<Backwards*>(self);
    ++me.runs;
    me.most_tasks = std::max(me.most_tasks, count);
    for (unsigned i = count; i-- > 0;) task(context, i);
  }
};

TEST(ContactFinder, UsesTheExecutorOnce) {
  ContactScene s = sheet(40, 18);
  s.rings = 1;
  Backwards backwards;
  Options options;
  options.executor = &backwards.executor;
  ContactFinder finder(options);
  EXPECT_TRUE(finds(finder, s.view(), s.radius, ContactReference(s).expected));
  EXPECT_EQ(backwards.runs, 1u);
  EXPECT_EQ(backwards.most_tasks, 4u);
  EXPECT_EQ(finder.find(s.view(), s.radius).plan.threads, 4u);
  options.threads = 2;
  finder.set_options(options);
  EXPECT_EQ(finder.find(s.view(), s.radius).plan.threads, 2u);
}

TEST(ContactFinder, Moves) {
  const ContactScene s = sheet(10, 19);
  const ContactReference reference(s);
  ContactFinder a;
  EXPECT_EQ(a.memory_bytes(), 0u);
  ASSERT_TRUE(finds(a, s.view(), s.radius, reference.expected));
  ContactFinder b(std::move(a));
  EXPECT_EQ(contact_difference(b.candidates(), reference.expected), "");
  ContactFinder c;
  c = std::move(b);
  EXPECT_EQ(contact_difference(c.candidates(), reference.expected), "");
  EXPECT_GT(c.memory_bytes(), 0u);
  EXPECT_TRUE(finds(c, s.view(), s.radius, reference.expected));
}

}  // namespace
}  // namespace throng::tests
