// Line plots as SVG text: no program is needed to look at them but a browser.
#pragma once

#include <string>
#include <vector>

namespace throng::report {

struct Series {
  std::string name;
  std::vector<double> x, y;  // as many of each; points that are not finite are left out
  bool emphasis = false;     // drawn thicker and on top: what the plot is about
  bool dashed = false;       // a bound or a goal rather than a measurement
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // then values that are not positive are left out
  std::vector<Series> series;
  int width = 720, height = 440;

  // One <svg> element. The colours are the eight of Okabe and Ito, which people with any kind of
  // colour vision tell apart, and the markers differ too.
  std::string svg() const;
};

}  // namespace throng::report
