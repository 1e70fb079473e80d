#include "apps/scenes/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#ifndef _WIN32
#include <sys/types.h>
#endif

namespace throng::scenes {

bool seek_to(std::FILE* file, std::uint64_t offset) noexcept {
#ifdef _WIN32
  return _fseeki64(file, static_cast<long long>(offset), SEEK_SET) == 0;
#else
  return fseeko(file, static_cast<off_t>(offset), SEEK_SET) == 0;
#endif
}

std::unique_ptr<std::FILE, FileCloser> open_regular_file(const std::string& path,
                                                         const std::string& kind,
                                                         std::uint64_t& size) {
  namespace fs = std::filesystem;
  const std::string wanted = "a readable " + kind + " file";
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw_file_error(path, error ? "no file (" + error.message() + ")" : "no file", wanted);
  }
  if (fs::is_directory(status)) throw_file_error(path, "a directory", "a " + kind + " file");
  if (!fs::is_regular_file(status)) {
    throw_file_error(path, "a device or a pipe", "a regular " + kind + " file");
  }
  size = fs::file_size(path, error);
  if (error) throw_file_error(path, error.message(), wanted);
  errno = 0;
  std::unique_ptr<std::FILE, FileCloser> file(std::fopen(path.c_str(), "rb"));
  if (!file) throw_file_error(path, std::strerror(errno), wanted);
  std::setvbuf(file.get(), nullptr, _IONBF, 0);  // readers use whole blocks
  return file;
}

InputFile::InputFile(const std::string& path) : name_(path) {
  std::uint64_t size = 0;
  file_ = open_regular_file(path, ".npy", size);

  unsigned char prefix[12];
  const std::size_t start = std::min<std::uint64_t>(sizeof prefix, size);
  read(0, prefix, start);
  std::vector<unsigned char> text(prefix, prefix + start);
  const std::size_t want = std::min<std::uint64_t>(npy_prefix_bytes(prefix, start, name_), size);
  if (want > start) {
    text.resize(want);
    read(start, text.data() + start, want - start);
  }
  header = parse_npy_header(text.data(), text.size(), size, name_);
}

void InputFile::read(std::uint64_t offset, void* out, std::size_t bytes) {
  if (bytes == 0) return;
  errno = 0;
  if (seek_to(file_.get(), offset) && std::fread(out, 1, bytes, file_.get()) == bytes) return;
  throw_file_error(
      name_, errno ? std::strerror(errno) : "a file that grew shorter while read",
      std::to_string(bytes) + " bytes of it from byte " + std::to_string(offset) + " on");
}

MemoryBytes::MemoryBytes(const unsigned char* data, std::size_t size, const std::string& name)
    : data_(data) {
  header = parse_npy_header(data, size, size, name);
}

void MemoryBytes::read(std::uint64_t offset, void* out, std::size_t bytes) {
  if (bytes != 0) std::memcpy(out, data_ + offset, bytes);
}

}  // namespace throng::scenes
