#include "mesh/triangle_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/bounds.hpp"
#include "grid/doubles.hpp"

namespace throng::mesh {
namespace {

// A chunk of triangles: what one task reads and writes at a time.
struct Chunk {
  const MeshArrays& mesh;
  std::size_t vertices;
  const BoxOptions& options;
  Box* out;
  MeshDefects defects;
  double largest = 0;

  void add_defect(std::size_t triangle, std::uint32_t vertex, bool out_of_range) noexcept {
    MeshDefects one;
    one.count = 1;
    one.first = triangle;
    one.vertex = vertex;
    one.out_of_range = out_of_range;
    defects.add(one);
  }

  // The interval of an axis, as floats.
  void round(double lower, double upper, double origin, float& to_lower,
             float& to_upper) const noexcept {
    if (options.enlarge != 0) {
      lower = base::subtract_rounded_down(lower, options.enlarge);
      upper = -base::subtract_rounded_down(-upper, options.enlarge);
    }
    to_lower = static_cast<float>(lower - origin);
    to_upper = static_cast<float>(upper - origin);
  }

  template <class Real>
  void write(std::size_t begin, std::size_t end) noexcept {
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle t = mesh.triangle(static_cast<std::uint32_t>(i));
      const std::uint32_t index[3] = {t.a, t.b, t.c};
      const std::uint32_t most = std::max({t.a, t.b, t.c});
      if (most >= vertices) [[unlikely]] {
        add_defect(i, t.a >= vertices ? t.a : (t.b >= vertices ? t.b : t.c), true);
        continue;
      }
      const Real* const a = mesh.coordinates<Real>(t.a);
      const Real* const b = mesh.coordinates<Real>(t.b);
      const Real* const c = mesh.coordinates<Real>(t.c);
      Real lower[3], upper[3], sum = 0, magnitude = 0;
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(std::min(a[k], b[k]), c[k]);
        upper[k] = std::max(std::max(a[k], b[k]), c[k]);
        // Zero times infinity or NaN is NaN.
        sum += (a[k] + b[k] + c[k]) * 0;
        magnitude = std::max(magnitude, std::max(std::fabs(lower[k]), std::fabs(upper[k])));
      }
      if (!(sum == 0)) [[unlikely]] {
        // The sum may have overflowed.
        const auto bad = std::find_if(index, index + 3, [this](std::uint32_t v) {
          const Real* const p = mesh.coordinates<Real>(v);
          return !std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]);
        });
        if (bad != index + 3) {
          add_defect(i, *bad, false);
          continue;
        }
      }
      largest = std::max(largest, static_cast<double>(magnitude));
      Box& box = out[i];
      const DoubleVec3& o = options.origin;
      if (std::is_same_v<Real, float> && options.enlarge == 0) {
        box = {{static_cast<float>(lower[0]), static_cast<float>(lower[1]),
                static_cast<float>(lower[2])},
               {static_cast<float>(upper[0]), static_cast<float>(upper[1]),
                static_cast<float>(upper[2])}};
      } else {
        round(static_cast<double>(lower[0]), static_cast<double>(upper[0]), o.x, box.lower.x,
              box.upper.x);
        round(static_cast<double>(lower[1]), static_cast<double>(upper[1]), o.y, box.lower.y,
              box.upper.y);
        round(static_cast<double>(lower[2]), static_cast<double>(upper[2]), o.z, box.lower.z,
              box.upper.z);
      }
    }
  }
};

}  // namespace

MeshDefects write_triangle_boxes(const MeshArrays& mesh, bool is_float, std::size_t triangles,
                                 std::size_t vertices, const BoxOptions& options,
                                 const Executor& executor, unsigned tasks, Box* out,
                                 double& largest) {
  MeshDefects defects;
  std::mutex mutex;
  base::ChunkQueue chunks(triangles, tasks, 512);
  auto task = [&](unsigned t) {
    Chunk chunk{mesh, vertices, options, out, {}, 0};
    for (std::size_t begin, end; chunks.take(t, begin, end);)
      is_float ? chunk.write<float>(begin, end) : chunk.write<double>(begin, end);
    const std::lock_guard<std::mutex> lock(mutex);
    defects.add(chunk.defects);
    largest = std::max(largest, chunk.largest);
  };
  base::run_tasks(executor, tasks, task);
  return defects;
}

DoubleVec3 choose_origin(const MeshArrays& mesh, std::size_t vertices) noexcept {
  // Each vertex as a box.
  const auto* const points = reinterpret_cast<const DoubleVec3*>(mesh.vertices);
  const DoubleBoxes boxes = DoubleBoxes::split(points, points, vertices, mesh.vertex_stride_bytes);
  return grid::choose_origin({&boxes, &boxes, 0});
}

}  // namespace throng::mesh
