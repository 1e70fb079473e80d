// A drawing in SVG: rectangles, lines, text. It works on light and dark pages.
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

namespace throng::figures {

// The colours of Okabe and Ito, distinct for people with any kind of colour vision.
inline constexpr const char* blue = "#0072b2";
inline constexpr const char* orange = "#e69f00";
inline constexpr const char* green = "#009e73";
inline constexpr const char* red = "#d55e00";
inline constexpr const char* grey = "#8a8a86";

class Drawing {
 public:
  // In pixels; y goes down.
  Drawing(int width, int height)
      : text_(fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
            "height=\"{1}\" font-family=\"sans-serif\" font-size=\"14\">\n"
            "<rect width=\"{0}\" height=\"{1}\" rx=\"6\" fill=\"#fdfdfb\"/>\n",
            width, height)) {}

  void rectangle(double x, double y, double width, double height, const char* colour,
                 double opacity = 0.25) {
    text_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
        "fill-opacity=\"{:.2f}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
        x, y, width, height, colour, opacity, colour);
  }
  // Without a border.
  void cell(double x, double y, double width, double height, const char* colour) {
    text_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", x, y,
        width, height, colour);
  }
  struct Point {
    double x, y;
  };
  void polygon(const std::vector<Point>& points, const char* colour, double opacity) {
    text_ += "<polygon points=\"";
    for (const Point& p : points) text_ += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    text_ +=
        fmt::format("\" fill=\"{}\" fill-opacity=\"{:.2f}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
                    colour, opacity, colour);
  }
  void line(double x1, double y1, double x2, double y2, const char* colour, bool dashed = false) {
    text_ += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
        "stroke-width=\"1.5\"{}/>\n",
        x1, y1, x2, y2, colour, dashed ? " stroke-dasharray=\"5 4\"" : "");
  }
  void dot(double x, double y, const char* colour) {
    text_ +=
        fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n", x, y, colour);
  }
  // `anchor`: start, middle or end. The text must hold no character that SVG reserves.
  void words(double x, double y, const std::string& words, const char* anchor = "start",
             const char* colour = "#222222") {
    text_ +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\">{}</text>\n", x,
                    y, anchor, colour, words);
  }

  std::string svg() const { return text_ + "</svg>\n"; }

 private:
  std::string text_;
};

}  // namespace throng::figures
