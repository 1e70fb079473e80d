// One or two small meshes from bytes, hard for a test of triangles: few distinct coordinates, of
// any magnitude, shared indices, strides, transforms and filters. And their pairs by a double loop
// over the rule.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <throng/mesh.hpp>

#include "mesh/distance.hpp"
#include "mesh/triangle_pair.hpp"
#include "support/bytes.hpp"

namespace throng::tests {

// A mesh with its arrays. Values between the elements of a strided array are NaN.
struct SceneMesh {
  bool is_float = true;
  std::size_t vertex_count = 0, triangle_count = 0;
  std::size_t vertex_gap = 0, triangle_gap = 0;  // in coordinates and in indices
  std::vector<float> floats;
  std::vector<double> doubles;
  std::vector<std::uint32_t> indices;
  bool moves = false;
  AffineTransform transform;
  std::vector<std::uint32_t> group, mask;  // empty: absent
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;

  std::size_t vertex_stride_bytes() const {
    return (3 + vertex_gap) * (is_float ? sizeof(float) : sizeof(double));
  }
  std::size_t triangle_stride_bytes() const { return (3 + triangle_gap) * sizeof(std::uint32_t); }
  TriangleMesh view() const {
    const Vertices vertices = is_float
                                  ? Vertices(reinterpret_cast<const Vec3*>(floats.data()),
                                             vertex_count, vertex_stride_bytes())
                                  : Vertices(reinterpret_cast<const DoubleVec3*>(doubles.data()),
                                             vertex_count, vertex_stride_bytes());
    TriangleMesh mesh(vertices, reinterpret_cast<const Triangle*>(indices.data()), triangle_count,
                      triangle_stride_bytes());
    if (moves) mesh.transform = transform;
    const auto set = [](auto& strided, const auto& values) {
      if (!values.empty()) strided = {values.data(), values.size()};
    };
    set(mesh.filters.group, group);
    set(mesh.filters.mask, mask);
    set(mesh.filters.owner, owner);
    set(mesh.filters.world, world);
    set(mesh.filters.is_static, is_static);
    return mesh;
  }

  Triangle triangle(std::size_t i) const {
    const std::uint32_t* const t = &indices[i * (3 + triangle_gap)];
    return {t[0], t[1], t[2]};
  }
  // After the transform.
  DoubleVec3 point(std::uint32_t vertex) const {
    double p[3], moved[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = vertex * (3 + vertex_gap) + k;
      p[k] = is_float ? static_cast<double>(floats[at]) : doubles[at];
    }
    if (!moves) return {p[0], p[1], p[2]};
    for (int k = 0; k < 3; ++k) {
      const double(&m)[4] = transform.row[k];
      const double x = m[0] * p[0], y = m[1] * p[1], z = m[2] * p[2];
      const double xy = x + y, xyz = xy + z;
      moved[k] = xyz + m[3];
    }
    return {moved[0], moved[1], moved[2]};
  }
  mesh::TrianglePoints points(std::size_t i) const {
    const Triangle t = triangle(i);
    return {{point(t.a), point(t.b), point(t.c)}};
  }
};

struct MeshScene {
  SceneMesh a, b;
  bool two = false;
  bool within = false;
  double distance = 0;

  const SceneMesh& second() const { return two ? b : a; }
};

// ---- the reference ------------------------------------------------------------------------------

// The first triangle with a bad index or vertex, and how many there are.
struct BadTriangles {
  std::uint64_t first = 0, count = 0;
};
inline BadTriangles bad_triangles(const SceneMesh& m) {
  BadTriangles bad;
  for (std::size_t i = m.triangle_count; i-- > 0;) {
    const Triangle t = m.triangle(i);
    bool is_bad = false;
    for (const std::uint32_t v : {t.a, t.b, t.c}) {
      is_bad = is_bad || v >= m.vertex_count;
      if (is_bad) break;
      const DoubleVec3 p = m.point(v);
      is_bad = !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z);
    }
    if (!is_bad) continue;
    bad.first = i;
    ++bad.count;
  }
  return bad;
}

inline bool filters_allow(const SceneMesh& a, std::size_t i, const SceneMesh& b, std::size_t j) {
  const auto value = [](const auto& values, std::size_t at, auto absent) {
    return values.empty() ? absent : values[at];
  };
  const std::uint32_t all = ~0u;
  if (!(value(a.group, i, all) & value(b.mask, j, all)) ||
      !(value(b.group, j, all) & value(a.mask, i, all)))
    return false;
  const std::int32_t owner = value(a.owner, i, -1);
  if (owner != -1 && owner == value(b.owner, j, -1)) return false;
  const std::int32_t of_a = value(a.world, i, -1), of_b = value(b.world, j, -1);
  if (of_a != -1 && of_b != -1 && of_a != of_b) return false;
  const std::uint8_t moves = 0;
  return !(value(a.is_static, i, moves) && value(b.is_static, j, moves));
}

inline bool share_a_vertex(const Triangle& a, const Triangle& b) {
  for (const std::uint32_t v : {a.a, a.b, a.c})
    if (v == b.a || v == b.b || v == b.c) return true;
  return false;
}

// All pairs, sorted. The meshes have no bad triangles.
inline std::vector<Pair> expected_pairs(const MeshScene& s) {
  std::vector<Pair> pairs;
  const SceneMesh& second = s.second();
  std::vector<mesh::TrianglePoints> of_a, of_b;
  for (std::size_t i = 0; i < s.a.triangle_count; ++i) of_a.push_back(s.a.points(i));
  for (std::size_t j = 0; j < second.triangle_count; ++j) of_b.push_back(second.points(j));
  for (std::uint32_t i = 0; i < of_a.size(); ++i) {
    for (std::uint32_t j = s.two ? 0 : i + 1; j < of_b.size(); ++j) {
      if (!filters_allow(s.a, i, second, j)) continue;
      bool is_pair;
      if (s.within) {
        is_pair = (s.two || !share_a_vertex(s.a.triangle(i), s.a.triangle(j))) &&
                  mesh::triangles_within(of_a[i], of_b[j], s.distance);
      } else {
        is_pair = s.two ? mesh::triangles_meet(of_a[i], of_b[j])
                        : mesh::triangles_pair(s.a.triangle(i), s.a.triangle(j), of_a[i], of_b[j]);
      }
      if (is_pair) pairs.push_back({i, j});
    }
  }
  return pairs;
}

// ---- scenes from bytes --------------------------------------------------------------------------

// Few distinct coordinates: a quarter of the tests on them are decided by equality.
class Palette {
 public:
  Palette(Bytes& bytes, bool floats) : floats_(floats), kind_(bytes.below(8)) {
    const std::uint32_t count = 2 + bytes.below(7);
    scale_ = kind_ == 2 ? std::ldexp(1.0, floats ? bytes.between(-149, 125)
                                                 : -1074 + static_cast<int>(bytes.below(2096)))
                        : 1;
    for (std::uint32_t i = 0; i < count; ++i) values_.push_back(one(bytes));
  }
  DoubleVec3 point(Bytes& bytes) const {
    const auto any = [&] {
      return values_[bytes.below(static_cast<std::uint32_t>(values_.size()))];
    };
    const DoubleVec3 p = {any(), any(), any()};
    // In one plane or on one line that is not parallel to an axis, exactly for small integers.
    if (kind_ == 6) return {p.x, p.y, as_given(p.x + p.y)};
    if (kind_ == 7) return {p.x, as_given(2 * p.x), as_given(-p.x)};
    return p;
  }

 private:
  double as_given(double x) const {
    if (!floats_)
      return std::clamp(x, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max());
    constexpr double most = static_cast<double>(std::numeric_limits<float>::max());
    return static_cast<double>(static_cast<float>(std::clamp(x, -most, most)));
  }
  double one_up(double x) const {
    if (!floats_) return std::nextafter(x, std::numeric_limits<double>::infinity());
    return static_cast<double>(
        std::nextafter(static_cast<float>(x), std::numeric_limits<float>::infinity()));
  }
  double raw(Bytes& bytes) const {
    std::uint64_t bits = bytes.word();
    if (floats_) {
      const auto word = static_cast<std::uint32_t>(bits);
      float f;
      std::memcpy(&f, &word, sizeof f);
      return std::isfinite(f) ? static_cast<double>(f) : 0;
    }
    bits |= std::uint64_t{bytes.word()} << 32;
    double d;
    std::memcpy(&d, &bits, sizeof d);
    return std::isfinite(d) ? d : 0;
  }
  double one(Bytes& bytes) const {
    const double integer = bytes.between(-3, 3);
    switch (kind_) {
      case 2:
        return as_given(integer * scale_);
      case 3:  // next to integers
        return bytes.one_in(2) ? one_up(integer) : integer;
      case 4:
        return raw(bytes);
      case 5: {  // the ends of the range
        const double most = floats_ ? static_cast<double>(std::numeric_limits<float>::max())
                                    : std::numeric_limits<double>::max();
        const double least = floats_ ? static_cast<double>(std::numeric_limits<float>::denorm_min())
                                     : std::numeric_limits<double>::denorm_min();
        const double ends[] = {0.0, -0.0, least, -least, most, -most, most / 2, 1.0};
        return as_given(ends[bytes.below(8)]);
      }
      default:
        return integer;
    }
  }

  bool floats_;
  std::uint32_t kind_;
  double scale_ = 1;
  std::vector<double> values_;
};

inline void draw_mesh(Bytes& bytes, std::uint32_t most_triangles, SceneMesh& m) {
  m.is_float = !bytes.one_in(2);
  m.vertex_gap = bytes.one_in(4) ? 1 + bytes.below(3) : 0;
  m.triangle_gap = bytes.one_in(4) ? 1 + bytes.below(3) : 0;
  const std::uint32_t n = 1 + bytes.below(24);
  m.triangle_count = bytes.below(most_triangles + 1);
  m.vertex_count = n;
  const Palette palette(bytes, m.is_float);
  const std::size_t numbers = n * (3 + m.vertex_gap);
  if (m.is_float)
    m.floats.assign(numbers, std::numeric_limits<float>::quiet_NaN());
  else
    m.doubles.assign(numbers, std::numeric_limits<double>::quiet_NaN());
  for (std::uint32_t v = 0; v < n; ++v) {
    const DoubleVec3 p = palette.point(bytes);
    const double xyz[3] = {p.x, p.y, p.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = v * (3 + m.vertex_gap) + k;
      if (m.is_float)
        m.floats[at] = static_cast<float>(xyz[k]);
      else
        m.doubles[at] = xyz[k];
    }
  }
  m.indices.assign(m.triangle_count * (3 + m.triangle_gap), ~0u);
  const bool fan = bytes.one_in(3);  // neighbors share edges
  for (std::size_t i = 0; i < m.triangle_count; ++i) {
    std::uint32_t* const t = &m.indices[i * (3 + m.triangle_gap)];
    t[0] = fan ? static_cast<std::uint32_t>(i) % n : bytes.below(n);
    t[1] = fan ? (t[0] + 1) % n : bytes.below(n);
    t[2] = fan ? (t[0] + 2) % n : bytes.below(n);
  }
  if (m.triangle_count != 0 && bytes.one_in(32)) {
    const std::uint32_t at = bytes.below(static_cast<std::uint32_t>(m.triangle_count));
    m.indices[at * (3 + m.triangle_gap) + bytes.below(3)] = n + bytes.next();
  }
  if (bytes.one_in(32)) {  // a bad vertex, which a triangle may use or not
    const std::size_t at = bytes.below(n) * (3 + m.vertex_gap) + bytes.below(3);
    const float bad = bytes.one_in(2) ? std::numeric_limits<float>::infinity()
                                      : std::numeric_limits<float>::quiet_NaN();
    if (m.is_float)
      m.floats[at] = bad;
    else
      m.doubles[at] = static_cast<double>(bad);
  }
  if (bytes.one_in(4)) {
    m.moves = true;
    const double values[] = {0, 1, -1, 0.5, 2, 0.1, 3, 0x1p-60, 0x1p40, 1e300, -0.7, 1 + 0x1p-52};
    for (auto& row : m.transform.row)
      for (double& x : row)
        if (bytes.one_in(2)) x = values[bytes.below(12)];
  }
  const auto filter = [&](auto& values, auto draw) {
    if (!bytes.one_in(8)) return;
    values.resize(m.triangle_count);
    for (auto& value : values) value = draw();
    if (m.triangle_count == 0) values.clear();
  };
  filter(m.group, [&] { return bytes.below(8); });
  filter(m.mask, [&] { return bytes.below(8); });
  filter(m.owner, [&] { return bytes.between(-1, 4); });
  filter(m.world, [&] { return bytes.between(-1, 2); });
  filter(m.is_static, [&] { return static_cast<std::uint8_t>(bytes.below(3)); });
}

inline MeshScene make_mesh_scene(Bytes& bytes, std::uint32_t most_triangles) {
  MeshScene s;
  s.two = bytes.one_in(3);
  s.within = bytes.one_in(4);
  if (s.within) {
    const double distances[] = {0, 1, 0.5, 2, 3, 0x1p-1074, 0x1p-149, 0x1p-30, 1e300, 0.1, 0x1p127};
    s.distance = bytes.one_in(4) ? bytes.between(0, 24) / 8.0 : distances[bytes.below(11)];
    if (bytes.one_in(4))
      s.distance = std::nextafter(s.distance, std::numeric_limits<double>::infinity());
  }
  if (s.within) most_triangles /= 3;  // exact distances are slow
  draw_mesh(bytes, most_triangles, s.a);
  if (s.two) draw_mesh(bytes, most_triangles, s.b);
  return s;
}

// The same meshes `copies` times, `step` apart along x. Coordinates must be integers of magnitude
// at most 8, transforms absent, and `step` more than 16 + distance: then no two copies have a pair.
inline SceneMesh copied(const SceneMesh& m, std::uint32_t copies, double step) {
  SceneMesh all = m;
  all.vertex_count = m.vertex_count * copies;
  all.triangle_count = m.triangle_count * copies;
  const auto repeat = [copies](auto& values) {
    const auto once = values;
    for (std::uint32_t c = 1; c < copies; ++c)
      values.insert(values.end(), once.begin(), once.end());
  };
  repeat(all.floats);
  repeat(all.doubles);
  repeat(all.indices);
  repeat(all.group);
  repeat(all.mask);
  repeat(all.owner);
  repeat(all.world);
  repeat(all.is_static);
  for (std::size_t v = 0; v < all.vertex_count; ++v) {
    const double shift = step * static_cast<double>(v / m.vertex_count);
    const std::size_t at = v * (3 + m.vertex_gap);
    if (m.is_float)
      all.floats[at] += static_cast<float>(shift);
    else
      all.doubles[at] += shift;
  }
  for (std::size_t i = 0; i < all.triangle_count; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      all.indices[i * (3 + m.triangle_gap) + k] +=
          static_cast<std::uint32_t>(i / m.triangle_count * m.vertex_count);
  }
  return all;
}
inline std::vector<Pair> copied(const std::vector<Pair>& pairs, const MeshScene& s,
                                std::uint32_t copies) {
  std::vector<Pair> all;
  const auto of_a = static_cast<std::uint32_t>(s.a.triangle_count);
  const auto of_b = static_cast<std::uint32_t>(s.second().triangle_count);
  for (std::uint32_t c = 0; c < copies; ++c)
    for (const Pair p : pairs) all.push_back({p.first + c * of_a, p.second + c * of_b});
  std::sort(all.begin(), all.end());
  return all;
}
// Whether copied() applies to the mesh.
inline bool can_be_copied(const SceneMesh& m) {
  if (m.moves || bad_triangles(m).count != 0) return false;
  for (std::uint32_t v = 0; v < m.vertex_count; ++v) {
    const DoubleVec3 p = m.point(v);
    for (const double x : {p.x, p.y, p.z})
      if (!(std::fabs(x) <= 8 && x == std::floor(x))) return false;
  }
  return true;
}

// Compares as sets. Empty if equal.
inline std::string pairs_difference(std::vector<Pair> got, const std::vector<Pair>& want) {
  std::sort(got.begin(), got.end());
  if (got == want) return {};
  std::string text = std::to_string(got.size()) + " pairs, expected " + std::to_string(want.size());
  const auto name = [&](const char* word, const std::vector<Pair>& from,
                        const std::vector<Pair>& without) {
    for (const Pair pair : from) {
      if (std::binary_search(without.begin(), without.end(), pair)) continue;
      text += std::string(", ") + word + " " + std::to_string(pair.first) + " " +
              std::to_string(pair.second);
      return;
    }
  };
  name("unexpected", got, want);
  name("missing", want, got);
  return text;
}

}  // namespace throng::tests
