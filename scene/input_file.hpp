// A .npy file that is read at any place, and bytes that are in memory already: one to a reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "scene/npy_header.hpp"

namespace throng::scene {

// fseek of 64 bits everywhere. False where it fails; errno says why.
bool seek_to(std::FILE* file, std::uint64_t offset) noexcept;

struct FileCloser {
  void operator()(std::FILE* f) const noexcept { std::fclose(f); }
};

// The bytes of a .npy file, header included.
class NpyBytes {
 public:
  virtual ~NpyBytes() = default;
  // FileError where they cannot be had.
  virtual void read(std::uint64_t offset, void* out, std::size_t bytes) = 0;

  NpyHeader header;
};

// A file opened, its size known, its header read and checked against that size. It is read, not
// mapped: of a mapped file what was touched counts as resident, and a file that another program
// cuts short would end this one by a signal instead of an error.
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

}  // namespace throng::scene
