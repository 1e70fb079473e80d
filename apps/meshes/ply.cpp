// PLY, ASCII and binary: vertices from `vertex`, triangles from `face` and `tristrips`. Other
// elements and properties are skipped.
#include <array>
#include <cstring>
#include <limits>

#include "apps/meshes/formats.hpp"
#include "apps/meshes/ply_header.hpp"
#include "apps/meshes/text_scanner.hpp"

namespace throng::meshes {
namespace {

// The values of the body, one after another, as text.
class TextValues {
 public:
  TextValues(std::string_view text, const PlyHeader& header, const MeshBuilder& builder)
      : scan_(text.substr(header.body_offset), builder, 0, false, header.body_line) {}

  Place place() const noexcept { return scan_.place(); }
  double number(PlyType) { return scan_.number(); }
  std::int64_t integer(PlyType) { return scan_.integer(scan_.word("an integer")); }
  void skip(PlyType) { scan_.word("a value"); }
  // The least size of a value in the text: a digit and a blank.
  std::size_t least_bytes(PlyType) const noexcept { return 2; }
  std::size_t left() const noexcept { return scan_.left() + 1; }
  bool at_end() { return scan_.at_end(); }

 private:
  TextScanner scan_;
};

class BinaryValues {
 public:
  BinaryValues(std::string_view bytes, const PlyHeader& header, const MeshBuilder& builder)
      : bytes_(bytes), at_(header.body_offset), builder_(builder) {
    const std::uint16_t one = 1;
    unsigned char low = 0;
    std::memcpy(&low, &one, 1);
    swaps_ = (low == 1) == (header.encoding == PlyEncoding::big_endian);
  }

  Place place() const noexcept { return {"byte", at_}; }
  double number(PlyType type) {
    if (type == PlyType::float32) return static_cast<double>(take<float>());
    if (type == PlyType::float64) return take<double>();
    return static_cast<double>(integer(type));
  }
  std::int64_t integer(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return take<std::int8_t>();
      case PlyType::uint8:
        return take<std::uint8_t>();
      case PlyType::int16:
        return take<std::int16_t>();
      case PlyType::uint16:
        return take<std::uint16_t>();
      case PlyType::int32:
        return take<std::int32_t>();
      case PlyType::uint32:
        return take<std::uint32_t>();
      case PlyType::int64:
        return take<std::int64_t>();
      default: {
        const auto value = take<std::uint64_t>();
        constexpr auto most = std::numeric_limits<std::int64_t>::max();
        return value > static_cast<std::uint64_t>(most) ? most : static_cast<std::int64_t>(value);
      }
    }
  }
  void skip(PlyType type) {
    need(bytes_of(type));
    at_ += bytes_of(type);
  }
  std::size_t least_bytes(PlyType type) const noexcept { return bytes_of(type); }
  std::size_t left() const noexcept { return bytes_.size() - at_; }
  bool at_end() const noexcept { return left() == 0; }

 private:
  void need(std::size_t count) const {
    if (left() >= count) return;
    builder_.fail(place(), "the end of the file", std::to_string(count - left()) + " more bytes");
  }
  template <class T>
  T take() {
    need(sizeof(T));
    std::array<char, sizeof(T)> raw;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      raw[swaps_ ? sizeof(T) - 1 - i : i] = bytes_[at_ + i];
    }
    at_ += sizeof(T);
    T value;
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }

  std::string_view bytes_;
  std::size_t at_;
  const MeshBuilder& builder_;
  bool swaps_ = false;
};

template <class Values>
class Body {
 public:
  Body(Values& values, MeshBuilder& builder) : values_(values), builder_(builder) {}

  void read(const PlyElement& element) {
    // No element is smaller than this, so a count that the file cannot hold is noticed first.
    std::size_t least = 0;
    for (const PlyProperty& p : element.properties) {
      least += values_.least_bytes(p.is_list ? p.count_type : p.type);
    }
    if (least == 0) return;
    if (element.count > values_.left() / least) {
      builder_.fail(
          values_.place(), std::to_string(values_.left()) + " bytes to the end of the file",
          "at least " + std::to_string(least) + " for each of " + std::to_string(element.count) +
              " elements '" + element.name + "' of the header");
    }
    if (element.name == "vertex") {
      vertices(element);
    } else if (element.name == "face") {
      lists(element, &Body::face);
    } else if (element.name == "tristrips") {
      lists(element, &Body::strips);
    } else {
      for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const PlyProperty& p : element.properties) skip(p);
      }
    }
  }

 private:
  void vertices(const PlyElement& element) {
    const std::size_t count = element.properties.size();
    const std::size_t axes[3] = {element.find("x"), element.find("y"), element.find("z")};
    for (const std::size_t axis : axes) {
      if (axis == count || element.properties[axis].is_list) {
        builder_.fail("a vertex without x, y and z", "these properties");
      }
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      double at[3] = {};
      const Place place = values_.place();
      for (std::size_t k = 0; k < count; ++k) {
        const PlyProperty& p = element.properties[k];
        if (k == axes[0] || k == axes[1] || k == axes[2]) {
          at[k == axes[0] ? 0 : k == axes[1] ? 1 : 2] = values_.number(p.type);
        } else {
          skip(p);
        }
      }
      builder_.add_vertex(at[0], at[1], at[2], place);
    }
  }

  void lists(const PlyElement& element, void (Body::*read_list)(const PlyProperty&)) {
    std::size_t list = element.find("vertex_indices");
    if (list == element.properties.size()) list = element.find("vertex_index");
    if (list == element.properties.size() || !element.properties[list].is_list) {
      builder_.fail("an element '" + element.name + "' without a list vertex_indices", "one");
    }
    if (is_float(element.properties[list].type)) {
      builder_.fail("vertex indices that are floats", "integers");
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        if (k == list) {
          (this->*read_list)(element.properties[k]);
        } else {
          skip(element.properties[k]);
        }
      }
    }
  }

  void face(const PlyProperty& list) {
    const std::uint64_t corners = length(list);
    builder_.begin_polygon();
    for (std::uint64_t k = 0; k < corners; ++k) {
      const Place place = values_.place();
      add_corner(values_.integer(list.type), place);
    }
    builder_.end_polygon();
  }

  // Each index after the second is a triangle with the two before it; -1 starts another strip.
  void strips(const PlyProperty& list) {
    const std::uint64_t indices = length(list);
    std::int64_t before[2] = {};
    std::uint64_t in_strip = 0;
    for (std::uint64_t k = 0; k < indices; ++k) {
      const Place place = values_.place();
      const std::int64_t index = values_.integer(list.type);
      if (index == -1) {
        in_strip = 0;
        continue;
      }
      if (in_strip >= 2) {
        const bool odd = in_strip % 2 == 1;  // every other one is turned around
        builder_.begin_polygon();
        add_corner(before[odd ? 1 : 0], place);
        add_corner(before[odd ? 0 : 1], place);
        add_corner(index, place);
        builder_.end_polygon();
      }
      before[0] = before[1];
      before[1] = index;
      ++in_strip;
    }
  }

  void add_corner(std::int64_t index, Place place) {
    if (index < 0) builder_.fail(place, "the vertex index " + std::to_string(index), "0 and up");
    builder_.add_corner(static_cast<std::uint64_t>(index), place);
  }

  std::uint64_t length(const PlyProperty& list) {
    const Place place = values_.place();
    const std::int64_t items = values_.integer(list.count_type);
    if (items < 0) builder_.fail(place, "a list of length " + std::to_string(items), "0 or more");
    if (static_cast<std::uint64_t>(items) > values_.left() / values_.least_bytes(list.type)) {
      builder_.fail(place, "a list of length " + std::to_string(items), "one that fits the file");
    }
    return static_cast<std::uint64_t>(items);
  }

  void skip(const PlyProperty& p) {
    const std::uint64_t items = p.is_list ? length(p) : 1;
    for (std::uint64_t k = 0; k < items; ++k) values_.skip(p.type);
  }

  Values& values_;
  MeshBuilder& builder_;
};

template <class Values>
void read_body(std::string_view text, const PlyHeader& header, MeshBuilder& builder) {
  Values values(text, header, builder);
  Body<Values> body(values, builder);
  for (const PlyElement& element : header.elements) body.read(element);
  if (!values.at_end()) builder.fail(values.place(), "more than the header describes", "the end");
}

}  // namespace

void parse_ply(std::string_view text, MeshBuilder& builder) {
  const PlyHeader header = parse_ply_header(text, builder);
  if (header.encoding == PlyEncoding::ascii) {
    read_body<TextValues>(text, header, builder);
  } else {
    read_body<BinaryValues>(text, header, builder);
  }
}

}  // namespace throng::meshes
