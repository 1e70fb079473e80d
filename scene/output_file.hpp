// A file that appears under its name only when it is complete.
#pragma once

#include <cstddef>
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
  // Back to the start of the file, to write its header again.
  void rewind();
  void commit();

 private:
  [[noreturn]] void fail(int error);
  void discard() noexcept;

  std::string name_;       // as the caller calls it
  std::string target_;     // where it will stand: symbolic links followed
  std::string temporary_;  // empty where the target is written in place
  std::FILE* file_ = nullptr;
};

}  // namespace throng::scene
