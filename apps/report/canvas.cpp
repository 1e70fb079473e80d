#include "apps/report/canvas.hpp"

#include <algorithm>
#include <cmath>

namespace throng::report {

Canvas::Canvas(int width, int height)
    : width_(width),
      height_(height),
      nearness_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                -std::numeric_limits<float>::infinity()),
      tag_(nearness_.size(), empty_tag) {}

void Canvas::quad(const Corner (&c)[4], std::uint32_t id, unsigned face) {
  // Depth as a plane over the screen, from the triangle with the larger area.
  const auto turn = [&](int i, int j, int k) {
    return (c[j].x - c[i].x) * (c[k].y - c[i].y) - (c[k].x - c[i].x) * (c[j].y - c[i].y);
  };
  int i = 0, j = 1, k = 2;
  if (std::fabs(turn(0, 2, 3)) > std::fabs(turn(0, 1, 2))) j = 2, k = 3;
  const float area = turn(i, j, k);
  if (!(std::fabs(area) > 1e-12f)) return;  // seen edge on, or not finite
  const float by_x = ((c[j].nearness - c[i].nearness) * (c[k].y - c[i].y) -
                      (c[k].nearness - c[i].nearness) * (c[j].y - c[i].y)) /
                     area;
  const float by_y = ((c[k].nearness - c[i].nearness) * (c[j].x - c[i].x) -
                      (c[j].nearness - c[i].nearness) * (c[k].x - c[i].x)) /
                     area;

  float top = c[0].y;
  float bottom = top;
  for (const Corner& p : c) {
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
  }
  const int first = static_cast<int>(std::ceil(std::max(top - 0.5f, 0.0f)));
  const int last = static_cast<int>(std::floor(std::min(bottom - 0.5f, height_ - 1.0f)));
  const std::uint64_t tag = std::uint64_t{id} * 8 + face;
  for (int y = first; y <= last; ++y) {
    const float line = static_cast<float>(y) + 0.5f;
    float left = std::numeric_limits<float>::infinity(), right = -left;
    for (int e = 0; e < 4; ++e) {
      const Corner &p = c[e], &q = c[(e + 1) & 3];
      if ((p.y <= line) == (q.y <= line)) continue;
      const float x = p.x + (line - p.y) / (q.y - p.y) * (q.x - p.x);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (!(left <= right)) continue;  // this line passes through the lowest corner
    const int from = static_cast<int>(std::ceil(std::max(left - 0.5f, 0.0f)));
    const int to = static_cast<int>(std::floor(std::min(right - 0.5f, width_ - 1.0f)));
    for (int x = from; x <= to; ++x) {
      const float near =
          c[i].nearness + by_x * (static_cast<float>(x) + 0.5f - c[i].x) + by_y * (line - c[i].y);
      const std::size_t s = at(x, y);
      if (near > nearness_[s]) {
        nearness_[s] = near;
        tag_[s] = tag;
      }
    }
  }
}

}  // namespace throng::report
