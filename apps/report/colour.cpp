#include "apps/report/colour.hpp"

#include <algorithm>

namespace throng::report {

Vector colour_map(float t) {
  t = t > 0 ? std::min(t, 1.0f) : 0;  // NaN is the lowest
  const float lightness = 0.47f + 0.46f * t;
  const float hue = (278.0f - 186.0f * t) * 0.017453293f;
  // The largest chroma that fits the screen along the path; less at the dark end and in the teal.
  const float chroma =
      0.150f + 0.02f * t - 0.05f * std::sin(3.1415927f * std::min(t * 1.25f, 1.0f));
  const float a = chroma * std::cos(hue), b = chroma * std::sin(hue);
  float l = lightness + 0.3963377774f * a + 0.2158037573f * b;
  float m = lightness - 0.1055613458f * a - 0.0638541728f * b;
  float s = lightness - 0.0894841775f * a - 1.2914855480f * b;
  l = l * l * l;
  m = m * m * m;
  s = s * s * s;
  const auto clamped = [](float x) { return std::min(std::max(x, 0.0f), 1.0f); };
  return {clamped(4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s),
          clamped(-1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s),
          clamped(-0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s)};
}

float to_screen(float x) {
  x = std::min(std::max(x, 0.0f), 1.0f);
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

Vector from_screen(unsigned rgb) {
  const auto channel = [](unsigned byte) {
    const float x = static_cast<float>(byte & 255) / 255;
    return x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
  };
  return {channel(rgb >> 16), channel(rgb >> 8), channel(rgb)};
}

}  // namespace throng::report
