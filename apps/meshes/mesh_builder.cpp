#include "apps/meshes/mesh_builder.hpp"

#include <cmath>
#include <cstring>
#include <utility>

#include <throng/checksum.hpp>

#include "apps/scenes/npy_header.hpp"

namespace throng::meshes {
namespace {

// Halfway between the largest float and 2^128: rounds to infinity, as all above it.
constexpr double beyond_float = 0x1.ffffffp127;

std::uint64_t bits(double x) noexcept {
  x += 0.0;  // -0 becomes 0
  std::uint64_t word = 0;
  std::memcpy(&word, &x, sizeof word);
  return word;
}

bool has_nan(DoubleVec3 p) noexcept {
  return std::isnan(p.x) || std::isnan(p.y) || std::isnan(p.z);
}

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

DoubleVec3 MeshBuilder::position(std::size_t i) const noexcept {
  if (mesh_.precision == Precision::float64) return mesh_.double_vertices[i];
  const Vec3& p = mesh_.vertices[i];
  return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}

// The slot of this position, or the empty one where it belongs.
std::size_t MeshBuilder::slot_of(DoubleVec3 p) const noexcept {
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = mix64(mix64(mix64(bits(p.x)) ^ bits(p.y)) ^ bits(p.z)) & mask;
  for (; table_[slot] != no_vertex; slot = (slot + 1) & mask) {
    const DoubleVec3 q = position(table_[slot]);
    if (p.x == q.x && p.y == q.y && p.z == q.z) break;
  }
  return slot;
}

void MeshBuilder::grow_table() {
  table_.assign(table_.empty() ? 1024 : 2 * table_.size(), no_vertex);
  for (std::size_t i = 0; i < vertex_count(); ++i) {
    const DoubleVec3 p = position(i);
    if (!has_nan(p)) table_[slot_of(p)] = static_cast<std::uint32_t>(i);
  }
}

std::uint32_t MeshBuilder::weld_vertex(double x, double y, double z, Place place) {
  if (2 * (vertex_count() + 1) > table_.size()) grow_table();
  const std::size_t count = vertex_count();
  add_vertex(x, y, z, place);  // rounds it
  // In the table they would be one long chain.
  if (has_nan(position(count))) return static_cast<std::uint32_t>(count);
  const std::size_t slot = slot_of(position(count));
  if (table_[slot] != no_vertex) {
    if (mesh_.precision == Precision::float64)
      mesh_.double_vertices.pop_back();
    else
      mesh_.vertices.pop_back();
    return table_[slot];
  }
  return table_[slot] = static_cast<std::uint32_t>(count);
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
         std::to_string(shift) + " to " + std::to_string(count - 1 + shift));
  }
  table_ = {};
  return std::move(mesh_);
}

}  // namespace throng::meshes
