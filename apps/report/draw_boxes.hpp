// A picture of boxes in space: perspective, sun, shadows; each box coloured by a value.
#pragma once

#include <cstddef>
#include <string>

#include <throng/types.hpp>

namespace throng::report {

struct PictureStyle {
  int width = 1600, height = 1000;
  std::string title;             // top left; may be empty
  std::string caption;           // one line, bottom left; may be empty
  std::string legend = "value";  // what the colours show
  bool dark = true;              // the background
  float azimuth = 35;            // degrees, the direction of the viewer
  float elevation = 24;
};

// Writes a PNG. `values` holds one number per box; null: a box's colour shows its height. z points
// up. Boxes far larger than the others (a ground plane) are drawn as the ground; inverted and
// non-finite boxes are left out. About 1 s for 100,000 boxes. The file gets its name when complete.
// Throws std::runtime_error that names the file.
void draw_boxes(const std::string& path, const Box* boxes, std::size_t count, const float* values,
                const PictureStyle& style = {});

}  // namespace throng::report
