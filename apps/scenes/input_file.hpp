// A .npy file with random access, and bytes in memory: one interface for readers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "apps/scenes/npy_header.hpp"

namespace throng::scenes {

// A 64-bit fseek on every system. False on failure; errno has the reason.
bool seek_to(std::FILE* file, std::uint64_t offset) noexcept;

struct FileCloser {
  void operator()(std::FILE* f) const noexcept { std::fclose(f); }
};

// A regular file of any kind, unbuffered, and its size; `kind` is for messages, such as ".npy".
// FileError if there is none.
std::unique_ptr<std::FILE, FileCloser> open_regular_file(const std::string& path,
                                                         const std::string& kind,
                                                         std::uint64_t& size);

// The bytes of a .npy file, header included.
class NpyBytes {
 public:
  virtual ~NpyBytes() = default;
  // FileError if they cannot be read.
  virtual void read(std::uint64_t offset, void* out, std::size_t bytes) = 0;

  NpyHeader header;
};

// An open file of known size, with its header parsed and checked against that size. It is read, not
// mapped: touched pages of a mapped file count as resident, and truncation by another program would
// raise a signal instead of an error.
class InputFile final : public NpyBytes {
 public:
  explicit InputFile(const std::string& path);
  void read(std::uint64_t offset, void* out, std::size_t bytes) override;

 private:
  std::string name_;
  std::unique_ptr<std::FILE, FileCloser> file_;
};

class MemoryBytes final : public NpyBytes {
 public:
  MemoryBytes(const unsigned char* data, std::size_t size, const std::string& name);
  void read(std::uint64_t offset, void* out, std::size_t bytes) override;

 private:
  const unsigned char* data_;
};

}  // namespace throng::scenes
