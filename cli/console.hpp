// What a command says: results on standard output, progress on a terminal's standard error.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace throng::cli {

// Nobody reads standard output any more: end quietly.
struct BrokenPipe {};

// Writes to standard output. Throws BrokenPipe, or Failure where it cannot be written (a full
// disk).
void say(const std::string& text);
// A line to standard error; errors there are nobody's to hear.
void complain(const std::string& line);
// Writes out what is buffered. The last word of every command, so that a full disk is noticed.
void finish_output();

// 1.94 as "1.94 ms".
std::string milliseconds(double ms);

using Clock = std::chrono::steady_clock;
inline double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// One line that is rewritten, on standard error, from the second second on, and only on a terminal.
class Progress {
 public:
  Progress(std::string what, std::size_t total);
  ~Progress() { wipe(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // The line tells about how long it will take yet, from what it has taken.
  void at(std::size_t done, const std::string& detail = {});
  // Takes the line away; for whatever is to be said next.
  void wipe();

 private:
  std::string what_;
  std::size_t total_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_ = start_;
  bool terminal_;
  bool visible_ = false;
};

}  // namespace throng::cli
