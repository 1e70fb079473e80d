// Rasterises triangles into a depth buffer of four samples per pixel; then lights each sample by
// the sun (with a shadow map) and the sky (with ambient occlusion), with normals blended between
// vertices.
#include "apps/report/draw_mesh.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>

#include "apps/report/lighting.hpp"
#include "apps/report/write_png.hpp"

namespace throng::report {
namespace {

constexpr int shadow_size = 3072;
constexpr std::uint32_t ground_id = 0xfffffffeu;
constexpr unsigned part_colours[] = {0xb9c6d1, 0xd8bd8c};
constexpr unsigned mark_colour = 0xe8351b;
constexpr float hidden_share = 0.5f;  // of the mark's colour where marked triangles are hidden

bool is_finite(const DoubleVec3& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// The same axes with z up.
template <class T>
std::array<T, 3> with_z_up(const T (&c)[3], UpAxis up) {
  return up == UpAxis::z   ? std::array<T, 3>{c[0], c[1], c[2]}
         : up == UpAxis::y ? std::array<T, 3>{c[2], c[0], c[1]}
                           : std::array<T, 3>{c[1], c[2], c[0]};
}

// The vertices of a part in units of the scene, z up, with their normals.
struct Surface {
  std::vector<Vector> points, normals;
  std::vector<Triangle> triangles;
  std::vector<std::uint8_t> marked;
};

// Moves and scales all parts into a cube from -1 to 1, in doubles: any coordinates may be drawn.
class Frame {
 public:
  explicit Frame(UpAxis up) : up_(up) {}

  void add(const DoubleVec3& p) {
    const double c[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k)
      low_[k] = std::min(low_[k], c[k]), high_[k] = std::max(high_[k], c[k]);
  }
  Vector to_scene(const DoubleVec3& at) const {
    const double c[3] = {at.x, at.y, at.z};
    double half = 0;
    for (int k = 0; k < 3; ++k) half = std::max(half, high_[k] / 2 - low_[k] / 2);
    if (!(half > 0)) half = 1;
    float s[3];
    for (int k = 0; k < 3; ++k) {
      s[k] = static_cast<float>((c[k] / 2 - (low_[k] / 4 + high_[k] / 4)) / half * 2);
    }
    const std::array<float, 3> p = with_z_up(s, up_);
    return {p[0], p[1], p[2]};
  }

 private:
  UpAxis up_;
  double low_[3] = {INFINITY, INFINITY, INFINITY}, high_[3] = {-INFINITY, -INFINITY, -INFINITY};
};

class Painter {
 public:
  Painter(const std::vector<MeshPart>& parts, UpAxis up, const PictureStyle& style)
      : style_(style),
        surfaces_(surfaces_of(parts, up)),
        view_(view_of(surfaces_, style)),
        canvas_(2 * style.width, 2 * style.height),
        marks_(2 * style.width, 2 * style.height),
        shadow_(shadow_size, shadow_size),
        backdrop_(style.dark, canvas_) {
    std::vector<float> edges;
    for (const Surface& surface : surfaces_) {
      offsets_.push_back(total_);
      total_ += static_cast<std::uint32_t>(surface.triangles.size());
      const std::size_t step = 1 + surface.triangles.size() / 4096;
      for (std::size_t i = 0; i < surface.triangles.size(); i += step) {
        const Vector d =
            surface.points[surface.triangles[i].b] - surface.points[surface.triangles[i].a];
        edges.push_back(std::sqrt(dot(d, d)));
      }
      for (const std::uint8_t mark : surface.marked) any_marked_ = any_marked_ || mark != 0;
    }
    if (edges.empty()) return;
    const auto half = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
    std::nth_element(edges.begin(), half, edges.end());
    typical_edge_ = *half;
  }

  Image paint() {
    draw_triangles();
    occlusion_ = find_occlusion(
        canvas_, view_, 0.16f, [this](int x, int y) { return face_normal_at(x, y); },
        [](std::uint64_t a, std::uint64_t b) {
          return (a == Canvas::empty_tag || is_ground(a)) ==
                 (b == Canvas::empty_tag || is_ground(b));
        });
    Image image{style_.width, style_.height, std::vector<std::uint32_t>(occlusion_.size())};
    on_rows(style_.height, [&](int y) {
      for (int x = 0; x < style_.width; ++x) {
        image.pixels[pixel_index(x, y)] =
            pixel_of(x, y, [this](int sx, int sy) { return shade_sample(sx, sy); });
      }
    });
    return image;
  }

  bool any_marked() const { return any_marked_; }
  bool any_hidden() const { return any_hidden_; }
  // Of a hidden mark in full light, over the first part.
  Vector hidden_colour() const { return blend(from_screen(part_colours[0]), mark_, hidden_share); }

 private:
  static bool is_ground(std::uint64_t tag) {
    return tag != Canvas::empty_tag && static_cast<std::uint32_t>(tag >> 3) == ground_id;
  }

  static std::vector<Surface> surfaces_of(const std::vector<MeshPart>& parts, UpAxis up) {
    std::vector<Surface> surfaces(parts.size());
    Frame frame(up);
    for (std::size_t s = 0; s < parts.size(); ++s) {
      const TriangleMesh& mesh = parts[s].mesh;
      for (std::size_t i = 0; i < mesh.size(); ++i) {
        const Triangle t = mesh.triangles[i];
        const DoubleVec3 c[3] = {mesh.vertices[t.a], mesh.vertices[t.b], mesh.vertices[t.c]};
        if (!is_finite(c[0]) || !is_finite(c[1]) || !is_finite(c[2])) continue;
        for (const DoubleVec3& p : c) frame.add(p);
        surfaces[s].triangles.push_back(t);
        surfaces[s].marked.push_back(parts[s].marked ? parts[s].marked[i] : std::uint8_t{0});
      }
    }
    for (std::size_t s = 0; s < parts.size(); ++s) {
      const Vertices& vertices = parts[s].mesh.vertices;
      Surface& surface = surfaces[s];
      surface.points.resize(vertices.size());
      surface.normals.resize(vertices.size());
      for (const Triangle& t : surface.triangles) {
        for (const std::uint32_t v : {t.a, t.b, t.c})
          surface.points[v] = frame.to_scene(vertices[v]);
        const Vector normal = area_normal(surface, t);
        for (const std::uint32_t v : {t.a, t.b, t.c})
          surface.normals[v] = surface.normals[v] + normal;
      }
    }
    return surfaces;
  }

  static View view_of(const std::vector<Surface>& surfaces, const PictureStyle& style) {
    std::vector<Box> points;
    for (const Surface& surface : surfaces) {
      const std::size_t step = 1 + surface.triangles.size() / 200000;
      for (std::size_t i = 0; i < surface.triangles.size(); i += step) {
        const Triangle& t = surface.triangles[i];
        for (const std::uint32_t v : {t.a, t.b, t.c}) {
          const Vector p = surface.points[v];
          points.push_back({{p.x, p.y, p.z}, {p.x, p.y, p.z}});
        }
      }
    }
    return look_at(points.data(), points.size(), 2 * style.width, 2 * style.height, style.azimuth,
                   style.elevation, shadow_size);
  }

  // Twice the area long.
  static Vector area_normal(const Surface& surface, const Triangle& t) {
    const Vector a = surface.points[t.a];
    return cross(surface.points[t.b] - a, surface.points[t.c] - a);
  }

  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(style_.width) +
           static_cast<std::size_t>(x);
  }

  void draw_triangles() {
    for (std::size_t s = 0; s < surfaces_.size(); ++s) {
      const Surface& surface = surfaces_[s];
      for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const Triangle& t = surface.triangles[i];
        const Vector c[3] = {surface.points[t.a], surface.points[t.b], surface.points[t.c]};
        const std::uint32_t id = offsets_[s] + static_cast<std::uint32_t>(i);
        const Corner q[4] = {view_.project(c[0]), view_.project(c[1]), view_.project(c[2]),
                             view_.project(c[2])};
        if (q[0].nearness > 0 && q[1].nearness > 0 && q[2].nearness > 0) {
          canvas_.quad(q, id, static_cast<unsigned>(s));
          if (surface.marked[i] != 0) marks_.quad(q, id, static_cast<unsigned>(s));
        }
        const Corner l[4] = {view_.project_to_sun(c[0]), view_.project_to_sun(c[1]),
                             view_.project_to_sun(c[2]), view_.project_to_sun(c[2])};
        shadow_.quad(l, id, 0);
      }
    }
    const Vector size = view_.high - view_.low;
    reach_ = 1.15f * std::max({size.x, size.y, size.z * 0.8f, 1e-6f});
    middle_ = blend(view_.low, view_.high, 0.5f);
    // From below, the floor would hide all.
    if (total_ != 0 && style_.elevation >= 0)
      draw_floor(canvas_, view_, middle_, reach_, view_.low.z - 0.01f, ground_id);
  }

  struct Hit {
    const Surface* surface;
    std::size_t triangle;
    std::size_t part;
  };
  Hit hit_of(std::uint64_t tag) const {
    const std::size_t part = tag & 7;
    return {&surfaces_[part], static_cast<std::uint32_t>(tag >> 3) - offsets_[part], part};
  }

  // Towards the viewer.
  Vector face_normal_at(int x, int y) const {
    const std::uint64_t tag = canvas_.tag(x, y);
    if (is_ground(tag)) return {0, 0, 1};
    const Hit hit = hit_of(tag);
    const Triangle& t = hit.surface->triangles[hit.triangle];
    const Vector n = area_normal(*hit.surface, t) * 1e6f;
    const float length = std::sqrt(dot(n, n));
    if (!(length > 0)) return view_.forward * -1;
    const Vector face = n * (1 / length);
    return dot(face, view_.eye - hit.surface->points[t.a]) < 0 ? face * -1 : face;
  }

  // The normal blended between the vertices; the face's own where they differ by much.
  Vector normal_at(const Hit& hit, Vector p, Vector face) const {
    const Triangle& t = hit.surface->triangles[hit.triangle];
    const std::vector<Vector>& points = hit.surface->points;
    const std::vector<Vector>& normals = hit.surface->normals;
    const Vector n = area_normal(*hit.surface, t);
    const float whole = dot(n, n);
    if (!(whole > 0)) return face;
    const float a = dot(cross(points[t.c] - points[t.b], p - points[t.b]), n) / whole;
    const float b = dot(cross(points[t.a] - points[t.c], p - points[t.c]), n) / whole;
    const auto smooth = [&](std::uint32_t v) {
      const float length = std::sqrt(dot(normals[v], normals[v]));
      if (!(length > 0)) return face;
      Vector at = normals[v] * (1 / length);
      if (dot(n, face) < 0) at = at * -1;
      return dot(at, face) > 0.6f ? at : face;
    };
    const Vector sum = smooth(t.a) * a + smooth(t.b) * b + smooth(t.c) * (1 - a - b);
    const float length = std::sqrt(dot(sum, sum));
    return length > 0 && dot(sum, face) > 0 ? sum * (1 / length) : face;
  }

  bool marked_at(int x, int y) const {
    const std::uint64_t tag = canvas_.tag(x, y);
    if (tag == Canvas::empty_tag || is_ground(tag)) return false;
    const Hit hit = hit_of(tag);
    return hit.surface->marked[hit.triangle] != 0;
  }

  // In samples, by the size of triangles on the screen.
  static int reach_of_mark(float pixels) { return pixels < 6 ? 3 : pixels < 12 ? 2 : 0; }

  // Whether a sample shows a marked triangle; where triangles are small, or one next to it: lines
  // of small triangles stay visible.
  bool shows_mark(int x, int y, float pixels) const {
    if (!any_marked_) return false;
    if (marked_at(x, y)) return true;
    const int reach = reach_of_mark(pixels);
    const float near = canvas_.nearness(x, y);
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const int sx = x + dx, sy = y + dy;
        if (dx * dx + dy * dy > reach * reach || sx < 0 || sy < 0 || sx >= canvas_.width() ||
            sy >= canvas_.height())
          continue;
        if (std::fabs(canvas_.nearness(sx, sy) - near) < 0.004f * near && marked_at(sx, sy))
          return true;
      }
    }
    return false;
  }

  // Whether a marked triangle lies here, behind others or not.
  bool has_mark(int x, int y, float pixels) const {
    if (!any_marked_) return false;
    const int reach = reach_of_mark(pixels);
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        const int sx = x + dx, sy = y + dy;
        if (dx * dx + dy * dy > reach * reach || sx < 0 || sy < 0 || sx >= marks_.width() ||
            sy >= marks_.height())
          continue;
        if (marks_.tag(sx, sy) != Canvas::empty_tag) return true;
      }
    }
    return false;
  }

  Vector shade_sample(int x, int y) {
    const std::uint64_t tag = canvas_.tag(x, y);
    const Vector behind = backdrop_.at(x, y);
    if (tag == Canvas::empty_tag) return behind;
    const float near = canvas_.nearness(x, y);
    const Vector p = sample_position(view_, x, y, near), face = face_normal_at(x, y);
    const float open = std::max(0.0f, 1 - 1.5f * occlusion_[pixel_index(x / 2, y / 2)]);
    const float bias = 1.6f / view_.sun_scale + 0.004f;
    const auto light_on = [&](Vector normal) {
      const float sun = dot(face, view_.sun) > 0 ? std::max(0.0f, dot(normal, view_.sun)) *
                                                       sunlight(view_, shadow_, p, face, bias)
                                                 : 0;
      return light_of(sun, (0.46f + 0.20f * normal.z) * open);
    };
    if (is_ground(tag)) return backdrop_.floor_at(p, middle_, reach_, light_on(face), behind);
    const Hit hit = hit_of(tag);
    const Vector light = light_on(normal_at(hit, p, face));
    const float pixels = typical_edge_ * near * view_.focal;  // in samples
    const bool marked = shows_mark(x, y, pixels);
    Vector colour = marked ? mark_ * blend(light, {1, 1, 1}, 0.45f)
                           : from_screen(part_colours[hit.part % 2]) * light;
    if (!marked && has_mark(x, y, pixels)) {
      colour = blend(colour, mark_, hidden_share);
      any_hidden_ = true;
    }
    // A thin line between triangles, if they are large enough on screen.
    const bool edge = (x + 1 < canvas_.width() && canvas_.tag(x + 1, y) != tag) ||
                      (y + 1 < canvas_.height() && canvas_.tag(x, y + 1) != tag);
    if (edge) colour = colour * (1 - 0.35f * std::min(1.0f, std::max(0.0f, (pixels - 10) / 40)));
    return colour;
  }

  const PictureStyle& style_;
  std::vector<Surface> surfaces_;
  std::vector<std::uint32_t> offsets_;  // the first triangle of each part
  std::uint32_t total_ = 0;
  View view_;
  Canvas canvas_, marks_, shadow_;  // marks_: the marked triangles alone
  Backdrop backdrop_;
  std::vector<float> occlusion_;
  bool any_marked_ = false;
  std::atomic<bool> any_hidden_{false};
  float typical_edge_ = 1, reach_ = 1;
  Vector middle_;
  const Vector mark_ = from_screen(mark_colour);
};

}  // namespace

void look_from(const DoubleVec3& direction, UpAxis up, PictureStyle& style) {
  const double c[3] = {direction.x, direction.y, direction.z};
  const std::array<double, 3> d = with_z_up(c, up);
  constexpr double degree = 0.017453292519943295;
  const double across = std::hypot(d[0], d[1]);
  style.elevation = static_cast<float>(std::atan2(d[2], across) / degree);
  // From above and below, an axis that is first in the coordinates points to the right.
  style.azimuth = across != 0       ? static_cast<float>(std::atan2(d[1], d[0]) / degree)
                  : up == UpAxis::y ? 0.0f
                                    : -90.0f;
}

void draw_meshes(const std::string& path, const std::vector<MeshPart>& parts,
                 const std::string& mark_name, UpAxis up, const PictureStyle& style) {
  Painter painter(parts, up, style);
  const Image image = painter.paint();
  std::vector<ColourKey> keys;
  for (std::size_t s = 0; s < parts.size(); ++s) {
    if (!parts[s].name.empty()) keys.push_back({from_screen(part_colours[s % 2]), parts[s].name});
  }
  if (painter.any_marked()) keys.push_back({from_screen(mark_colour), mark_name});
  if (painter.any_hidden()) keys.push_back({painter.hidden_colour(), "of them, behind others"});
  write_png(path, image, style, keys);
}

}  // namespace throng::report
