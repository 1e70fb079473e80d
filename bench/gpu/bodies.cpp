// Boxes of bodies computed on the device: the time of a graph replay. All bits are compared with
// the host's.
#include <cstring>
#include <stdexcept>

#include <throng/checksum.hpp>
#include <throng/cuda.hpp>
#include <throng/update_boxes.hpp>

#include "bench/gpu/gpu.hpp"
#include "bench/gpu/session.hpp"
#include "bench/gpu/timing.hpp"

namespace throng::bench::gpu {
namespace {

struct Kind {
  const char* name;
  Shape (*shape)(float size);
};
// The corners of two cubes, one inside the other.
constexpr std::uint32_t hull_points = 16;
constexpr Kind kinds[] = {
    {"spheres", [](float size) { return Shape::sphere(size); }},
    {"boxes",
     [](float size) {
       return Shape::box({size, 2 * size, 0.5f * size});
     }},
    {"hulls of 16 points", [](float) { return Shape::convex(0, hull_points); }},
};

// A function of the index only, between -1 and 1.
float draw(std::size_t i, std::uint64_t which) {
  const std::uint64_t bits = mix64(8 * i + which) >> 40;
  return static_cast<float>(bits) / static_cast<float>(1 << 23) - 1.0f;
}

Transform transform_of(std::size_t i) {
  Transform t;
  t.position = {100 * draw(i, 0), 100 * draw(i, 1), 100 * draw(i, 2)};
  // Not normalized, at no cost: the boxes are those of the matrix as given.
  t.rotation = {draw(i, 3), draw(i, 4), draw(i, 5), draw(i, 6)};
  return t;
}

void measure_kind(const Kind& kind, const std::vector<Transform>& transforms, Session& s) {
  const std::size_t n = transforms.size();
  std::vector<Shape> shapes;
  std::vector<std::uint32_t> shape(n);
  for (int k = 0; k < 64; ++k) shapes.push_back(kind.shape(0.1f * static_cast<float>(k + 1)));
  for (std::size_t i = 0; i < n; ++i)
    shape[i] = static_cast<std::uint32_t>(mix64(i) % shapes.size());
  std::vector<Vec3> points;
  for (std::uint32_t k = 0; k < hull_points; ++k) {
    const float size = k < 8 ? 1.0f : 0.5f;
    points.push_back({k & 1 ? size : -size, k & 2 ? size : -size, k & 4 ? size : -size});
  }
  const auto view = [n](const Transform* t, const Shape* of, std::size_t shape_count,
                        const std::uint32_t* which, const Vec3* p) {
    Bodies b(t, n, of, shape_count);
    b.shape = {which, n};
    b.points = {p, hull_points};
    return b;
  };
  std::vector<Box> want(n), got(n);
  const Result host = update_boxes(
      view(transforms.data(), shapes.data(), shapes.size(), shape.data(), points.data()),
      want.data());
  if (!host.ok()) throw std::runtime_error(host.message);

  const auto upload = [](const auto& values) {
    DeviceArray<std::decay_t<decltype(values[0])>> there(values.size());
    there.put(values.data(), values.size());
    return there;
  };
  const auto d_transforms = upload(transforms);
  const auto d_shapes = upload(shapes);
  const auto d_shape = upload(shape);
  const auto d_points = upload(points);
  const DeviceArray<Box> boxes(n);
  const DeviceArray<cuda::BodyReport> report(1);
  const Bodies there =
      view(d_transforms.data(), d_shapes.data(), d_shapes.size(), d_shape.data(), d_points.data());
  const OwnStream stream;
  const Graph graph(stream.get(), [&] {
    const Result r = cuda::update_boxes_async(there, boxes.data(), report.data(), stream.get());
    if (!r.ok()) throw std::runtime_error(r.message);
  });
  graph.launch(stream.get());
  stream.wait();
  boxes.get(got.data(), n);
  ++s.checked;
  if (std::memcmp(got.data(), want.data(), n * sizeof(Box)) != 0)
    s.wrong.push_back(std::string(kind.name) + ", " + std::to_string(n) +
                      ": the device's boxes are not those of the host");
  const Timing t =
      time_runs(stream.get(), s.budget_ms, [&](std::size_t) { graph.launch(stream.get()); });
  Measurement row;
  row.experiment = "bodies";
  row.what = kind.name;
  row.objects = n;
  row.time = t;
  row.bytes_per_box = sizeof(Transform) + sizeof(std::uint32_t) + sizeof(Box);
  row.rate = 100 * row.bytes_per_box * static_cast<double>(n) / (t.median_ms * 1e6) / s.copy_gbs;
  row.rate_metric = "copy_percent";
  row.note = "transform 28, shape 4, box 24; shapes and points in the caches";
  s.measurements.push_back(std::move(row));
}

}  // namespace

void measure_bodies(Session& s, std::size_t most) {
  if (s.copy_gbs == 0) s.copy_gbs = copy_bandwidth_gbs();
  for (const std::size_t n : {100000u, 1000000u, 10000000u}) {
    if (n > most) continue;
    std::vector<Transform> transforms(n);
    for (std::size_t i = 0; i < n; ++i) transforms[i] = transform_of(i);
    for (const Kind& kind : kinds) measure_kind(kind, transforms, s);
  }
}

}  // namespace throng::bench::gpu
