// STL, ASCII and binary. Normals and attributes are skipped. Each corner is a vertex of its own.
#include <algorithm>
#include <cstring>

#include "apps/meshes/formats.hpp"
#include "apps/meshes/text_scanner.hpp"

namespace throng::meshes {
namespace {

constexpr std::size_t head_bytes = 84, facet_bytes = 50;

std::uint32_t word_at(std::string_view bytes, std::size_t at) noexcept {
  std::uint32_t word = 0;
  for (int k = 3; k >= 0; --k) {
    word = word << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(k)]);
  }
  return word;
}
double float_at(std::string_view bytes, std::size_t at) noexcept {
  const std::uint32_t word = word_at(bytes, at);
  float value = 0;
  std::memcpy(&value, &word, sizeof value);
  return static_cast<double>(value);
}

// Binary files may start with 'solid', too; text has no byte 0.
bool is_text(std::string_view bytes) {
  const std::string_view start = TextScanner::without_byte_order_mark(bytes).substr(0, 512);
  const std::size_t word = start.find_first_not_of(" \t\r\n");
  return word != std::string_view::npos && start.find('\0') == std::string_view::npos &&
         (start.substr(word, 5) == "solid" || start.substr(word, 5) == "SOLID");
}

void parse_binary(std::string_view bytes, MeshBuilder& builder) {
  if (bytes.size() < head_bytes) {
    builder.fail("a file of " + std::to_string(bytes.size()) + " bytes",
                 "an STL file: 'solid', or at least 84 bytes");
  }
  const std::uint64_t count = word_at(bytes, 80);
  const std::uint64_t wanted = head_bytes + facet_bytes * count;
  if (bytes.size() != wanted) {
    builder.fail(
        {"byte", 80},
        std::to_string(count) + " triangles, which take " + std::to_string(wanted) + " bytes",
        "as many as the file has: " + std::to_string(bytes.size()) + " bytes");
  }
  for (std::size_t at = head_bytes; at < bytes.size(); at += facet_bytes) {
    builder.begin_polygon();
    for (std::size_t k = 1; k < 4; ++k) {
      const std::size_t corner = at + 12 * k;
      const Place place{"byte", corner};
      builder.add_vertex(float_at(bytes, corner), float_at(bytes, corner + 4),
                         float_at(bytes, corner + 8), place);
      builder.add_corner(builder.vertex_count() - 1, place);
    }
    builder.end_polygon();
  }
}

class TextFacets {
 public:
  TextFacets(std::string_view text, MeshBuilder& builder)
      : scan_(text, builder, 0), builder_(builder) {}

  void parse() {
    do {
      expect("solid");
      std::string_view word = scan_.word("facet or endsolid");
      for (; !is(word, "endsolid"); word = scan_.word("facet or endsolid")) {
        if (!is(word, "facet")) scan_.fail(TextScanner::quoted(word), "facet or endsolid");
        facet();
      }
      scan_.next_line();  // skips a name
    } while (!scan_.at_end());
  }

 private:
  static bool is(std::string_view word, std::string_view keyword) {
    return word.size() == keyword.size() &&
           std::equal(word.begin(), word.end(), keyword.begin(), [](char a, char b) {
             return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
           });
  }
  // The next word; what follows on its line is skipped.
  void expect(const char* keyword) {
    const std::string_view word = scan_.word(keyword);
    if (!is(word, keyword)) scan_.fail(TextScanner::quoted(word), keyword);
    scan_.next_line();
  }
  void facet() {
    scan_.next_line();  // skips the normal
    expect("outer");
    builder_.begin_polygon();
    for (int k = 0; k < 3; ++k) {
      const std::string_view word = scan_.word("vertex");
      if (!is(word, "vertex")) scan_.fail(TextScanner::quoted(word), "vertex");
      const Place place = scan_.place();
      const double x = scan_.number_of_line(), y = scan_.number_of_line(),
                   z = scan_.number_of_line();
      builder_.add_vertex(x, y, z, place);
      builder_.add_corner(builder_.vertex_count() - 1, place);
    }
    expect("endloop");
    expect("endfacet");
    builder_.end_polygon();
  }

  TextScanner scan_;
  MeshBuilder& builder_;
};

}  // namespace

void parse_stl(std::string_view text, MeshBuilder& builder) {
  if (is_text(text)) {
    TextFacets(text, builder).parse();
  } else {
    parse_binary(text, builder);
  }
}

}  // namespace throng::meshes
