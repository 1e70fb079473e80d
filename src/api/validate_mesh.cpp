#include "validate_mesh.hpp"

#include <cmath>

#include "validate.hpp"

namespace throng {
namespace {

using ull = unsigned long long;

constexpr Noun triangle_noun = {"triangle", "triangles"};

bool valid_arrays(const TriangleMesh& mesh, const char* which, Result& r) noexcept {
  const std::size_t n = mesh.size();
  const Vertices& vertices = mesh.vertices;
  const std::size_t unit = vertices.is_float() ? sizeof(float) : sizeof(double);
  if (n > max_box_count) {
    set_message(r, "%s has %llu triangles, at most %llu can be indexed; split it", which, ull{n},
                ull{max_box_count});
    return refuse(r, Status::too_many_boxes);
  }
  if (n != 0 && !mesh.triangles.data) {
    set_message(r, "%s has %llu triangles but their array is null; give its address", which,
                ull{n});
  } else if (vertices.size() != 0 && !vertices.data()) {
    set_message(r, "%s has %llu vertices but their array is null; give its address", which,
                ull{vertices.size()});
  } else if (mesh.triangles.stride_bytes % alignof(Triangle) != 0) {
    set_message(r, "the stride of the triangles of %s is %llu bytes; it must be a multiple of %llu",
                which, ull{mesh.triangles.stride_bytes}, ull{alignof(Triangle)});
  } else if (vertices.stride_bytes() % unit != 0) {
    set_message(r, "the stride of the vertices of %s is %llu bytes; it must be a multiple of %llu",
                which, ull{vertices.stride_bytes()}, ull{unit});
  } else {
    return true;
  }
  return refuse(r, Status::bad_mesh);
}

bool valid_transform(const TriangleMesh& mesh, const char* which, Result& r) noexcept {
  for (const auto& row : mesh.transform.row) {
    for (const double x : row) {
      if (std::isfinite(x)) continue;
      set_message(r, "the transform of %s has the value %g; it must be finite", which, x);
      return refuse(r, Status::bad_mesh);
    }
  }
  return true;
}

}  // namespace

bool valid_mesh_margin(float margin, Result& r) noexcept {
  if (margin == 0) return true;
  set_message(r, "the margin is %g, but a margin is for boxes; use find_within for triangles",
              double{margin});
  return refuse(r, Status::bad_option);
}

bool valid_mesh(const TriangleMesh& mesh, const char* which, Result& r) noexcept {
  return valid_arrays(mesh, which, r) &&
         valid_filters(mesh.filters, mesh.size(), which, triangle_noun, r) &&
         valid_transform(mesh, which, r);
}

bool valid_mesh_on_device(const TriangleMesh& mesh, const char* which, Result& r) noexcept {
  return valid_arrays(mesh, which, r) &&
         valid_filter_lengths(mesh.filters, mesh.size(), which, triangle_noun, r) &&
         valid_transform(mesh, which, r);
}

void explain_bad_triangle(const TriangleMesh& mesh, const char* which, std::uint64_t triangle,
                          std::uint32_t vertex, const char* after, Result& r) noexcept {
  if (vertex >= mesh.vertices.size()) {
    set_message(
        r,
        "triangle %llu of %s has vertex %llu, but there %s %llu %s, counted from 0; fix the "
        "index%s",
        ull{triangle}, which, ull{vertex}, mesh.vertices.size() == 1 ? "is" : "are",
        ull{mesh.vertices.size()}, mesh.vertices.size() == 1 ? "vertex" : "vertices", after);
    return;
  }
  const DoubleVec3 p = mesh.vertices[vertex];
  const bool is_finite = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  set_message(
      r, "triangle %llu of %s uses vertex %llu at (%g, %g, %g)%s; coordinates must be finite%s",
      ull{triangle}, which, ull{vertex}, p.x, p.y, p.z,
      is_finite ? ", not finite after the transform" : "", after);
}

}  // namespace throng
