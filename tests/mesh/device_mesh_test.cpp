// Intersections of triangles by the device pipeline on the host: against the double loop, against
// the CPU's search, and on a device whose memory the host cannot access.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <throng/throng.hpp>

#include "device/collected.hpp"
#include "device/discrete_device.hpp"
#include "device/engine.hpp"
#include "device/mesh_job.hpp"
#include "mesh/larger_meshes.hpp"
#include "mesh/mesh_cases.hpp"
#include "support/counting_resource.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {

using device::Collected;
using device::DiscreteDevice;

Options emulated(Order order = Order::canonical, Algorithm algorithm = Algorithm::automatic) {
  Options options;
  options.backend = Backend::emulated;
  options.order = order;
  options.algorithm = algorithm;
  return options;
}
Options on_cpu() {
  Options options;
  options.order = Order::canonical;
  options.isa = Isa::scalar;
  return options;
}

SmallMesh scaled(SmallMesh m, double by) {
  for (DoubleVec3& p : m.vertices) p = {p.x * by, p.y * by, p.z * by};
  return m;
}
SmallMesh joined(SmallMesh a, const SmallMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles)
    a.triangles.push_back({t.a + first, t.b + first, t.c + first});
  return a;
}
TEST(DeviceMesh, SmallMeshesOfEveryKind) {
  const Options options = emulated();
  for (int kind = 0; kind < static_cast<int>(MeshKind::count); ++kind) {
    for (std::uint64_t seed = 0; seed < seeds(10); ++seed) {
      for (const bool floats : {false, true}) {
        const SmallMesh m = small_mesh(static_cast<MeshKind>(kind), floats, seed);
        const SmallMesh other = small_mesh(static_cast<MeshKind>(kind), floats, seed + 1000);
        const TriangleMesh a(m.vertices, m.triangles), b(other.vertices, other.triangles);
        const std::vector<Pair> want = pairs_of(m), between = pairs_of(m, other);
        EXPECT_EQ(find_self_intersections(a, options), want) << kind << " " << seed;
        EXPECT_EQ(find_intersections(a, b, options), between) << kind << " " << seed;
        if (!floats) continue;
        const std::vector<Vec3> v = to_floats(m.vertices), w = to_floats(other.vertices);
        EXPECT_EQ(find_self_intersections({v, m.triangles}, options), want);
        EXPECT_EQ(find_intersections({v, m.triangles}, {w, other.triangles}, options), between);
        EXPECT_EQ(find_intersections({v, m.triangles}, b, options), between);
        EXPECT_EQ(find_intersections(a, {w, other.triangles}, options), between);
      }
    }
  }
}

// The same pairs, candidates and exact tests as the scalar search on the CPU.
void expect_same(const TriangleMesh& a, const TriangleMesh* b, Algorithm algorithm) {
  MeshFinder device(emulated(Order::canonical, algorithm)), cpu(on_cpu());
  const MeshResult got = b ? device.find(a, *b) : device.find(a);
  const MeshResult want = b ? cpu.find(a, *b) : cpu.find(a);
  ASSERT_TRUE(got.ok()) << got.message;
  ASSERT_TRUE(want.ok()) << want.message;
  EXPECT_EQ(got.plan.backend, Backend::emulated);
  EXPECT_EQ(got.found, want.found);
  EXPECT_EQ(got.written, want.found);
  EXPECT_EQ(got.candidates, want.candidates);
  EXPECT_EQ(got.exact_tests, want.exact_tests);
  EXPECT_EQ(got.inactive, 0u);
  EXPECT_TRUE(std::equal(device.pairs().begin(), device.pairs().end(), cpu.pairs().begin(),
                         cpu.pairs().end(), [](const Pair& p, const Pair& q) { return p == q; }));
}

TEST(DeviceMesh, LargerMeshesAsOnTheCpu) {
  const SmallMesh first = soup(1), second = soup(2), folded = sheet(40);
  const std::vector<Vec3> v = to_floats(first.vertices), w = to_floats(folded.vertices);
  for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs}) {
    const TriangleMesh doubles(first.vertices, first.triangles),
        others(second.vertices, second.triangles), sheets(folded.vertices, folded.triangles);
    const TriangleMesh floats(v, first.triangles), float_sheets(w, folded.triangles);
    for (const TriangleMesh* m : {&doubles, &sheets, &floats, &float_sheets})
      expect_same(*m, nullptr, algorithm);
    expect_same(doubles, &others, algorithm);
    expect_same(floats, &others, algorithm);
    expect_same(floats, &float_sheets, algorithm);
  }
}

// Coordinates beyond the range of the filter, far from the origin, and below the least float.
TEST(DeviceMesh, AnyScale) {
  for (const double scale : {1e-320, 1e-200, 1e-45, 1e37, 1e200, 1e307}) {
    const SmallMesh m = scaled(sheet(7), scale);
    EXPECT_EQ(find_self_intersections({m.vertices, m.triangles}, emulated()), pairs_of(m)) << scale;
  }
  SmallMesh m = sheet(25);
  for (DoubleVec3& p : m.vertices) p = {p.x + 1e9, p.y - 3e8, p.z + 7e10};
  expect_same({m.vertices, m.triangles}, nullptr, Algorithm::grid);
  // One large vertex makes all tests exact.
  m = sheet(7);
  m.vertices[5].z = 1e300;
  MeshFinder finder(emulated());
  const MeshResult r = finder.find({m.vertices, m.triangles});
  EXPECT_EQ(r.exact_tests, r.candidates);
  EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), pairs_of(m));
}

// More uncertain candidates than the list holds: the rest are decided at once.
TEST(DeviceMesh, MoreUncertainCandidatesThanTheListHolds) {
  const SmallMesh m = joined(flat_sheet(18), soup(3, 200));
  const std::vector<Pair> want = pairs_of(m);
  for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs}) {
    for (const unsigned threads : {1u, 3u}) {
      Options options = emulated(Order::canonical, algorithm);
      options.threads = threads;
      MeshFinder finder(options);
      const MeshResult r = finder.find({m.vertices, m.triangles});
      ASSERT_TRUE(r.ok());
      device::MeshWorkspace w;
      w.carve(m.triangles.size(), 0, nullptr);
      EXPECT_GT(r.exact_tests, w.uncertain_capacity + 1000);
      EXPECT_EQ(std::vector<Pair>(finder.pairs().begin(), finder.pairs().end()), want);
    }
  }
}

TEST(DeviceMesh, FormsAndOrders) {
  const SmallMesh m = joined(soup(3, 800, 0.25), flat_sheet(14));
  const TriangleMesh view(m.vertices, m.triangles);
  const std::vector<Pair> want = pairs_of(m);
  ASSERT_GT(want.size(), 100u);
  for (const Order order : {Order::any, Order::canonical}) {
    for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs}) {
      MeshFinder finder(emulated(order, algorithm));
      const auto check = [&](std::vector<Pair> got) {
        if (order == Order::any) std::sort(got.begin(), got.end());
        EXPECT_EQ(got, want);
      };
      MeshResult r = finder.find(view);
      ASSERT_TRUE(r.ok()) << r.message;
      const std::uint64_t candidates = r.candidates, exact_tests = r.exact_tests;
      check({finder.pairs().begin(), finder.pairs().end()});

      // The capacity is exact, one too few, and none.
      std::vector<Pair> buffer(want.size());
      r = finder.find(view, buffer.data(), buffer.size());
      ASSERT_TRUE(r.ok()) << r.message;
      check(buffer);
      EXPECT_TRUE(finder.pairs().empty());
      for (const std::size_t few : {want.size() - 1, std::size_t{1}, std::size_t{0}}) {
        const Pair untouched{7, 7};
        buffer.assign(want.size(), untouched);
        r = finder.find(view, buffer.data(), few);
        EXPECT_EQ(r.status, Status::buffer_too_small);
        EXPECT_EQ(r.found, want.size());
        EXPECT_EQ(r.written, order == Order::any ? few : 0);
        for (std::size_t i = 0; i < r.written; ++i)
          EXPECT_TRUE(std::binary_search(want.begin(), want.end(), buffer[i]));
        EXPECT_TRUE(buffer[few] == untouched);
      }

      Collected taken;
      r = finder.consume(view, Consumer(taken));
      ASSERT_TRUE(r.ok()) << r.message;
      check(taken.pairs);
      EXPECT_EQ(r.candidates, candidates);
      EXPECT_EQ(r.exact_tests, exact_tests);
      r = finder.consume(view, [](const Pair*, std::size_t) { return false; });
      EXPECT_EQ(r.status, Status::stopped);
    }
  }
}

// A cap that allows only blocks: several searches deliver each pair once.
TEST(DeviceMesh, BlocksUnderACap) {
  const SmallMesh m = joined(soup(9, 1500, 0.4), flat_sheet(14));
  const TriangleMesh view(m.vertices, m.triangles);
  const std::vector<Pair> want = pairs_of(m);
  for (const Order order : {Order::any, Order::canonical}) {
    CountingResource memory;
    Options options = emulated(order, Algorithm::grid);
    options.memory = &memory;
    options.memory_cap_bytes = 1;
    Collected taken;
    MeshFinder finder(options);
    MeshResult r = finder.consume(view, Consumer(taken));
    ASSERT_EQ(r.status, Status::memory_cap_too_small) << r.message;
    options.memory_cap_bytes = r.bytes_needed;
    finder.set_options(options);
    r = finder.consume(view, Consumer(taken));
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, want.size());
    EXPECT_LT(taken.largest, want.size());
    if (order == Order::any) std::sort(taken.pairs.begin(), taken.pairs.end());
    EXPECT_EQ(taken.pairs, want);
    EXPECT_LE(memory.peak(), options.memory_cap_bytes);
    // All at once: as many candidates and exact tests.
    options.memory_cap_bytes = 0;
    finder.set_options(options);
    Collected all;
    const MeshResult whole = finder.consume(view, Consumer(all));
    EXPECT_EQ(r.candidates, whole.candidates);
    EXPECT_EQ(r.exact_tests, whole.exact_tests);
  }
}

// A cap of an earlier search on the CPU does not limit the memory for pairs.
TEST(DeviceMesh, ForgetsTheCapOfTheCpu) {
  const SmallMesh m = sheet(4);
  const std::vector<Triangle> equal(700, Triangle{0, 1, 6});
  Options options = on_cpu();
  options.memory_cap_bytes = 1 << 20;
  MeshFinder finder(options);
  Collected taken;
  ASSERT_TRUE(finder.consume({m.vertices, m.triangles}, Consumer(taken)).ok());
  finder.set_options(emulated());
  const MeshResult r = finder.find({m.vertices, equal});
  ASSERT_TRUE(r.ok()) << r.message;
  EXPECT_EQ(r.found, 700u * 699 / 2);
}

// Memory is that of boxes and of the result, whatever the number of candidates.
TEST(DeviceMesh, CandidatesAreNotStored) {
  const SmallMesh few = soup(4, 3000, 0.01), many = sheet(39);
  Options options = emulated(Order::any, Algorithm::grid);
  std::size_t held[2];
  std::uint64_t candidates[2];
  for (int k = 0; k < 2; ++k) {
    const SmallMesh& m = k == 0 ? few : many;
    CountingResource memory;
    options.memory = &memory;
    MeshFinder finder(options);
    std::vector<Pair> out(20'000);
    const MeshResult r =
        finder.find({m.vertices, m.triangles.data(), 3000}, out.data(), out.size());
    ASSERT_TRUE(r.ok()) << r.message;
    candidates[k] = r.candidates;
    held[k] = memory.held();
    EXPECT_EQ(finder.memory_bytes(), memory.held());
    EXPECT_LT(held[k], 3000 * 100 + 100'000u);
    const std::size_t calls = memory.allocations();
    ASSERT_TRUE(finder.find({m.vertices, m.triangles.data(), 3000}, out.data(), out.size()).ok());
    EXPECT_EQ(memory.allocations(), calls);
  }
  EXPECT_GT(candidates[1], 10 * candidates[0]);
  EXPECT_EQ(held[0], held[1]);
}

TEST(DeviceMesh, LayoutsTransformsAndFilters) {
  const SmallMesh a = soup(5, 600), b = sheet(20);
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
  for (const Vec3& p : to_floats(b.vertices)) vertices.push_back({NAN, p, {}});
  std::vector<Face> faces;
  for (const Triangle& t : b.triangles) faces.push_back({{}, t});
  TriangleMesh strided(Vertices(&vertices[0].position, vertices.size(), sizeof(Vertex)),
                       &faces[0].triangle, faces.size(), sizeof(Face));
  EXPECT_EQ(find_self_intersections(strided, emulated()), pairs_of(b));

  strided.transform.row[0][0] = 0.8;
  strided.transform.row[0][1] = -0.6;
  strided.transform.row[1][0] = 0.6;
  strided.transform.row[1][1] = 0.8;
  strided.transform.row[2][3] = 0.05;
  const std::vector<Vec3> v = to_floats(a.vertices);
  const TriangleMesh floats(v, a.triangles), doubles(a.vertices, a.triangles);
  expect_same(strided, nullptr, Algorithm::grid);
  for (const TriangleMesh* other : {&floats, &doubles}) {
    expect_same(*other, &strided, Algorithm::grid);
    expect_same(strided, other, Algorithm::all_pairs);
  }

  TriangleMesh filtered = doubles;
  std::vector<std::uint32_t> group(a.triangles.size()), mask(a.triangles.size());
  std::vector<std::int32_t> world(a.triangles.size()), owner(a.triangles.size());
  std::vector<std::uint8_t> is_static(a.triangles.size());
  for (std::size_t i = 0; i < group.size(); ++i) {
    group[i] = 1u << (i % 3);
    mask[i] = i % 2 ? 7u : 3u;
    owner[i] = static_cast<std::int32_t>(i % 9);
    is_static[i] = i % 5 == 0;
  }
  // Small worlds that stand together would be searched one by one if they were of boxes.
  for (const std::size_t of_a_world : {4, 150}) {
    for (std::size_t i = 0; i < world.size(); ++i)
      world[i] = static_cast<std::int32_t>(i / of_a_world) - 1;
    filtered.filters = {};
    filtered.filters.world = {world.data(), world.size()};
    for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs})
      expect_same(filtered, nullptr, algorithm);
    filtered.filters.group = {group.data(), group.size()};
    filtered.filters.mask = {mask.data(), mask.size()};
    filtered.filters.owner = {owner.data(), owner.size()};
    filtered.filters.is_static = {is_static.data(), is_static.size()};
    for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs})
      expect_same(filtered, nullptr, algorithm);
    expect_same(filtered, &doubles, Algorithm::grid);
    expect_same(filtered, &filtered, Algorithm::grid);
  }
}

// ---- what is refused ----------------------------------------------------------------------------

// The same status, numbers and message as on the CPU.
void expect_same_error(const TriangleMesh& a, const TriangleMesh* b) {
  MeshFinder device(emulated()), cpu(on_cpu());
  const MeshResult got = b ? device.find(a, *b) : device.find(a);
  const MeshResult want = b ? cpu.find(a, *b) : cpu.find(a);
  EXPECT_EQ(want.status, Status::bad_mesh);
  EXPECT_EQ(got.status, want.status);
  EXPECT_EQ(got.first_invalid, want.first_invalid);
  EXPECT_EQ(got.invalid_count, want.invalid_count);
  EXPECT_STREQ(got.message, want.message);
  EXPECT_EQ(got.found, 0u);
  EXPECT_TRUE(device.pairs().empty());
}

TEST(DeviceMesh, NamesTheFirstBadTriangle) {
  const SmallMesh good = sheet(50);  // above the limit of brute force
  const std::vector<Vec3> floats = to_floats(good.vertices);
  const TriangleMesh fine(floats, good.triangles), none;
  const auto expect_errors = [&](const TriangleMesh& bad) {
    expect_same_error(bad, nullptr);
    expect_same_error(bad, &fine);
    expect_same_error(fine, &bad);
    expect_same_error(none, &bad);
    expect_same_error(bad, &bad);
  };
  std::vector<Triangle> triangles = good.triangles;
  triangles[700].c = ~0u;
  triangles[500].b = static_cast<std::uint32_t>(floats.size());
  triangles[500].c = ~0u;
  expect_errors({floats, triangles});
  for (const double bad :
       {static_cast<double>(NAN), static_cast<double>(INFINITY), -static_cast<double>(INFINITY)}) {
    std::vector<Vec3> v = floats;
    v[good.triangles[300].c].y = static_cast<float>(bad);
    v[good.triangles[3000].a].x = static_cast<float>(bad);
    expect_errors({v, good.triangles});
    expect_errors({v, triangles});
    std::vector<DoubleVec3> w = good.vertices;
    w[good.triangles[300].c].z = bad;
    expect_errors({w, good.triangles});
  }
  TriangleMesh moved = fine;
  moved.transform.row[1][1] = 1e308;
  moved.transform.row[1][0] = 1e308;
  expect_errors(moved);
  expect_errors({Vertices(), good.triangles});
  // An unused vertex may be anything.
  std::vector<Vec3> more = floats;
  more.push_back({NAN, INFINITY, 0});
  expect_same({more, good.triangles}, nullptr, Algorithm::grid);
}

TEST(DeviceMesh, RefusesWhatItDoesNotSupport) {
  const SmallMesh m = sheet(4);
  const TriangleMesh view(m.vertices, m.triangles);
  MeshFinder finder(emulated());
  MeshResult r = finder.find_within(view, 0.1);
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::strstr(r.message, "triangles within a distance are searched on the CPU alone"),
            nullptr)
      << r.message;
  Options options = emulated();
  options.cell_scale = 0;
  finder.set_options(options);
  EXPECT_EQ(finder.find(view).status, Status::bad_option);
  std::atomic<bool> stop{true};
  options = emulated();
  options.stop = &stop;
  finder.set_options(options);
  EXPECT_EQ(finder.find(view).status, Status::stopped);
  stop = false;
  EXPECT_TRUE(finder.find(view).ok());
  // A GPU that is not there.
  options = emulated();
  options.backend = Backend::cuda;
  MeshFinder on_gpu(options);
  r = on_gpu.find(view);
  if (!r.ok()) {
    EXPECT_EQ(r.status, Status::no_device) << r.message;
    EXPECT_NE(r.message[0], 0);
  } else {
    EXPECT_EQ(r.found, pairs_of(m).size());
  }
}

TEST(DeviceMesh, EmptyAndSingleMeshes) {
  const SmallMesh m = sheet(4);
  const Options options = emulated();
  EXPECT_TRUE(find_self_intersections(TriangleMesh(), options).empty());
  EXPECT_TRUE(find_self_intersections({m.vertices, m.triangles.data(), 1}, options).empty());
  EXPECT_TRUE(find_intersections(TriangleMesh(), {m.vertices, m.triangles}, options).empty());
  EXPECT_TRUE(find_intersections({m.vertices, m.triangles}, TriangleMesh(), options).empty());
  const std::vector<Triangle> equal(100, Triangle{0, 1, 6});
  EXPECT_EQ(find_self_intersections({m.vertices, equal}, options).size(), 100u * 99 / 2);
}

TEST(DeviceMesh, WithoutMemory) {
  const SmallMesh m = sheet(30);
  for (std::size_t limit = 2000; limit < 600'000; limit += 30'000) {
    CountingResource memory;
    memory.limit(limit);
    Options options = emulated();
    options.memory = &memory;
    MeshFinder finder(options);
    const MeshResult r = finder.find({m.vertices, m.triangles});
    if (!r.ok()) {
      EXPECT_EQ(r.status, Status::out_of_memory);
      EXPECT_EQ(r.found, 0u);
    }
    memory.limit(std::numeric_limits<std::size_t>::max());
    EXPECT_TRUE(finder.find({m.vertices, m.triangles}).ok());
  }
}

// ---- a device whose memory the host cannot access -----------------------------------------------

using DiscreteEngine = device::Engine<DiscreteDevice>;

std::vector<Pair> find_on(DiscreteEngine& engine, const TriangleMesh& a, const TriangleMesh* b,
                          const Options& options, MeshResult& r) {
  std::vector<Pair> out(1);
  base::Output output{out.data(), out.size(),
                      [](void* context, std::size_t count) {
                        auto& v = *static_cast<std::vector<Pair>*>(context);
                        v.resize(count);
                        return v.data();
                      },
                      &out};
  device::MeshJob<DiscreteDevice> job(a, b, options, r);
  engine.find(job, options, 0, &output, nullptr, r);
  out.resize(static_cast<std::size_t>(r.written));
  if (options.order == Order::any) std::sort(out.begin(), out.end());
  return out;
}

TEST(DeviceMesh, OnADeviceOfItsOwnMemory) {
  const SmallMesh a = joined(soup(11, 800), flat_sheet(14)), b = sheet(20);
  const std::vector<Vec3> v = to_floats(b.vertices);
  TriangleMesh first(a.vertices, a.triangles), second(v, b.triangles);
  const std::vector<Pair> want = pairs_of(a), between = pairs_of(a, b);
  for (const Order order : {Order::any, Order::canonical}) {
    for (const Algorithm algorithm : {Algorithm::grid, Algorithm::all_pairs}) {
      CountingResource memory;
      DiscreteEngine engine(&memory);
      const Options options = emulated(order, algorithm);
      MeshResult r;
      EXPECT_EQ(find_on(engine, first, nullptr, options, r), want);
      EXPECT_EQ(find_on(engine, first, &second, options, r = {}), between);
      EXPECT_EQ(engine.held(), memory.held());
      EXPECT_EQ(find_on(engine, first, nullptr, options, r = {}), want);
      // Once memory is there, a call waits for the report of the boxes, the grid, and the pairs.
      engine.device().syncs = 0;
      EXPECT_EQ(find_on(engine, first, nullptr, options, r = {}), want);
      EXPECT_LE(engine.device().syncs, 3u);
      EXPECT_EQ(find_on(engine, second, nullptr, options, r = {}), pairs_of(b));
    }
  }
}

// The cap that is named suffices to the byte; one byte less does not, and nothing is allocated.
TEST(DeviceMesh, TheCapHoldsToTheByte) {
  const SmallMesh a = sheet(20), b = soup(12, 500);
  const std::vector<Vec3> v = to_floats(a.vertices);
  const TriangleMesh floats(v, a.triangles), doubles(b.vertices, b.triangles);
  for (const TriangleMesh* other : {static_cast<const TriangleMesh*>(nullptr), &doubles}) {
    const std::vector<Pair> want = other ? pairs_of(a, b) : pairs_of(a);
    for (const Order order : {Order::any, Order::canonical}) {
      CountingResource memory;
      DiscreteEngine engine(&memory);
      Options options = emulated(order, Algorithm::grid);
      Collected taken;
      const Consumer consumer(taken);
      const auto needed = [&](std::size_t cap) -> std::size_t {
        options.memory_cap_bytes = cap;
        taken = {};
        MeshResult r;
        device::MeshJob<DiscreteDevice> job(floats, other, options, r);
        try {
          engine.find(job, options, 100, nullptr, &consumer, r);
        } catch (const device::Failure& failure) {
          EXPECT_EQ(failure.status, Status::memory_cap_too_small);
          return failure.bytes;
        }
        return 0;
      };
      const std::size_t bytes = needed(1);
      EXPECT_EQ(needed(bytes - 1), bytes);
      EXPECT_EQ(memory.allocations(), 0u);
      EXPECT_EQ(needed(bytes), 0u);
      EXPECT_LE(memory.peak() + 100, bytes);
      if (order == Order::any) std::sort(taken.pairs.begin(), taken.pairs.end());
      EXPECT_EQ(taken.pairs, want);
    }
  }
}

}  // namespace
}  // namespace throng::tests
