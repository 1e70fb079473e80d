// The film of falling boxes: an animated SVG file that loops, for `demo`. It shows the boxes that a
// vertical plane through the middle cuts, as squares.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/throng/falling_boxes.hpp"

namespace throng::cli {

class Film {
 public:
  Film(std::size_t objects, std::size_t frames);

  // Whether this frame becomes a picture. There are 40 to 120 pictures, fewer of many objects, but
  // not more than frames.
  bool shows(std::size_t frame) const {
    return (frame + 1) * pictures_ / frames_ > frame * pictures_ / frames_;
  }
  // Adds a picture. `pairs`: of heap.boxes(); `caption`: words for this picture.
  void add(const FallingBoxes& heap, const Pair* pairs, std::size_t count, std::string caption);

  // The last picture also shows where animation is not supported. Call it with one picture or more.
  std::string svg(const std::string& title) const;

 private:
  struct Square {
    float x, z;  // of its centre
    std::uint8_t colour;
  };
  struct Picture {
    std::vector<Square> squares;
    std::string caption;
  };
  std::size_t frames_, pictures_;
  std::vector<Picture> shown_;
};

}  // namespace throng::cli
