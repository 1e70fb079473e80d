#include "mesh/triangle_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/bounds.hpp"
#include "base/mutex.hpp"
#include "grid/doubles.hpp"

namespace throng::mesh {
namespace {

DoubleVec3 widened(const float (&p)[3]) noexcept { return {p[0], p[1], p[2]}; }
DoubleVec3 widened(const double (&p)[3]) noexcept { return {p[0], p[1], p[2]}; }

// The work of one task.
struct Writer {
  const MeshArrays& mesh;
  std::size_t vertices;
  const BoxOptions& options;
  Box* out;
  MeshDefects defects = {};
  CoordinateRange range = {};

  void add_defect(std::size_t triangle, std::uint32_t vertex, bool out_of_range) noexcept {
    MeshDefects one;
    one.count = 1;
    one.first = triangle;
    one.vertex = vertex;
    one.out_of_range = out_of_range;
    defects.add(one);
  }

  template <class Real>
  void write(std::size_t begin, std::size_t end) noexcept {
    constexpr Real infinity = std::numeric_limits<Real>::infinity();
    Real least[3] = {infinity, infinity, infinity}, most[3] = {-infinity, -infinity, -infinity};
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle t = mesh.triangle(static_cast<std::uint32_t>(i));
      const std::uint32_t index[3] = {t.a, t.b, t.c};
      if (std::max({t.a, t.b, t.c}) >= vertices) [[unlikely]] {
        add_defect(i, t.a >= vertices ? t.a : (t.b >= vertices ? t.b : t.c), true);
        continue;
      }
      const Real* const a = mesh.coordinates<Real>(t.a);
      const Real* const b = mesh.coordinates<Real>(t.b);
      const Real* const c = mesh.coordinates<Real>(t.c);
      Real lower[3], upper[3], sum = 0;
      for (int k = 0; k < 3; ++k) {
        lower[k] = std::min(std::min(a[k], b[k]), c[k]);
        upper[k] = std::max(std::max(a[k], b[k]), c[k]);
        least[k] = std::min(least[k], lower[k]);
        most[k] = std::max(most[k], upper[k]);
        // Zero times infinity or NaN is NaN.
        sum += (a[k] + b[k] + c[k]) * 0;
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
      out[i] = options.box(widened(lower), widened(upper));
    }
    range.add(widened(least), widened(most));
  }

  // By the kernel of floats; false if it cannot.
  bool write_by(const PairKernels& kernels, std::size_t begin, std::size_t end) noexcept {
    if (!kernels.write_boxes || options.enlarge != 0) return false;
    Box bounds;
    if (!kernels.write_boxes(mesh, vertices, begin, end, out, bounds)) return false;
    range.add({bounds.lower.x, bounds.lower.y, bounds.lower.z},
              {bounds.upper.x, bounds.upper.y, bounds.upper.z});
    return true;
  }
};

}  // namespace

void BoxOptions::round(double lower, double upper, double from, float& to_lower,
                       float& to_upper) const noexcept {
  if (enlarge != 0) {
    lower = base::subtract_rounded_down(lower, enlarge);
    upper = -base::subtract_rounded_down(-upper, enlarge);
  }
  to_lower = static_cast<float>(lower - from);
  to_upper = static_cast<float>(upper - from);
}

MeshDefects write_triangle_boxes(const MeshArrays& mesh, bool is_float, std::size_t triangles,
                                 std::size_t vertices, const BoxOptions& options,
                                 const PairKernels& kernels, const Executor& executor,
                                 unsigned tasks, Box* out, CoordinateRange& range) {
  MeshDefects defects;
  base::Mutex mutex;
  base::ChunkQueue chunks(triangles, tasks, 512);
  auto task = [&](unsigned t) {
    Writer writer{mesh, vertices, options, out};
    for (std::size_t begin, end; chunks.take(t, begin, end);) {
      if (!is_float)
        writer.write<double>(begin, end);
      else if (!writer.write_by(kernels, begin, end))
        writer.write<float>(begin, end);
    }
    const std::lock_guard<base::Mutex> lock(mutex);
    defects.add(writer.defects);
    range.add(writer.range.lower, writer.range.upper);
  };
  base::run_tasks(executor, tasks, task);
  return defects;
}

void drop_boxes_outside(const CoordinateRange& range, const CoordinateRange& of_boxes,
                        const BoxOptions& options, const Executor& executor, unsigned tasks,
                        Box* boxes, std::size_t count) {
  if (range.contains(of_boxes)) return;
  const Box kept = options.box(range.lower, range.upper);
  base::ChunkQueue chunks(count, tasks, 512);
  auto task = [&](unsigned t) {
    for (std::size_t begin, end; chunks.take(t, begin, end);) {
      for (std::size_t i = begin; i < end; ++i)
        if (!base::overlaps(boxes[i], kept)) boxes[i] = {{1, 1, 1}, {0, 0, 0}};
    }
  };
  base::run_tasks(executor, tasks, task);
}

DoubleVec3 choose_origin(const MeshArrays& mesh, std::size_t vertices) noexcept {
  // Each vertex as a box.
  const auto* const points = reinterpret_cast<const DoubleVec3*>(mesh.vertices);
  const DoubleBoxes boxes = DoubleBoxes::split(points, points, vertices, mesh.vertex_stride_bytes);
  return grid::choose_origin({&boxes, &boxes, 0});
}

}  // namespace throng::mesh
