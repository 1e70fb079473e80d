#include "apps/throng/film.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "apps/report/colour.hpp"
#include "apps/report/format.hpp"

namespace throng::cli {
namespace {

// Lengths in half pixels: integers that are fine enough for smooth motion.
constexpr int width = 1720, most_height = 920, header = 130, footer = 110, edge = 50;
constexpr double pictures_per_second = 15, hold_seconds = 1.5;
constexpr double most_squares = 200000;  // of all pictures: the file has about nine bytes for each

// Colours by the number of boxes that a box touches.
constexpr struct {
  float least;
  const char* words;
} classes[] = {{0, "0"},       {1, "1, 2"},      {3, "3 to 5"}, {6, "6 to 8"},
               {9, "9 to 12"}, {13, "13 to 18"}, {19, "more"}};
constexpr int class_count = 7;

std::uint8_t class_of(float touches) {
  int k = 0;
  while (k + 1 < class_count && touches >= classes[k + 1].least) ++k;
  return static_cast<std::uint8_t>(k);
}

std::string colour_of(int kind) {
  const report::Vector c = report::colour_map(static_cast<float>(kind) / (class_count - 1));
  const auto byte = [](float x) { return std::lround(255 * report::to_screen(x)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(c.x), byte(c.y), byte(c.z));
}

// When a picture is visible. Without animation, only the last is.
std::string visible(std::size_t k, std::size_t count) {
  const double seconds = static_cast<double>(count) / pictures_per_second + hold_seconds;
  const auto time = [&](std::size_t picture) {
    return fmt::format("{:.5f}", static_cast<double>(picture) / pictures_per_second / seconds);
  };
  std::string values = "inline", times = "0";
  if (k > 0) values = "none;inline", times += ";" + time(k);
  if (k + 1 < count) values += ";none", times += ";" + time(k + 1);
  return fmt::format(
      "<g{}><animate attributeName=\"display\" dur=\"{:.2f}s\" repeatCount=\"indefinite\" "
      "calcMode=\"discrete\" keyTimes=\"{}\" values=\"{}\"/>",
      k + 1 < count ? " display=\"none\"" : "", seconds, times, values);
}

}  // namespace

Film::Film(std::size_t objects, std::size_t frames) : frames_(frames) {
  const double squares = 3 * std::pow(static_cast<double>(objects) / 3, 2.0 / 3);
  const double wanted = std::clamp(most_squares / squares, 40.0, 120.0);
  pictures_ = std::min(frames, static_cast<std::size_t>(wanted));
}

void Film::add(const FallingBoxes& heap, const Pair* pairs, std::size_t count,
               std::string caption) {
  const std::vector<float> touches = heap.touches(pairs, count);
  const float y = heap.middle_row();
  Picture picture{{}, std::move(caption)};
  for (std::size_t i = 0; i < heap.objects(); ++i) {
    const Box& b = heap.boxes()[i];
    if (b.lower.y > y || b.upper.y < y) continue;
    picture.squares.push_back(
        {(b.lower.x + b.upper.x) / 2, (b.lower.z + b.upper.z) / 2, class_of(touches[i])});
  }
  shown_.push_back(std::move(picture));
}

std::string Film::svg(const std::string& title) const {
  float reach = 1, top = 1;
  for (const Picture& picture : shown_) {
    for (const Square& s : picture.squares) {
      reach = std::max(reach, std::fabs(s.x) + 0.5f);
      top = std::max(top, s.z + 0.5f);
    }
  }
  const float side = std::min(static_cast<float>(width - 2 * edge) / (2 * reach),
                              static_cast<float>(most_height) / top);
  const int ground = header + static_cast<int>(std::ceil(top * side)), height = ground + footer;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{2}\" "
      "height=\"{3}\" font-family=\"sans-serif\" font-size=\"26\" fill=\"#c9d5e6\">\n"
      "<rect width=\"{0}\" height=\"{1}\" rx=\"20\" fill=\"#0e1624\"/>\n"
      "<text x=\"{4}\" y=\"60\" font-size=\"34\" font-weight=\"bold\">{5}</text>\n"
      "<path d=\"M{4} {6}H{7}\" stroke=\"#6f83a3\" stroke-width=\"3\"/>\n"
      "<text x=\"{4}\" y=\"{8}\">touching boxes per box:</text>\n",
      width, height, width / 2, (height + 1) / 2, edge, report::escape_html(title), ground + 2,
      width - edge, height - 36);
  for (int k = 0; k < class_count; ++k) {
    const int x = edge + 360 + 160 * k;
    out += fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"24\" height=\"24\" fill=\"{}\"/>"
        "<text x=\"{}\" y=\"{}\">{}</text>\n",
        x, height - 57, colour_of(k), x + 34, height - 36, classes[k].words);
  }
  // A gap makes neighbours distinct.
  const int drawn = std::max(1, static_cast<int>(std::lround(0.9f * side)));
  out += fmt::format("<g fill=\"none\" stroke-width=\"{}\">\n", drawn);
  for (std::size_t k = 0; k < shown_.size(); ++k) {
    out += visible(k, shown_.size());
    out += fmt::format("<text x=\"{}\" y=\"104\" fill=\"#c9d5e6\" stroke=\"none\">{}</text>", edge,
                       report::escape_html(shown_[k].caption));
    // A square is a thick line downwards; it begins relative to the end of the one before.
    std::vector<std::tuple<std::uint8_t, int, int>> squares;
    for (const Square& s : shown_[k].squares) {
      squares.emplace_back(s.colour, ground - drawn / 2 - static_cast<int>(std::lround(s.z * side)),
                           width / 2 + static_cast<int>(std::lround(s.x * side)));
    }
    std::sort(squares.begin(), squares.end());
    int kind = -1, x = 0, y = 0;
    for (const auto& [colour, at_y, at_x] : squares) {
      if (colour != kind) {
        out += fmt::format("{}<path stroke=\"{}\" d=\"M{} {}v{}", kind < 0 ? "" : "\"/>",
                           colour_of(colour), at_x, at_y, drawn);
      } else {
        out += fmt::format("m{} {}v{}", at_x - x, at_y - y, drawn);
      }
      kind = colour, x = at_x, y = at_y + drawn;
    }
    out += kind < 0 ? "</g>\n" : "\"/></g>\n";
  }
  return out + "</g>\n</svg>\n";
}

}  // namespace throng::cli
