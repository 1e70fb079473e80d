// What a picture shows: the boxes, the ground, the camera and the sun.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/types.hpp>

#include "apps/report/canvas.hpp"
#include "apps/report/vector.hpp"

namespace throng::report {

struct View {
  // The boxes to draw: finite, not inverted, not far larger than the rest.
  std::vector<std::uint32_t> shown;
  Vector low, high;        // their bounds
  float typical_size = 1;  // the median of their largest extents
  float ground = 0;        // z of the plane below them

  Vector eye, right, up, forward;  // the camera
  float focal = 1, centre_x = 0, centre_y = 0;
  Vector sun, sun_right, sun_up;  // towards the sun, and two axes across
  float sun_scale = 1, sun_x = 0, sun_y = 0;

  Corner project(Vector p) const {
    const Vector d = p - eye;
    const float near = 1 / dot(d, forward);
    return {centre_x + focal * dot(d, right) * near, centre_y - focal * dot(d, up) * near, near};
  }
  Vector unproject(float x, float y, float nearness) const {
    const Vector d = forward + right * ((x - centre_x) / focal) + up * ((centre_y - y) / focal);
    return eye + d * (1 / nearness);
  }
  Corner project_to_sun(Vector p) const {
    return {(dot(p, sun_right) - sun_x) * sun_scale, (dot(p, sun_up) - sun_y) * sun_scale,
            dot(p, sun)};
  }
};

// Camera angles in degrees; the picture is width x height, with a margin for text at the top and
// the bottom.
View look_at(const Box* boxes, std::size_t count, int width, int height, float azimuth,
             float elevation, int shadow_size);

// Faces 0 .. 5: -x, +x, -y, +y, -z, +z.
inline Vector face_normal(unsigned face) {
  const float s = face % 2 ? 1.0f : -1.0f;
  return {face / 2 == 0 ? s : 0, face / 2 == 1 ? s : 0, face / 2 == 2 ? s : 0};
}
// The four corners of a face, in order around it.
void face_corners(const Box& b, unsigned face, Vector (&out)[4]);

}  // namespace throng::report
