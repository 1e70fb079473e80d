// A file that appears under its name only when it is complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

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

// Where a file that is to be written will stand, links followed; empty where the path is that of a
// device or a pipe, which has nothing to rename over it. FileError for a directory.
std::string output_target(const std::string& path);
// A name beside it that no other thread or process is likely to choose.
std::string temporary_name(const std::string& target);

// A file, and what the user calls it by, such as "--csv". No path: it was not given.
struct NamedFile {
  std::string name, path;
};

// Before the work whose results go there: each has a folder that can be written to, and none of
// them is another, or a file that is read. Nothing is opened or made. FileError.
void check_outputs(const std::vector<NamedFile>& outputs,
                   const std::vector<NamedFile>& inputs = {});

}  // namespace throng::scene
