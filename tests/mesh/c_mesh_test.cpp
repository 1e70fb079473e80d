// The C API of meshes: the pairs of the C++ API in every layout and form, and its errors.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <throng/mesh.hpp>

#include "mesh/mesh_cases.hpp"
#include "support/aligned_memory.hpp"

namespace throng::tests {
namespace {

using Found = std::vector<Pair>;

Found copied(const throng_pair* pairs, size_t count) {
  Found found;
  for (size_t i = 0; i < count; ++i) found.push_back({pairs[i].first, pairs[i].second});
  return found;
}

// Consumes all pairs, or `most` blocks.
struct Taken {
  Found pairs;
  int most = std::numeric_limits<int>::max();
  static int take(void* self, const throng_pair* pairs, size_t count) {
    Taken& t = *static_cast<Taken*>(self);
    const Found block = copied(pairs, count);
    t.pairs.insert(t.pairs.end(), block.begin(), block.end());
    return --t.most > 0;
  }
};

// Arrays of a mesh for both APIs.
struct Mesh {
  explicit Mesh(const SmallMesh& m)
      : vertices(m.vertices), floats(to_floats(m.vertices)), triangles(m.triangles) {}
  const uint32_t* indices() const { return &triangles[0].a; }
  throng_mesh c_floats() const {
    return throng_mesh_packed(&floats[0].x, floats.size(), indices(), triangles.size());
  }
  throng_mesh c_doubles() const {
    return throng_mesh_packed_doubles(&vertices[0].x, vertices.size(), indices(), triangles.size());
  }

  std::vector<DoubleVec3> vertices;
  std::vector<Vec3> floats;
  std::vector<Triangle> triangles;
};

// Memory of the caller, with a limit.
struct CallersMemory {
  std::atomic<size_t> held{0};
  size_t limit = std::numeric_limits<size_t>::max();
  static void* allocate(void* self, size_t bytes, size_t alignment) {
    CallersMemory& m = *static_cast<CallersMemory*>(self);
    if (m.held + bytes > m.limit) return nullptr;
    m.held += bytes;
    return allocate_aligned(bytes, alignment);
  }
  static void deallocate(void* self, void* p, size_t bytes, size_t) {
    static_cast<CallersMemory*>(self)->held -= bytes;
    free_aligned(p);
  }
};

class CMesh : public testing::Test {
 protected:
  void SetUp() override {
    throng_options_init(&options_);
    options_.order = THRONG_ORDER_CANONICAL;
    canonical_.order = Order::canonical;
  }
  void TearDown() override { throng_mesh_finder_destroy(finder_); }

  throng_mesh_finder* finder() {
    if (!finder_) finder_ = throng_mesh_finder_create(&options_);
    return finder_;
  }
  const throng_result& result() { return *throng_mesh_finder_result(finder_); }
  std::string message() { return result().message; }
  Found pairs() {
    size_t count = 0;
    const throng_pair* const found = throng_mesh_finder_pairs(finder_, &count);
    return copied(found, count);
  }
  Found find(const throng_mesh& a, const throng_mesh* b = nullptr) {
    EXPECT_EQ(throng_mesh_finder_find(finder(), &a, b), THRONG_OK) << message();
    EXPECT_EQ(result().found, pairs().size());
    return pairs();
  }
  void expect_refused(const throng_mesh& a, throng_status status, const char* text) {
    EXPECT_EQ(throng_mesh_finder_find(finder(), &a, nullptr), status);
    EXPECT_NE(message().find(text), std::string::npos) << message();
    EXPECT_EQ(result().found, 0u);
    EXPECT_TRUE(pairs().empty());
  }

  const Mesh a_{small_mesh(MeshKind::grid, true, 1, 60)};
  const Mesh b_{small_mesh(MeshKind::grid, true, 2, 60)};
  throng_options options_;
  Options canonical_;
  throng_mesh_finder* finder_ = nullptr;
};

TEST_F(CMesh, FloatsAndDoublesGiveThePairsOfTheCppApi) {
  for (int kind = 0; kind < static_cast<int>(MeshKind::count); ++kind) {
    for (const bool floats : {false, true}) {
      const Mesh a(small_mesh(static_cast<MeshKind>(kind), floats, 3));
      const Mesh b(small_mesh(static_cast<MeshKind>(kind), floats, 4));
      const Found one = find_self_intersections({a.vertices, a.triangles}, canonical_);
      const Found two =
          find_intersections({a.vertices, a.triangles}, {b.vertices, b.triangles}, canonical_);
      const throng_mesh c_a = a.c_doubles(), c_b = b.c_doubles();
      EXPECT_EQ(find(c_a), one) << kind;
      EXPECT_EQ(find(c_a, &c_b), two) << kind;
      if (!floats) continue;
      const throng_mesh float_a = a.c_floats(), float_b = b.c_floats();
      EXPECT_EQ(find(float_a), one) << kind;
      EXPECT_EQ(find(float_a, &float_b), two) << kind;
      EXPECT_EQ(find(c_a, &float_b), two) << kind;
    }
  }
}

TEST_F(CMesh, TheResultHasTheCounters) {
  MeshFinder cpp(canonical_);
  const MeshResult want = cpp.find({a_.floats, a_.triangles});
  ASSERT_TRUE(want.ok());
  ASSERT_GT(want.found, 10u);
  ASSERT_GT(want.exact_tests, 0u);
  EXPECT_EQ(find(a_.c_floats()).size(), want.found);
  EXPECT_EQ(result().candidates, want.candidates);
  EXPECT_EQ(result().exact_tests, want.exact_tests);
  EXPECT_GT(throng_mesh_finder_memory_bytes(finder_), 0u);
  // A refused call has none.
  EXPECT_EQ(throng_mesh_finder_find(finder_, nullptr, nullptr), THRONG_BAD_MESH);
  EXPECT_EQ(result().candidates, 0u);
  EXPECT_EQ(result().exact_tests, 0u);
}

TEST_F(CMesh, StridedArrays) {
  struct Vertex {
    float other[2];
    Vec3 position;
  };
  struct Face {
    Triangle triangle;
    uint32_t material;
  };
  std::vector<Vertex> vertices;
  for (const Vec3& p : a_.floats) vertices.push_back({{NAN, 0}, p});
  std::vector<Face> faces;
  for (const Triangle& t : a_.triangles) faces.push_back({t, 7});
  throng_mesh mesh = throng_mesh_packed(&vertices[0].position.x, vertices.size(),
                                        &faces[0].triangle.a, faces.size());
  mesh.vertices.stride_bytes = sizeof(Vertex);
  mesh.triangles.stride_bytes = sizeof(Face);
  EXPECT_EQ(find(mesh), find_self_intersections({a_.vertices, a_.triangles}, canonical_));
}

TEST_F(CMesh, FormsGiveTheSamePairs) {
  const throng_mesh a = a_.c_floats(), b = b_.c_floats();
  for (const throng_mesh* second : {static_cast<const throng_mesh*>(nullptr), &b}) {
    const Found want = find(a, second);
    ASSERT_GT(want.size(), 10u);
    std::vector<throng_pair> out(want.size(), throng_pair{7, 7});
    ASSERT_EQ(throng_mesh_finder_find_into(finder_, &a, second, out.data(), out.size()), THRONG_OK)
        << message();
    EXPECT_EQ(copied(out.data(), result().written), want);
    EXPECT_TRUE(pairs().empty());
    EXPECT_EQ(throng_mesh_finder_find_into(finder_, &a, second, out.data(), out.size() - 1),
              THRONG_BUFFER_TOO_SMALL);
    EXPECT_EQ(result().found, want.size());
    Taken taken;
    ASSERT_EQ(throng_mesh_finder_consume(finder_, &a, second, Taken::take, &taken), THRONG_OK)
        << message();
    EXPECT_EQ(taken.pairs, want);
    Taken first_block;
    first_block.most = 1;
    EXPECT_EQ(throng_mesh_finder_consume(finder_, &a, second, Taken::take, &first_block),
              THRONG_STOPPED);
    EXPECT_EQ(throng_mesh_finder_consume(finder_, &a, second, nullptr, nullptr), THRONG_BAD_OPTION);
    EXPECT_NE(message().find("consumer"), std::string::npos) << message();
  }
}

TEST_F(CMesh, FormsWithinADistanceGiveThePairsOfTheCppApi) {
  const throng_mesh a = a_.c_doubles(), b = b_.c_doubles();
  const TriangleMesh cpp_a(a_.vertices, a_.triangles), cpp_b(b_.vertices, b_.triangles);
  for (const double distance : {0.0, 0.6}) {
    for (const bool two : {false, true}) {
      const Found want = two ? find_within(cpp_a, cpp_b, distance, canonical_)
                             : find_within(cpp_a, distance, canonical_);
      const throng_mesh* const second = two ? &b : nullptr;
      ASSERT_GT(want.size(), 10u);
      ASSERT_EQ(throng_mesh_finder_find_within(finder(), &a, second, distance), THRONG_OK)
          << message();
      EXPECT_EQ(pairs(), want);
      std::vector<throng_pair> out(want.size());
      ASSERT_EQ(throng_mesh_finder_find_within_into(finder_, &a, second, distance, out.data(),
                                                    out.size()),
                THRONG_OK)
          << message();
      EXPECT_EQ(copied(out.data(), out.size()), want);
      Taken taken;
      ASSERT_EQ(
          throng_mesh_finder_consume_within(finder_, &a, second, distance, Taken::take, &taken),
          THRONG_OK)
          << message();
      EXPECT_EQ(taken.pairs, want);
    }
  }
  EXPECT_EQ(throng_mesh_finder_find_within(finder(), &a, nullptr, -1), THRONG_BAD_OPTION);
}

TEST_F(CMesh, DescribesThePairsAsTheCppApi) {
  const throng_mesh a = a_.c_floats(), b = b_.c_doubles();
  const TriangleMesh cpp_a(a_.floats, a_.triangles), cpp_b(b_.vertices, b_.triangles);
  for (const bool two : {false, true}) {
    const throng_mesh* const second = two ? &b : nullptr;
    const Found found = find(a, second);
    const auto want =
        describe_intersections(cpp_a, two ? cpp_b : cpp_a, found.data(), found.size());
    size_t count = 0;
    const throng_pair* const c_pairs = throng_mesh_finder_pairs(finder_, &count);
    std::vector<throng_intersection> got(count);
    ASSERT_EQ(throng_mesh_finder_describe(finder_, &a, second, c_pairs, count, got.data()),
              THRONG_OK)
        << message();
    EXPECT_EQ(result().found, count);
    EXPECT_EQ(pairs(), found);
    int kinds[3] = {};
    for (std::size_t i = 0; i < count; ++i) {
      ++kinds[got[i].kind];
      ASSERT_EQ(got[i].kind, static_cast<uint8_t>(want[i].kind));
      ASSERT_EQ(got[i].point_count, want[i].point_count);
      for (int k = 0; k < got[i].point_count; ++k) {
        EXPECT_EQ(got[i].points[k][0], want[i].points[k].x);
        EXPECT_EQ(got[i].points[k][1], want[i].points[k].y);
        EXPECT_EQ(got[i].points[k][2], want[i].points[k].z);
      }
    }
    EXPECT_GT(kinds[THRONG_INTERSECTION_CROSSING], 0);
    EXPECT_GT(kinds[THRONG_INTERSECTION_TOUCHING], 0);
  }
}

TEST_F(CMesh, DescribesAMovedMesh) {
  const double transform[12] = {0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 0};
  throng_mesh a = a_.c_floats(), b = b_.c_doubles();
  b.transform = transform;
  TriangleMesh cpp_b(b_.vertices, b_.triangles);
  std::copy(transform, transform + 12, &cpp_b.transform.row[0][0]);
  const Found found = find(a, &b);
  const auto want =
      describe_intersections({a_.floats, a_.triangles}, cpp_b, found.data(), found.size());
  size_t count = 0;
  const throng_pair* const c_pairs = throng_mesh_finder_pairs(finder_, &count);
  ASSERT_GT(count, 10u);
  std::vector<throng_intersection> got(count);
  ASSERT_EQ(throng_mesh_finder_describe(finder_, &a, &b, c_pairs, count, got.data()), THRONG_OK)
      << message();
  for (std::size_t i = 0; i < count; ++i) {
    ASSERT_GE(got[i].point_count, 1);
    ASSERT_EQ(got[i].point_count, want[i].point_count);
    EXPECT_EQ(got[i].points[0][0], want[i].points[0].x);
    EXPECT_EQ(got[i].points[0][1], want[i].points[0].y);
    EXPECT_EQ(got[i].points[0][2], want[i].points[0].z);
  }
}

TEST_F(CMesh, DescribesWithoutTheTransformAsNone) {
  const double transform[12] = {1, 0, 0, 500, 0, 1, 0, 0, 0, 0, 1, 0};
  throng_mesh a = a_.c_floats();
  const throng_mesh b = b_.c_doubles();
  const Found found = find(a, &b);
  ASSERT_GT(found.size(), 0u);
  a.transform = transform;
  throng_intersection out[1] = {};
  ASSERT_EQ(throng_mesh_finder_describe(finder_, &a, &b, throng_mesh_finder_pairs(finder_, nullptr),
                                        1, out),
            THRONG_OK)
      << message();
  EXPECT_EQ(out[0].kind, THRONG_INTERSECTION_NONE);
  EXPECT_EQ(out[0].point_count, 0);
}

TEST_F(CMesh, DescribeRefusesWhatItCannotRead) {
  const throng_mesh a = a_.c_floats();
  const throng_pair out_of_range = {0, 60};
  throng_intersection out;
  const auto describe = [&](const throng_mesh* mesh, const throng_pair* p, throng_intersection* o) {
    return throng_mesh_finder_describe(finder(), mesh, nullptr, p, 1, o);
  };
  EXPECT_EQ(describe(&a, &out_of_range, &out), THRONG_BAD_MESH);
  EXPECT_NE(message().find("but the mesh has 60 triangles"), std::string::npos) << message();
  EXPECT_EQ(throng_mesh_finder_describe(finder_, &a, &a, &out_of_range, 1, &out), THRONG_BAD_MESH);
  EXPECT_NE(message().find("but the second mesh has 60 triangles"), std::string::npos) << message();
  EXPECT_EQ(result().found, 0u);
  EXPECT_EQ(describe(nullptr, &out_of_range, &out), THRONG_BAD_MESH);
  EXPECT_EQ(describe(&a, nullptr, &out), THRONG_BAD_OPTION);
  EXPECT_EQ(describe(&a, &out_of_range, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("give both"), std::string::npos) << message();
  throng_mesh both = a;
  both.vertices.doubles = &a_.vertices[0].x;
  EXPECT_EQ(describe(&both, &out_of_range, &out), THRONG_BAD_MESH);
  EXPECT_EQ(throng_mesh_finder_describe(finder_, &a, nullptr, nullptr, 0, nullptr), THRONG_OK);
  EXPECT_EQ(throng_mesh_finder_describe(nullptr, &a, nullptr, nullptr, 0, nullptr),
            THRONG_OUT_OF_MEMORY);
}

TEST_F(CMesh, ATransformAndFilters) {
  const double transform[12] = {0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 0};
  throng_mesh b = b_.c_floats();
  b.transform = transform;
  TriangleMesh cpp_b(b_.floats, b_.triangles);
  std::copy(transform, transform + 12, &cpp_b.transform.row[0][0]);
  throng_mesh a = a_.c_floats();
  TriangleMesh cpp_a(a_.floats, a_.triangles);
  const Found moved = find(a, &b);
  EXPECT_EQ(moved, find_intersections(cpp_a, cpp_b, canonical_));
  b.transform = nullptr;
  EXPECT_NE(moved, find(a, &b));

  const std::size_t n = a_.triangles.size();
  std::vector<uint32_t> group, mask;
  std::vector<int32_t> owner, world;
  std::vector<uint8_t> is_static;
  for (std::size_t i = 0; i < n; ++i) {
    group.push_back(1u << i % 3);
    mask.push_back(i % 2 ? 7 : 3);
    owner.push_back(static_cast<int32_t>(i % 5));
    world.push_back(static_cast<int32_t>(i % 4) - 1);
    is_static.push_back(i % 6 == 0);
  }
  // Each filter alone changes the pairs, so a filter that is not passed on is noticed.
  const Found all = find(a);
  const auto check = [&] {
    const Found filtered = find(a);
    EXPECT_EQ(filtered, find_self_intersections(cpp_a, canonical_));
    EXPECT_LT(filtered.size(), all.size());
    a.group = a.mask = a.owner = a.world = a.is_static = {};
    cpp_a.filters = {};
  };
  a.group = {group.data(), 0};
  cpp_a.filters.group = {group.data(), n};
  a.mask = {mask.data(), 0};
  cpp_a.filters.mask = {mask.data(), n};
  check();
  a.owner = {owner.data(), 0};
  cpp_a.filters.owner = {owner.data(), n};
  check();
  a.world = {world.data(), sizeof(int32_t)};
  cpp_a.filters.world = {world.data(), n};
  check();
  a.is_static = {is_static.data(), 0};
  cpp_a.filters.is_static = {is_static.data(), n};
  check();
}

TEST_F(CMesh, ATransformAndAFilterWithinADistance) {
  const double transform[12] = {0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 3};
  throng_mesh a = a_.c_floats(), b = b_.c_floats();
  TriangleMesh cpp_a(a_.floats, a_.triangles), cpp_b(b_.floats, b_.triangles);
  b.transform = transform;
  std::copy(transform, transform + 12, &cpp_b.transform.row[0][0]);
  std::vector<uint32_t> group, mask(b_.triangles.size(), 1);
  for (std::size_t i = 0; i < a_.triangles.size(); ++i) group.push_back(i % 2 ? 1 : 2);
  const auto found = [&] {
    EXPECT_EQ(throng_mesh_finder_find_within(finder(), &a, &b, 0.3), THRONG_OK) << message();
    EXPECT_EQ(pairs(), find_within(cpp_a, cpp_b, 0.3, canonical_));
    return pairs().size();
  };
  const std::size_t all = found();
  a.group = {group.data(), 0};
  b.mask = {mask.data(), 0};
  cpp_a.filters.group = {group.data(), group.size()};
  cpp_b.filters.mask = {mask.data(), mask.size()};
  const std::size_t some = found();
  EXPECT_GT(some, 0u);
  EXPECT_LT(some, all);
}

TEST_F(CMesh, Errors) {
  const throng_mesh good = a_.c_floats();
  throng_mesh mesh = good;
  std::vector<Triangle> triangles = a_.triangles;
  triangles[41].b = triangles[50].c = 1000;
  mesh.triangles.indices = &triangles[0].a;
  expect_refused(mesh, THRONG_BAD_MESH, "triangle 41 of the mesh has vertex 1000");
  EXPECT_EQ(result().first_invalid, 41u);
  EXPECT_EQ(result().invalid_count, 2u);
  mesh = good;
  mesh.vertices.doubles = &a_.vertices[0].x;
  expect_refused(mesh, THRONG_BAD_MESH, "as floats and as doubles");
  EXPECT_EQ(throng_mesh_finder_find(finder_, &good, &mesh), THRONG_BAD_MESH);
  mesh.vertices.floats = nullptr;
  mesh.vertices.doubles = nullptr;
  expect_refused(mesh, THRONG_BAD_MESH, "vertices but their array is null");
  mesh = good;
  mesh.triangles.stride_bytes = 13;
  expect_refused(mesh, THRONG_BAD_MESH, "13 bytes");
  EXPECT_EQ(throng_mesh_finder_find(finder_, nullptr, nullptr), THRONG_BAD_MESH);
  EXPECT_NE(message().find("found no mesh (NULL)"), std::string::npos) << message();
  EXPECT_TRUE(find(throng_mesh{}).empty());
}

TEST_F(CMesh, Options) {
  const throng_mesh a = a_.c_floats();
  options_.margin = 1;
  EXPECT_EQ(throng_mesh_finder_find(finder(), &a, nullptr), THRONG_BAD_OPTION);
  TearDown();
  finder_ = nullptr;
  options_.margin = 0;
  options_.struct_bytes = 0;
  EXPECT_EQ(throng_mesh_finder_find(finder(), &a, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("throng_options_init"), std::string::npos) << message();
}

TEST_F(CMesh, CallersMemoryAndThreads) {
  const throng_mesh a = a_.c_floats();
  const Found want = find(a);
  TearDown();
  finder_ = nullptr;
  CallersMemory memory;
  unsigned runs = 0;
  options_.allocate = CallersMemory::allocate;
  options_.deallocate = CallersMemory::deallocate;
  options_.memory_self = &memory;
  options_.concurrency = 2;
  options_.run_self = &runs;
  options_.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    ++*static_cast<unsigned*>(self);
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  EXPECT_EQ(find(a), want);
  EXPECT_EQ(throng_mesh_finder_memory_bytes(finder_), memory.held);
  const Mesh large(small_mesh(MeshKind::random, true, 5, 8000));
  const throng_mesh more = large.c_floats();
  Taken taken;
  taken.most = 1;
  EXPECT_EQ(throng_mesh_finder_consume(finder_, &more, nullptr, Taken::take, &taken),
            THRONG_STOPPED);
  EXPECT_GT(runs, 0u);
  TearDown();
  finder_ = nullptr;
  EXPECT_EQ(memory.held, 0u);
  memory.limit = 1000;
  EXPECT_EQ(throng_mesh_finder_find(finder(), &a, nullptr), THRONG_OUT_OF_MEMORY);
  EXPECT_GT(result().bytes_needed, 0u);
  // Describing takes no memory from it.
  const throng_pair pair = {want[0].first, want[0].second};
  throng_intersection out;
  EXPECT_EQ(throng_mesh_finder_describe(finder_, &a, nullptr, &pair, 1, &out), THRONG_OK)
      << message();
}

TEST_F(CMesh, MemoryCap) {
  const Mesh large(small_mesh(MeshKind::grid, true, 6, 2000));
  const throng_mesh mesh = large.c_floats();
  const Found want = find_self_intersections({large.floats, large.triangles}, canonical_);
  options_.memory_cap_bytes = 1000;
  Taken taken;
  EXPECT_EQ(throng_mesh_finder_consume(finder(), &mesh, nullptr, Taken::take, &taken),
            THRONG_MEMORY_CAP_TOO_SMALL);
  EXPECT_GT(result().bytes_needed, 1000u);
  EXPECT_TRUE(taken.pairs.empty());
  TearDown();
  finder_ = nullptr;
  options_.memory_cap_bytes = 1 << 20;
  options_.order = THRONG_ORDER_ANY;
  EXPECT_EQ(throng_mesh_finder_consume(finder(), &mesh, nullptr, Taken::take, &taken), THRONG_OK)
      << message();
  EXPECT_LE(throng_mesh_finder_memory_bytes(finder_), std::size_t{1} << 20);
  std::sort(taken.pairs.begin(), taken.pairs.end());
  EXPECT_EQ(taken.pairs, want);
}

// Every instruction set gives the same pairs, or is refused.
TEST_F(CMesh, InstructionSetsAndAlgorithms) {
  const throng_mesh a = a_.c_floats(), b = b_.c_doubles();
  const Found one = find(a), two = find(a, &b);
  for (int isa = THRONG_ISA_SCALAR; isa <= THRONG_ISA_WASM; ++isa) {
    for (int algorithm = THRONG_ALGORITHM_AUTOMATIC; algorithm <= THRONG_ALGORITHM_GRID;
         ++algorithm) {
      TearDown();
      finder_ = nullptr;
      options_.isa = isa;
      options_.algorithm = algorithm;
      options_.threads = 2;
      const throng_status status = throng_mesh_finder_find(finder(), &a, nullptr);
      if (status == THRONG_UNSUPPORTED_ISA && isa != THRONG_ISA_SCALAR) continue;
      ASSERT_EQ(status, THRONG_OK) << message();
      EXPECT_EQ(pairs(), one) << isa << " " << algorithm;
      EXPECT_EQ(find(a, &b), two) << isa << " " << algorithm;
      EXPECT_EQ(result().isa, isa);
    }
  }
}

// Stops the call from a task of its own executor.
TEST_F(CMesh, Stop) {
  static throng_mesh_finder* running;
  options_.stoppable = 1;
  options_.concurrency = 2;
  options_.run = [](void*, unsigned count, void (*task)(void*, unsigned), void* context) {
    throng_mesh_finder_stop(running);
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  running = finder();
  const Mesh large(small_mesh(MeshKind::random, true, 5, 40'000));
  const throng_mesh mesh = large.c_floats();
  std::uint64_t taken = 0;
  const auto take = [](void* context, const throng_pair*, size_t count) {
    *static_cast<std::uint64_t*>(context) += count;
    return 1;
  };
  EXPECT_EQ(throng_mesh_finder_consume(running, &mesh, nullptr, take, &taken), THRONG_STOPPED);
  EXPECT_EQ(result().found, 0u);
  const throng_pair pair = {0, 1};
  throng_intersection out;
  EXPECT_EQ(throng_mesh_finder_describe(running, &mesh, nullptr, &pair, 1, &out), THRONG_STOPPED);
  EXPECT_EQ(result().found, 0u);
}

TEST(CMeshFinder, NoHandle) {
  throng_mesh_finder* const none = nullptr;
  const throng_mesh mesh{};
  size_t count = 1;
  EXPECT_EQ(throng_mesh_finder_find(none, &mesh, nullptr), THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_mesh_finder_pairs(none, &count), nullptr);
  EXPECT_EQ(count, 0u);
  EXPECT_EQ(throng_mesh_finder_pairs(none, nullptr), nullptr);
  EXPECT_EQ(throng_mesh_finder_result(none)->status, THRONG_OUT_OF_MEMORY);
  EXPECT_EQ(throng_mesh_finder_result(none)->exact_tests, 0u);
  EXPECT_EQ(throng_mesh_finder_memory_bytes(none), 0u);
  throng_mesh_finder_stop(none);
  throng_mesh_finder_destroy(none);
}

}  // namespace
}  // namespace throng::tests
