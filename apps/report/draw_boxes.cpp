// Rasterises faces into a depth buffer of four samples per pixel; then lights each sample by the
// sun (with a shadow map) and the sky (with ambient occlusion), and darkens the edges of boxes.
#include "apps/report/draw_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "apps/report/colour.hpp"
#include "apps/report/view.hpp"
#include "apps/report/write_png.hpp"

namespace throng::report {
namespace {

constexpr int shadow_size = 3072;
constexpr std::uint32_t ground_id = 0xfffffffeu;

template <class F>
void on_rows(int rows, const F& f) {
  const int parts =
      static_cast<int>(std::min(16u, std::max(1u, std::thread::hardware_concurrency())));
  std::vector<std::thread> threads;
  for (int p = 1; p < parts; ++p)
    threads.emplace_back([&, p] {
      for (int y = rows * p / parts; y < rows * (p + 1) / parts; ++y) f(y);
    });
  for (int y = 0; y < rows / parts; ++y) f(y);
  for (auto& t : threads) t.join();
}

class Painter {
 public:
  Painter(const Box* boxes, std::size_t count, const float* values, const PictureStyle& style)
      : boxes_(boxes),
        values_(values),
        style_(style),
        width_(style.width),
        height_(style.height),
        view_(look_at(boxes, count, 2 * width_, 2 * height_, style.azimuth, style.elevation,
                      shadow_size)),
        canvas_(2 * width_, 2 * height_),
        shadow_(shadow_size, shadow_size),
        occlusion_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
    scale_values();
  }

  Image paint() {
    draw_faces();
    find_occlusion();
    Image image{width_, height_, std::vector<std::uint32_t>(occlusion_.size())};
    on_rows(height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        Vector sum;
        for (int k = 0; k < 4; ++k) sum = sum + shade_sample(2 * x + k % 2, 2 * y + k / 2);
        const auto byte = [](float v) {
          return static_cast<std::uint32_t>(std::lround(255 * to_screen(v / 4)));
        };
        image.pixels[index(x, y)] = byte(sum.x) << 16 | byte(sum.y) << 8 | byte(sum.z);
      }
    });
    return image;
  }

  float lowest() const { return lowest_; }
  float highest() const { return highest_; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  float value(std::uint32_t i) const {
    return values_ ? values_[i] : (boxes_[i].lower.z + boxes_[i].upper.z) / 2;
  }

  // The colour map spans all but the highest 1 %, so that outliers do not darken the rest.
  void scale_values() {
    if (view_.shown.empty()) return;
    std::vector<float> v;
    for (const std::uint32_t i : view_.shown)
      if (std::isfinite(value(i))) v.push_back(value(i));
    if (v.empty()) return;
    lowest_ = *std::min_element(v.begin(), v.end());
    const auto top = v.begin() + static_cast<std::ptrdiff_t>(0.99 * double(v.size() - 1));
    std::nth_element(v.begin(), top, v.end());
    highest_ = std::max(*top, lowest_);
    if (highest_ == lowest_) highest_ = lowest_ + std::max(1.0f, 1e-3f * std::fabs(lowest_));
  }

  void draw_faces() {
    Vector c[4];
    Corner q[4];
    for (const std::uint32_t i : view_.shown) {
      const Box& b = boxes_[i];
      const Vector m{b.lower.x, b.lower.y, b.lower.z}, n{b.upper.x, b.upper.y, b.upper.z};
      for (unsigned face = 0; face < 6; ++face) {
        const Vector normal = face_normal(face), on = face % 2 ? n : m;
        face_corners(b, face, c);
        if (dot(view_.eye - on, normal) > 0) {
          for (int k = 0; k < 4; ++k) q[k] = view_.project(c[k]);
          if (q[0].nearness > 0 && q[1].nearness > 0 && q[2].nearness > 0 && q[3].nearness > 0)
            canvas_.quad(q, i, face);
        }
        if (dot(view_.sun, normal) > 0) {
          for (int k = 0; k < 4; ++k) q[k] = view_.project_to_sun(c[k]);
          shadow_.quad(q, i, face);
        }
      }
    }
    const Vector size = view_.high - view_.low;
    reach_ = 0.95f * std::max({size.x, size.y, size.z * 0.8f, view_.typical_size});
    middle_ = blend(view_.low, view_.high, 0.5f);
    const Box floor{{middle_.x - reach_, middle_.y - reach_, view_.ground},
                    {middle_.x + reach_, middle_.y + reach_, view_.ground}};
    face_corners(floor, 5, c);
    bool visible = !view_.shown.empty();
    for (int k = 0; k < 4; ++k) {
      q[k] = view_.project(c[k]);
      visible = visible && q[k].nearness > 0;
    }
    if (visible) canvas_.quad(q, ground_id, 5);
  }

  Vector position(int x, int y, float nearness) const {
    return view_.unproject(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, nearness);
  }

  // Ambient occlusion: sixteen samples per pixel on a spiral, rotated in a pattern of 4 x 4 pixels
  // that the averaging removes.
  void find_occlusion() {
    std::vector<float> raw_occlusion(occlusion_.size());
    const float radius = 3.0f * view_.typical_size;
    on_rows(height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        const int px = 2 * x, py = 2 * y;
        const std::uint64_t tag = canvas_.tag(px, py);
        raw_occlusion[index(x, y)] = 0;
        if (tag == Canvas::empty_tag) continue;
        const float near = canvas_.nearness(px, py);
        const Vector p = position(px, py, near), normal = face_normal(tag & 7);
        const float reach = std::min(std::max(radius * near * view_.focal, 8.0f), 220.0f);
        float hidden = 0;
        for (int k = 0; k < 16; ++k) {
          const float r = reach * (static_cast<float>(k) + 0.5f) / 16;
          const float turn = 2.3999632f * static_cast<float>(k) +
                             0.3926991f * static_cast<float>((x & 3) * 4 + (y & 3));
          const int sx = px + static_cast<int>(r * std::cos(turn)),
                    sy = py + static_cast<int>(r * std::sin(turn));
          if (sx < 0 || sy < 0 || sx >= canvas_.width() || sy >= canvas_.height()) continue;
          if (canvas_.tag(sx, sy) == Canvas::empty_tag) continue;
          const Vector d = position(sx, sy, canvas_.nearness(sx, sy)) - p;
          const float squared = dot(d, d) + 1e-20f;
          const float cosine = dot(d, normal) / std::sqrt(squared);
          if (cosine > 0.08f) hidden += cosine / (1 + squared / (radius * radius));
        }
        raw_occlusion[index(x, y)] = hidden / 16;
      }
    });
    on_rows(height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        const std::uint64_t tag = canvas_.tag(2 * x, 2 * y);
        float sum = 0, weight = 1e-6f;
        for (int dy = -2; dy < 2; ++dy)
          for (int dx = -2; dx < 2; ++dx) {
            const int sx = x + dx, sy = y + dy;
            if (sx < 0 || sy < 0 || sx >= width_ || sy >= height_) continue;
            const float w = (canvas_.tag(2 * sx, 2 * sy) & 7) == (tag & 7) ? 1.0f : 0.05f;
            sum += w * raw_occlusion[index(sx, sy)];
            weight += w;
          }
        occlusion_[index(x, y)] = sum / weight;
      }
    });
  }

  // 1 in the sun, 0 in the shade; between along the edge of a shadow.
  float sunlight(Vector p, Vector normal) const {
    const float bias = 1.6f / view_.sun_scale + 0.02f * view_.typical_size;
    const Corner c = view_.project_to_sun(p + normal * bias);
    float lit = 0;
    for (int k = 0; k < 9; ++k) {
      const int x = static_cast<int>(std::floor(c.x + static_cast<float>(k % 3 - 1)));
      const int y = static_cast<int>(std::floor(c.y + static_cast<float>(k / 3 - 1)));
      if (x < 0 || y < 0 || x >= shadow_size || y >= shadow_size ||
          c.nearness + bias >= shadow_.nearness(x, y))
        lit += 1;
    }
    return lit / 9;
  }

  Vector background(int x, int y) const {
    const float fx = (static_cast<float>(x) / static_cast<float>(canvas_.width()) - 0.5f);
    const float fy = (static_cast<float>(y) / static_cast<float>(canvas_.height()) - 0.5f);
    const float edge = std::min(1.0f, 1.6f * (fx * fx + fy * fy));
    // A little noise: the screen's 256 steps would show as rings.
    const auto hash = (static_cast<std::uint32_t>(x) * 0x9e3779b1u ^
                       static_cast<std::uint32_t>(y) * 0x85ebca77u) *
                      0xc2b2ae3du;
    const float noise =
        (static_cast<float>(hash >> 16) / 65536 - 0.5f) * (style_.dark ? 0.05f : 0.01f);
    return blend(inner_, outer_, edge) * (1 + noise);
  }

  Vector shade_sample(int x, int y) const {
    const std::uint64_t tag = canvas_.tag(x, y);
    const Vector behind = background(x, y);
    if (tag == Canvas::empty_tag) return behind;
    const auto id = static_cast<std::uint32_t>(tag >> 3);
    const Vector normal = face_normal(tag & 7), p = position(x, y, canvas_.nearness(x, y));
    const float hidden = occlusion_[index(x / 2, y / 2)];
    const float open = std::max(0.0f, 1 - 2.0f * hidden);
    const float sun = std::max(0.0f, dot(normal, view_.sun)) * sunlight(p, normal);
    const float sky = (0.42f + 0.24f * normal.z) * open;
    const Vector light =
        Vector{1.0f, 0.95f, 0.86f} * (1.15f * sun) + Vector{0.82f, 0.92f, 1.06f} * sky;
    if (id == ground_id) {
      const float dx = (p.x - middle_.x) / reach_, dy = (p.y - middle_.y) / reach_;
      const float far = std::min(1.0f, std::sqrt(dx * dx + dy * dy));
      const float fade = (1 - far) * (1 - far) * (1 + 2 * far);  // smooth at both ends
      return blend(behind, floor_ * light, fade);
    }
    Vector colour = colour_map((value(id) - lowest_) / (highest_ - lowest_)) * light;
    // A thin line where another face begins, if boxes are large enough on screen.
    const float pixels = view_.typical_size * canvas_.nearness(x, y) * view_.focal;
    const bool edge = (x + 1 < canvas_.width() && canvas_.tag(x + 1, y) != tag) ||
                      (y + 1 < canvas_.height() && canvas_.tag(x, y + 1) != tag);
    if (edge) colour = colour * (1 - 0.45f * std::min(1.0f, std::max(0.0f, (pixels - 5) / 25)));
    return colour;
  }

  const Box* boxes_;
  const float* values_;
  const PictureStyle& style_;
  int width_, height_;
  View view_;
  Canvas canvas_, shadow_;
  std::vector<float> occlusion_;
  float lowest_ = 0, highest_ = 1, reach_ = 1;
  const Vector inner_ = from_screen(style_.dark ? 0x1d2531 : 0xf8f7f3);
  const Vector outer_ = from_screen(style_.dark ? 0x0b0f15 : 0xe3e2dc);
  const Vector floor_ = from_screen(style_.dark ? 0x47515f : 0xe9e6de);
  Vector middle_;
};

}  // namespace

void draw_boxes(const std::string& path, const Box* boxes, std::size_t count, const float* values,
                const PictureStyle& style) {
  Painter painter(boxes, count, values, style);
  const Image image = painter.paint();
  write_png(path, image, style, painter.lowest(), painter.highest());
}

}  // namespace throng::report
