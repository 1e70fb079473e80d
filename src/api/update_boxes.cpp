// update_boxes: checks arguments, runs on the CPU, and turns failures into messages.
#include <throng/update_boxes.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>

#include "base/float_state.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"
#include "base/update_boxes.hpp"
#include "bodies/body_boxes.hpp"
#include "grid/engine.hpp"
#include "grid/sweep/kernel_table.hpp"
#include "update_boxes.hpp"
#include "validate.hpp"

namespace throng {
namespace {

using ull = unsigned long long;

// Checks that the array is not null, has one value per body if `bodies` is given, and has a stride
// that is a multiple of a float's alignment.
template <class T>
bool valid(const Strided<T>& array, const char* name, const std::size_t* bodies,
           Result& r) noexcept {
  if (!array.data && array.count != 0) {
    set_message(r,
                "the array '%s' has %llu values but is null; give its address, or count 0 for none",
                name, ull{array.count});
  } else if (array && bodies && array.count != *bodies) {
    set_message(r, "the array '%s' has %llu values for %llu bodies; give one value per body", name,
                ull{array.count}, ull{*bodies});
  } else if (array.stride_bytes % alignof(float) != 0) {
    set_message(r, "the stride of '%s' is %llu bytes; it must be a multiple of %llu", name,
                ull{array.stride_bytes}, ull{alignof(float)});
  } else {
    return true;
  }
  return refuse(r, Status::bad_bodies);
}

bool valid(const Bodies& b, const Box* out, std::size_t stride, Result& r) noexcept {
  const std::size_t n = b.size();
  if (!valid(b.position, "position", nullptr, r) || !valid(b.rotation, "rotation", &n, r) ||
      !valid(b.displacement, "displacement", &n, r) || !valid(b.shape, "shape", &n, r) ||
      !valid(b.shapes, "shapes", nullptr, r) || !valid(b.points, "points", nullptr, r)) {
    return false;
  }
  if (n == 0) return true;
  if (!b.shape && b.shapes.count != n && b.shapes.count != 1) {
    set_message(
        r,
        "there are %llu shapes for %llu bodies; give one per body, one for all, or the array "
        "'shape' with the shape index of each body",
        ull{b.shapes.count}, ull{n});
    return refuse(r, Status::bad_bodies);
  }
  if (!out) {
    set_message(r, "the array of boxes is null; provide space for %llu boxes", ull{n});
    return refuse(r, Status::bad_bodies);
  }
  if (stride % alignof(float) != 0 || stride < sizeof(Box)) {
    set_message(
        r, "the stride of the boxes is %llu bytes; it must be a multiple of %llu, and %llu or more",
        ull{stride}, ull{alignof(float)}, ull{sizeof(Box)});
    return refuse(r, Status::bad_bodies);
  }
  return true;
}

void explain(Result& r, const base::UpdateBoxes& job) noexcept {
  const auto i = static_cast<std::size_t>(r.first_invalid);
  const ull count{r.invalid_count}, index{job.shape_index(i)};
  const base::ShapeFault fault = job.fault(i);
  if (fault == base::ShapeFault::index) {
    set_message(
        r,
        "%llu bodies have an invalid shape, the first is body %llu with shape %llu of %llu; use 0 "
        "to one less than that",
        count, ull{i}, index, ull{job.shape_count});
    return;
  }
  const Shape& s = job.shapes[static_cast<std::size_t>(index)];
  char what[112] = {};
  const Vec3& h = s.half_extents;
  switch (fault) {
    case base::ShapeFault::radius:
      std::snprintf(what, sizeof what, "radius %g; it must be 0 or more", double{s.radius});
      break;
    case base::ShapeFault::half_extents:
      std::snprintf(what, sizeof what, "half extents %g %g %g; they must be 0 or more", double{h.x},
                    double{h.y}, double{h.z});
      break;
    case base::ShapeFault::points:
      std::snprintf(what, sizeof what, "points %lu to %llu of %llu; fix the range or give more",
                    static_cast<unsigned long>(s.first_point),
                    ull{s.first_point} + s.point_count - 1, ull{job.point_count});
      break;
    default:
      std::snprintf(what, sizeof what, "kind %lu; it must be a ShapeKind",
                    static_cast<unsigned long>(s.kind));
      break;
  }
  set_message(r, "%llu bodies have an invalid shape, the first is body %llu: shape %llu has %s",
              count, ull{i}, index, what);
}

}  // namespace

bool make_job(const Bodies& bodies, Box* out, const UpdateOptions& options,
              std::size_t stride_bytes, base::UpdateBoxes& job, Result& r) noexcept {
  if (!valid_margin(options.margin, r) || !valid(bodies, out, stride_bytes, r)) return false;
  job.position = base::strided_array(bodies.position);
  job.rotation = base::strided_array(bodies.rotation);
  job.displacement = base::strided_array(bodies.displacement);
  job.shape = base::strided_array(bodies.shape);
  job.shapes = base::strided_array(bodies.shapes);
  job.points = base::strided_array(bodies.points);
  job.shape_count = bodies.shapes.count;
  job.point_count = bodies.points.count;
  job.one_shape = bodies.shapes.count == 1;
  job.margin = options.margin;
  job.out = reinterpret_cast<char*>(out);
  job.out_stride = stride_bytes;
  return true;
}

Result update_boxes(const Bodies& bodies, Box* out, const UpdateOptions& options,
                    std::size_t stride_bytes) noexcept {
  THRONG_RANGE("update boxes");
  const base::FloatState float_state;
  const auto start = std::chrono::steady_clock::now();
  Result r;
  r.plan.reason = "one pass over the bodies";
  const grid::Kernels* kernels = kernels_for(options.isa, "UpdateOptions::isa", r);
  if (!kernels) return r;
  if (!valid_executor(options.executor, r)) return r;
  base::UpdateBoxes job;
  if (!make_job(bodies, out, options, stride_bytes, job, r)) return r;

  const std::size_t n = bodies.size();
  r.plan.isa = kernels->isa;
  r.plan.threads = grid::threads_for(n, options);
  base::Cancellation stop(options.stop);
  if (n != 0) {
    const bodies::BodyReport report = bodies::update_boxes(
        job, n, kernels->isa, base::executor_of(options), r.plan.threads, stop);
    r.first_invalid = report.first_invalid;
    r.invalid_count = report.invalid_count;
  }
  r.written = n;
  if (stop()) {
    r.written = r.first_invalid = r.invalid_count = 0;
    r.status = Status::stopped;
  } else if (r.invalid_count != 0) {
    r.status = Status::bad_shape;
    explain(r, job);
  }
  r.times.total_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return r;
}

}  // namespace throng
