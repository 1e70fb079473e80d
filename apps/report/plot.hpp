// Line plots as SVG text, for any browser.
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
  int width = 720, height = 440;

  // One <svg> element. The colours are the eight of Okabe and Ito, distinct for people with any
  // kind of colour vision; the markers differ, too.
  std::string svg() const;
};

}  // namespace throng::report
