#include "apps/common/child.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <thread>

#include "apps/common/child_process.hpp"

namespace throng::common {
namespace {

using Clock = std::chrono::steady_clock;

// Since the last line.
class SilenceTimer {
 public:
  explicit SilenceTimer(double seconds) : seconds_(seconds) {}
  void restart() { last_ = Clock::now(); }
  // Rounded up, so that nothing is left at the timeout; -1: no limit.
  int milliseconds_left() const {
    if (!(seconds_ > 0)) return -1;
    const std::chrono::duration<double> elapsed = Clock::now() - last_;
    return static_cast<int>(std::clamp((seconds_ - elapsed.count()) * 1000 + 0.999, 0.0, 1e9));
  }

 private:
  double seconds_;
  Clock::time_point last_ = Clock::now();
};

// Removes the complete lines from `text` and passes them on.
void forward_lines(std::string& text, const std::function<void(const std::string&)>& line,
                   SilenceTimer& silence_timer) {
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    const bool carriage_return = end > begin && text[end - 1] == '\r';  // before it on Windows
    line(text.substr(begin, end - begin - carriage_return));
    silence_timer.restart();
  }
  text.erase(0, begin);
}

}  // namespace

ChildEnd run_child(const std::string& path, const std::vector<std::string>& arguments,
                   double quiet_seconds, const std::function<void(const std::string&)>& line) {
  ChildProcess child(path, arguments);
  SilenceTimer silence_timer(quiet_seconds);
  std::string text;
  const auto stop = [&] {
    child.kill();
    return ChildEnd{true, child.status()};
  };
  for (;;) {
    char some[4096];
    const std::optional<std::size_t> got =
        child.read(some, sizeof some, silence_timer.milliseconds_left());
    if (!got) return stop();
    if (*got == 0) break;
    text.append(some, *got);
    forward_lines(text, line, silence_timer);
    if (silence_timer.milliseconds_left() == 0)
      return stop();  // output without a line end also counts as activity
  }
  if (!text.empty()) {
    line(text);
    silence_timer.restart();
  }
  // It may run on after closing its output.
  while (!child.has_ended()) {
    if (silence_timer.milliseconds_left() == 0) return stop();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return {false, child.status()};
}

}  // namespace throng::common
