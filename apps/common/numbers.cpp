#include "apps/common/numbers.hpp"

#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <system_error>

#include <fmt/format.h>

#include "apps/common/failure.hpp"

namespace throng::common {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& option,
                         const std::string& wanted) {
  throw Failure(fmt::format("{}: found '{}', wanted {}", option, text, wanted));
}

std::uint64_t parse_scaled(const std::string& text, const std::string& option, double unit,
                           const std::string& wanted) {
  const char* begin = text.c_str();
  char* end = nullptr;
  double value = std::strtod(begin, &end);
  std::string suffix;
  for (; *end; ++end) suffix += static_cast<char>(std::toupper(static_cast<unsigned char>(*end)));
  const bool bytes = unit == 1024;
  // MB and MiB count as M.
  const std::string rest = suffix.empty() ? "" : suffix.substr(1);
  const bool whole = rest.empty() || (bytes && (rest == "B" || rest == "IB"));
  double scale = 0;
  if (suffix.empty() || (bytes && suffix == "B")) scale = 1;
  if (whole && suffix[0] == 'K') scale = unit;
  if (whole && suffix[0] == 'M') scale = unit * unit;
  if (whole && suffix[0] == 'G') scale = unit * unit * unit;
  if (whole && suffix[0] == 'T') scale = unit * unit * unit * unit;
  value *= scale;
  // Above 2^53 a double does not represent every integer; such counts are rejected.
  const bool number = !text.empty() && (std::isdigit(static_cast<unsigned char>(text[0])) != 0);
  if (!number || scale == 0 || !(value < 9007199254740992.0) || value != std::floor(value)) {
    refuse(text, option, wanted);
  }
  return static_cast<std::uint64_t>(value);
}

}  // namespace

std::uint64_t parse_count(const std::string& text, const std::string& option) {
  return parse_scaled(text, option, 1000, "a count such as 100000, 100K or 1M");
}

std::uint64_t parse_count(const std::string& text, const std::string& option, std::uint64_t least,
                          std::uint64_t most) {
  const std::string wanted = fmt::format("{} to {}", least, most);
  const std::uint64_t count = parse_scaled(text, option, 1000, wanted);
  if (count < least || count > most) refuse(text, option, wanted);
  return count;
}

unsigned parse_threads(const std::string& text, const std::string& option) {
  return static_cast<unsigned>(parse_count(text, option, 0, std::numeric_limits<unsigned>::max()));
}

std::uint64_t parse_seed(const std::string& text, const std::string& option) {
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, seed);
  if (error != std::errc() || at != end) {
    refuse(text, option, fmt::format("0 to {}", std::numeric_limits<std::uint64_t>::max()));
  }
  return seed;
}

double parse_number(const std::string& text, const std::string& option, double least, double most,
                    const std::string& wanted) {
  const char* const begin = text.c_str();
  char* end = nullptr;
  const double value = std::strtod(begin, &end);
  const bool whole = end == begin + text.size() && !text.empty() &&
                     std::isspace(static_cast<unsigned char>(text[0])) == 0;
  if (!whole || !(value >= least && value <= most)) refuse(text, option, wanted);
  return value;
}

float parse_margin(const std::string& text, const std::string& option) {
  constexpr float most = std::numeric_limits<float>::max();
  const double margin = parse_number(text, option, 0, double{most}, "0 to 3.4e38");
  const auto nearest = static_cast<float>(margin);
  if (static_cast<double>(nearest) >= margin) return nearest;
  return std::nextafter(nearest, most);
}

std::uint64_t parse_bytes(const std::string& text, const std::string& option) {
  return parse_scaled(text, option, 1024, "bytes such as 1000000, 64M or 2G");
}

}  // namespace throng::common
