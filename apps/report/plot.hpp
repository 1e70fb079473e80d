// Line and bar plots for a Page, whose style has their colours.
#pragma once

#include <string>
#include <vector>

namespace throng::report {

struct Series {
  std::string name;
  std::vector<double> x, y;  // as many of each; non-finite points are left out
  bool emphasis = false;     // drawn thicker and on top: the subject of the plot
  bool dashed = false;       // a bound or a goal rather than a measurement
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // then values <= 0 are left out
  std::vector<Series> series;
  int width = 520, height = 360;

  // One <figure>: the title, an <svg> and the legend. The markers differ as well as the colours.
  std::string html() const;
};

// One bar per class of a histogram, from left to right.
struct Bars {
  struct Bar {
    std::string label;
    double value = 0;  // >= 0, finite
  };
  std::string title, x_label, y_label;
  std::vector<Bar> bars;
  int height = 300;

  // One <figure>; each bar has its value above it.
  std::string html() const;
};

// The same as lines of text, each at most `width` characters: label, value, a bar of '#' whose
// length is proportional to the value. A value above 0 has at least one '#'.
std::string bar_text(const Bars& bars, int width);

}  // namespace throng::report
