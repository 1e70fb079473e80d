#include "apps/throng/console.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/report/format.hpp"
#include "apps/throng/failure.hpp"

#ifdef _WIN32
#include <io.h>
#else
#include <unistd.h>
#endif

namespace throng::cli {
namespace {

bool error_is_terminal() {
#ifdef _WIN32
  return _isatty(_fileno(stderr)) != 0;
#else
  return isatty(STDERR_FILENO) != 0;
#endif
}

// "1 h 05 min", "2 min 05 s", "7 s".
std::string duration(double seconds) {
  const auto s = static_cast<unsigned long long>(std::llround(std::min(seconds, 1e12)));
  if (s >= 3600) return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
  if (s >= 60) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} s", s);
}

[[noreturn]] void output_failed(int error) {
  if (error == EPIPE) throw BrokenPipe{};
  throw Failure(fmt::format("standard output cannot be written: {}", std::strerror(error)));
}

}  // namespace

void print(const std::string& text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) output_failed(errno);
}

void print_error(const std::string& line) {
  std::fflush(stdout);  // keeps the two streams in order where both go to one place
  std::fputs((line + "\n").c_str(), stderr);
}

void finish_output() {
  errno = 0;
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) output_failed(errno ? errno : EIO);
}

std::string milliseconds(double ms) { return report::format_ms(ms) + " ms"; }

Progress::Progress(std::string what, std::size_t total)
    : label_(std::move(what)), total_(total), terminal_(error_is_terminal()) {}

void Progress::clear_line() {
  if (visible_) std::fputs("\r\033[K", stderr);
  visible_ = false;
}

void Progress::at(std::size_t done, const std::string& detail) {
  if (!terminal_) return;
  const Clock::time_point now = Clock::now();
  if (now - start_ < std::chrono::seconds(1) || now - shown_ < std::chrono::milliseconds(100)) {
    return;
  }
  shown_ = now;
  visible_ = true;
  std::string line = fmt::format("\r\033[K{} {} of {}", label_, report::format_count(done),
                                 report::format_count(total_));
  if (!detail.empty()) line += "  " + detail;
  if (done != 0 && done < total_) {
    const double passed = std::chrono::duration<double>(now - start_).count();
    const double left = passed / static_cast<double>(done) * static_cast<double>(total_ - done);
    line += "  about " + duration(left) + " left";
  }
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace throng::cli
