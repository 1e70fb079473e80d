// The paper's future work: its scheme in the narrow phase, on triangles. A thread computes a pair
// of triangles from its index and decides it exactly; then only the pairs whose boxes overlap are
// numbered.
#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <throng/checksum.hpp>
#include <throng/mesh.hpp>
#include <throng/throng.hpp>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/host.hpp"
#include "apps/paper/mapping.hpp"
#include "apps/paper/pair_list.hpp"
#include "apps/paper/search.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/meshes.hpp"
#include "mesh/triangle_pair.hpp"

namespace throng::paper {
namespace {

// Decides one pair of triangles of a mesh and reports it.
struct TriangleTest {
  const Vec3* vertices;
  const Triangle* triangles;
  PairSink sink;

  mesh::TrianglePoints points(const Triangle& t) const {
    const auto point = [&](std::uint32_t i) {
      const Vec3& v = vertices[i];
      return DoubleVec3{v.x, v.y, v.z};
    };
    return {{point(t.a), point(t.b), point(t.c)}};
  }
  void operator()(Pair pair) const {
    const Triangle &a = triangles[pair.first], &b = triangles[pair.second];
    if (mesh::triangles_pair(a, b, points(a), points(b))) sink(pair);
  }
};

std::vector<Box> boxes_of(const scenes::GeneratedMesh& mesh) {
  std::vector<Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t.a], &b = mesh.vertices[t.b], &c = mesh.vertices[t.c];
    boxes.push_back(
        {{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})},
         {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})}});
  }
  return boxes;
}

// More triangles take brute force more than some seconds.
constexpr std::uint64_t max_brute_force = 10000;

}  // namespace

Section triangles(const Lab& lab) {
  Section section("triangles", "Section 7, future work: the narrow phase on triangles");
  double slowest = 0, fastest = 0;
  std::uint64_t largest = 0;
  for (const std::uint64_t wanted : lab.sizes({1000, 3000, 10000, 100000, 1000000}, 10000)) {
    scenes::MeshSpec spec;
    spec.name = "crumpled";
    spec.triangles = wanted;
    const scenes::GeneratedMesh mesh = scenes::make_mesh(spec);
    const std::uint64_t n = mesh.triangles.size();
    lab.say(fmt::format("triangles: {}", report::format_short(n)));
    const std::vector<Box> boxes = boxes_of(mesh);
    const auto add = [&](const std::string& what, std::uint64_t tests, double ms, const Pair* pairs,
                         std::uint64_t count, DeviceKind device) {
      Row row = lab.row(what, n, "total", "ms", device);
      row.measured = ms;
      row.pairs = count;
      row.checksum = pair_checksum(pairs, count);
      row.found = fmt::format("{} pairs of triangles decided, {} intersect",
                              report::format_count(tests), report::format_count(count));
      section.rows.push_back(std::move(row));
    };

    HostDevice host(lab.setting().threads);
    PairList<HostDevice> list(n);
    const auto test = [&](const PairSink& sink) {
      return TriangleTest{mesh.vertices.data(), mesh.triangles.data(), sink};
    };
    if (n <= max_brute_force) {
      const Exact mapping;
      const double ms = median_ms(
          [&] {
            list.collect(host, [&](const PairSink& sink) {
              host.each(mapping.threads(n), [&](std::uint64_t k) {
                Pair pair{};
                if (mapping(k, n, pair)) test(sink)(pair);
              });
            });
          },
          lab.repeat(), lab.budget_ms());
      add("a thread per pair of triangles", mapping.threads(n), ms, list.fetch(host), list.count(),
          DeviceKind::cpu);
      slowest = ms;
      largest = n;
    }

    Options options;
    options.threads = lab.setting().threads;
    Finder broad_phase(options);
    const double ms = median_ms(
        [&] {
          const Result result = broad_phase.find(boxes);
          if (!result.ok()) throw Failure(result.message);
          const Pairs candidates = broad_phase.pairs();
          list.collect(host, [&](const PairSink& sink) {
            host.each(candidates.size(),
                      [&](std::uint64_t k) { test(sink)(candidates.data()[k]); });
          });
        },
        lab.repeat(), lab.budget_ms());
    add("broad phase, then a thread per candidate", broad_phase.pairs().size(), ms,
        list.fetch(host), list.count(), DeviceKind::cpu);

    for (const DeviceKind device : lab.devices()) {
      options.backend = device == DeviceKind::cuda ? Backend::cuda : Backend::cpu;
      MeshFinder finder(options);
      MeshResult result;
      const double total = median_ms(
          [&] {
            result = finder.find(mesh.view());
            if (!result.ok()) throw Failure(result.message);
          },
          lab.repeat(), lab.budget_ms());
      add("Throng: both in one pass", result.candidates, total, finder.pairs().data(),
          finder.pairs().size(), device);
      if (device == DeviceKind::cpu && n == largest) fastest = total;
    }
  }
  if (largest > 0) {
    section.finding = fmt::format(
        "The scheme carries over: a thread per pair of triangles finds what intersects. At {} "
        "triangles a broad phase before it, in one pass with it, is {} times faster.",
        report::format_count(largest),
        report::format_count(static_cast<std::uint64_t>(slowest / fastest)));
  }
  section.words = {
      "The paper ends with the plan to use its scheme \"not only on bounding volumes but also on "
      "triangles or polygons\". The mesh is a crumpled sheet that intersects itself. A thread "
      "computes its pair from its index as in section 3 and decides it exactly. The second form "
      "numbers only the pairs whose boxes overlap, and a thread takes its candidate by index. "
      "Throng tests candidates a block at a time, where they are found, so that no list of them "
      "exists."};
  return section;
}

}  // namespace throng::paper
