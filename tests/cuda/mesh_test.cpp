// Triangles in device memory against the double loop, and in host memory against the CPU's search.
#include <throng/cuda_mesh.hpp>

#include <cmath>
#include <cstdio>
#include <limits>

#include "cuda/gpu_fixture.hpp"
#include "mesh/larger_meshes.hpp"

namespace throng::tests {
namespace {

// A mesh in device memory, of floats or of doubles.
class MeshOnDevice {
 public:
  MeshOnDevice(const SmallMesh& m, bool floats)
      : floats_(floats),
        singles_(to_floats(m.vertices)),
        doubles_(m.vertices),
        triangles_(m.triangles) {}
  TriangleMesh view() const {
    const Vertices vertices = floats_ ? Vertices(singles_.data(), singles_.size())
                                      : Vertices(doubles_.data(), doubles_.size());
    return {vertices, triangles_.data(), triangles_.size()};
  }
  void put(const SmallMesh& m) {
    singles_.put(to_floats(m.vertices));
    doubles_.put(m.vertices);
    triangles_.put(m.triangles);
  }

 private:
  bool floats_;
  OnDevice<Vec3> singles_;
  OnDevice<DoubleVec3> doubles_;
  OnDevice<Triangle> triangles_;
};

class GpuMesh : public OnGpu {
 protected:
  void expect_pairs(cuda::MeshFinder& finder, const TriangleMesh& a, const TriangleMesh* b,
                    const std::vector<Pair>& want) {
    const PairBuffer buffer(want.size());
    const MeshResult r = b ? finder.find(a, *b, buffer.out(), buffer.capacity(), stream())
                           : finder.find(a, buffer.out(), buffer.capacity(), stream());
    ASSERT_TRUE(r.ok()) << r.message;
    EXPECT_EQ(r.found, want.size());
    EXPECT_GE(r.candidates, r.found);
    std::vector<Pair> got = buffer.take(static_cast<std::size_t>(r.written));
    if (!canonical()) std::sort(got.begin(), got.end());
    EXPECT_EQ(got, want);
  }
};

TEST_P(GpuMesh, SmallMeshesOfEveryKind) {
  cuda::MeshFinder finder(options());
  for (int kind = 0; kind < static_cast<int>(MeshKind::count); ++kind) {
    for (const bool floats : {false, true}) {
      SCOPED_TRACE(std::to_string(kind) + (floats ? " floats" : " doubles"));
      const SmallMesh m = small_mesh(static_cast<MeshKind>(kind), floats, 5);
      const SmallMesh other = small_mesh(static_cast<MeshKind>(kind), floats, 6);
      const MeshOnDevice a(m, floats), b(other, floats), as_doubles(other, false);
      const TriangleMesh second = b.view(), third = as_doubles.view();
      expect_pairs(finder, a.view(), nullptr, pairs_of(m));
      expect_pairs(finder, a.view(), &second, pairs_of(m, other));
      expect_pairs(finder, a.view(), &third, pairs_of(m, other));
    }
  }
}

TEST_P(GpuMesh, LargerMeshes) {
  static const SmallMesh meshes[] = {soup(1), sheet(50), flat_sheet(30)};
  static const std::vector<Pair> want[] = {pairs_of(meshes[0]), pairs_of(meshes[1]),
                                           pairs_of(meshes[2])};
  cuda::MeshFinder finder(options());
  for (int k = 0; k < 3; ++k) {
    for (const bool floats : {false, true}) {
      SCOPED_TRACE(k);
      const MeshOnDevice m(meshes[k], floats);
      expect_pairs(finder, m.view(), nullptr, want[k]);
      const MeshResult r = finder.find(m.view(), stream());
      ASSERT_TRUE(r.ok()) << r.message;
      EXPECT_EQ(finder.pairs().size(), want[k].size());
    }
  }
}

TEST_P(GpuMesh, BadTriangles) {
  SmallMesh m = sheet(50);
  m.triangles[700].b = ~0u;
  m.vertices[m.triangles[3000].a].y = NAN;
  std::uint64_t bad = 0;
  for (const Triangle& t : m.triangles) {
    const std::uint32_t it = m.triangles[3000].a;
    bad += t.b == ~0u || t.a == it || t.b == it || t.c == it;
  }
  const MeshOnDevice there(m, true), fine(sheet(50), true);
  cuda::MeshFinder finder(options());
  const OnDevice<Pair> out(100'000);
  MeshResult r = finder.find(there.view(), out.data(), out.size(), stream());
  EXPECT_EQ(r.status, Status::bad_mesh) << r.message;
  EXPECT_EQ(r.first_invalid, 700u);
  EXPECT_EQ(r.invalid_count, bad);
  r = finder.find(fine.view(), there.view(), out.data(), out.size(), stream());
  EXPECT_EQ(r.status, Status::bad_mesh) << r.message;
  EXPECT_EQ(r.first_invalid, 700u);
  EXPECT_NE(std::string(r.message).find("second mesh"), std::string::npos) << r.message;
  const std::vector<Triangle> on_host(10);
  r = finder.find({fine.view().vertices, on_host}, stream());
  EXPECT_EQ(r.status, Status::bad_mesh);
  EXPECT_NE(std::string(r.message).find("host memory"), std::string::npos) << r.message;
}

// One captured call, replayed with other vertices in the same memory.
TEST_P(GpuMesh, AGraphIsReplayed) {
  if (!stream()) GTEST_SKIP() << "the default stream cannot be captured";
  const SmallMesh scenes[] = {sheet(30), flat_sheet(30)};
  MeshOnDevice there(scenes[0], true);
  const TriangleMesh view = there.view();
  constexpr std::size_t capacity = 50'000;
  const PairBuffer buffer(capacity);
  const OnDevice<cuda::MeshReport> report(1);
  cuda::MeshFinder finder(options());
  EXPECT_EQ(finder.find_async(view, buffer.out(), capacity, report.data(), stream()).status,
            Status::not_reserved);
  ASSERT_TRUE(finder.reserve(view.size(), capacity, stream()).ok());
  // Loads the kernels.
  ASSERT_TRUE(finder.find_async(view, buffer.out(), capacity, report.data(), stream()).ok());
  check_cuda(cudaStreamSynchronize(stream()));
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  check_cuda(cudaStreamBeginCapture(stream(), cudaStreamCaptureModeGlobal));
  const Result launched = finder.find_async(view, buffer.out(), capacity, report.data(), stream());
  check_cuda(cudaStreamEndCapture(stream(), &graph));
  ASSERT_TRUE(launched.ok()) << launched.message;
  check_cuda(cudaGraphInstantiate(&ready, graph, 0));
  for (const SmallMesh& m : scenes) {
    there.put(m);
    for (int again = 0; again < 2; ++again) {
      check_cuda(cudaGraphLaunch(ready, stream()));
      check_cuda(cudaStreamSynchronize(stream()));
      const cuda::MeshReport seen = report.get()[0];
      const std::vector<Pair> want = pairs_of(m);
      EXPECT_EQ(seen.search.found, want.size());
      EXPECT_EQ(seen.bad_triangles, 0u);
      std::vector<Pair> got = buffer.take(capacity);
      got.resize(want.size());
      if (!canonical()) std::sort(got.begin(), got.end());
      EXPECT_EQ(got, want);
    }
  }
  check_cuda(cudaGraphExecDestroy(ready));
  check_cuda(cudaGraphDestroy(graph));
}

TEST_P(GpuMesh, MemoryIsWhatWasReserved) {
  CountingDeviceMemory memory;
  const SmallMesh m = sheet(60);
  const MeshOnDevice there(m, true);
  const std::size_t n = m.triangles.size();
  constexpr std::size_t capacity = 100'000;
  const OnDevice<Pair> out(capacity);
  cuda::MeshFinder finder(options(), memory.resource());
  ASSERT_TRUE(finder.reserve(n, capacity, stream()).ok());
  const std::size_t allocations = memory.allocations();
  EXPECT_LE(memory.held(), 75 * n + 16 * capacity + 100'000);
  EXPECT_EQ(finder.memory_bytes(), memory.held());
  for (int k = 0; k < 3; ++k)
    ASSERT_TRUE(finder.find(there.view(), out.data(), capacity, stream()).ok());
  EXPECT_EQ(memory.allocations(), allocations);
}

// Every step at which memory may run out.
TEST_P(GpuMesh, MemoryRunsOut) {
  const SmallMesh m = sheet(40);
  const MeshOnDevice there(m, true);
  TriangleMesh moved = there.view();
  moved.transform.row[0][3] = 1;
  const std::size_t want = pairs_of(m).size();
  for (std::size_t limit = 0; limit < 1'000'000; limit += 40'000) {
    CountingDeviceMemory memory;
    cuda::MeshFinder finder(options(), memory.resource());
    memory.limit(limit);
    const MeshResult r = finder.find(moved, stream());
    if (!r.ok()) {
      EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
    }
    memory.limit(~std::size_t{0});
    const MeshResult again = finder.find(there.view(), stream());
    ASSERT_TRUE(again.ok()) << again.message;
    EXPECT_EQ(again.found, want);
    EXPECT_TRUE(finder.find(moved, stream()).ok());
  }
}

THRONG_INSTANTIATE_GPU(GpuMesh);

// Meshes in host memory: MeshFinder with Backend::cuda.
TEST(GpuMeshOfHost, AsOnTheCpu) {
  THRONG_NEEDS_GPU();
  const SmallMesh a = soup(1, 20'000, 0.05), b = sheet(150);
  const std::vector<Vec3> v = to_floats(b.vertices);
  TriangleMesh first(a.vertices, a.triangles), second(v, b.triangles);
  second.transform.row[2][3] = 0.01;
  std::vector<std::int32_t> world(a.triangles.size());
  for (std::size_t i = 0; i < world.size(); ++i) world[i] = static_cast<int>(i % 3) - 1;
  for (const bool filtered : {false, true}) {
    if (filtered) first.filters.world = {world.data(), world.size()};
    for (const Order order : {Order::any, Order::canonical}) {
      Options options;
      options.order = order;
      options.isa = Isa::scalar;
      MeshFinder cpu(options);
      options.backend = Backend::cuda;
      MeshFinder gpu(options);
      for (const bool two : {false, true}) {
        const MeshResult want = two ? cpu.find(first, second) : cpu.find(first);
        const MeshResult got = two ? gpu.find(first, second) : gpu.find(first);
        ASSERT_TRUE(got.ok()) << got.message;
        EXPECT_EQ(got.found, want.found);
        EXPECT_EQ(got.candidates, want.candidates);
        EXPECT_EQ(got.exact_tests, want.exact_tests);
        std::vector<Pair> p(cpu.pairs().begin(), cpu.pairs().end());
        std::vector<Pair> q(gpu.pairs().begin(), gpu.pairs().end());
        std::sort(p.begin(), p.end());
        if (order == Order::any) std::sort(q.begin(), q.end());
        EXPECT_EQ(p, q);
      }
    }
  }
}

// A million triangles, and 250,000 in a plane: prints the times of the stages, and compares with
// the CPU.
TEST(GpuMeshTimes, LargeMeshes) {
  THRONG_NEEDS_GPU();
  const SmallMesh scenes[] = {sheet(708), flat_sheet(354)};
  const char* const names[] = {"wavy sheet", "folded in a plane"};
  for (int k = 0; k < 2; ++k) {
    const std::vector<Vec3> v = to_floats(scenes[k].vertices);
    const MeshOnDevice there(scenes[k], true);
    const Stream stream;
    cuda::MeshFinder gpu;
    MeshResult best;
    best.times.total_ms = std::numeric_limits<double>::infinity();
    for (int again = 0; again < 12; ++again) {
      const MeshResult r = gpu.find(there.view(), stream);
      ASSERT_TRUE(r.ok()) << r.message;
      if (again > 1 && r.times.total_ms < best.times.total_ms) best = r;
    }
    MeshFinder cpu;
    const MeshResult want = cpu.find({v, scenes[k].triangles});
    EXPECT_EQ(best.found, want.found);
    EXPECT_EQ(best.candidates, want.candidates);
    std::printf(
        "triangles on the GPU, %s: %zu triangles, %llu candidates, %llu exact tests, %llu pairs: "
        "boxes and plan %.3f ms, bin %.3f ms, find %.3f ms, all %.3f ms\n",
        names[k], scenes[k].triangles.size(), static_cast<unsigned long long>(best.candidates),
        static_cast<unsigned long long>(best.exact_tests),
        static_cast<unsigned long long>(best.found), best.times.plan_ms, best.times.bin_ms,
        best.times.find_ms, best.times.total_ms);
  }
}

// Without a GPU every call says so.
TEST(NoDeviceForMeshes, EveryCallSaysWhy) {
  if (cuda::available().ok()) GTEST_SKIP() << "there is a GPU";
  // Stand-ins for device memory; never dereferenced.
  const auto* const vertices = reinterpret_cast<const Vec3*>(std::uintptr_t{0x1000});
  const auto* const triangles = reinterpret_cast<const Triangle*>(std::uintptr_t{0x2000});
  auto* const pairs = reinterpret_cast<Pair*>(std::uintptr_t{0x3000});
  auto* const report = reinterpret_cast<cuda::MeshReport*>(std::uintptr_t{0x4000});
  const TriangleMesh mesh(Vertices(vertices, 10), triangles, 100);
  cuda::MeshFinder finder;
  const auto expect_no_device = [](const Result& r) {
    EXPECT_EQ(r.status, Status::no_device);
    EXPECT_NE(std::string(r.message).find("use Backend::cpu"), std::string::npos) << r.message;
    EXPECT_EQ(r.found, 0u);
  };
  expect_no_device(finder.reserve(100, 1000, nullptr));
  expect_no_device(finder.find(mesh, pairs, 10, nullptr));
  expect_no_device(finder.find(mesh, mesh, pairs, 10, nullptr));
  expect_no_device(finder.find(mesh, nullptr));
  expect_no_device(finder.find(mesh, mesh, nullptr));
  expect_no_device(finder.find_async(mesh, pairs, 10, report, nullptr));
  expect_no_device(finder.find_async(mesh, mesh, pairs, 10, report, nullptr));
  EXPECT_EQ(finder.memory_bytes(), 0u);
  EXPECT_TRUE(finder.pairs().empty());
  // What needs no device to be refused.
  EXPECT_EQ(finder.find(TriangleMesh(Vertices(vertices, 10, 7), triangles, 3), nullptr).status,
            Status::bad_mesh);
  Options options;
  options.margin = 1;
  EXPECT_EQ(cuda::MeshFinder(options).find(mesh, nullptr).status, Status::bad_option);
}

}  // namespace
}  // namespace throng::tests
