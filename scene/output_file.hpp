// A file that appears under its name only when it is complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace throng::scene {

// Every failure is a FileError. Destroyed before commit(): nothing is left behind.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t bytes);
  // Where the next write goes: back, to write a header again. A pipe has no way back.
  void seek(std::uint64_t offset);
  bool can_seek() const noexcept;
  // seek(), and what stands from there on is no part of the file any more.
  void cut(std::uint64_t offset);
  void commit();

 private:
  [[noreturn]] void fail(int error);
  void discard() noexcept;

  std::string name_;       // as the caller calls it
  std::string target_;     // where it will stand: symbolic links followed
  std::string temporary_;  // empty where the target is written in place
  std::FILE* file_ = nullptr;
  std::uint64_t at_ = 0, end_ = 0;  // where the next write goes; how long the file is to be
  std::uint64_t longest_ = 0;       // how long it has been
};

}  // namespace throng::scene
