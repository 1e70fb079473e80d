#include "apps/meshes/ply_header.hpp"

#include "apps/meshes/text_scanner.hpp"

namespace throng::meshes {
namespace {

struct TypeName {
  const char* name;
  PlyType type;
};
constexpr TypeName type_names[] = {
    {"char", PlyType::int8},       {"int8", PlyType::int8},      {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},     {"short", PlyType::int16},    {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},   {"uint16", PlyType::uint16},  {"int", PlyType::int32},
    {"int32", PlyType::int32},     {"uint", PlyType::uint32},    {"uint32", PlyType::uint32},
    {"int64", PlyType::int64},     {"uint64", PlyType::uint64},  {"float", PlyType::float32},
    {"float32", PlyType::float32}, {"double", PlyType::float64}, {"float64", PlyType::float64}};

PlyType type_of(std::string_view word, const TextScanner& scan) {
  for (const TypeName& known : type_names) {
    if (word == known.name) return known.type;
  }
  scan.fail("the type " + TextScanner::quoted(word), "a type such as float or int");
}

PlyProperty property_of(TextScanner& scan) {
  PlyProperty property;
  std::string_view word = scan.word_of_line();
  property.is_list = word == "list";
  if (property.is_list) {
    property.count_type = type_of(scan.word_of_line(), scan);
    if (is_float(property.count_type)) scan.fail("a list with a float as its length", "an integer");
    word = scan.word_of_line();
  }
  property.type = type_of(word, scan);
  property.name = std::string(scan.word_of_line());
  if (property.name.empty()) scan.fail("a property without a name", "a name");
  return property;
}

PlyEncoding encoding_of(TextScanner& scan) {
  const std::string_view word = scan.word_of_line(), version = scan.word_of_line();
  if (version != "1.0") scan.fail("version " + TextScanner::quoted(version), "1.0");
  if (word == "ascii") return PlyEncoding::ascii;
  if (word == "binary_little_endian") return PlyEncoding::little_endian;
  if (word == "binary_big_endian") return PlyEncoding::big_endian;
  scan.fail("the format " + TextScanner::quoted(word),
            "ascii, binary_little_endian or binary_big_endian");
}

}  // namespace

std::size_t PlyElement::find(std::string_view property) const noexcept {
  std::size_t i = 0;
  while (i < properties.size() && properties[i].name != property) ++i;
  return i;
}

PlyHeader parse_ply_header(std::string_view text, const MeshBuilder& builder) {
  constexpr std::size_t most_names = 1000;  // elements and properties
  PlyHeader header;
  TextScanner scan(text, builder, 0);
  const std::string_view magic = scan.word_of_line();
  if (magic != "ply") scan.fail(TextScanner::quoted(magic), "'ply'");
  bool has_format = false;
  std::size_t names = 0;
  while (scan.next_line()) {
    const std::string_view keyword = scan.word_of_line();
    if (keyword == "end_header") {
      if (!has_format) scan.fail("a header without a format", "'format ascii 1.0'");
      scan.next_line();
      header.body_offset = text.size() - scan.left();
      header.body_line = scan.place().number;
      return header;
    }
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
    if (++names > most_names) scan.fail("more than 1000 lines", "a shorter header");
    if (keyword == "format") {
      header.encoding = encoding_of(scan);
      has_format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = std::string(scan.word_of_line());
      const std::string_view count = scan.word_of_line();
      const std::int64_t value = scan.integer(count);
      if (value < 0) scan.fail(TextScanner::quoted(count), "a number of elements");
      element.count = static_cast<std::uint64_t>(value);
      header.elements.push_back(element);
    } else if (keyword == "property") {
      if (header.elements.empty()) scan.fail("a property before any element", "an element");
      header.elements.back().properties.push_back(property_of(scan));
    } else {
      scan.fail(TextScanner::quoted(keyword), "element, property or end_header");
    }
  }
  scan.fail("the end of the file", "end_header");
}

}  // namespace throng::meshes
