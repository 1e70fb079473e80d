// Rasterises faces into a depth buffer of four samples per pixel; then lights each sample by the
// sun (with a shadow map) and the sky (with ambient occlusion), and darkens the edges of boxes.
#include "apps/report/draw_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/report/colour.hpp"
#include "apps/report/lighting.hpp"
#include "apps/report/view.hpp"
#include "apps/report/write_png.hpp"

namespace throng::report {
namespace {

constexpr int shadow_size = 3072;
constexpr std::uint32_t ground_id = 0xfffffffeu;

class Painter {
 public:
  Painter(const Box* boxes, std::size_t count, const float* values, const PictureStyle& style)
      : boxes_(boxes),
        values_(values),
        width_(style.width),
        height_(style.height),
        view_(look_at(boxes, count, 2 * width_, 2 * height_, style.azimuth, style.elevation,
                      shadow_size)),
        canvas_(2 * width_, 2 * height_),
        shadow_(shadow_size, shadow_size),
        backdrop_(style.dark, canvas_) {
    scale_values();
  }

  Image paint() {
    draw_faces();
    const auto normal_at = [this](int x, int y) { return face_normal(canvas_.tag(x, y) & 7); };
    occlusion_ =
        find_occlusion(canvas_, view_, 3.0f * view_.typical_size, normal_at,
                       [](std::uint64_t a, std::uint64_t b) { return (a & 7) == (b & 7); });
    Image image{width_, height_, std::vector<std::uint32_t>(occlusion_.size())};
    on_rows(height_, [&](int y) {
      for (int x = 0; x < width_; ++x) {
        image.pixels[index(x, y)] =
            pixel_of(x, y, [this](int sx, int sy) { return shade_sample(sx, sy); });
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
    if (!view_.shown.empty()) {
      draw_floor(canvas_, view_, middle_, reach_, view_.ground, ground_id);
    }
  }

  Vector shade_sample(int x, int y) const {
    const std::uint64_t tag = canvas_.tag(x, y);
    const Vector behind = backdrop_.at(x, y);
    if (tag == Canvas::empty_tag) return behind;
    const auto id = static_cast<std::uint32_t>(tag >> 3);
    const Vector normal = face_normal(tag & 7),
                 p = sample_position(view_, x, y, canvas_.nearness(x, y));
    const float hidden = occlusion_[index(x / 2, y / 2)];
    const float open = std::max(0.0f, 1 - 2.0f * hidden);
    const float bias = 1.6f / view_.sun_scale + 0.02f * view_.typical_size;
    const float sun =
        std::max(0.0f, dot(normal, view_.sun)) * sunlight(view_, shadow_, p, normal, bias);
    const float sky = (0.42f + 0.24f * normal.z) * open;
    const Vector light = light_of(sun, sky);
    if (id == ground_id) return backdrop_.floor_at(p, middle_, reach_, light, behind);
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
  int width_, height_;
  View view_;
  Canvas canvas_, shadow_;
  Backdrop backdrop_;
  std::vector<float> occlusion_;
  float lowest_ = 0, highest_ = 1, reach_ = 1;
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
