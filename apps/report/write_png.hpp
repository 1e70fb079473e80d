// From pixels to a PNG with text and legend, by Cairo.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/report/draw_boxes.hpp"

namespace throng::report {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  // 0x00rrggbb, row by row
};

// The legend spans lowest .. highest. Throws std::runtime_error that names the file.
void write_png(const std::string& path, Image image, const PictureStyle& style, float lowest,
               float highest);

}  // namespace throng::report
