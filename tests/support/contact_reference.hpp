// Contact candidates by double loops over float boxes, and meshes for tests. Shares no code with
// the library: neighbors come from a search over all edges, and boxes from sums that doubles hold
// exactly, rounded by nextafter.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <throng/contact.hpp>

#include "support/bytes.hpp"
#include "support/reference.hpp"

namespace throng::tests {

// Coordinates and radius are multiples of contact_unit below 2^6, so their sums are exact doubles;
// floats hold them only if they are small.
constexpr double contact_unit = 0x1p-40;

struct ContactScene {
  std::vector<DoubleVec3> start, end;  // end may be empty
  std::vector<Edge> edges;
  std::vector<Triangle> faces;
  int dimension = 3;
  unsigned rings = 0;
  std::vector<std::uint32_t> group, mask;  // empty: absent
  double radius = 0;

  ContactMesh view() const {
    ContactMesh mesh;
    mesh.start = start;
    if (!end.empty()) mesh.end = end;
    mesh.edges = {edges.data(), edges.size()};
    mesh.faces = {faces.data(), faces.size()};
    mesh.dimension = dimension;
    mesh.rings = rings;
    if (!group.empty()) mesh.group = {group.data(), group.size()};
    if (!mask.empty()) mesh.mask = {mask.data(), mask.size()};
    return mesh;
  }
};

class ContactReference {
 public:
  explicit ContactReference(const ContactScene& scene) : s_(scene) {
    const std::uint32_t n = static_cast<std::uint32_t>(s_.start.size());
    find_distances();
    Elements vertices, edges, faces;
    for (std::uint32_t v = 0; v < n; ++v) vertices.push_back({v});
    for (const Edge& e : s_.edges) edges.push_back({e.a, e.b});
    for (const Triangle& f : s_.faces) faces.push_back({f.a, f.b, f.c});
    if (s_.dimension == 2) {
      expected.edge_vertex = pairs(edges, vertices, false);
    } else {
      expected.vertex_face = pairs(vertices, faces, false);
      expected.edge_edge = pairs(edges, edges, true);
    }
  }

  ContactCandidates expected;  // each sorted

 private:
  using Element = std::vector<std::uint32_t>;
  using Elements = std::vector<Element>;
  struct Bounds {
    bool finite = true;
    std::array<float, 3> lower{}, upper{};
  };

  // Whether two vertices are the same or at most `rings` edges apart, for all pairs.
  void find_distances() {
    const std::size_t n = s_.start.size();
    near_.assign(n, std::vector<bool>(n, false));
    for (std::size_t v = 0; v < n; ++v) near_[v][v] = true;
    for (unsigned ring = 0; ring < std::min<std::size_t>(s_.rings, n); ++ring) {
      auto next = near_;
      const auto join = [&](std::uint32_t a, std::uint32_t b) {
        for (std::size_t v = 0; v < n; ++v) {
          if (near_[v][a]) next[v][b] = true;
          if (near_[v][b]) next[v][a] = true;
        }
      };
      for (const Edge& e : s_.edges) join(e.a, e.b);
      if (s_.dimension == 3)
        for (const Triangle& f : s_.faces) join(f.a, f.b), join(f.b, f.c), join(f.c, f.a);
      near_ = next;
    }
  }

  static float rounded_down(double exact) {
    const float f = static_cast<float>(exact);
    return static_cast<double>(f) > exact
               ? std::nextafter(f, -std::numeric_limits<float>::infinity())
               : f;
  }

  Bounds bounds_of(const Element& element) const {
    Bounds b;
    for (int k = 0; k < s_.dimension; ++k) {
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (const std::uint32_t v : element) {
        for (const auto* at : {&s_.start, s_.end.empty() ? &s_.start : &s_.end}) {
          const DoubleVec3& p = (*at)[v];
          const double x = k == 0 ? p.x : k == 1 ? p.y : p.z;
          b.finite &= std::isfinite(x);
          least = std::min(least, x);
          most = std::max(most, x);
        }
      }
      b.lower[static_cast<std::size_t>(k)] = rounded_down(least - s_.radius);
      b.upper[static_cast<std::size_t>(k)] = -rounded_down(-(most + s_.radius));
    }
    return b;
  }

  bool may_collide(std::uint32_t u, std::uint32_t v) const {
    const auto of = [](const std::vector<std::uint32_t>& values, std::uint32_t i) {
      return values.empty() ? ~0u : values[i];
    };
    return (of(s_.group, u) & of(s_.mask, v)) && (of(s_.group, v) & of(s_.mask, u));
  }

  std::vector<Pair> pairs(const Elements& a, const Elements& b, bool one_set) const {
    std::vector<Bounds> of_a, of_b;
    for (const Element& element : a) of_a.push_back(bounds_of(element));
    for (const Element& element : b) of_b.push_back(bounds_of(element));
    std::vector<Pair> found;
    for (std::uint32_t i = 0; i < a.size(); ++i) {
      for (std::uint32_t j = one_set ? i + 1 : 0; j < b.size(); ++j) {
        bool overlap = of_a[i].finite && of_b[j].finite;
        for (std::size_t k = 0; k < 3; ++k)
          overlap &= of_a[i].lower[k] <= of_b[j].upper[k] && of_b[j].lower[k] <= of_a[i].upper[k];
        if (!overlap) continue;
        bool near = false, allowed = s_.group.empty() && s_.mask.empty();
        for (const std::uint32_t u : a[i]) {
          for (const std::uint32_t v : b[j]) {
            near |= near_[u][v];
            allowed |= may_collide(u, v);
          }
        }
        if (!near && allowed) found.push_back({i, j});
      }
    }
    return found;
  }

  const ContactScene& s_;
  std::vector<std::vector<bool>> near_;
};

// Any small mesh: indices are random, so elements repeat, share vertices and have equal vertices.
inline ContactScene make_contact_scene(Bytes& bytes, std::uint32_t most_vertices) {
  ContactScene s;
  const std::uint32_t n = bytes.below(most_vertices + 1);
  s.dimension = bytes.one_in(3) ? 2 : 3;
  s.rings = bytes.below(5);
  const int extent = 1 << bytes.between(1, 5);
  const auto coordinate = [&] {
    // Neighbors of quarters: many bounds are equal or adjacent.
    const double at = bytes.between(-4 * extent, 4 * extent) / 4.0;
    return at +
           (bytes.one_in(2) ? bytes.between(-8, 8) * contact_unit * (1 << bytes.below(17)) : 0);
  };
  const auto point = [&] { return DoubleVec3{coordinate(), coordinate(), coordinate()}; };
  for (std::uint32_t v = 0; v < n; ++v) s.start.push_back(point());
  if (bytes.one_in(3) || n == 0) {
    s.end.clear();
  } else if (bytes.one_in(4)) {
    s.end = s.start;
  } else {
    for (std::uint32_t v = 0; v < n; ++v)
      s.end.push_back(bytes.one_in(3) ? point()
                                      : DoubleVec3{s.start[v].x, coordinate(), s.start[v].z});
  }
  const auto index = [&] { return bytes.below(n); };
  const bool strip = bytes.one_in(2);  // neighbors in a row, as in a mesh
  for (std::uint32_t k = n == 0 ? 0 : bytes.below(2 * n + 2); k > 0; --k) {
    const std::uint32_t a = index();
    s.edges.push_back({a, strip ? (a + 1) % n : index()});
  }
  for (std::uint32_t k = n == 0 ? 0 : bytes.below(2 * n + 2); k > 0; --k) {
    const std::uint32_t a = index();
    s.faces.push_back(strip ? Triangle{a, (a + 1) % n, (a + 2) % n}
                            : Triangle{a, index(), index()});
  }
  const auto filter = [&](std::vector<std::uint32_t>& values) {
    for (std::uint32_t v = 0; v < n; ++v) values.push_back(bytes.below(8));
  };
  if (bytes.one_in(3)) filter(s.group);
  if (bytes.one_in(3)) filter(s.mask);
  switch (bytes.below(3)) {
    case 0:
      break;
    case 1:
      s.radius = bytes.below(5) / 8.0;
      break;
    default:
      s.radius = bytes.below(200) * contact_unit * (1 << bytes.below(17));
      break;
  }
  return s;
}

// Compares as sets of pairs; `what` begins the message. Empty if equal.
inline std::string contact_difference(std::vector<Pair> got, const std::vector<Pair>& want,
                                      const char* what) {
  std::sort(got.begin(), got.end());
  if (got == want) return {};
  std::string text = std::string(what) + ": " + std::to_string(got.size()) +
                     " candidates, expected " + std::to_string(want.size());
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
inline std::string contact_difference(const ContactCandidatesView& got,
                                      const ContactCandidates& want) {
  const auto list = [](const Pairs& p) { return std::vector<Pair>(p.begin(), p.end()); };
  return contact_difference(list(got.vertex_face), want.vertex_face, "vertex-face") +
         contact_difference(list(got.edge_edge), want.edge_edge, "edge-edge") +
         contact_difference(list(got.edge_vertex), want.edge_vertex, "edge-vertex");
}

}  // namespace throng::tests
