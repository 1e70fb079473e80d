// A file that gets its name only when it is complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace throng::scenes {

// Every failure is a FileError. Without commit() the destructor removes the file.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t bytes);
  // Moves the position of the next write: back, to rewrite a header. Fails for a pipe.
  void seek(std::uint64_t offset);
  bool can_seek() const noexcept;
  // seek(), and truncates the file there.
  void truncate(std::uint64_t offset);
  void commit();

 private:
  [[noreturn]] void fail(int error);
  void discard() noexcept;

  std::string name_;       // as the caller named it
  std::string target_;     // the final path: symbolic links resolved
  std::string temporary_;  // empty where the target is written in place
  std::FILE* file_ = nullptr;
  std::uint64_t at_ = 0, end_ = 0;  // position of the next write; final size
  std::uint64_t longest_ = 0;       // largest size so far
};

// The final path of an output, links resolved; empty for a device or a pipe, which cannot be
// renamed over. FileError for a directory.
std::string output_target(const std::string& path);
// A name in the same folder that no other thread or process is likely to choose.
std::string temporary_name(const std::string& target);

// A file and its option, such as "--csv". Empty path: not given.
struct NamedFile {
  std::string name, path;
};

// Checks outputs before the work: each has a writable folder, and none is the same file as another
// or as an input. Opens and creates nothing. FileError.
void check_outputs(const std::vector<NamedFile>& outputs,
                   const std::vector<NamedFile>& inputs = {});

}  // namespace throng::scenes
