#include "apps/figures/animation.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/figures/motion.hpp"

namespace throng::figures {
namespace {

// In pixels: the area, and below it the chart of the number of pairs.
constexpr int width = 860, height = 420, area_height = 318;
constexpr int chart_left = 20, chart_right = 560, chart_top = 338, chart_bottom = 402;
constexpr int seconds = 30;
// Ticks for which the begin or end of a pair is highlighted.
constexpr int begun_ticks = 15, ended_ticks = 8;

constexpr const char* begin_colour = "#2ee6a6";
constexpr const char* pair_colour = "#dbe4f0";
constexpr const char* end_colour = "#ff5a3c";
// Colours of a box that overlaps none, one, two, more.
constexpr const char* box_colours[] = {"#6f83a3", "#4db8ff", "#ffb52e", "#ff7ac6"};

// Tenths of a pixel, without trailing zeros.
std::string pixels(int tenths) {
  return tenths % 10 ? fmt::format("{}.{}", tenths / 10, tenths % 10) : fmt::to_string(tenths / 10);
}

// Thousandths of the whole duration.
std::string key_time(int tick) {
  static_assert(tick_count == 1000);
  if (tick == 0 || tick == tick_count) return tick == 0 ? "0" : "1";
  std::string text = fmt::format(".{:03}", tick);
  text.erase(text.find_last_not_of('0') + 1);
  return text;
}

// An attribute's values over time. A value holds until the next if `steps`, else it is
// interpolated.
class Keyframes {
 public:
  void at(int tick, const std::string& value) {
    if (!times_.empty()) times_ += ';', values_ += ';';
    times_ += key_time(tick);
    values_ += value;
  }
  std::string of(const char* attribute, bool steps) const {
    return fmt::format(
        "<animate attributeName=\"{}\" dur=\"{}s\" repeatCount=\"indefinite\"{} "
        "keyTimes=\"{}\" values=\"{}\"/>",
        attribute, seconds, steps ? " calcMode=\"discrete\"" : "", times_, values_);
  }

 private:
  std::string times_, values_;
};

std::string animate(const char* attribute, const Oscillation& oscillation) {
  Keyframes keyframes;
  for (int tick = 0; tick <= tick_count; ++tick) {
    if (tick == 0 || tick == tick_count || oscillation.turns_at(tick)) {
      keyframes.at(tick, pixels(oscillation.at(tick)));
    }
  }
  return keyframes.of(attribute, false);
}

// A moving box, coloured by its number of pairs.
std::string box(const Motion& motion, std::size_t index) {
  const Mover& m = motion.movers[index];
  std::vector<int> change(tick_count + 1);
  for (const PairInterval& interval : motion.intervals) {
    if (interval.first != index && interval.second != index) continue;
    ++change[static_cast<std::size_t>(interval.began)];
    --change[static_cast<std::size_t>(interval.ended)];
  }
  Keyframes colour;
  int pairs = 0, shown = -1, first = 0;
  for (int tick = 0; tick < tick_count; ++tick) {
    pairs += change[static_cast<std::size_t>(tick)];
    const int kind = std::min(pairs, 3);
    if (kind == shown) continue;
    shown = kind;
    if (tick == 0) first = kind;
    colour.at(tick, box_colours[kind]);
  }
  return fmt::format(
      "<rect width=\"{}\" height=\"{}\" x=\"{}\" y=\"{}\" color=\"{}\" fill=\"currentColor\" "
      "stroke=\"currentColor\">{}{}{}</rect>\n",
      pixels(m.width), pixels(m.height), pixels(m.x.at(0)), pixels(m.y.at(0)), box_colours[first],
      animate("x", m.x), animate("y", m.y), colour.of("color", true));
}

// The line between the centres, which follows both boxes a little longer than the pair exists.
std::string line(const Motion& motion, const PairInterval& interval) {
  const Mover &a = motion.movers[interval.first], &b = motion.movers[interval.second];
  const auto drawn = [&](int tick) {
    const auto [x, y] = a.middle(tick);
    const auto [to_x, to_y] = b.middle(tick);
    return fmt::format("M{} {}L{} {}", pixels(x), pixels(y), pixels(to_x), pixels(to_y));
  };
  const std::string nothing = "M-9 0L-9 0";  // outside
  const int last = std::min(interval.ended + ended_ticks, tick_count);
  Keyframes way;
  if (interval.began > 0) {
    way.at(0, nothing);
    way.at(interval.began, nothing);
  }
  for (int tick = interval.began; tick <= last; ++tick) {
    const bool turns = a.turns_at(tick) || b.turns_at(tick);
    if (tick == interval.began || tick == last || turns) way.at(tick, drawn(tick));
  }
  if (last < tick_count) {
    way.at(last, nothing);
    way.at(tick_count, nothing);
  }
  Keyframes colour;
  colour.at(0, interval.began > 0 ? begin_colour : pair_colour);
  const int settled = interval.began + begun_ticks;
  if (interval.began > 0 && settled < interval.ended) colour.at(settled, pair_colour);
  if (interval.ended < tick_count) colour.at(interval.ended, end_colour);
  // Without animation the picture shows the first tick.
  return fmt::format("<path d=\"{}\"{}>{}{}</path>\n", interval.began > 0 ? nothing : drawn(0),
                     interval.began > 0 ? "" : fmt::format(" stroke=\"{}\"", pair_colour),
                     way.of("d", false), colour.of("stroke", true));
}

// The number of pairs per tick, and a mark for each begin and end.
std::string chart(const Motion& motion) {
  std::vector<int> live(tick_count + 1);
  std::string begins, ends;
  const auto across = [](int tick) {
    return pixels(10 * chart_left + (chart_right - chart_left) * 10 * tick / tick_count);
  };
  for (const PairInterval& interval : motion.intervals) {
    for (int tick = interval.began; tick < interval.ended; ++tick)
      ++live[static_cast<std::size_t>(tick)];
    if (interval.began > 0)
      begins += fmt::format("M{} {}v6", across(interval.began), chart_top - 6);
    if (interval.ended < tick_count)
      ends += fmt::format("M{} {}v6", across(interval.ended), chart_bottom);
  }
  const int most = *std::max_element(live.begin(), live.end());
  std::string curve = fmt::format("M{} {}", chart_left, chart_bottom);
  for (std::size_t tick = 0, before = 0; tick < tick_count; ++tick) {
    if (tick > 0 && live[tick] == live[before]) continue;
    before = tick;
    const int up = (chart_bottom - chart_top - 8) * 10 * live[tick] / most;
    curve += fmt::format("H{}V{}", across(static_cast<int>(tick)), pixels(10 * chart_bottom - up));
  }
  curve += fmt::format("H{}V{}z", chart_right, chart_bottom);
  Keyframes grown;
  grown.at(0, "0");
  grown.at(tick_count, fmt::to_string(chart_right - chart_left));
  // The whole chart dimmed, and the past again, bright. Without animation all is past.
  return fmt::format(
      "<clipPath id=\"past\"><rect x=\"{0}\" y=\"{1}\" width=\"{12}\" height=\"{2}\">{3}</rect>"
      "</clipPath>\n<g opacity=\".35\"><g id=\"all\"><path d=\"{4}\" fill=\"{5}\"/>"
      "<path d=\"{6}\" stroke=\"{7}\"/><path d=\"{8}\" stroke=\"{9}\"/></g></g>\n"
      "<use href=\"#all\" clip-path=\"url(#past)\"/>\n"
      "<path d=\"M0 {1}v{2}\" transform=\"translate({10})\" stroke=\"#ffffff\"><animateTransform "
      "attributeName=\"transform\" "
      "type=\"translate\" dur=\"{11}s\" repeatCount=\"indefinite\" values=\"{0};{10}\"/></path>\n",
      chart_left, chart_top - 8, chart_bottom - chart_top + 16, grown.of("width", false), curve,
      "#2f7fbf", begins, begin_colour, ends, end_colour, chart_right, seconds,
      chart_right - chart_left);
}

// The legend, and the totals.
std::string legend(const Motion& motion) {
  constexpr int left = chart_right + 24;
  std::string text;
  const char* const words[] = {"alone", "1 pair", "2", "more"};
  const int places[] = {left, left + 66, left + 136, left + 178};
  for (std::size_t i = 0; i < 4; ++i) {
    text += fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"11\" height=\"11\" fill=\"{}\"/>"
        "<text x=\"{}\" y=\"{}\">{}</text>\n",
        places[i], chart_top - 4, box_colours[i], places[i] + 17, chart_top + 6, words[i]);
  }
  const auto legend_entry = [&](int left_of, const char* colour, const char* word) {
    text += fmt::format(
        "<path d=\"M{} {}h14\" stroke=\"{}\" stroke-width=\"3\"/>"
        "<text x=\"{}\" y=\"{}\">{}</text>\n",
        left_of, chart_top + 28, colour, left_of + 20, chart_top + 33, word);
  };
  legend_entry(left, begin_colour, "begun");
  legend_entry(left + 80, pair_colour, "persists");
  legend_entry(left + 166, end_colour, "ended");
  const auto begun = std::count_if(motion.intervals.begin(), motion.intervals.end(),
                                   [](const PairInterval& interval) { return interval.began > 0; });
  text += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"#ffffff\">current pairs</text>\n",
                      chart_left + 6, chart_bottom - 6);
  return text + fmt::format("<text x=\"{}\" y=\"{}\">{} boxes; {} pairs begin in {} s</text>\n",
                            left, chart_bottom, motion.movers.size(), begun, seconds);
}

}  // namespace

std::string moving() {
  const Motion made = motion(22, width, area_height);
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#c9d5e6\">\n"
      "<rect width=\"{0}\" height=\"{1}\" rx=\"10\" fill=\"#0e1624\"/>\n",
      width, height);
  text += chart(made) + legend(made);
  text += "<g fill-opacity=\".28\" stroke-width=\"1.5\">\n";
  for (std::size_t i = 0; i < made.movers.size(); ++i) text += box(made, i);
  text += "</g>\n<g fill=\"none\" stroke-width=\"2\" stroke-linecap=\"round\">\n";
  for (const PairInterval& interval : made.intervals) text += line(made, interval);
  return text + "</g>\n</svg>\n";
}

}  // namespace throng::figures
