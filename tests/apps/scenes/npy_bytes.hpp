// Hand-made .npy files, byte by byte, for the tests of the reader.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace npy_bytes {

inline std::string preamble(int major, std::size_t header_bytes) {
  std::string s = "\x93NUMPY";
  s += static_cast<char>(major);
  s += '\0';
  for (int k = 0; k < (major == 1 ? 2 : 4); ++k) {
    s += static_cast<char>(header_bytes >> (8 * k) & 0xff);
  }
  return s;
}

inline std::string with_header(const std::string& header, const std::string& data, int major = 1) {
  return preamble(major, header.size()) + header + data;
}

inline std::string file(const std::string& descr, const std::string& shape, const std::string& data,
                        bool fortran = false, int major = 1) {
  return with_header("{'descr': '" + descr + "', 'fortran_order': " + (fortran ? "True" : "False") +
                         ", 'shape': " + shape + ", }\n",
                     data, major);
}

// Values as in memory, or with the bytes of each reversed.
template <class T>
std::string raw(const std::vector<T>& values, bool turned = false) {
  std::string s;
  for (const T& v : values) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &v, sizeof(T));
    for (std::size_t k = 0; k < sizeof(T); ++k) s += bytes[turned ? sizeof(T) - 1 - k : k];
  }
  return s;
}

// A temporary folder per test.
class Folder {
 public:
  Folder() {
    static std::atomic<int> number{0};
    path_ = std::filesystem::temp_directory_path() /
            ("throng-scene-" + std::to_string(getpid()) + "-" + std::to_string(number++));
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

  std::string put(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return *this / name;
  }
  std::string get(const std::string& name) const {
    std::ifstream in(path_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

}  // namespace npy_bytes
