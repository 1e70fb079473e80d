// Numbers on the command line, with an optional K or M suffix.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace throng::common {

// "100000", "100K", "1M", "2.5M": a count, in thousands. Throws Failure that names `option`.
std::uint64_t parse_count(const std::string& text, const std::string& option);
// The same, from `least` to `most`.
std::uint64_t parse_count(const std::string& text, const std::string& option, std::uint64_t least,
                          std::uint64_t most);
// Number of threads; 0: all.
unsigned parse_threads(const std::string& text, const std::string& option);
// Any 64-bit integer, without a suffix.
std::uint64_t parse_seed(const std::string& text, const std::string& option);
// "1000000", "64M", "2G", also "64MiB": bytes, in units of 1024. Throws Failure likewise.
std::uint64_t parse_bytes(const std::string& text, const std::string& option);

// Any number from `least` to `most`; `wanted` describes the range. Rejects NaN.
double parse_number(const std::string& text, const std::string& option, double least, double most,
                    const std::string& wanted);
// A margin: a finite float32 >= 0. Other values are rounded up, so that no pair is lost.
float parse_margin(const std::string& text, const std::string& option);

// The parser of such an option; `value` must outlive it.
template <class T>
auto count_into(T& value, std::string option, std::uint64_t least, std::uint64_t most) {
  return [&value, option = std::move(option), least, most](const std::string& text) {
    value = static_cast<T>(parse_count(text, option, least, most));
  };
}
inline auto number_into(double& value, std::string option, double least, double most,
                        std::string wanted) {
  return [&value, option = std::move(option), least, most, wanted = std::move(wanted)](
             const std::string& text) { value = parse_number(text, option, least, most, wanted); };
}
inline auto margin_into(float& margin) {
  return [&margin](const std::string& text) { margin = parse_margin(text, "--margin"); };
}
inline auto threads_into(unsigned& threads) {
  return [&threads](const std::string& text) { threads = parse_threads(text, "--threads"); };
}
inline auto seed_into(std::uint64_t& seed) {
  return [&seed](const std::string& text) { seed = parse_seed(text, "--seed"); };
}

}  // namespace throng::common
