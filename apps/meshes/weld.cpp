// Vertices at equal positions become one, by a hash table of positions.
#include <cmath>
#include <cstring>
#include <limits>

#include <throng/checksum.hpp>

#include "apps/meshes/mesh_file.hpp"

namespace throng::meshes {
namespace {

std::uint64_t bits(double x) noexcept {
  x += 0.0;  // -0 becomes 0
  std::uint64_t word = 0;
  std::memcpy(&word, &x, sizeof word);
  return word;
}

// Point: Vec3 or DoubleVec3.
template <class Point>
class Welder {
 public:
  explicit Welder(std::vector<Point>& points) : points_(points), table_(1024, empty) {}

  // Leaves one point per position. Returns the new index of each old one.
  std::vector<std::uint32_t> run() {
    std::vector<std::uint32_t> index(points_.size());
    for (std::size_t i = 0; i < index.size(); ++i) index[i] = index_of(points_[i]);
    points_.resize(kept_);
    points_.shrink_to_fit();
    return index;
  }

 private:
  static constexpr std::uint32_t empty = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t index_of(const Point p) {
    // In the table they would be one long chain.
    if (std::isnan(p.x) || std::isnan(p.y) || std::isnan(p.z)) return keep(p);
    if (2 * (kept_ + 1) > table_.size()) grow_table();
    std::uint32_t& slot = table_[slot_of(p)];
    if (slot == empty) slot = keep(p);
    return slot;
  }
  std::uint32_t keep(const Point& p) {
    points_[kept_] = p;
    return static_cast<std::uint32_t>(kept_++);
  }
  // The slot of this position, or the empty one where it belongs.
  std::size_t slot_of(const Point& p) const noexcept {
    const std::size_t mask = table_.size() - 1;
    const auto x = static_cast<double>(p.x), y = static_cast<double>(p.y),
               z = static_cast<double>(p.z);
    std::size_t slot = mix64(mix64(mix64(bits(x)) ^ bits(y)) ^ bits(z)) & mask;
    for (; table_[slot] != empty; slot = (slot + 1) & mask) {
      const Point& q = points_[table_[slot]];
      if (p.x == q.x && p.y == q.y && p.z == q.z) break;
    }
    return slot;
  }
  void grow_table() {
    std::vector<std::uint32_t> old(2 * table_.size(), empty);
    old.swap(table_);
    for (const std::uint32_t i : old)
      if (i != empty) table_[slot_of(points_[i])] = i;
  }

  std::vector<Point>& points_;
  std::size_t kept_ = 0;              // the first points, one per position
  std::vector<std::uint32_t> table_;  // open addressing
};

}  // namespace

std::size_t weld_vertices(MeshFile& mesh) {
  const std::size_t before = mesh.vertex_count();
  const std::vector<std::uint32_t> index = mesh.precision == Precision::float64
                                               ? Welder(mesh.double_vertices).run()
                                               : Welder(mesh.vertices).run();
  std::size_t kept = 0;
  for (const Triangle& old : mesh.triangles) {
    const Triangle t = {index[old.a], index[old.b], index[old.c]};
    if (t.a != t.b && t.b != t.c && t.c != t.a) mesh.triangles[kept++] = t;
  }
  mesh.dropped += mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  return before - mesh.vertex_count();
}

}  // namespace throng::meshes
