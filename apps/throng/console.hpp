// Console output: results on standard output, progress on standard error if it is a terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace throng::cli {

// The reader of standard output closed it: end quietly.
struct BrokenPipe {};

// Writes to standard output. Throws BrokenPipe, or Failure on other errors (a full disk).
void print(const std::string& text);
// Writes a line to standard error; errors are ignored.
void print_error(const std::string& line);
// Flushes. Every command ends with it, so that a full disk is noticed.
void finish_output();

// 1.94 as "1.94 ms".
std::string milliseconds(double ms);

using Clock = std::chrono::steady_clock;
inline double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A line on standard error that is rewritten; shown after one second, and only on a terminal.
class Progress {
 public:
  Progress(std::string what, std::size_t total);
  ~Progress() { clear_line(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // The line shows the remaining time, estimated from the elapsed time.
  void at(std::size_t done, const std::string& detail = {});
  // Clears the line before other output.
  void clear_line();

 private:
  std::string label_;
  std::size_t total_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_ = start_;
  bool terminal_;
  bool visible_ = false;
};

}  // namespace throng::cli
