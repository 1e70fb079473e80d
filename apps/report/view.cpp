#include "apps/report/view.hpp"

#include <algorithm>
#include <cmath>

namespace throng::report {
namespace {

float size_of(const Box& b) {
  return std::max({b.upper.x - b.lower.x, b.upper.y - b.lower.y, b.upper.z - b.lower.z});
}
bool drawable(const Box& b) {
  const float values[] = {b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y, b.upper.z};
  for (const float v : values)
    if (!(std::fabs(v) < 1e30f)) return false;
  return b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z;
}
Vector middle(const Box& b) {
  return {(b.lower.x + b.upper.x) / 2, (b.lower.y + b.upper.y) / 2, (b.lower.z + b.upper.z) / 2};
}

// The value below which the given share lies: a few outliers must not shrink the rest.
float quantile(std::vector<float>& v, double share) {
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * double(v.size() - 1));
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

void choose(View& view, const Box* boxes, std::size_t count) {
  std::vector<float> sizes;
  for (std::size_t i = 0; i < count; ++i)
    if (drawable(boxes[i])) sizes.push_back(size_of(boxes[i]));
  if (sizes.empty()) return;
  view.typical_size = std::max(quantile(sizes, 0.5), 1e-20f);
  const float inf = INFINITY;
  view.low = {inf, inf, inf};
  view.high = {-inf, -inf, -inf};
  float plane = -inf;
  for (std::size_t i = 0; i < count; ++i) {
    const Box& b = boxes[i];
    if (b.lower.x > b.upper.x || std::isnan(b.lower.x)) continue;
    if (!drawable(b) || size_of(b) > 30 * view.typical_size) {
      if (std::isfinite(b.upper.z)) plane = std::max(plane, b.upper.z);
      continue;
    }
    view.shown.push_back(static_cast<std::uint32_t>(i));
    view.low = {std::min(view.low.x, b.lower.x), std::min(view.low.y, b.lower.y),
                std::min(view.low.z, b.lower.z)};
    view.high = {std::max(view.high.x, b.upper.x), std::max(view.high.y, b.upper.y),
                 std::max(view.high.z, b.upper.z)};
  }
  const float height = view.high.z - view.low.z;
  // A plane below the boxes, if there is one; else their lowest face.
  view.ground = plane > view.low.z - height && plane < view.low.z + height / 2 ? plane : view.low.z;
}

}  // namespace

void face_corners(const Box& b, unsigned face, Vector (&out)[4]) {
  const Vector l{b.lower.x, b.lower.y, b.lower.z}, u{b.upper.x, b.upper.y, b.upper.z};
  switch (face / 2) {
    case 0: {
      const float x = face % 2 ? u.x : l.x;
      out[0] = {x, l.y, l.z}, out[1] = {x, u.y, l.z}, out[2] = {x, u.y, u.z},
      out[3] = {x, l.y, u.z};
      break;
    }
    case 1: {
      const float y = face % 2 ? u.y : l.y;
      out[0] = {l.x, y, l.z}, out[1] = {u.x, y, l.z}, out[2] = {u.x, y, u.z},
      out[3] = {l.x, y, u.z};
      break;
    }
    default: {
      const float z = face % 2 ? u.z : l.z;
      out[0] = {l.x, l.y, z}, out[1] = {u.x, l.y, z}, out[2] = {u.x, u.y, z},
      out[3] = {l.x, u.y, z};
    }
  }
}

View look_at(const Box* boxes, std::size_t count, int width, int height, float azimuth,
             float elevation, int shadow_size) {
  View v;
  choose(v, boxes, count);
  const float degree = 0.017453293f, a = azimuth * degree, e = elevation * degree;
  v.forward = {-std::cos(e) * std::cos(a), -std::cos(e) * std::sin(a), -std::sin(e)};
  v.right = {-std::sin(a), std::cos(a), 0};
  v.up = cross(v.right, v.forward);
  const float half_view = 14 * degree;
  const float w = static_cast<float>(width), h = static_cast<float>(height);
  v.centre_x = w / 2;
  v.centre_y = h * 0.475f;  // the legend needs more space than the title
  v.focal = h / 2 / std::tan(half_view);
  if (v.shown.empty()) {
    v.eye = v.forward * -10;
    v.sun = {0, 0, 1};
    return v;
  }
  // Centre the boxes, then step back until they fit.
  std::vector<float> across, along, back;
  for (const std::uint32_t i : v.shown) {
    const Vector m = middle(boxes[i]);
    across.push_back(dot(m, v.right));
    along.push_back(dot(m, v.up));
  }
  const float x = (quantile(across, 0.002) + quantile(across, 0.998)) / 2;
  const float y = (quantile(along, 0.002) + quantile(along, 0.998)) / 2;
  const float tan_x = 0.43f * w / v.focal, tan_y = 0.38f * h / v.focal;
  for (const std::uint32_t i : v.shown) {
    const Vector m = middle(boxes[i]);
    back.push_back(
        std::max(std::fabs(dot(m, v.right) - x) / tan_x, std::fabs(dot(m, v.up) - y) / tan_y) -
        dot(m, v.forward));
  }
  const float distance = quantile(back, 0.998) + v.typical_size;
  v.eye = v.right * x + v.up * y + v.forward * -distance;

  // The sun is to the left of the viewer, and higher; from below, lower.
  const float s = (azimuth - 62) * degree, high = (elevation < 0 ? -48 : 48) * degree;
  v.sun = {std::cos(high) * std::cos(s), std::cos(high) * std::sin(s), std::sin(high)};
  v.sun_right = unit(cross(v.sun, {0, 0, 1}));
  v.sun_up = cross(v.sun_right, v.sun);
  float box[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (int k = 0; k < 8; ++k) {
    const Vector c{k & 1 ? v.high.x : v.low.x, k & 2 ? v.high.y : v.low.y,
                   k & 4 ? v.high.z : v.low.z};
    box[0] = std::min(box[0], dot(c, v.sun_right)), box[2] = std::max(box[2], dot(c, v.sun_right));
    box[1] = std::min(box[1], dot(c, v.sun_up)), box[3] = std::max(box[3], dot(c, v.sun_up));
  }
  v.sun_x = box[0];
  v.sun_y = box[1];
  v.sun_scale =
      static_cast<float>(shadow_size - 1) / std::max({box[2] - box[0], box[3] - box[1], 1e-20f});
  return v;
}

}  // namespace throng::report
