#include "apps/report/format.hpp"

#include <cmath>

#include <fmt/format.h>

namespace throng::report {
namespace {

// Three significant digits without an exponent.
std::string three_digits(double x) {
  if (!std::isfinite(x)) return "-";
  if (x == 0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::fabs(x)))) + 1;
  // 9.996 has one digit before the point, but "10.0" two: check again after rounding.
  const double scale = std::pow(10.0, 3 - before);
  const double rounded = std::round(x * scale) / scale;
  const int digits = static_cast<int>(std::floor(std::log10(std::fabs(rounded)))) + 1;
  const int after = 3 - digits;
  return fmt::format("{:.{}f}", x, after < 0 ? 0 : after > 6 ? 6 : after);
}

}  // namespace

std::string format_ms(double ms) {
  std::string text = three_digits(ms);
  // Below a tenth of a millisecond a clock is good for two digits.
  if (ms > 0 && ms < 0.1 && text.size() > 6) text = fmt::format("{:.4f}", ms);
  return text;
}

std::string format_count(std::uint64_t count) {
  const std::string digits = std::to_string(count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i != 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

std::string format_short(std::uint64_t count) {
  if (count >= 1000000 && count % 100000 == 0) return fmt::format("{:g}M", double(count) / 1e6);
  if (count >= 1000 && count % 100 == 0) return fmt::format("{:g}K", double(count) / 1e3);
  return format_count(count);
}

std::string format_bytes(double bytes) {
  static const char* const units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  int unit = 0;
  while (std::fabs(bytes) >= 1024 && unit < 4) {
    bytes /= 1024;
    ++unit;
  }
  return unit == 0 ? fmt::format("{:.0f} B", bytes)
                   : fmt::format("{:.{}f} {}", bytes, std::fabs(bytes) < 10 ? 1 : 0, units[unit]);
}

std::string format_ratio(double ratio) { return three_digits(ratio) + "x"; }

std::string escape_html(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace throng::report
