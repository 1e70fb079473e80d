// What update_boxes costs beside a plain copy of as many bytes: ns a body, the median of 31 calls.
#include <throng/throng.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "program/median.hpp"

namespace {

using namespace throng;

template <class F>
double median_ns(F&& f) {
  std::vector<double> times;
  f();
  for (int k = 0; k < 31; ++k) {
    const auto start = std::chrono::steady_clock::now();
    f();
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  return program::median(std::move(times));
}

struct Scene {
  std::vector<Transform> transforms;
  std::vector<Vec3> positions, displacements;
  std::vector<std::uint32_t> shape;
  std::vector<Shape> shapes, own;
};

Scene make(std::size_t n) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  Scene s;
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

}  // namespace

int main() {
  std::printf("%-26s %8s %6s %8s %8s %8s\n", "", "bodies", "bytes", "copy", "1 thread", "2");
  for (const std::size_t n : {std::size_t{100000}, std::size_t{1000000}}) {
    const Scene s = make(n);
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
      std::size_t bytes;  // a body, read and written
    } cases[] = {{"spheres, unrotated", spheres, sizeof(Vec3) + sizeof(Box)},
                 {"boxes, one shape", boxes, sizeof(Transform) + sizeof(Box)},
                 {"four shapes by index", mixed, sizeof(Transform) + sizeof(Box) + 4},
                 {"boxes, swept", swept, sizeof(Transform) + sizeof(Vec3) + sizeof(Box)},
                 {"a shape a body", own, sizeof(Transform) + sizeof(Shape) + sizeof(Box)}};
    for (const auto& c : cases) {
      const std::vector<char> from(c.bytes * n / 2, 1);
      std::vector<char> to(from.size(), 2);
      std::vector<Box> out(n);
      const double copy = median_ns([&] { std::memcpy(to.data(), from.data(), to.size()); });
      double ns[2] = {};
      for (const unsigned threads : {1u, 2u}) {
        UpdateOptions options;
        options.threads = threads;
        if (!update_boxes(c.bodies, out.data(), options).ok()) return 1;
        ns[threads - 1] = median_ns([&] { (void)update_boxes(c.bodies, out.data(), options); });
      }
      const auto each = static_cast<double>(n);
      std::printf("%-26s %8zu %6zu %8.2f %8.2f %8.2f\n", c.name, n, c.bytes, copy / each,
                  ns[0] / each, ns[1] / each);
    }
  }
}
