#include "apps/report/write_png.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <stdexcept>
#include <utility>

#include <cairo.h>
#include <fmt/format.h>

#include "apps/report/colour.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::report {
namespace {

struct Release {
  void operator()(cairo_t* c) const { cairo_destroy(c); }
  void operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }
};
using Surface = std::unique_ptr<cairo_surface_t, Release>;
using Pen = std::unique_ptr<cairo_t, Release>;

// Without fonts a Cairo context turns into an error; the built-in outlines always work.
const char* usable_font() {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, 8, 8));
  const Pen pen(cairo_create(surface.get()));
  cairo_select_font_face(pen.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         CAIRO_FONT_WEIGHT_NORMAL);
  cairo_text_extents_t extents;
  cairo_text_extents(pen.get(), "a", &extents);
  return cairo_status(pen.get()) == CAIRO_STATUS_SUCCESS && extents.width > 0 ? "sans-serif"
                                                                              : "@cairo:";
}

class TextPainter {
 public:
  TextPainter(cairo_t* pen, bool dark)
      : pen_(pen), font_(usable_font()), gray_(dark ? 0.93 : 0.12) {}

  double width(const std::string& text, double size) {
    cairo_select_font_face(pen_, font_, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(pen_, size);
    cairo_text_extents_t e;
    cairo_text_extents(pen_, text.c_str(), &e);
    return e.x_advance;
  }

  // Anchored at x by `align`: 0 left, 0.5 middle, 1 right. y is the baseline.
  void put(const std::string& text, double x, double y, double size, double align = 0,
           double strength = 1, bool bold = false) {
    cairo_select_font_face(pen_, font_, CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(pen_, size);
    cairo_text_extents_t e;
    cairo_text_extents(pen_, text.c_str(), &e);
    cairo_set_source_rgba(pen_, gray_, gray_, gray_, strength);
    cairo_move_to(pen_, x - align * e.x_advance, y);
    cairo_show_text(pen_, text.c_str());
  }

 private:
  cairo_t* pen_;
  const char* font_;
  double gray_;
};

std::string tick(float v) {
  return std::fabs(v) >= 1e5f ? fmt::format("{:.0e}", v)
                              : fmt::format("{:g}", std::round(v * 100) / 100);
}

// A step of 1, 2 or 5 times a power of ten that gives about five ticks.
float tick_step(float range) {
  const float raw = range / 5, power = std::pow(10.0f, std::floor(std::log10(raw)));
  for (const float m : {1.0f, 2.0f, 5.0f})
    if (raw <= m * power) return m * power;
  return 10 * power;
}

void legend(cairo_t* pen, TextPainter& text_painter, const Image& image, const PictureStyle& style,
            float lowest, float highest) {
  const double unit = image.height / 1000.0, width = 300 * unit, height = 13 * unit;
  const double x = image.width - 48 * unit - width, y = image.height - 66 * unit;
  for (int k = 0; k < 256; ++k) {
    const Vector c = colour_map(static_cast<float>(k) / 255);
    cairo_set_source_rgb(pen, to_screen(c.x), to_screen(c.y), to_screen(c.z));
    cairo_rectangle(pen, x + width * k / 256, y, width / 256 + 1, height);
    cairo_fill(pen);
  }
  text_painter.put(style.legend, x, y - 12 * unit, 17 * unit, 0, 0.85);
  const float step = tick_step(highest - lowest);
  const double first = std::ceil(double(lowest) / step);
  for (int k = 0; k < 12; ++k) {
    const double v = (first + k) * step, share = (v - lowest) / (double(highest) - lowest);
    if (!(share <= 1.0001)) break;
    const double at = x + width * share;
    cairo_set_source_rgba(pen, 0.6, 0.6, 0.6, 0.9);
    cairo_rectangle(pen, at - 0.5 * unit, y + height, unit, 5 * unit);
    cairo_fill(pen);
    text_painter.put(tick(static_cast<float>(v)), at, y + height + 22 * unit, 15 * unit, 0.5, 0.75);
  }
}

// From right to left, on the caption's line.
void draw_keys(cairo_t* pen, TextPainter& text_painter, const Image& image,
               const std::vector<ColourKey>& keys) {
  const double unit = image.height / 1000.0, side = 17 * unit, y = image.height - 44 * unit;
  double right = image.width - 48 * unit;
  for (auto key = keys.rbegin(); key != keys.rend(); ++key) {
    const double width = text_painter.width(key->text, 18 * unit);
    text_painter.put(key->text, right - width, y, 18 * unit, 0, 0.8);
    right -= width + 9 * unit + side;
    const Vector c = key->colour;
    cairo_set_source_rgb(pen, to_screen(c.x), to_screen(c.y), to_screen(c.z));
    cairo_rectangle(pen, right, y - 14.5 * unit, side, side);
    cairo_fill(pen);
    right -= 30 * unit;
  }
}

// `draw_legend(pen, text painter, image)` draws what is not common.
template <class DrawLegend>
void write(const std::string& path, Image image, const PictureStyle& style,
           const DrawLegend& draw_legend) {
  const Surface surface(cairo_image_surface_create_for_data(
      reinterpret_cast<unsigned char*>(image.pixels.data()), CAIRO_FORMAT_RGB24, image.width,
      image.height, image.width * 4));
  const Pen pen(cairo_create(surface.get()));
  TextPainter text_painter(pen.get(), style.dark);
  const double unit = image.height / 1000.0;
  if (!style.title.empty())
    text_painter.put(style.title, 48 * unit, 74 * unit, 34 * unit, 0, 1, true);
  if (!style.caption.empty())
    text_painter.put(style.caption, 48 * unit, image.height - 44 * unit, 18 * unit, 0, 0.8);
  draw_legend(pen.get(), text_painter, image);
  cairo_surface_flush(surface.get());

  scenes::OutputFile file(path);
  struct Target {
    scenes::OutputFile& file;
    std::exception_ptr failure;
  } target{file, nullptr};
  const auto write = [](void* to, const unsigned char* bytes, unsigned count) noexcept {
    Target& at = *static_cast<Target*>(to);
    try {
      at.file.write(bytes, count);
    } catch (...) {  // Cairo is C: no exception may pass through it
      at.failure = std::current_exception();
      return CAIRO_STATUS_WRITE_ERROR;
    }
    return CAIRO_STATUS_SUCCESS;
  };
  cairo_status_t status = cairo_status(pen.get());
  if (status == CAIRO_STATUS_SUCCESS)
    status = cairo_surface_write_to_png_stream(surface.get(), write, &target);
  if (target.failure) std::rethrow_exception(target.failure);
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error("cannot draw the picture '" + path +
                             "': " + cairo_status_to_string(status));
  file.commit();
}

}  // namespace

bool can_write_png() noexcept { return true; }
void check_png(const std::string&) {}

void write_png(const std::string& path, Image image, const PictureStyle& style, float lowest,
               float highest) {
  write(path, std::move(image), style,
        [&](cairo_t* pen, TextPainter& text_painter, const Image& drawn) {
          legend(pen, text_painter, drawn, style, lowest, highest);
        });
}

void write_png(const std::string& path, Image image, const PictureStyle& style,
               const std::vector<ColourKey>& keys) {
  write(path, std::move(image), style,
        [&](cairo_t* pen, TextPainter& text_painter, const Image& drawn) {
          draw_keys(pen, text_painter, drawn, keys);
        });
}

}  // namespace throng::report
