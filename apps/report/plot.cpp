#include "apps/report/plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "apps/report/format.hpp"

namespace throng::report {
namespace {

constexpr std::size_t colour_count = 8;  // classes c0 .. c7 of the page's style

// Maps values to a range of pixels.
struct Axis {
  bool log = false;
  double low = 0, high = 1;  // in units of the axis: log10 where log
  double from = 0, to = 1;   // pixels

  double unit(double v) const { return log ? std::log10(v) : v; }
  bool shows(double v) const { return std::isfinite(v) && (!log || v > 0); }
  double pixel(double v) const { return from + (unit(v) - low) / (high - low) * (to - from); }
};

struct Tick {
  double value;
  bool labelled;
};

void fit(Axis& axis, double smallest, double largest) {
  if (!(smallest <= largest)) {
    smallest = axis.log ? 1 : 0;
    largest = axis.log ? 10 : 1;
  }
  axis.low = axis.unit(smallest);
  axis.high = axis.unit(largest);
  if (!axis.log) axis.low = std::min(axis.low, 0.0);
  const double pad = std::max(axis.log ? 0.12 : 1e-9, 0.04 * (axis.high - axis.low));
  if (axis.log || axis.low < 0) axis.low -= pad;
  axis.high += pad;
}

std::vector<Tick> ticks(const Axis& axis) {
  std::vector<Tick> result;
  if (axis.log) {
    const int first = static_cast<int>(std::floor(axis.low)),
              last = static_cast<int>(std::ceil(axis.high));
    // Below two decades, 2 and 5 are labelled as well.
    const bool fine = axis.high - axis.low < 2;
    for (int e = first; e <= last; ++e)
      for (int m = 1; m < 10; ++m) {
        const double v = m * std::pow(10.0, e), u = std::log10(v);
        if (u >= axis.low && u <= axis.high)
          result.push_back({v, m == 1 || (fine && (m == 2 || m == 5))});
      }
    return result;
  }
  const double raw = (axis.high - axis.low) / 6,
               power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = raw / power < 1.5   ? power
                      : raw / power < 3.5 ? 2 * power
                      : raw / power < 7.5 ? 5 * power
                                          : 10 * power;
  for (int k = 0; k < 12; ++k) {
    const double v = (std::ceil(axis.low / step) + k) * step;
    if (v <= axis.high) result.push_back({v, true});
  }
  return result;
}

std::string label(double v) {
  if (v >= 1e9) return fmt::format("{:g}G", v / 1e9);
  if (v >= 1e6) return fmt::format("{:g}M", v / 1e6);
  if (v >= 1e3) return fmt::format("{:g}K", v / 1e3);
  return fmt::format("{:g}", v);
}

std::string value_text(double value) {
  return format_count(static_cast<std::uint64_t>(std::llround(value)));
}

// In the current colour.
std::string marker(std::size_t kind, double x, double y, bool emphasis) {
  const double r = emphasis ? 4.5 : 3.5;
  switch (kind % 4) {
    case 0:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", x, y, r);
    case 1:
      return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\"/>", x - r,
                         y - r, 2 * r, 2 * r);
    case 2:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}h{}z\"/>", x, y - r, r, 2 * r, -2 * r);
    default:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}l{} {}l{} {}z\"/>", x, y - r - 1, r + 1,
                         r + 1, -r - 1, r + 1, -r - 1, -r - 1);
  }
}

std::string line(const std::string& path, const Series& s) {
  return fmt::format("<path class=\"line\" d=\"{}\" stroke-width=\"{}\"{}/>", path,
                     s.emphasis ? 3.2 : 1.6, s.dashed ? " stroke-dasharray=\"6 4\"" : "");
}

std::string colour_class(const Series& s, std::size_t k) {
  return s.dashed ? "bound" : fmt::format("c{}", k % colour_count);
}

// `text` with this anchor; `turned` upwards.
std::string words(double x, double y, const char* anchor, const std::string& text, const char* kind,
                  bool turned = false) {
  return fmt::format("<text class=\"{}\" {} text-anchor=\"{}\">{}</text>\n", kind,
                     turned
                         ? fmt::format("transform=\"translate({:.1f} {:.1f}) rotate(-90)\"", x, y)
                         : fmt::format("x=\"{:.1f}\" y=\"{:.1f}\"", x, y),
                     anchor, escape_html(text));
}

// A figure: the title, the drawing, which a narrow screen shows no smaller than to 60 %, and the
// legend.
std::string figure(const std::string& title, double width, double height,
                   const std::string& drawing, const std::string& legend) {
  return fmt::format(
      "<figure class=\"plot\">\n<figcaption>{0}</figcaption>\n<div class=\"wide\">"
      "<svg viewBox=\"0 0 {1:.0f} {2:.0f}\" width=\"{1:.0f}\" height=\"{2:.0f}\" role=\"img\" "
      "style=\"min-width:{3:.0f}px\">\n<title>{0}</title>\n{4}</svg></div>\n{5}</figure>\n",
      escape_html(title), width, height, 0.6 * width, drawing, legend);
}

}  // namespace

std::string Plot::html() const {
  const double left = 68, right = width - 14, top = 12, bottom = height - 48.0;
  Axis ax, ay;
  ax.log = log_x;
  ay.log = log_y;
  double limits[4] = {
      std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
      std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Series& s : series)
    for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
      if (!ax.shows(s.x[i]) || !ay.shows(s.y[i])) continue;
      limits[0] = std::min(limits[0], s.x[i]);
      limits[1] = std::max(limits[1], s.x[i]);
      limits[2] = std::min(limits[2], s.y[i]);
      limits[3] = std::max(limits[3], s.y[i]);
    }
  fit(ax, limits[0], limits[1]);
  fit(ay, limits[2], limits[3]);
  ax.from = left;
  ax.to = right;
  ay.from = bottom;
  ay.to = top;

  std::string out;
  for (const Tick& t : ticks(ax)) {
    const double x = ax.pixel(t.value);
    out += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>\n",
                       t.labelled ? "grid" : "fine", x, bottom, top);
    if (t.labelled) out += words(x, bottom + 18, "middle", label(t.value), "tick");
  }
  for (const Tick& t : ticks(ay)) {
    const double y = ay.pixel(t.value);
    out += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>\n",
                       t.labelled ? "grid" : "fine", left, y, right);
    if (t.labelled) out += words(left - 8, y + 4, "end", label(t.value), "tick");
  }
  out += fmt::format("<path class=\"axis\" d=\"M{} {}V{}H{}\"/>\n", left, top, bottom, right);
  out += words((left + right) / 2, height - 10, "middle", x_label, "label");
  out += words(16, (top + bottom) / 2, "middle", y_label, "label", true);

  // Emphasized series last, so that they are on top; the legend keeps the caller's order.
  std::vector<std::size_t> order;
  for (const bool emphasis : {false, true})
    for (std::size_t i = 0; i < series.size(); ++i)
      if (series[i].emphasis == emphasis) order.push_back(i);
  for (const std::size_t k : order) {
    const Series& s = series[k];
    std::string path, marks;
    for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
      if (!ax.shows(s.x[i]) || !ay.shows(s.y[i])) continue;
      const double x = ax.pixel(s.x[i]), y = ay.pixel(s.y[i]);
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x, y);
      if (!s.dashed) marks += marker(k / colour_count + k, x, y, s.emphasis);
    }
    out += fmt::format("<g class=\"{}\" data-series=\"{}\">{}{}</g>\n", colour_class(s, k),
                       escape_html(s.name), line(path, s), marks);
  }
  std::string legend = "<ul class=\"legend\">\n";
  for (std::size_t k = 0; k < series.size(); ++k) {
    const Series& s = series[k];
    legend += fmt::format(
        "<li{}><svg class=\"{}\" width=\"24\" height=\"12\" "
        "aria-hidden=\"true\">{}{}</svg>{}</li>\n",
        s.emphasis ? " class=\"emphasis\"" : "", colour_class(s, k), line("M0 6h24", s),
        s.dashed ? "" : marker(k / colour_count + k, 12, 6, s.emphasis), escape_html(s.name));
  }
  return figure(title, width, height, out, series.empty() ? "" : legend + "</ul>\n");
}

std::string Bars::html() const {
  double most = 0;
  std::size_t longest = 1;
  for (const Bar& bar : bars) {
    most = std::max(most, bar.value);
    longest = std::max({longest, bar.label.size(), value_text(bar.value).size()});
  }
  // Wide enough for the labels of the bars and of the axis: less than eight pixels per letter.
  const auto count = static_cast<double>(std::max<std::size_t>(1, bars.size()));
  const double slot = std::max({44.0, 14 + 7.4 * static_cast<double>(longest),
                                7.4 * static_cast<double>(x_label.size()) / count});
  const double left = 36, top = 30, bottom = height - 48.0, right = left + slot * count;
  std::string out;
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const double tall = most > 0 ? bars[k].value / most * (bottom - top) : 0;
    const double x = left + slot * static_cast<double>(k), middle = x + slot / 2;
    out += fmt::format(
        "<rect class=\"c0\" data-bar=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
        "height=\"{:.1f}\"/>\n",
        escape_html(bars[k].label), x + 0.1 * slot, bottom - tall, 0.8 * slot, tall);
    out += words(middle, bottom - tall - 6, "middle", value_text(bars[k].value), "label");
    out += words(middle, bottom + 18, "middle", bars[k].label, "tick");
  }
  out += fmt::format("<path class=\"axis\" d=\"M{} {}H{}\"/>\n", left, bottom, right);
  out += words((left + right) / 2, height - 10, "middle", x_label, "label");
  out += words(18, (top + bottom) / 2, "middle", y_label, "label", true);
  return figure(title, right + 14, height, out, "");
}

std::string bar_text(const Bars& bars, int width) {
  double most = 0;
  std::size_t label_width = bars.x_label.size(), value_width = bars.y_label.size();
  for (const Bars::Bar& bar : bars.bars) {
    most = std::max(most, bar.value);
    label_width = std::max(label_width, bar.label.size());
    value_width = std::max(value_width, value_text(bar.value).size());
  }
  const double room = std::max(1.0, width - static_cast<double>(label_width + value_width + 4));
  std::string out = bars.title + "\n";
  out += fmt::format("{:>{}}  {:>{}}\n", bars.x_label, label_width, bars.y_label, value_width);
  for (const Bars::Bar& bar : bars.bars) {
    const double length = most > 0 ? bar.value / most * room : 0;
    const auto marks = static_cast<std::size_t>(bar.value > 0 ? std::max(1.0, length) : 0);
    std::string line = fmt::format("{:>{}}  {:>{}}  {}", bar.label, label_width,
                                   value_text(bar.value), value_width, std::string(marks, '#'));
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

}  // namespace throng::report
