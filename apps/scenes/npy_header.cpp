#include "apps/scenes/npy_header.hpp"

#include <bit>
#include <cstring>
#include <limits>

#include "apps/scenes/npy.hpp"

namespace throng::scenes {
namespace {

constexpr char magic[] = "\x93NUMPY";
constexpr std::size_t magic_bytes = 6;
constexpr const char* wanted_file = "a NumPy .npy file";

struct Preamble {
  std::size_t header_at = 0;
  std::size_t header_bytes = 0;
};

Preamble parse_preamble(const unsigned char* data, std::size_t size, const std::string& name) {
  if (size == 0) throw_file_error(name, "an empty file", wanted_file);
  if (std::memcmp(data, magic, size < magic_bytes ? size : magic_bytes) != 0) {
    throw_file_error(name, "a file that does not start with \\x93NUMPY", wanted_file);
  }
  if (size < 10) {
    throw_file_error(name, "a file of only " + std::to_string(size) + " bytes", wanted_file);
  }
  const int major = data[6], minor = data[7];
  if (major < 1 || major > 3) {
    throw_file_error(name, ".npy version " + std::to_string(major) + "." + std::to_string(minor),
                     "version 1.0, 2.0 or 3.0");
  }
  Preamble p;
  p.header_at = major == 1 ? 10 : 12;
  if (size < p.header_at) {
    throw_file_error(name, "a file of only " + std::to_string(size) + " bytes", wanted_file);
  }
  p.header_bytes = data[8] | std::size_t{data[9]} << 8;
  if (major > 1) p.header_bytes |= std::size_t{data[10]} << 16 | std::size_t{data[11]} << 24;
  if (p.header_bytes > max_npy_header_bytes) {
    throw_file_error(name, "a header that claims " + std::to_string(p.header_bytes) + " bytes",
                     "a header of at most " + std::to_string(max_npy_header_bytes) + " bytes");
  }
  return p;
}

// A parser of the header's Python literal: a dictionary of three known keys.
class Literal {
 public:
  Literal(const char* begin, const char* end, const std::string& name)
      : at_(begin), end_(end), name_(name) {}

  void parse(NpyHeader& header) {
    bool has_descr = false, has_order = false, has_shape = false;
    expect('{');
    while (!take('}')) {
      const std::string key = string();
      expect(':');
      if (key == "descr" && !has_descr) {
        if (peek() == '[') throw_file_error(name_, "records of several fields", "plain numbers");
        header.descr = string();
        has_descr = true;
      } else if (key == "fortran_order" && !has_order) {
        header.fortran_order = boolean();
        has_order = true;
      } else if (key == "shape" && !has_shape) {
        header.shape = tuple();
        has_shape = true;
      } else {
        fail("the key '" + key + "'");
      }
      if (!take(',') && peek() != '}') fail("no comma after '" + key + "'");
    }
    if (peek() != '\0') fail("text after the closing brace");
    if (!has_descr) fail("no 'descr'");
    if (!has_order) fail("no 'fortran_order'");
    if (!has_shape) fail("no 'shape'");
  }

 private:
  [[noreturn]] void fail(const std::string& found) const {
    throw_file_error(name_, "a header with " + found,
                     "{'descr': ..., 'fortran_order': ..., 'shape': ...} alone");
  }

  // The next character that is not a space; '\0' at the end.
  char peek() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\t' || *at_ == '\r')) ++at_;
    return at_ == end_ ? '\0' : (*at_ == '\0' ? '?' : *at_);
  }
  bool take(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail(std::string("no '") + c + "' where one is expected");
  }

  std::string string() {
    const char quote = peek();
    if (quote != '\'' && quote != '"') fail("no quoted word where one belongs");
    const char* begin = ++at_;
    while (at_ != end_ && *at_ != quote) ++at_;
    if (at_ == end_ || at_ - begin > 64) fail("an unterminated word");
    std::string text;
    for (const char* c = begin; c != at_; ++c) text += *c >= ' ' && *c <= '~' ? *c : '?';
    ++at_;
    return text;
  }

  bool boolean() {
    peek();
    if (end_ - at_ >= 4 && std::memcmp(at_, "True", 4) == 0) return at_ += 4, true;
    if (end_ - at_ >= 5 && std::memcmp(at_, "False", 5) == 0) return at_ += 5, false;
    fail("neither True nor False as 'fortran_order'");
  }

  std::vector<std::uint64_t> tuple() {
    std::vector<std::uint64_t> values;
    expect('(');
    while (!take(')')) {
      values.push_back(number());
      if (values.size() > 32) fail("more than 32 dimensions");
      if (!take(',') && peek() != ')') fail("no comma in 'shape'");
    }
    return values;
  }

  std::uint64_t number() {
    const char first = peek();
    if (first < '0' || first > '9') fail("a 'shape' that is not of numbers from 0 upward");
    std::uint64_t value = 0;
    for (; at_ != end_ && *at_ >= '0' && *at_ <= '9'; ++at_) {
      const std::uint64_t digit = static_cast<std::uint64_t>(*at_ - '0');
      if (value > (std::numeric_limits<std::uint64_t>::max() - digit) / 10) {
        fail("a dimension past 2^64");
      }
      value = value * 10 + digit;
    }
    if (at_ != end_ && *at_ == 'L') ++at_;  // a Python 2 long
    return value;
  }

  const char* at_;
  const char* end_;
  const std::string& name_;
};

// descr into kind, size and byte order; kind is 0 if it is malformed.
void read_descr(NpyHeader& header) {
  const std::string& d = header.descr;
  if (d.size() < 3 || d.size() > 4) return;
  if (d[0] != '<' && d[0] != '>' && d[0] != '|' && d[0] != '=') return;
  std::size_t bytes = 0;
  for (std::size_t i = 2; i < d.size(); ++i) {
    if (d[i] < '0' || d[i] > '9') return;
    bytes = bytes * 10 + static_cast<std::size_t>(d[i] - '0');
  }
  constexpr bool little = std::endian::native == std::endian::little;
  if (bytes == 0) return;
  header.kind = d[1];
  header.item_bytes = bytes;
  header.swapped = (d[0] == '<' && !little) || (d[0] == '>' && little);
}

}  // namespace

void throw_file_error(const std::string& name, const std::string& found,
                      const std::string& wanted) {
  throw FileError(name + ": found " + found + "; wanted " + wanted);
}

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (i > 0) text += ", ";
    text += std::to_string(shape[i]);
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::string NpyHeader::text() const {
  const char* word = kind == 'f'   ? "float"
                     : kind == 'i' ? "int"
                     : kind == 'u' ? "uint"
                     : kind == 'b' ? "bool"
                                   : nullptr;
  std::string type = "'" + descr + "'";
  if (word) {
    type =
        word + (kind == 'b' ? std::string() : std::to_string(item_bytes * 8)) + " (" + descr + ")";
  }
  return type + " of shape " + shape_text(shape);
}

std::size_t npy_prefix_bytes(const unsigned char* data, std::size_t size, const std::string& name) {
  const Preamble p = parse_preamble(data, size, name);
  return p.header_at + p.header_bytes;
}

NpyHeader parse_npy_header(const unsigned char* data, std::size_t size, std::uint64_t file_bytes,
                           const std::string& name) {
  const Preamble p = parse_preamble(data, size, name);
  if (size - p.header_at < p.header_bytes) {
    throw_file_error(name,
                     "a file that ends inside its header, after " + std::to_string(size) + " bytes",
                     "a header of " + std::to_string(p.header_bytes) + " bytes and then the data");
  }
  const char* text = reinterpret_cast<const char*>(data) + p.header_at;
  NpyHeader header;
  Literal(text, text + p.header_bytes, name).parse(header);
  read_descr(header);
  header.data_offset = p.header_at + p.header_bytes;
  const char k = header.kind;
  if (k != 'f' && k != 'i' && k != 'u' && k != 'b') return header;  // not supported here

  // The shape against the file. A product past 2^64 is longer than any file, unless a dimension is
  // 0.
  std::uint64_t claimed = header.item_bytes;
  bool overflow = false, none = false;
  for (std::uint64_t d : header.shape) {
    none = none || d == 0;
    if (d != 0 && claimed > std::numeric_limits<std::uint64_t>::max() / d) overflow = true;
    claimed *= d;
  }
  if (none) overflow = false, claimed = 0;
  const std::uint64_t there = file_bytes - header.data_offset;
  if (overflow || claimed != there) {
    throw_file_error(
        name, header.text() + " but " + std::to_string(there) + " bytes of data after the header",
        overflow ? "a shape that fits in a file"
                 : "exactly " + std::to_string(claimed) + " bytes of data");
  }
  return header;
}

std::string native_descr(char kind, std::size_t item_bytes) {
  constexpr char order = std::endian::native == std::endian::little ? '<' : '>';
  return std::string(1, item_bytes == 1 ? '|' : order) + kind + std::to_string(item_bytes);
}

std::string format_npy_header(const std::string& descr, const std::vector<std::uint64_t>& shape) {
  constexpr std::size_t total = 128;  // a multiple of 64, as NumPy aligns its data
  std::string header(magic, magic_bytes);
  header += {'\1', '\0', static_cast<char>(total - 10), '\0'};
  header +=
      "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape_text(shape) + ", }";
  header.resize(total - 1, ' ');
  return header + '\n';
}

}  // namespace throng::scenes
