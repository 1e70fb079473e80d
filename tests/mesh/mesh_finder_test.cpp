// MeshFinder: its forms and options against a double loop, and what it refuses.
#include <throng/throng.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "mesh/distance.hpp"
#include "mesh/larger_meshes.hpp"
#include "mesh/mesh_cases.hpp"
#include "support/counting_resource.hpp"
#include "support/guarded_resource.hpp"
#include "support/heap_count.hpp"
#include "support/modified_float_state.hpp"
#include "support/random.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {

Options canonical() {
  Options options;
  options.order = Order::canonical;
  return options;
}

class Isas : public testing::TestWithParam<Isa> {
 protected:
  Options options() const {
    Options options = canonical();
    options.isa = GetParam();
    return options;
  }
  void SetUp() override {
    MeshFinder finder(options());
    if (finder.find(TriangleMesh()).status == Status::unsupported_isa)
      GTEST_SKIP() << "this processor lacks " << to_string(GetParam());
  }
};

TEST_P(Isas, FindAllPairs) {
  for (int kind = 0; kind < static_cast<int>(MeshKind::count); ++kind) {
    for (std::uint64_t seed = 0; seed < seeds(6); ++seed) {
      for (const bool floats : {false, true}) {
        const SmallMesh m = small_mesh(static_cast<MeshKind>(kind), floats, seed);
        const SmallMesh other = small_mesh(static_cast<MeshKind>(kind), floats, seed + 1000);
        const std::vector<Pair> want = pairs_of(m), between = pairs_of(m, other);
        EXPECT_EQ(find_self_intersections({m.vertices, m.triangles}, options()), want)
            << kind << " " << seed;
        EXPECT_EQ(find_intersections({m.vertices, m.triangles}, {other.vertices, other.triangles},
                                     options()),
                  between);
        if (!floats) continue;
        const std::vector<Vec3> v = to_floats(m.vertices), w = to_floats(other.vertices);
        EXPECT_EQ(find_self_intersections({v, m.triangles}, options()), want);
        EXPECT_EQ(find_intersections({v, m.triangles}, {w, other.triangles}, options()), between);
        // One mesh of floats, one of doubles.
        EXPECT_EQ(
            find_intersections({v, m.triangles}, {other.vertices, other.triangles}, options()),
            between);
      }
    }
  }
}

// So small that products of three or of two differences underflow, of floats and of doubles.
TEST_P(Isas, FindAllPairsWhereProductsUnderflow) {
  struct Scale {
    bool floats;
    int exponent;
  };
  for (const Scale scale : {Scale{true, -50}, {true, -75}, {false, -359}, {false, -538}}) {
    for (const MeshKind kind : {MeshKind::small_grid, MeshKind::grid, MeshKind::flat}) {
      for (std::uint64_t seed = 0; seed < seeds(6); ++seed) {
        SmallMesh m = small_mesh(kind, true, seed), other = small_mesh(kind, true, seed + 1000);
        for (SmallMesh* mesh : {&m, &other}) {
          for (DoubleVec3& p : mesh->vertices) {
            p = {std::ldexp(p.x, scale.exponent), std::ldexp(p.y, scale.exponent),
                 std::ldexp(p.z, scale.exponent)};
          }
        }
        const std::vector<Vec3> v = to_floats(m.vertices), w = to_floats(other.vertices);
        const TriangleMesh a =
            scale.floats ? TriangleMesh(v, m.triangles) : TriangleMesh(m.vertices, m.triangles);
        const TriangleMesh b = scale.floats ? TriangleMesh(w, other.triangles)
                                            : TriangleMesh(other.vertices, other.triangles);
        EXPECT_EQ(find_self_intersections(a, options()), pairs_of(m))
            << scale.exponent << ", seed " << seed;
        EXPECT_EQ(find_intersections(a, b, options()), pairs_of(m, other))
            << scale.exponent << ", seed " << seed;
      }
    }
  }
}

// Neighbours that overlap, where a filter computes rounding errors alone: none is lost.
TEST_P(Isas, RoundingErrorsLoseNoNeighbors) {
  Random random(11);
  const auto expect_pair = [&](const std::vector<DoubleVec3>& v, const Triangle& second,
                               bool floats) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, second};
    const std::vector<Vec3> w = to_floats(v);
    const TriangleMesh mesh = floats ? TriangleMesh(w, triangles) : TriangleMesh(v, triangles);
    EXPECT_EQ(find_self_intersections(mesh, options()).size(), 1u) << floats;
  };
  for (const bool floats : {true, false}) {
    const int most = floats ? 1 << 14 : 1 << 30;
    const double tiny = floats ? 0x1p-24 : 0x1p-53;
    for (int n = 0; n < 200; ++n) {
      // At vertex 0, two edges on the ray r, and the rest on both sides of a plane through it: its
      // normal (y, z - x, -y) and r have the product 0, whose terms are rounded.
      const double x = random.between(1, most), y = random.between(1, most),
                   z = random.between(1, most);
      expect_pair({{0, 0, 0},
                   {x, y, z},
                   {2 * x + y, 2 * y + z - x, 2 * z - y},
                   {3 * x, 3 * y, 3 * z},
                   {-y, x - z, y}},
                  {0, 3, 4}, floats);
      // In the plane x = 3 y, two triangles on one side of their edge. Differences are rounded.
      const auto point = [](double t, double height) { return DoubleVec3{3 * t, t, height}; };
      const auto odd = [&] { return 2.0 * random.between(1, 8) - 1; };
      expect_pair({point(odd() * tiny, 0), point(odd(), 0), point(odd(), 1), point(odd(), 2)},
                  {0, 1, 3}, floats);
    }
  }
}

TEST_P(Isas, FindAllPairsOfLargerMeshes) {
  const SmallMesh first = soup(1), second = soup(2), folded = sheet(24);
  EXPECT_EQ(find_self_intersections({to_floats(first.vertices), first.triangles}, options()),
            pairs_of(first));
  EXPECT_EQ(find_self_intersections({first.vertices, first.triangles}, options()), pairs_of(first));
  EXPECT_EQ(find_self_intersections({folded.vertices, folded.triangles}, options()),
            pairs_of(folded));
  EXPECT_EQ(find_intersections({first.vertices, first.triangles},
                               {second.vertices, second.triangles}, options()),
            pairs_of(first, second));
  Options brute = options();
  brute.algorithm = Algorithm::all_pairs;
  EXPECT_EQ(find_self_intersections({first.vertices, first.triangles}, brute), pairs_of(first));
}

TEST_P(Isas, WriteOnlyToTheirMemory) {
  const SmallMesh m = sheet(10);
  const std::vector<Vec3> v = to_floats(m.vertices);
  GuardedResource memory;
  Options guarded = options();
  guarded.memory = &memory;
  guarded.memory_cap_bytes = 1 << 24;
  MeshFinder finder(guarded);
  const MeshResult r =
      finder.consume({v, m.triangles}, [](const Pair*, std::size_t) { return true; });
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_TRUE(memory.check());
}

// On ordinary meshes of floats less than one test in a thousand is exact.
TEST_P(Isas, RarelyTestExactly) {
  const SmallMesh m = sheet(60);
  const std::vector<Vec3> v = to_floats(m.vertices);
  MeshFinder finder(options());
  const MeshResult r = finder.find({v, m.triangles});
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_GT(r.candidates, 30'000u);
  EXPECT_LT(r.exact_tests, r.candidates / 1000);
}

// Nor on flat ones, whose neighbours lie in one plane: a sheet in the plane z = x + y, a fan of
// thin triangles around a point, and a sheet made of unconnected triangles, which touch.
TEST_P(Isas, RarelyTestFlatMeshesExactly) {
  const auto exact_tests = [&](const SmallMesh& m) {
    MeshFinder finder(options());
    const MeshResult r = finder.find({to_floats(m.vertices), m.triangles});
    EXPECT_TRUE(r.ok()) << r.message;
    EXPECT_GT(r.candidates, m.triangles.size());
    EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), pairs_of(m));
    return r.exact_tests;
  };
  SmallMesh flat = sheet(16), fan;
  for (std::uint32_t i = 0; i < flat.vertices.size(); ++i) {
    // Multiples of 2^-7, so that all is exactly in one plane.
    const double x = 1.25 * (i % 17) / 16, y = 1.625 * (i / 17) / 16;
    flat.vertices[i] = {x, y, x + y};
  }
  EXPECT_EQ(exact_tests(flat), 0u);
  SmallMesh unconnected;
  for (const Triangle& t : flat.triangles) {
    const auto n = static_cast<std::uint32_t>(unconnected.vertices.size());
    for (const std::uint32_t i : {t.a, t.b, t.c}) unconnected.vertices.push_back(flat.vertices[i]);
    unconnected.triangles.push_back({n, n + 1, n + 2});
  }
  EXPECT_EQ(exact_tests(unconnected), 0u);
  fan.vertices.push_back({0, 0, 0});
  for (std::uint32_t i = 0; i <= 60; ++i) {
    const double x = std::round(512 * std::cos(0.1 * i)), y = std::round(512 * std::sin(0.1 * i));
    fan.vertices.push_back({x, y, 2 * x - y});
    if (i > 0) fan.triangles.push_back({0, i, i + 1});
  }
  EXPECT_EQ(exact_tests(fan), 0u);
}

std::string isa_name(const testing::TestParamInfo<Isa>& info) { return to_string(info.param); }
INSTANTIATE_TEST_SUITE_P(All, Isas,
                         testing::Values(Isa::scalar, Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon),
                         isa_name);

TEST(MeshFinder, LayoutsGiveTheSamePairs) {
  const SmallMesh m = sheet(20);
  const std::vector<Pair> want = pairs_of(m);
  struct Vertex {
    float other;
    Vec3 position;
    float normal[3];
  };
  struct Face {
    std::uint16_t material[2];
    Triangle triangle;
  };
  std::vector<Vertex> vertices;
  for (const Vec3& p : to_floats(m.vertices)) vertices.push_back({NAN, p, {}});
  std::vector<Face> faces;
  for (const Triangle& t : m.triangles) faces.push_back({{}, t});
  const TriangleMesh view(Vertices(&vertices[0].position, vertices.size(), sizeof(Vertex)),
                          &faces[0].triangle, faces.size(), sizeof(Face));
  EXPECT_EQ(find_self_intersections(view, canonical()), want);
}

TEST(MeshFinder, FormsAndOrdersGiveTheSamePairs) {
  const SmallMesh m = soup(3);
  const TriangleMesh view(m.vertices, m.triangles);
  const std::vector<Pair> want = pairs_of(m);
  ASSERT_GT(want.size(), 100u);
  for (const Order order : {Order::any, Order::canonical}) {
    for (const unsigned threads : {1u, 2u, 5u}) {
      Options options;
      options.order = order;
      options.threads = threads;
      MeshFinder finder(options);
      const auto check = [&](std::vector<Pair> got) {
        if (order == Order::any) std::sort(got.begin(), got.end());
        EXPECT_EQ(got, want);
      };
      MeshResult r = finder.find(view);
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(r.found, want.size());
      EXPECT_GE(r.candidates, r.found);
      check({finder.pairs().begin(), finder.pairs().end()});

      std::vector<Pair> buffer(want.size());
      r = finder.find(view, buffer.data(), buffer.size());
      ASSERT_TRUE(r.ok()) << r.message;
      check(buffer);
      EXPECT_TRUE(finder.pairs().empty());

      const std::size_t few = want.size() - 1;
      r = finder.find(view, buffer.data(), few);
      EXPECT_EQ(r.status, Status::buffer_too_small);
      EXPECT_EQ(r.found, want.size());
      EXPECT_EQ(r.written, order == Order::any ? few : 0);

      std::vector<Pair> consumed;
      r = finder.consume(view, [&consumed](const Pair* pairs, std::size_t count) {
        consumed.insert(consumed.end(), pairs, pairs + count);
        return true;
      });
      ASSERT_TRUE(r.ok()) << r.message;
      check(consumed);

      r = finder.consume(view, [](const Pair*, std::size_t) { return false; });
      EXPECT_EQ(r.status, Status::stopped);
    }
  }
}

TEST(MeshFinder, CandidatesAreTheOverlappingBoxes) {
  const SmallMesh m = soup(4);
  std::vector<Box> boxes;
  const std::vector<Vec3> v = to_floats(m.vertices);
  for (const Triangle& t : m.triangles) {
    const Vec3 &a = v[t.a], &b = v[t.b], &c = v[t.c];
    boxes.push_back(
        {{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})},
         {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})}});
  }
  MeshFinder finder;
  const MeshResult r = finder.find({v, m.triangles});
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r.candidates, find_pairs(boxes).size());
}

TEST(MeshFinder, AWarmFinderAllocatesNothing) {
  const SmallMesh m = sheet(40);
  SmallMesh moved = m;
  for (DoubleVec3& p : moved.vertices) p.z += 0.01;
  Options options;
  options.threads = 1;
  CountingResource memory;
  options.memory = &memory;
  MeshFinder finder(options);
  ASSERT_TRUE(finder.find({m.vertices, m.triangles}).ok());
  const std::size_t found = finder.pairs().size(), calls = memory.allocations();
  ASSERT_TRUE(finder.find({moved.vertices, m.triangles}).ok());
  EXPECT_EQ(memory.allocations(), calls);
  EXPECT_EQ(finder.pairs().size(), found);
  EXPECT_EQ(finder.memory_bytes(), memory.held());
}

TEST(MeshFinder, ATransformMovesAMesh) {
  const SmallMesh a = soup(5, 500), b = soup(6, 500);
  AffineTransform turn;
  const double c = std::cos(0.7), s = std::sin(0.7);
  turn.row[0][0] = c;
  turn.row[0][1] = -s;
  turn.row[0][3] = 0.1;
  turn.row[1][0] = s;
  turn.row[1][1] = c;
  turn.row[1][3] = -0.2;
  turn.row[2][3] = 0.05;
  SmallMesh turned = b;
  for (DoubleVec3& p : turned.vertices) {
    const auto row = [&p](const double(&m)[4]) {
      return ((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3];
    };
    p = {row(turn.row[0]), row(turn.row[1]), row(turn.row[2])};
  }
  const std::vector<Vec3> v = to_floats(a.vertices), w = to_floats(b.vertices);
  TriangleMesh placed(w, b.triangles);
  placed.transform = turn;
  EXPECT_EQ(find_intersections({v, a.triangles}, placed, canonical()), pairs_of(a, turned));
  EXPECT_EQ(find_intersections(placed, {v, a.triangles}, canonical()), pairs_of(turned, a));
  EXPECT_NE(pairs_of(a, turned), pairs_of(a, b));
  EXPECT_EQ(find_self_intersections(placed, canonical()), pairs_of(turned));
}

TEST(MeshFinder, ATransformIsRoundedAsDocumented) {
  // In doubles (1 + u) + u is 1, and 1 + (u + u) is not.
  constexpr double u = 0x1p-53;
  const std::vector<DoubleVec3> segment = {{1, u, u}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<DoubleVec3> wall = {{1, -1, -1}, {1, 1, -1}, {1, 0, 1}};
  const std::vector<Triangle> one = {{0, 1, 2}};
  TriangleMesh moved(segment, one);
  moved.transform = {{{1, 1, 1, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}}};
  EXPECT_EQ(find_intersections(moved, {wall, one}).size(), 1u);
  // A translation alone.
  moved.transform = {};
  EXPECT_EQ(find_intersections(moved, {wall, one}).size(), 1u);
  moved.transform.row[0][3] = -3;
  EXPECT_TRUE(find_intersections(moved, {wall, one}).empty());
}

// Triangles away from the other mesh take no part, and are not counted as inactive. The second
// sheet touches the first one in the plane x = 1, or overlaps a little of it, or is far away.
TEST(MeshFinder, FindsAllPairsOfMeshesThatOverlapALittle) {
  const SmallMesh a = sheet(24);
  double most = -1;
  for (const DoubleVec3& v : a.vertices) most = std::max(most, v.x);
  for (const double x : {most, 0.9, 5.0}) {
    SmallMesh b = sheet(24);
    double least = 1;
    for (const DoubleVec3& v : b.vertices) least = std::min(least, v.x);
    for (DoubleVec3& v : b.vertices) v.x = static_cast<double>(static_cast<float>(v.x - least + x));
    for (const unsigned threads : {1u, 2u}) {
      Options options = canonical();
      options.threads = threads;
      options.inverted = InvertedPolicy::refuse;
      MeshFinder finder(options);
      for (const bool floats : {true, false}) {
        const auto va = to_floats(a.vertices), vb = to_floats(b.vertices);
        const MeshResult r =
            floats ? finder.find({va, a.triangles}, {vb, b.triangles})
                   : finder.find({a.vertices, a.triangles}, {b.vertices, b.triangles});
        ASSERT_TRUE(r.ok()) << r.message;
        EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), pairs_of(a, b));
        EXPECT_EQ(r.inactive, 0u);
      }
      constexpr double distance = 0.1;
      std::vector<Pair> near;
      for (std::uint32_t i = 0; i < a.triangles.size(); ++i) {
        for (std::uint32_t j = 0; j < b.triangles.size(); ++j) {
          if (mesh::triangles_within(points_of(a, i), points_of(b, j), distance))
            near.push_back({i, j});
        }
      }
      const MeshResult r =
          finder.find_within({a.vertices, a.triangles}, {b.vertices, b.triangles}, distance);
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), near);
    }
  }
}

// Also where the search starts again with more space for pairs.
TEST(MeshFinder, CandidatesCountOnce) {
  const std::vector<DoubleVec3> v = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> equal(700, Triangle{0, 1, 2});
  MeshFinder finder;
  for (int i = 0; i < 2; ++i) {
    const MeshResult r = finder.find({v, equal});
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.candidates, 700u * 699 / 2);
    EXPECT_EQ(r.found, r.candidates);
  }
}

// Beyond the range of the filters, of either mesh and of either sign, every test is exact.
TEST(MeshFinder, LargeCoordinatesAreTestedExactly) {
  const SmallMesh m = sheet(7);
  for (const double large : {1e300, -1e300}) {
    for (const bool in_second : {false, true}) {
      SmallMesh a = m, b = m;
      (in_second ? b : a).vertices[5].z = large;
      MeshFinder finder(canonical());
      const MeshResult r = finder.find({a.vertices, a.triangles}, {b.vertices, b.triangles});
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_GT(r.candidates, 100u);
      EXPECT_EQ(r.exact_tests, r.candidates);
      EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), pairs_of(a, b));
    }
  }
}

TEST(MeshFinder, TheCallersFloatStateDoesNotMatter) {
  const SmallMesh m = small_mesh(MeshKind::nudged_grid, true, 3);
  const SmallMesh tiny = small_mesh(MeshKind::denormal, false, 4);
  const std::vector<Pair> want = pairs_of(m), of_tiny = pairs_of(tiny);
  TriangleMesh moved(m.vertices, m.triangles);
  moved.transform.row[0][0] = moved.transform.row[1][1] = 0.1;
  moved.transform.row[0][3] = 1 / 3.0;
  const std::vector<Pair> of_moved = find_self_intersections(moved, canonical());
  for (const unsigned threads : {1u, 2u}) {
    Options options = canonical();
    options.threads = threads;
    for (const int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      const ModifiedFloatState state(rounding, true);
      EXPECT_EQ(find_self_intersections({m.vertices, m.triangles}, options), want);
      EXPECT_EQ(find_self_intersections({tiny.vertices, tiny.triangles}, options), of_tiny);
      EXPECT_EQ(find_self_intersections(moved, options), of_moved);
      EXPECT_TRUE(state.unchanged());
    }
  }
}

TEST(MeshFinder, FiltersAreThoseOfBoxes) {
  const SmallMesh m = soup(7, 800);
  std::vector<std::uint32_t> group(m.triangles.size()), mask(m.triangles.size());
  std::vector<std::int32_t> world(m.triangles.size());
  for (std::size_t i = 0; i < group.size(); ++i) {
    group[i] = 1u << (i % 3);
    mask[i] = i % 2 ? 7u : 3u;
    world[i] = static_cast<std::int32_t>(i % 4) - 1;
  }
  TriangleMesh view(m.vertices, m.triangles);
  view.filters.group = {group.data(), group.size()};
  view.filters.mask = {mask.data(), mask.size()};
  view.filters.world = {world.data(), world.size()};
  std::vector<Pair> want;
  for (const Pair p : pairs_of(m)) {
    const std::int32_t wa = world[p.first], wb = world[p.second];
    if ((group[p.first] & mask[p.second]) && (group[p.second] & mask[p.first]) &&
        (wa == wb || wa == -1 || wb == -1)) {
      want.push_back(p);
    }
  }
  ASSERT_GT(want.size(), 10u);
  EXPECT_EQ(find_self_intersections(view, canonical()), want);
}

TEST(MeshFinder, WithinADistanceLeavesOutNeighbors) {
  const SmallMesh m = sheet(8);
  constexpr double distance = 0.05;
  std::vector<Pair> want;
  std::size_t neighbors = 0;
  for (std::uint32_t i = 0; i < m.triangles.size(); ++i) {
    for (std::uint32_t j = i + 1; j < m.triangles.size(); ++j) {
      if (!mesh::triangles_within(points_of(m, i), points_of(m, j), distance)) continue;
      const Triangle &s = m.triangles[i], &t = m.triangles[j];
      bool shared = false;
      for (const std::uint32_t v : {s.a, s.b, s.c}) shared |= v == t.a || v == t.b || v == t.c;
      if (!shared) want.push_back({i, j});
      neighbors += shared;
    }
  }
  EXPECT_GT(want.size(), 10u);
  EXPECT_GT(neighbors, 10u);
  EXPECT_EQ(find_within({m.vertices, m.triangles}, distance, canonical()), want);
  EXPECT_EQ(find_within({to_floats(m.vertices), m.triangles}, distance, canonical()), want);
  // Two meshes share no vertices, whatever their indices.
  const std::size_t of_two = 2 * (want.size() + neighbors) + m.triangles.size();
  const TriangleMesh view(m.vertices, m.triangles);
  EXPECT_EQ(find_within(view, view, distance).size(), of_two);
}

// A distance that enlarges boxes beyond the largest number.
TEST(MeshFinder, WithinADistanceAtTheEndsOfTheRange) {
  constexpr double most = std::numeric_limits<double>::max();
  const std::vector<DoubleVec3> v = {{-most, 0, 0}, {-most, 1, 0}, {-most, 0, 1},
                                     {most, 0, 0},  {most, 1, 0},  {most, 0, 1},
                                     {0, 0, 0},     {0, 1, 0},     {0, 0, 1}};
  const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  const TriangleMesh view(v, triangles);
  EXPECT_TRUE(find_within(view, 1e300, canonical()).empty());
  const std::vector<Pair> want = {{0, 2}, {1, 2}};
  EXPECT_EQ(find_within(view, most, canonical()), want);
}

// ---- what is refused ----------------------------------------------------------------------------

void expect_error(const TriangleMesh& view, Status status, const char* text,
                  const Options& options = {}) {
  MeshFinder finder(options);
  const MeshResult r = finder.find(view);
  EXPECT_EQ(r.status, status) << r.message;
  EXPECT_NE(std::strstr(r.message, text), nullptr) << r.message;
  EXPECT_TRUE(finder.pairs().empty());
  EXPECT_THROW((void)find_self_intersections(view, options), Error);
}

TEST(MeshFinder, NamesTheFirstBadTriangle) {
  SmallMesh m = sheet(30);
  std::vector<Vec3> v = to_floats(m.vertices);
  m.triangles[500].b = static_cast<std::uint32_t>(v.size());
  m.triangles[700].c = ~0u;
  expect_error(
      {v, m.triangles}, Status::bad_mesh,
      "triangle 500 of the mesh has vertex 961, but there are 961 vertices, counted from 0; "
      "fix the index (1 more bad triangle)");
  // Whichever of its vertices it is.
  const SmallMesh other = sheet(5);
  for (std::uint32_t Triangle::*const vertex : {&Triangle::a, &Triangle::b, &Triangle::c}) {
    SmallMesh one = sheet(4);
    one.triangles[3].*vertex = 25;
    const TriangleMesh bad(one.vertices, one.triangles);
    MeshFinder finder;
    EXPECT_STREQ(finder.find(bad).message,
                 "triangle 3 of the mesh has vertex 25, but there are 25 vertices, counted from 0; "
                 "fix the index");
    EXPECT_STREQ(finder.find({other.vertices, other.triangles}, bad).message,
                 "triangle 3 of the second mesh has vertex 25, but there are 25 vertices, counted "
                 "from 0; fix the index");
  }
  m.triangles[500].b = 0;
  m.triangles[700].c = 0;
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    v[m.triangles[300].c].y = bad;
    MeshFinder finder;
    const MeshResult r = finder.find({v, m.triangles});
    EXPECT_EQ(r.status, Status::bad_mesh);
    std::uint64_t users = 0, first = ~std::uint64_t{0};
    for (std::size_t i = 0; i < m.triangles.size(); ++i) {
      const Triangle& t = m.triangles[i];
      const std::uint32_t it = m.triangles[300].c;
      if (t.a != it && t.b != it && t.c != it) continue;
      ++users;
      first = std::min<std::uint64_t>(first, i);
    }
    EXPECT_EQ(r.invalid_count, users);
    EXPECT_EQ(r.first_invalid, first);
    EXPECT_NE(std::strstr(r.message, "coordinates must be finite"), nullptr) << r.message;
    const std::string vertex = "uses vertex " + std::to_string(m.triangles[300].c) + " at (";
    EXPECT_NE(std::strstr(r.message, vertex.c_str()), nullptr) << r.message;
  }
}

TEST(MeshFinder, UnusedVerticesMayBeAnything) {
  const SmallMesh m = sheet(10);
  std::vector<Vec3> v = to_floats(m.vertices);
  v.push_back({NAN, INFINITY, 0});
  EXPECT_EQ(find_self_intersections({v, m.triangles}, canonical()), pairs_of(m));
}

TEST(MeshFinder, RefusesWhatItCannotRead) {
  const SmallMesh m = sheet(4);
  const std::vector<Vec3> v = to_floats(m.vertices);
  expect_error(TriangleMesh(v, nullptr, 3), Status::bad_mesh, "array is null");
  expect_error(TriangleMesh(Vertices(static_cast<const Vec3*>(nullptr), 9), m.triangles),
               Status::bad_mesh, "vertices but their array is null");
  expect_error(TriangleMesh(v, m.triangles.data(), m.triangles.size(), 13), Status::bad_mesh,
               "13 bytes; it must be a multiple of 4");
  expect_error(TriangleMesh(Vertices(v.data(), v.size(), 14), m.triangles), Status::bad_mesh,
               "14 bytes; it must be a multiple of 4");
  expect_error(TriangleMesh(Vertices(m.vertices.data(), m.vertices.size(), 28), m.triangles),
               Status::bad_mesh, "28 bytes; it must be a multiple of 8");
  expect_error(TriangleMesh(v, m.triangles.data(), max_box_count + 1, 0), Status::too_many_boxes,
               "at most 4294901760");
  expect_error(TriangleMesh(Vertices(), m.triangles), Status::bad_mesh, "there are 0 vertices");
  Options options;
  options.margin = 1;
  expect_error({v, m.triangles}, Status::bad_option, "use find_within", options);
  options.margin = 0;
  options.cell_scale = 0;
  expect_error({v, m.triangles}, Status::bad_option, "the cell scale is 0", options);
  TriangleMesh filtered(v, m.triangles);
  const std::uint32_t one = 1;
  filtered.filters.group = {&one, 1};
  expect_error(filtered, Status::bad_filter,
               "has 1 values for 32 triangles; give one value per triangle");
  TriangleMesh placed(v, m.triangles);
  placed.transform.row[1][2] = NAN;
  expect_error(placed, Status::bad_mesh, "the transform of the mesh has the value nan");
  placed.transform.row[1][2] = 1e300;
  placed.transform.row[1][1] = 1e300;
  placed.transform.row[1][3] = 1.7e308;
  MeshFinder finder;
  EXPECT_TRUE(finder.find(placed).ok());
  for (const double d : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    const MeshResult r = finder.find_within({v, m.triangles}, d);
    EXPECT_EQ(r.status, Status::bad_option);
    EXPECT_NE(std::strstr(r.message, "distance"), nullptr) << r.message;
  }
}

TEST(MeshFinder, EmptyAndSingleMeshes) {
  const SmallMesh m = sheet(4);
  EXPECT_TRUE(find_self_intersections(TriangleMesh()).empty());
  EXPECT_TRUE(find_self_intersections({m.vertices, m.triangles.data(), 1}).empty());
  EXPECT_TRUE(find_intersections(TriangleMesh(), {m.vertices, m.triangles}).empty());
  const std::vector<Triangle> equal(100, Triangle{0, 1, 6});
  EXPECT_EQ(find_self_intersections({m.vertices, equal}).size(), 100u * 99 / 2);
}

TEST(MeshFinder, StopsWhenItIsStopped) {
  const SmallMesh m = soup(8);
  std::atomic<bool> stop{true};
  Options options;
  options.stop = &stop;
  MeshFinder finder(options);
  EXPECT_EQ(finder.find({m.vertices, m.triangles}).status, Status::stopped);
  stop = false;
  EXPECT_TRUE(finder.find({m.vertices, m.triangles}).ok());
}

// Boxes that all overlap are one column of the grid; the search stops inside of it.
TEST(MeshFinder, StopsInsideAColumn) {
  SmallMesh m;
  m.vertices = {{0, 0, 0}, {1, 0, 1}, {0, 1, 1}};
  m.triangles.assign(2'000, {0, 1, 2});
  Options options;
  options.threads = 1;
  options.algorithm = Algorithm::grid;
  MeshFinder finder(options);
  std::size_t seen = 0;
  const MeshResult r =
      finder.consume({m.vertices, m.triangles}, [&seen](const Pair*, std::size_t count) {
        seen += count;
        return false;
      });
  EXPECT_EQ(r.status, Status::stopped) << r.message;
  EXPECT_GT(seen, 0u);
  EXPECT_LT(r.candidates, 20'000u);  // of 1,999,000
}

TEST(MeshFinder, AMemoryCapHoldsOrNamesWhatIsNeeded) {
  const SmallMesh m = soup(9, 20'000, 0.05);
  const std::vector<Vec3> v = to_floats(m.vertices);
  for (const Order order : {Order::any, Order::canonical}) {
    Options options;
    options.order = order;
    CountingResource memory;
    options.memory = &memory;
    std::uint64_t found = 0;
    options.memory_cap_bytes = 1;
    MeshFinder finder(options);
    MeshResult r;
    // One message is enough, even if the cap does not suffice for the boxes.
    for (int tries = 0; tries < 2; ++tries) {
      found = 0;
      r = finder.consume({v, m.triangles}, [&found](const Pair*, std::size_t count) {
        found += count;
        return true;
      });
      if (r.status != Status::memory_cap_too_small) break;
      // Not even memory for the boxes is taken.
      if (tries == 0) {
        EXPECT_LT(memory.peak(), m.triangles.size() * sizeof(Box));
      }
      ASSERT_GT(r.bytes_needed, options.memory_cap_bytes);
      options.memory_cap_bytes = r.bytes_needed;
      finder.set_options(options);
    }
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_LE(finder.memory_bytes(), options.memory_cap_bytes);
    EXPECT_EQ(found, r.found);
    EXPECT_EQ(found, find_self_intersections({v, m.triangles}).size());
  }
}

}  // namespace
}  // namespace throng::tests
