// From pixels to a PNG with text and legend, by Cairo.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/report/draw_boxes.hpp"
#include "apps/report/vector.hpp"

namespace throng::report {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;  // 0x00rrggbb, row by row
};

// A colour and what it shows.
struct ColourKey {
  Vector colour;
  std::string text;
};

// Whether this build has Cairo. If not, write_png() throws.
bool can_write_png() noexcept;
// Throws what write_png() throws for lack of Cairo, before the work; does nothing if `path` is
// empty.
void check_png(const std::string& path);

// The legend spans lowest .. highest. Throws std::runtime_error that names the file.
void write_png(const std::string& path, Image image, const PictureStyle& style, float lowest,
               float highest);
// The same with a square for each key instead of a scale.
void write_png(const std::string& path, Image image, const PictureStyle& style,
               const std::vector<ColourKey>& keys);

}  // namespace throng::report
