// The light of a picture: sun with a shadow map, sky with ambient occlusion, background. Shared by
// pictures of boxes and of meshes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <thread>
#include <vector>

#include "apps/report/canvas.hpp"
#include "apps/report/colour.hpp"
#include "apps/report/view.hpp"

namespace throng::report {

// Calls f(0) .. f(rows - 1) on several threads.
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

// The point that a sample of the canvas shows.
inline Vector sample_position(const View& view, int x, int y, float nearness) {
  return view.unproject(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, nearness);
}

// Ambient occlusion of each pixel of a canvas of 2 x 2 samples per pixel: sixteen samples on a
// spiral within `radius`, rotated in a pattern of 4 x 4 pixels that the averaging removes.
// `normal_at(x, y)`: the normal of a sample; `same(tag, tag)`: whether two samples are averaged.
template <class NormalAt, class Same>
std::vector<float> find_occlusion(const Canvas& canvas, const View& view, float radius,
                                  const NormalAt& normal_at, const Same& same) {
  const int width = canvas.width() / 2, height = canvas.height() / 2;
  const auto index = [width](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  };
  std::vector<float> raw_occlusion(index(0, height)), occlusion(raw_occlusion.size());
  on_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const int px = 2 * x, py = 2 * y;
      raw_occlusion[index(x, y)] = 0;
      if (canvas.tag(px, py) == Canvas::empty_tag) continue;
      const float near = canvas.nearness(px, py);
      const Vector p = sample_position(view, px, py, near), normal = normal_at(px, py);
      const float reach = std::min(std::max(radius * near * view.focal, 8.0f), 220.0f);
      float hidden = 0;
      for (int k = 0; k < 16; ++k) {
        const float r = reach * (static_cast<float>(k) + 0.5f) / 16;
        const float turn = 2.3999632f * static_cast<float>(k) +
                           0.3926991f * static_cast<float>((x & 3) * 4 + (y & 3));
        const int sx = px + static_cast<int>(r * std::cos(turn)),
                  sy = py + static_cast<int>(r * std::sin(turn));
        if (sx < 0 || sy < 0 || sx >= canvas.width() || sy >= canvas.height()) continue;
        if (canvas.tag(sx, sy) == Canvas::empty_tag) continue;
        const Vector d = sample_position(view, sx, sy, canvas.nearness(sx, sy)) - p;
        const float squared = dot(d, d) + 1e-20f;
        const float cosine = dot(d, normal) / std::sqrt(squared);
        if (cosine > 0.08f) hidden += cosine / (1 + squared / (radius * radius));
      }
      raw_occlusion[index(x, y)] = hidden / 16;
    }
  });
  on_rows(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const std::uint64_t tag = canvas.tag(2 * x, 2 * y);
      float sum = 0, weight = 1e-6f;
      for (int dy = -2; dy < 2; ++dy)
        for (int dx = -2; dx < 2; ++dx) {
          const int sx = x + dx, sy = y + dy;
          if (sx < 0 || sy < 0 || sx >= width || sy >= height) continue;
          const float w = same(canvas.tag(2 * sx, 2 * sy), tag) ? 1.0f : 0.05f;
          sum += w * raw_occlusion[index(sx, sy)];
          weight += w;
        }
      occlusion[index(x, y)] = sum / weight;
    }
  });
  return occlusion;
}

// The share of sunlight at p, `bias` above its surface: 1 in the sun, 0 in the shade; between along
// the edge of a shadow. `shadow`: nearness to the sun.
inline float sunlight(const View& view, const Canvas& shadow, Vector p, Vector normal, float bias) {
  const Corner c = view.project_to_sun(p + normal * bias);
  float lit = 0;
  for (int k = 0; k < 9; ++k) {
    const int x = static_cast<int>(std::floor(c.x + static_cast<float>(k % 3 - 1)));
    const int y = static_cast<int>(std::floor(c.y + static_cast<float>(k / 3 - 1)));
    if (x < 0 || y < 0 || x >= shadow.width() || y >= shadow.height() ||
        c.nearness + bias >= shadow.nearness(x, y))
      lit += 1;
  }
  return lit / 9;
}

inline Vector light_of(float sun, float sky) {
  return Vector{1.0f, 0.95f, 0.86f} * (1.15f * sun) + Vector{0.82f, 0.92f, 1.06f} * sky;
}

// The background and the floor, and the floor's light fading into the background.
class Backdrop {
 public:
  Backdrop(bool dark, const Canvas& canvas)
      : floor(from_screen(dark ? 0x47515f : 0xe9e6de)),
        inner_(from_screen(dark ? 0x1d2531 : 0xf8f7f3)),
        outer_(from_screen(dark ? 0x0b0f15 : 0xe3e2dc)),
        noise_(dark ? 0.05f : 0.01f),
        width_(static_cast<float>(canvas.width())),
        height_(static_cast<float>(canvas.height())) {}

  // Of a sample.
  Vector at(int x, int y) const {
    const float fx = (static_cast<float>(x) / width_ - 0.5f);
    const float fy = (static_cast<float>(y) / height_ - 0.5f);
    const float edge = std::min(1.0f, 1.6f * (fx * fx + fy * fy));
    // A little noise: the screen's 256 steps would show as rings.
    const auto hash = (static_cast<std::uint32_t>(x) * 0x9e3779b1u ^
                       static_cast<std::uint32_t>(y) * 0x85ebca77u) *
                      0xc2b2ae3du;
    const float noise = (static_cast<float>(hash >> 16) / 65536 - 0.5f) * noise_;
    return blend(inner_, outer_, edge) * (1 + noise);
  }

  // The floor's colour at p in this light; `reach` from `middle` on only the background is left.
  Vector floor_at(Vector p, Vector middle, float reach, Vector light, Vector behind) const {
    const float dx = (p.x - middle.x) / reach, dy = (p.y - middle.y) / reach;
    const float far = std::min(1.0f, std::sqrt(dx * dx + dy * dy));
    const float fade = (1 - far) * (1 - far) * (1 + 2 * far);  // smooth at both ends
    return blend(behind, floor * light, fade);
  }

  const Vector floor;

 private:
  Vector inner_, outer_;
  float noise_, width_, height_;
};

// The floor: a square around `middle` at height z.
inline void draw_floor(Canvas& canvas, const View& view, Vector middle, float reach, float z,
                       std::uint32_t id) {
  Vector c[4];
  Corner q[4];
  face_corners({{middle.x - reach, middle.y - reach, z}, {middle.x + reach, middle.y + reach, z}},
               5, c);
  bool visible = true;
  for (int k = 0; k < 4; ++k) {
    q[k] = view.project(c[k]);
    visible = visible && q[k].nearness > 0;
  }
  if (visible) canvas.quad(q, id, 5);
}

// The mean of the four samples of a pixel, as 0x00rrggbb.
template <class Sample>
std::uint32_t pixel_of(int x, int y, const Sample& sample) {
  Vector sum;
  for (int k = 0; k < 4; ++k) sum = sum + sample(2 * x + k % 2, 2 * y + k / 2);
  const auto byte = [](float v) {
    return static_cast<std::uint32_t>(std::lround(255 * to_screen(v / 4)));
  };
  return byte(sum.x) << 16 | byte(sum.y) << 8 | byte(sum.z);
}

}  // namespace throng::report
