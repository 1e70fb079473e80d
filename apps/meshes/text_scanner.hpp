// Reads words and numbers of a text, and counts its lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "apps/meshes/mesh_builder.hpp"

namespace throng::meshes {

class TextScanner {
 public:
  // `comment` starts a comment that lasts to the end of its line; 0: none. With
  // `continues_by_backslash` a backslash at the end of a line joins it with the next.
  // `first_line`: the number of the first line, for messages. Skips a byte order mark.
  TextScanner(std::string_view text, const MeshBuilder& builder, char comment,
              bool continues_by_backslash = false, std::uint64_t first_line = 1)
      : at_(without_byte_order_mark(text).data()),
        end_(text.data() + text.size()),
        builder_(builder),
        line_(first_line),
        comment_(comment),
        joins_(continues_by_backslash) {}

  Place place() const noexcept { return {"line", line_}; }
  std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }

  // The next word of this line; empty at its end.
  std::string_view word_of_line();
  // Goes to the start of the next line. False at the end of the text.
  bool next_line();
  // The next word of the text, on this line or a later one. Throws at the end of the text;
  // `wanted` is for the message.
  std::string_view word(const char* wanted);
  // True if only blanks and comments are left.
  bool at_end();

  // The numbers that a word is; throw for any other word.
  double number(std::string_view word) const;
  std::int64_t integer(std::string_view word) const;
  // The same of the next word.
  double number() { return number(word("a number")); }
  double number_of_line();
  // From 0 on.
  std::uint64_t count(const char* what);

  [[noreturn]] void fail(const std::string& found, const std::string& wanted) const {
    builder_.fail(place(), found, wanted);
  }
  // The text behind a byte order mark of UTF-8, which some editors write.
  static std::string_view without_byte_order_mark(std::string_view text) noexcept {
    constexpr std::string_view mark = "\xef\xbb\xbf";
    return text.substr(0, mark.size()) == mark ? text.substr(mark.size()) : text;
  }
  // "'WORD'", shortened, without control characters.
  static std::string quoted(std::string_view word);

 private:
  void skip_blanks();

  const char* at_;
  const char* end_;
  const MeshBuilder& builder_;
  std::uint64_t line_;
  char comment_;
  bool joins_;
};

}  // namespace throng::meshes
