// Wavefront OBJ: the statements `v` and `f`. Others are skipped.
#include "apps/meshes/formats.hpp"
#include "apps/meshes/text_scanner.hpp"

namespace throng::meshes {
namespace {

bool is_keyword(std::string_view word) {
  for (const char c : word) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (!letter && !(c >= '0' && c <= '9')) return false;
  }
  return !(word[0] >= '0' && word[0] <= '9');
}

// "7", "7/1", "7//3", "7/1/3": indices from 1, or from -1 backwards.
void add_corner(std::string_view word, const TextScanner& scan, MeshBuilder& builder) {
  const std::int64_t index = scan.integer(word.substr(0, word.find('/')));
  if (index > 0) return builder.add_corner(static_cast<std::uint64_t>(index) - 1, scan.place(), 1);
  const std::uint64_t back = 0 - static_cast<std::uint64_t>(index);
  if (index == 0 || back > builder.vertex_count()) {
    const std::size_t count = builder.vertex_count();
    const std::string negative = count == 0   ? ""
                                 : count == 1 ? ", or -1 here"
                                              : ", or -1 to -" + std::to_string(count) + " here";
    scan.fail("the vertex index " + std::to_string(index), "1 and up" + negative);
  }
  builder.add_corner(builder.vertex_count() - back, scan.place(), 1);
}

}  // namespace

void parse_obj(std::string_view text, MeshBuilder& builder) {
  TextScanner scan(text, builder, '#', true);
  do {
    const std::string_view keyword = scan.word_of_line();
    if (keyword.empty()) continue;
    if (keyword == "v") {
      const double x = scan.number_of_line(), y = scan.number_of_line(), z = scan.number_of_line();
      builder.add_vertex(x, y, z, scan.place());  // weights and colours are skipped
    } else if (keyword == "f") {
      std::string_view corner = scan.word_of_line();
      if (corner.empty()) scan.fail("a face without vertices", "'f' and indices");
      builder.begin_polygon();
      for (; !corner.empty(); corner = scan.word_of_line()) add_corner(corner, scan, builder);
      builder.end_polygon();
    } else if (!is_keyword(keyword)) {
      scan.fail(TextScanner::quoted(keyword), "a statement of an OBJ file, such as 'v' or 'f'");
    } else {
      while (!scan.word_of_line().empty()) {  // a statement may have several lines
      }
    }
  } while (scan.next_line());
}

}  // namespace throng::meshes
