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

  // FileError where a file of this name could not be begun: to be told before the work, not after
  // it. Nothing is left, and a device or a pipe is not opened.
  static void probe(const std::string& path);
  // The name under which it stands until commit(); empty where it is written in place.
  const std::string& temporary() const noexcept { return temporary_; }

  void write(const void* data, std::size_t bytes);
  // Out of the buffers, so that others who open temporary() see it.
  void flush();
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
