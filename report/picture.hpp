// A picture of boxes in space: perspective, sun, shadows, a colour for each box by a value.
#pragma once

#include <cstddef>
#include <string>

#include <throng/types.hpp>

namespace throng::report {

struct PictureStyle {
  int width = 1600, height = 1000;
  std::string title;             // top left; may be empty
  std::string caption;           // one line, bottom left; may be empty
  std::string legend = "value";  // what the colours tell
  bool dark = true;              // the background
  float azimuth = 35;            // degrees, where the viewer stands
  float elevation = 24;
};

// Writes a PNG. `values` holds one number a box, or is null: then a box's colour tells its height.
// z points up. Boxes far larger than the others (a ground plane) are drawn as the ground; inverted
// and non-finite boxes are left out. Takes about a second for 100,000 boxes. The file appears
// under its name when it is complete; std::runtime_error names it where that fails.
void draw_boxes(const std::string& path, const Box* boxes, std::size_t count, const float* values,
                const PictureStyle& style = {});

}  // namespace throng::report
