// Object File Format, ASCII: OFF, and COFF, NOFF, CNOFF, STOFF, whose normals, colours and texture
// coordinates are skipped.
#include "apps/meshes/formats.hpp"
#include "apps/meshes/text_scanner.hpp"

namespace throng::meshes {
namespace {

// The length of the keyword; ModelNet's files have the first count right behind it.
std::size_t keyword_length(std::string_view word) {
  for (const std::string_view keyword : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF"}) {
    if (word.substr(0, keyword.size()) != keyword) continue;
    const std::string_view rest = word.substr(keyword.size());
    if (rest.empty() || (rest[0] >= '0' && rest[0] <= '9')) return keyword.size();
  }
  return 0;
}

}  // namespace

void parse_off(std::string_view text, MeshBuilder& builder) {
  TextScanner scan(text, builder, '#');
  const std::string_view keyword = scan.word("the keyword OFF");
  const std::size_t length = keyword_length(keyword);
  if (length == 0) scan.fail(TextScanner::quoted(keyword), "the keyword OFF");
  std::uint64_t vertices = 0;
  if (length < keyword.size()) {
    vertices = static_cast<std::uint64_t>(scan.integer(keyword.substr(length)));
  } else {
    std::string_view next = scan.word("the number of vertices");
    if (next == "BINARY") scan.fail("a binary OFF file", "an ASCII one, or PLY");
    const std::int64_t value = scan.integer(next);
    if (value < 0) scan.fail(TextScanner::quoted(next), "the number of vertices");
    vertices = static_cast<std::uint64_t>(value);
  }
  const std::uint64_t faces = scan.count("the number of faces");
  // The number of edges is often missing, and never needed.
  if (const std::string_view edges = scan.word_of_line(); !edges.empty()) scan.integer(edges);
  for (std::uint64_t i = 0; i < vertices; ++i) {
    if (scan.at_end()) {
      scan.fail("the end of the file after " + std::to_string(i) + " vertices",
                std::to_string(vertices) + " by its header");
    }
    const double x = scan.number_of_line(), y = scan.number_of_line(), z = scan.number_of_line();
    builder.add_vertex(x, y, z, scan.place());
    scan.next_line();
  }
  for (std::uint64_t i = 0; i < faces; ++i) {
    if (scan.at_end()) {
      scan.fail("the end of the file after " + std::to_string(i) + " faces",
                std::to_string(faces) + " by its header");
    }
    const std::uint64_t corners = scan.count("the number of vertices of a face");
    builder.begin_polygon();
    for (std::uint64_t k = 0; k < corners; ++k) {
      builder.add_corner(scan.count("a vertex index"), scan.place());
    }
    builder.end_polygon();
    scan.next_line();  // skips a colour
  }
  if (!scan.at_end()) {
    scan.fail("text after the last face", std::to_string(vertices) + " vertices and " +
                                              std::to_string(faces) + " faces by its header");
  }
}

}  // namespace throng::meshes
