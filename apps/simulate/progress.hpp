// A line on a terminal's standard error that is rewritten; shown after one second.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace throng::simulate {

class Progress {
 public:
  explicit Progress(std::size_t total) : total_(total) {
#ifdef _WIN32
    terminal_ = _isatty(_fileno(stderr)) != 0;
#else
    terminal_ = isatty(STDERR_FILENO) != 0;
#endif
  }
  ~Progress() {
    if (visible_) std::fputs("\r\033[K", stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void at(std::size_t done, const std::string& detail) {
    const auto now = std::chrono::steady_clock::now();
    if (!terminal_ || now - start_ < std::chrono::seconds(1) ||
        now - shown_ < std::chrono::milliseconds(100)) {
      return;
    }
    shown_ = now;
    visible_ = true;
    std::fprintf(stderr, "\r\033[Kstep %zu of %zu  %s", done, total_, detail.c_str());
    std::fflush(stderr);
  }

 private:
  std::size_t total_;
  bool terminal_ = false, visible_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point shown_ = start_;
};

}  // namespace throng::simulate
