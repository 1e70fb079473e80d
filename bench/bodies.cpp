// Subcommand bodies: update_boxes, which computes boxes from transforms and shapes, compared with a
// copy (memcpy, one thread) that reads and writes as many bytes. ns per body, medians.
#include <throng/throng.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

struct BodyData {
  std::vector<Transform> transforms;
  std::vector<Vec3> positions, displacements;
  std::vector<std::uint32_t> shape;
  std::vector<Shape> shapes, own;
};

BodyData make(std::size_t n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  BodyData s;
  s.shapes = {Shape::sphere(.5f), Shape::box({1, 2, 3}), Shape::capsule(1, .5f),
              Shape::box({.5f, .5f, .5f}, {0, 1, 0})};
  for (std::size_t i = 0; i < n; ++i) {
    const float x = unit(random), y = unit(random), z = unit(random), w = unit(random);
    const float f = 1 / std::sqrt(x * x + y * y + z * z + w * w);
    s.positions.push_back({unit(random) * 100, unit(random) * 100, unit(random) * 100});
    s.transforms.push_back({s.positions.back(), {x * f, y * f, z * f, w * f}});
    s.displacements.push_back({unit(random), unit(random), unit(random)});
    s.shape.push_back(static_cast<std::uint32_t>(random() % s.shapes.size()));
    s.own.push_back(s.shapes[s.shape.back()]);
  }
  return s;
}

template <class F>
std::vector<double> ns_per_body(int rounds, std::size_t bodies, F&& f) {
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(rounds));
  f();
  for (int k = 0; k < rounds; ++k) times.push_back(1e6 * time_ms(f) / static_cast<double>(bodies));
  return times;
}

void measure(std::size_t n, const CaseOptions& a, Results& results) {
  const BodyData s = make(n);
  const Bodies boxes(s.transforms.data(), n, &s.shapes[1], 1);
  Bodies spheres, mixed = boxes, swept = boxes;
  spheres.position = {s.positions.data(), n};
  spheres.shapes = {s.shapes.data(), 1};
  mixed.shapes = {s.shapes.data(), s.shapes.size()};
  mixed.shape = {s.shape.data(), n};
  swept.displacement = {s.displacements.data(), n};
  const Bodies own(s.transforms.data(), n, s.own.data(), n);
  const struct {
    const char* name;
    Bodies bodies;
    std::size_t bytes;  // per body, read and written
  } cases[] = {{"spheres, not rotated", spheres, sizeof(Vec3) + sizeof(Box)},
               {"boxes, one shape", boxes, sizeof(Transform) + sizeof(Box)},
               {"boxes, swept", swept, sizeof(Transform) + sizeof(Vec3) + sizeof(Box)},
               {"four shapes by index", mixed, sizeof(Transform) + sizeof(Box) + 4},
               {"one shape per body", own, sizeof(Transform) + sizeof(Shape) + sizeof(Box)}};
  const int rounds = a.rounds_of(31);
  for (const auto& c : cases) {
    Row row;
    row.kind = "bodies";
    row.name = c.name;
    row.objects = n;
    row.metric = "ns_per_body";
    row.note = fmt::format("{} bytes per body", c.bytes);
    const std::vector<char> from(c.bytes * n / 2, 1);
    std::vector<char> to(from.size(), 2);
    row.library = "memcpy";
    set_samples(row,
                ns_per_body(rounds, n, [&] { std::memcpy(to.data(), from.data(), to.size()); }));
    results.add(row);
    std::vector<Box> out(n);
    row.library = "Throng update_boxes";
    for (const unsigned threads : a.threads) {
      UpdateOptions options;
      options.threads = threads;
      require(update_boxes(c.bodies, out.data(), options));
      row.threads = threads;
      set_samples(
          row, ns_per_body(rounds, n, [&] { (void)update_boxes(c.bodies, out.data(), options); }));
      results.add(row);
    }
  }
  results.show(fmt::format("{} bodies", n));
}

}  // namespace

int bodies_command(int argc, char** argv) {
  CaseOptions a;
  CLI::App app{"Boxes computed from transforms and shapes, compared with a copy of as many bytes.",
               "throng-bench bodies"};
  int status = 0;
  if (!parse_case_options(app, a, "", argc, argv, status)) return status;
  Results results(a.output);
  measure(a.objects(100'000), a, results);
  if (a.objects(1'000'000) > 100'000) measure(a.objects(1'000'000), a, results);
  return common::exit_done;
}

}  // namespace throng::bench
