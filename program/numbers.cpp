#include "program/numbers.hpp"

#include <cctype>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "program/failure.hpp"

namespace throng::program {
namespace {

std::uint64_t parse_scaled(const std::string& text, const std::string& option, double unit,
                           const char* wanted) {
  const char* begin = text.c_str();
  char* end = nullptr;
  double value = std::strtod(begin, &end);
  std::string suffix;
  for (; *end; ++end) suffix += static_cast<char>(std::toupper(static_cast<unsigned char>(*end)));
  const bool bytes = unit == 1024;
  // MB and MiB are taken as M.
  const std::string rest = suffix.empty() ? "" : suffix.substr(1);
  const bool whole = rest.empty() || (bytes && (rest == "B" || rest == "IB"));
  double scale = 0;
  if (suffix.empty() || (bytes && suffix == "B")) scale = 1;
  if (whole && suffix[0] == 'K') scale = unit;
  if (whole && suffix[0] == 'M') scale = unit * unit;
  if (whole && suffix[0] == 'G') scale = unit * unit * unit;
  if (whole && suffix[0] == 'T') scale = unit * unit * unit * unit;
  value *= scale;
  // Above 2^53 a double no longer counts in ones; nobody has such an amount of either.
  const bool number = !text.empty() && (std::isdigit(static_cast<unsigned char>(text[0])) != 0);
  if (!number || scale == 0 || !(value < 9007199254740992.0) || value != std::floor(value)) {
    throw Failure(fmt::format("{}: found '{}', wanted {}", option, text, wanted));
  }
  return static_cast<std::uint64_t>(value);
}

}  // namespace

std::uint64_t parse_count(const std::string& text, const std::string& option) {
  return parse_scaled(text, option, 1000, "a count such as 100000, 100K or 1M");
}

std::uint64_t parse_bytes(const std::string& text, const std::string& option) {
  return parse_scaled(text, option, 1024, "bytes such as 1000000, 64M or 2G");
}

}  // namespace throng::program
