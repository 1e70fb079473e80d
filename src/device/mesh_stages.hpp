// Per-thread work of a search for intersecting triangles: from meshes to boxes, and the test of
// candidates.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <throng/cuda_mesh.hpp>
#include <throng/mesh.hpp>

#include "base/host_device_macros.hpp"
#include "device/atomic.hpp"
#include "device/input.hpp"
#include "mesh/decide_pair.hpp"
#include "mesh/transform.hpp"

namespace throng::device {

// A search's report, in the memory of the device that runs it.
using cuda::MeshReport;

// What the stages of a search pass on, in device memory.
struct MeshState {
  DoubleVec3 origin;           // subtracted before coordinates are rounded to floats
  std::uint32_t has_large;     // some coordinate is too large for the filter
  std::uint32_t bad_vertex;    // index of the first bad triangle
  std::uint32_t out_of_range;  // whether that is what is wrong with it
  std::uint32_t unused;
};

// Vertices as doubles, transformed.
struct ConvertVertices {
  mesh::MeshArrays mesh;
  mesh::VertexOfEither vertex;
  AffineTransform transform;
  bool moves;
  DoubleVec3* out;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const DoubleVec3 p = vertex(mesh, static_cast<std::uint32_t>(i));
    out[i] = moves ? mesh::transformed(transform, p) : p;
  }
};

// One thread. The origin of double coordinates: as grid::choose_origin, of the first mesh.
struct ChooseOrigin {
  mesh::MeshArrays mesh;
  std::uint64_t vertices;
  MeshState* state;

  THRONG_HD void operator()(std::uint64_t) const noexcept {
    state->origin = {origin_of(0), origin_of(1), origin_of(2)};
  }

 private:
  static constexpr int most_samples = 64;

  THRONG_HD double origin_of(int axis) const noexcept {
    const std::uint64_t samples = vertices < most_samples ? vertices : most_samples;
    const std::uint64_t step = vertices < most_samples ? 1 : vertices / most_samples;
    double sorted[most_samples];
    int count = 0;
    THRONG_UNROLL(1)
    for (std::uint64_t i = 0; i < samples; ++i) {
      const double x = mesh.coordinates<double>(static_cast<std::uint32_t>(i * step))[axis];
      if (!(x * 0 == 0)) continue;  // not finite
      int at = count++;
      for (; at > 0 && sorted[at - 1] > x; --at) sorted[at] = sorted[at - 1];
      sorted[at] = x;
    }
    if (count == 0) return 0;
    const double middle = sorted[count / 2];
    const double spread = sorted[count * 3 / 4] - sorted[count / 4];
    constexpr double far = 4;
    return std::fabs(middle) > far * spread ? middle : 0;
  }
};

// The vertices of a triangle, if it is valid.
struct CheckedTriangle {
  bool valid = false;
  std::uint32_t bad_vertex = 0;
  bool out_of_range = false;
  DoubleVec3 p[3] = {};

  THRONG_HD CheckedTriangle(const mesh::MeshArrays& mesh, const mesh::VertexOfEither& vertex,
                            std::uint64_t vertices, std::uint32_t i) noexcept {
    const Triangle t = mesh.triangle(i);
    const std::uint32_t index[3] = {t.a, t.b, t.c};
    for (int k = 0; k < 3; ++k) {
      if (index[k] < vertices) continue;
      bad_vertex = index[k];
      out_of_range = true;
      return;
    }
    for (int k = 0; k < 3; ++k) {
      p[k] = vertex(mesh, index[k]);
      // Zero times infinity or NaN is NaN.
      if (p[k].x * 0 == 0 && p[k].y * 0 == 0 && p[k].z * 0 == 0) continue;
      bad_vertex = index[k];
      return;
    }
    valid = true;
  }
};

// The boxes of a mesh's triangles. A bad triangle is reported and has an inactive box, so that no
// later stage reads its vertices. Rounding: see mesh/triangle_boxes.hpp.
struct WriteTriangleBoxes {
  mesh::MeshArrays mesh;
  mesh::VertexOfEither vertex;
  std::uint64_t vertices;
  bool is_second;
  std::uint32_t first;  // the number of triangles of the mesh before
  MeshState* state;
  MeshReport* report;
  Box* out;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const CheckedTriangle t(mesh, vertex, vertices, static_cast<std::uint32_t>(i));
    if (!t.valid) {
      out[i] = {{1, 1, 1}, {0, 0, 0}};
      fetch_add(&report->bad_triangles, std::uint64_t{1});
      if (is_second) fetch_add(&report->bad_in_second, std::uint64_t{1});
      fetch_max(&report->bad_mark, ~(first + static_cast<std::uint32_t>(i)));
      return;
    }
    DoubleVec3 lower = t.p[0], upper = t.p[0];
    for (int k = 1; k < 3; ++k) {
      const DoubleVec3& p = t.p[k];
      lower = {less(p.x, lower.x), less(p.y, lower.y), less(p.z, lower.z)};
      upper = {greater(p.x, upper.x), greater(p.y, upper.y), greater(p.z, upper.z)};
    }
    const double most = greater(greater(magnitude(lower.x, upper.x), magnitude(lower.y, upper.y)),
                                magnitude(lower.z, upper.z));
    if (most > mesh::Bounds<double>::largest) set_flag(&state->has_large);
    const DoubleVec3 o = state->origin;
    out[i] = {{static_cast<float>(lower.x - o.x), static_cast<float>(lower.y - o.y),
               static_cast<float>(lower.z - o.z)},
              {static_cast<float>(upper.x - o.x), static_cast<float>(upper.y - o.y),
               static_cast<float>(upper.z - o.z)}};
  }

 private:
  THRONG_HD static double less(double a, double b) noexcept { return a < b ? a : b; }
  THRONG_HD static double greater(double a, double b) noexcept { return a > b ? a : b; }
  THRONG_HD static double magnitude(double lower, double upper) noexcept {
    return greater(std::fabs(lower), std::fabs(upper));
  }
};

// One thread: what is wrong with the first bad triangle.
struct InspectBadTriangle {
  mesh::MeshArrays meshes[2];
  mesh::VertexOfEither vertex;
  std::uint64_t vertices[2];
  std::uint32_t first_count;
  const MeshReport* report;
  MeshState* state;

  THRONG_HD void operator()(std::uint64_t) const noexcept {
    const std::uint32_t i = report->first_bad();
    const bool second = i >= first_count;
    const CheckedTriangle t(meshes[second], vertex, vertices[second], second ? i - first_count : i);
    state->bad_vertex = t.bad_vertex;
    state->out_of_range = t.out_of_range;
  }
};

// The test of one candidate, taken by its number among those that a warp or host thread has
// collected. What the filter leaves uncertain is listed for a second pass. If the list is full, it
// is decided at once.
struct TriangleTest {
  mesh::PairInput input;
  const MeshState* state;
  MeshReport* report;
  Pair* uncertain;
  std::uint64_t capacity;

  THRONG_HD mesh::VertexOfEither vertex() const noexcept { return {input.is_float}; }

  THRONG_HD THRONG_OUTLINE bool operator()(std::uint32_t first,
                                           std::uint32_t second) const noexcept {
    const Pair pair{first, second};
    if (state->has_large == 0) {
      const mesh::Decision decision = mesh::filter_pair(input, pair, vertex());
      if (decision != mesh::Decision::unsure) return decision == mesh::Decision::yes;
    }
    const std::uint64_t at = fetch_increment(&report->exact_tests);
    if (at >= capacity) return mesh::exact_pair(input, pair, vertex());
    uncertain[at] = pair;
    return false;
  }
  // Called once for a number of candidates.
  THRONG_HD void add_candidates(std::uint64_t count) const noexcept {
    fetch_add(&report->candidates, count);
  }
};

// The second pass: thread i takes the i-th uncertain pair. See ListSearch.
struct DecideUncertain {
  TriangleTest test;

  THRONG_HD std::uint64_t count() const noexcept {
    const std::uint64_t listed = test.report->exact_tests;
    return listed < test.capacity ? listed : test.capacity;
  }
  THRONG_HD bool operator()(std::uint64_t i, Pair& pair, std::uint32_t&) const noexcept {
    pair = test.uncertain[i];
    return mesh::exact_pair(test.input, pair, test.vertex());
  }
};

}  // namespace throng::device
