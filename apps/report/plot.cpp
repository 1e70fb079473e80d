#include "apps/report/plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "apps/report/format.hpp"

namespace throng::report {
namespace {

const char* const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                               "#e69f00", "#56b4e9", "#7f7f7f", "#b8a800"};
constexpr std::size_t colour_count = 8;

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

std::string marker(std::size_t kind, double x, double y, const char* colour, bool emphasis) {
  const double r = emphasis ? 4.5 : 3.5;
  switch (kind % 4) {
    case 0:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>", x, y, r,
                         colour);
    case 1:
      return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>",
                         x - r, y - r, 2 * r, 2 * r, colour);
    case 2:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}h{}z\" fill=\"{}\"/>", x, y - r, r, 2 * r,
                         -2 * r, colour);
    default:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l{} {}l{} {}l{} {}z\" fill=\"{}\"/>", x,
                         y - r - 1, r + 1, r + 1, -r - 1, r + 1, -r - 1, -r - 1, colour);
  }
}

}  // namespace

std::string Plot::svg() const {
  // About seven pixels per letter, plus the space before the first.
  std::size_t longest = 0;
  for (const Series& s : series) longest = std::max(longest, s.name.size());
  const double legend_width = std::max(210.0, 56 + 6.8 * static_cast<double>(longest));
  const double left = 68, right = width - 210, top = 44, bottom = height - 52.0;
  const int total_width = static_cast<int>(right + legend_width);
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

  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" "
      "role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n<title>{2}</title>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n"
      "<text x=\"{3}\" y=\"24\" font-size=\"15\" font-weight=\"600\" fill=\"#222\">{2}</text>\n",
      total_width, height, escape_html(title), left);
  for (const Tick& t : ticks(ax)) {
    const double x = ax.pixel(t.value);
    out += fmt::format("<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"{3}\"/>\n", x, bottom, top,
                       t.labelled ? "#dddddd" : "#f2f2f2");
    if (t.labelled)
      out += fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" fill=\"#444\">{}</text>\n", x,
          bottom + 18, label(t.value));
  }
  for (const Tick& t : ticks(ay)) {
    const double y = ay.pixel(t.value);
    out += fmt::format("<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"{3}\"/>\n", left, y, right,
                       t.labelled ? "#dddddd" : "#f2f2f2");
    if (t.labelled)
      out += fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\" fill=\"#444\">{}</text>\n", left - 8,
          y + 4, label(t.value));
  }
  out += fmt::format("<path d=\"M{0} {1}V{2}H{3}\" fill=\"none\" stroke=\"#666\"/>\n", left, top,
                     bottom, right);
  out += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" fill=\"#222\">{}</text>\n",
                     (left + right) / 2, height - 14, escape_html(x_label));
  out += fmt::format(
      "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
      "fill=\"#222\">{}</text>\n",
      (top + bottom) / 2, escape_html(y_label));

  // Emphasized series last, so that they are on top; the legend keeps the caller's order.
  std::vector<std::size_t> order;
  for (const bool emphasis : {false, true})
    for (std::size_t i = 0; i < series.size(); ++i)
      if (series[i].emphasis == emphasis) order.push_back(i);
  for (const std::size_t k : order) {
    const Series& s = series[k];
    const char* colour = s.dashed ? "#444444" : colours[k % colour_count];
    std::string path, marks;
    for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
      if (!ax.shows(s.x[i]) || !ay.shows(s.y[i])) continue;
      const double x = ax.pixel(s.x[i]), y = ay.pixel(s.y[i]);
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x, y);
      if (!s.dashed) marks += marker(k / colour_count + k, x, y, colour, s.emphasis);
    }
    out += fmt::format(
        "<g data-series=\"{}\"><path d=\"{}\" fill=\"none\" stroke=\"{}\" "
        "stroke-width=\"{}\"{}/>{}</g>\n",
        escape_html(s.name), path, colour, s.emphasis ? 3.2 : 1.6,
        s.dashed ? " stroke-dasharray=\"6 4\"" : "", marks);
  }
  const double step = std::min(20.0, (bottom - top) / std::max<std::size_t>(1, series.size()));
  for (std::size_t k = 0; k < series.size(); ++k) {
    const Series& s = series[k];
    const char* colour = s.dashed ? "#444444" : colours[k % colour_count];
    const double y = top + 8 + step * static_cast<double>(k), x = right + 14;
    out += fmt::format("<path d=\"M{:.1f} {:.1f}h22\" stroke=\"{}\" stroke-width=\"{}\"{}/>", x, y,
                       colour, s.emphasis ? 3.2 : 1.6, s.dashed ? " stroke-dasharray=\"6 4\"" : "");
    if (!s.dashed) out += marker(k / colour_count + k, x + 11, y, colour, s.emphasis);
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"#222\"{}>{}</text>\n", x + 28, y + 4,
                       s.emphasis ? " font-weight=\"600\"" : "", escape_html(s.name));
  }
  return out + "</svg>\n";
}

std::string Bars::svg() const {
  double most = 0;
  std::size_t longest = 1;
  for (const Bar& bar : bars) {
    most = std::max(most, bar.value);
    longest = std::max({longest, bar.label.size(), value_text(bar.value).size()});
  }
  // Wide enough for the labels: about seven pixels per letter.
  const double slot = std::max(44.0, 14 + 6.8 * static_cast<double>(longest));
  const double left = 44, top = 64, bottom = height - 60.0;
  const double right = left + slot * static_cast<double>(std::max<std::size_t>(1, bars.size()));
  const double total_width =
      std::max(right + 16, left + 16 + 8.5 * static_cast<double>(title.size()));
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1}\" width=\"{0:.0f}\" "
      "height=\"{1}\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n"
      "<title>{2}</title>\n<rect width=\"{0:.0f}\" height=\"{1}\" fill=\"#ffffff\"/>\n"
      "<text x=\"{3}\" y=\"24\" font-size=\"15\" font-weight=\"600\" fill=\"#222\">{2}</text>\n",
      total_width, height, escape_html(title), left);
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const double tall = most > 0 ? bars[k].value / most * (bottom - top) : 0;
    const double x = left + slot * static_cast<double>(k), middle = x + slot / 2;
    out += fmt::format(
        "<rect data-bar=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
        "fill=\"{}\"/>\n",
        escape_html(bars[k].label), x + 0.1 * slot, bottom - tall, 0.8 * slot, tall, colours[0]);
    out += fmt::format(
        "<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"middle\" fill=\"#222\">{2}</text>\n"
        "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\" fill=\"#444\">{4}</text>\n",
        middle, bottom - tall - 6, value_text(bars[k].value), bottom + 18,
        escape_html(bars[k].label));
  }
  out +=
      fmt::format("<path d=\"M{} {}H{}\" fill=\"none\" stroke=\"#666\"/>\n", left, bottom, right);
  out += fmt::format(
      "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" fill=\"#222\">{}</text>\n"
      "<text transform=\"translate(24 {:.1f}) rotate(-90)\" text-anchor=\"middle\" "
      "fill=\"#222\">{}</text>\n",
      (left + right) / 2, height - 16, escape_html(x_label), (top + bottom) / 2,
      escape_html(y_label));
  return out + "</svg>\n";
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
