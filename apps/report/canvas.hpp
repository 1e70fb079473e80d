// A depth buffer that also stores the box and face in front.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

namespace throng::report {

struct Corner {
  float x, y;      // pixels, y downwards
  float nearness;  // linear on screen, larger is nearer: 1 / distance, or -distance in a parallel
                   // projection
};

class Canvas {
 public:
  Canvas(int width, int height);

  // A convex quadrilateral, corners in either orientation; `face` 0 .. 5.
  void quad(const Corner (&corners)[4], std::uint32_t id, unsigned face);

  int width() const { return width_; }
  int height() const { return height_; }
  float nearness(int x, int y) const { return nearness_[at(x, y)]; }
  // id * 8 + face, or empty_tag.
  std::uint64_t tag(int x, int y) const { return tag_[at(x, y)]; }
  static constexpr std::uint64_t empty_tag = ~std::uint64_t{0};

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  int width_, height_;
  std::vector<float> nearness_;
  std::vector<std::uint64_t> tag_;
};

}  // namespace throng::report
