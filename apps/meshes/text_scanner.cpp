#include "apps/meshes/text_scanner.hpp"

#include <charconv>
#include <cstdlib>
#include <system_error>

namespace throng::meshes {
namespace {

bool is_blank(char c) noexcept {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

// A line ends with LF, CR LF or CR.
bool ends_line(const char* at, const char* end) noexcept {
  return *at == '\n' || (*at == '\r' && (at + 1 == end || at[1] != '\n'));
}

// from_chars reads no plus sign.
const char* after_plus(const char* begin, const char* end) noexcept {
  return end - begin > 1 && *begin == '+' && begin[1] != '-' ? begin + 1 : begin;
}

}  // namespace

std::string TextScanner::quoted(std::string_view word) {
  constexpr std::size_t most = 40;
  std::string text = "'";
  for (const char c : word.substr(0, most)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > most ? "...'" : "'");
}

void TextScanner::skip_blanks() {
  for (;;) {
    while (at_ < end_ && is_blank(*at_) && !ends_line(at_, end_)) ++at_;
    if (joins_ && at_ < end_ && *at_ == '\\') {
      const char* next = at_ + 1;
      if (next < end_ && *next == '\r') ++next;
      if (next < end_ && *next == '\n') {
        at_ = next + 1;
        ++line_;
        continue;
      }
    }
    break;
  }
  if (comment_ != 0 && at_ < end_ && *at_ == comment_) {
    while (at_ < end_ && !ends_line(at_, end_)) ++at_;
  }
}

std::string_view TextScanner::word_of_line() {
  skip_blanks();
  const char* const begin = at_;
  while (at_ < end_ && *at_ != '\n' && !is_blank(*at_) && !(joins_ && *at_ == '\\')) ++at_;
  if (at_ == begin && at_ < end_ && *at_ == '\\') ++at_;  // a backslash that joins nothing
  return {begin, static_cast<std::size_t>(at_ - begin)};
}

bool TextScanner::next_line() {
  while (at_ < end_ && !ends_line(at_, end_)) ++at_;
  if (at_ == end_) return false;
  ++at_;
  ++line_;
  return at_ < end_;
}

bool TextScanner::at_end() {
  for (;;) {
    skip_blanks();
    if (at_ == end_) return true;
    if (*at_ != '\n') return false;
    ++at_;
    ++line_;
  }
}

std::string_view TextScanner::word(const char* wanted) {
  if (at_end()) fail("the end of the file", wanted);
  return word_of_line();
}

double TextScanner::number(std::string_view word) const {
  const char* const end = word.data() + word.size();
  const char* const begin = after_plus(word.data(), end);
  double value = 0;
  const auto [at, error] = std::from_chars(begin, end, value);
  if (error == std::errc::result_out_of_range && at == end) {
    // Too large or too small: infinity or the nearest of 0 and the denormals.
    return std::strtod(std::string(begin, end).c_str(), nullptr);
  }
  if (error != std::errc() || at != end) fail(quoted(word), "a number");
  return value;
}

std::int64_t TextScanner::integer(std::string_view word) const {
  const char* const end = word.data() + word.size();
  std::int64_t value = 0;
  const auto [at, error] = std::from_chars(after_plus(word.data(), end), end, value);
  if (error != std::errc() || at != end) fail(quoted(word), "an integer");
  return value;
}

double TextScanner::number_of_line() {
  const std::string_view found = word_of_line();
  if (found.empty()) fail("the end of the line", "three coordinates");
  return number(found);
}

std::uint64_t TextScanner::count(const char* what) {
  const std::string_view found = word(what);
  const std::int64_t value = integer(found);
  if (value < 0) fail(quoted(found), what);
  return static_cast<std::uint64_t>(value);
}

}  // namespace throng::meshes
