// The header of a .npy file: validated parsing, and writing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace throng::scenes {

struct NpyHeader {
  std::string descr;  // as in the file, such as "<f4"
  char kind = 0;      // 'f', 'i', 'u', 'b'; other letters as they are
  std::size_t item_bytes = 0;
  bool swapped = false;  // not this machine's byte order
  bool fortran_order = false;
  std::vector<std::uint64_t> shape;
  std::size_t data_offset = 0;

  // "float32 (<f4) of shape (5, 6)"
  std::string text() const;
};

// Far above any header that NumPy writes for plain arrays.
constexpr std::size_t max_npy_header_bytes = 1 << 20;

// How many bytes of the file parse_npy_header needs, from its first bytes.
std::size_t npy_prefix_bytes(const unsigned char* data, std::size_t size, const std::string& name);

// data[0 .. size-1]: the start of a file of file_bytes bytes. FileError if it is not a header, or
// if the array's size differs from the rest of the file.
NpyHeader parse_npy_header(const unsigned char* data, std::size_t size, std::uint64_t file_bytes,
                           const std::string& name);

// A version 1.0 header of 128 bytes; enough for any shape of up to three dimensions.
std::string format_npy_header(const std::string& descr, const std::vector<std::uint64_t>& shape);

// "<f4" or ">f4", by the machine's byte order.
std::string native_descr(char kind, std::size_t item_bytes);

[[noreturn]] void throw_file_error(const std::string& name, const std::string& found,
                                   const std::string& wanted);

std::string shape_text(const std::vector<std::uint64_t>& shape);

}  // namespace throng::scenes
