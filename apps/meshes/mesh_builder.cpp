#include "apps/meshes/mesh_builder.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "apps/scenes/npy_header.hpp"

namespace throng::meshes {
namespace {

// Halfway between the largest float and 2^128: rounds to infinity, as all above it.
constexpr double beyond_float = 0x1.ffffffp127;

constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

}  // namespace

MeshBuilder::MeshBuilder(std::string name, Precision precision) : name_(std::move(name)) {
  mesh_.precision = precision;
}

void MeshBuilder::fail(Place place, const std::string& found, const std::string& wanted) const {
  scenes::throw_file_error(name_ + ", " + place.unit + " " + std::to_string(place.number), found,
                           wanted);
}

void MeshBuilder::fail(const std::string& found, const std::string& wanted) const {
  scenes::throw_file_error(name_, found, wanted);
}

void MeshBuilder::add_vertex(double x, double y, double z, Place place) {
  if (vertex_count() == no_vertex) fail(place, "more than 4294967295 vertices", "fewer");
  if (mesh_.precision == Precision::float64) {
    mesh_.double_vertices.push_back({x, y, z});
    return;
  }
  for (const double c : {x, y, z}) {
    if (std::fabs(c) >= beyond_float && std::isfinite(c)) {
      fail(place, "a coordinate beyond float32", "at most 3.4e38 in size, or --double");
    }
  }
  mesh_.vertices.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
}

void MeshBuilder::add_triangle(Triangle t) {
  if (t.a == t.b || t.b == t.c || t.c == t.a) {
    ++mesh_.dropped;
  } else {
    mesh_.triangles.push_back(t);
  }
}

void MeshBuilder::add_corner(std::uint64_t index, Place place, unsigned written) {
  if (index >= no_vertex) {
    fail(place, "the vertex index " + std::to_string(index + written),
         "at most " + std::to_string(std::uint64_t{no_vertex} - 1 + written));
  }
  const auto corner = static_cast<std::uint32_t>(index);
  if (!any_corner_ || corner > largest_) {
    any_corner_ = true;
    largest_ = corner;
    largest_written_ = written;
    largest_place_ = place;
  }
  if (corners_ == 0) first_ = corner;
  if (corners_ >= 2) add_triangle({first_, last_, corner});
  last_ = corner;
  ++corners_;
}

void MeshBuilder::end_polygon() {
  if (corners_ < 3) ++mesh_.dropped;
  corners_ = 0;
}

MeshFile MeshBuilder::finish() {
  const std::size_t count = vertex_count();
  if (count == 0) fail("no vertices", "a mesh");
  if (any_corner_ && largest_ >= count) {
    const std::uint64_t shift = largest_written_;
    fail(largest_place_, "the vertex index " + std::to_string(largest_ + shift),
         count == 1 ? std::to_string(shift) + ", the only one"
                    : std::to_string(shift) + " to " + std::to_string(count - 1 + shift));
  }
  return std::move(mesh_);
}

}  // namespace throng::meshes
